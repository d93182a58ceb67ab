//! The inverse mass matrix M⁻¹: it turns impulses into velocities. It is lumped or dense by block,
//! and zero for prescribed components.

use pulp::{Arch, Simd, WithSimd};

/// A block whose mass matrix is dense.
#[derive(Clone, Debug)]
struct Dense<const D: usize> {
    first: usize,
    size: usize,
    /// n×n, kg.
    matrix: Vec<f64>,
    /// n×n inverses, zero in the rows of prescribed nodes, symmetric to the bit. Components that
    /// are prescribed at the same nodes use the same inverse; mostly all of them do.
    inverses: Vec<Vec<f64>>,
    /// Index into `inverses` for each component.
    inverse_of: [usize; D],
    /// Prescribed components of its nodes, for which the inverses hold. Empty before the first call
    /// of [`Self::set_prescribed`].
    prescribed: Vec<[bool; D]>,
}

impl<const D: usize> Dense<D> {
    /// Creates a block whose nodes begin at `first`. It has no inverse yet.
    fn new(first: usize, matrix: Vec<f64>) -> Self {
        Self {
            first,
            size: matrix.len().isqrt(),
            matrix,
            inverses: Vec::new(),
            inverse_of: [0; D],
            prescribed: Vec::new(),
        }
    }

    /// Takes the `prescribed` components out of the inverses. Computes the inverses again only if
    /// they have changed.
    fn set_prescribed(&mut self, prescribed: &[[bool; D]]) {
        if self.prescribed == prescribed {
            return;
        }
        self.inverses.clear();
        for c in 0..D {
            let is_alike = |other: &usize| {
                prescribed
                    .iter()
                    .all(|prescribed| prescribed[*other] == prescribed[c])
            };
            self.inverse_of[c] = match (0..c).find(is_alike) {
                Some(other) => self.inverse_of[other],
                None => {
                    self.inverses
                        .push(self.inverse_without(|a| prescribed[a][c]));
                    self.inverses.len() - 1
                }
            };
        }
        self.prescribed = prescribed.to_vec();
    }

    /// Returns the inverse for a component.
    #[inline]
    fn inverse(&self, component: usize) -> &[f64] {
        &self.inverses[self.inverse_of[component]]
    }

    /// Returns a column of the inverse for a component. By symmetry it is stored as a row.
    #[inline]
    fn column(&self, node: usize, component: usize) -> &[f64] {
        &self.inverse(component)[node * self.size..][..self.size]
    }

    /// Returns the inverse of the free rows and columns, with zeros in the prescribed ones.
    fn inverse_without(&self, is_prescribed: impl Fn(usize) -> bool) -> Vec<f64> {
        let n = self.size;
        let free: Vec<usize> = (0..n).filter(|&a| !is_prescribed(a)).collect();
        let matrix = nalgebra::DMatrix::from_fn(free.len(), free.len(), |i, j| {
            self.matrix[free[i] * n + free[j]]
        });
        let mut inverse = vec![0.0; n * n];
        if let Some(factor) = matrix.cholesky() {
            let small = factor.inverse();
            for (i, &a) in free.iter().enumerate() {
                for (j, &b) in free.iter().enumerate() {
                    // Symmetric to the bit, so that action is reaction.
                    inverse[a * n + b] = 0.5 * (small[(i, j)] + small[(j, i)]);
                }
            }
        }
        inverse
    }
}

/// The mass matrix of all nodes and its inverse.
#[derive(Clone, Debug)]
pub(crate) struct InverseMass<const D: usize> {
    /// Lumped or fitted mass of each node, kg (row sums in dense blocks).
    mass: Vec<f64>,
    /// Inverse mass of each node by component, 1/kg; 0 where the component is prescribed.
    inverse: Vec<[f64; D]>,
    dense: Vec<Dense<D>>,
    /// Index into `dense` of each node, or `LUMPED`; and the largest number of nodes in a dense
    /// block (1 if there is none).
    dense_of: Vec<u32>,
    most_coupled: usize,
    /// Prescribed components of each node, and the number of times that they have been set.
    prescribed: Vec<[bool; D]>,
    changes: u64,
}

/// Motion of consecutive nodes in two parts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SplitMotion<'a, const D: usize> {
    /// Velocities of the rigid motion, m/s.
    pub(crate) rigid: &'a [[f64; D]],
    /// Momenta of the vibration, N·s.
    pub(crate) vibration_momenta: &'a [[f64; D]],
}

const LUMPED: u32 = u32::MAX;

/// Number of nodes of a dense block that are kicked in one SIMD loop.
const ABREAST: usize = 8;

/// Largest number of nodes of a dense block whose inverse stays in the cache nearest to the
/// processor (32 KiB), so that rows can be read across columns.
const FEW_NODES: usize = 64;

impl<const D: usize> InverseMass<D> {
    /// Creates the matrix with all components free. `dense` lists the first node and the n×n mass
    /// matrix of each dense block.
    pub(crate) fn new(mass: Vec<f64>, dense: Vec<(usize, Vec<f64>)>) -> Self {
        let mut inertia = Self {
            inverse: Vec::new(),
            prescribed: Vec::new(),
            changes: 0,
            dense: Vec::new(),
            dense_of: vec![LUMPED; mass.len()],
            most_coupled: 1,
            mass,
        };
        for (first, matrix) in dense {
            inertia.add(Dense::new(first, matrix));
        }
        let free = vec![[false; D]; inertia.mass.len()];
        inertia.set_prescribed(&free);
        inertia
    }

    /// Replaces the nodes by others with these masses, kg. Call [`Self::set_prescribed`]
    /// afterwards. `dense` lists for each dense block its first node before and now, and its n×n
    /// mass matrix. A block that was dense before keeps its inverses.
    pub(crate) fn remesh<'a>(
        &mut self,
        mass: Vec<f64>,
        dense: impl Iterator<Item = ([usize; 2], &'a [f64])>,
    ) {
        let mut old: Vec<Option<Dense<D>>> = self.dense.drain(..).map(Some).collect();
        let old_of = std::mem::replace(&mut self.dense_of, vec![LUMPED; mass.len()]);
        self.mass = mass;
        self.most_coupled = 1;
        for ([before, first], matrix) in dense {
            let known = old.get_mut(old_of[before] as usize);
            self.add(match known.and_then(Option::take) {
                Some(known) => Dense { first, ..known },
                None => Dense::new(first, matrix.to_vec()),
            });
        }
    }

    fn add(&mut self, dense: Dense<D>) {
        let nodes = dense.first..dense.first + dense.size;
        self.most_coupled = self.most_coupled.max(dense.size);
        self.dense_of[nodes].fill(self.dense.len() as u32);
        self.dense.push(dense);
    }

    /// Takes the `prescribed` components of the nodes out of the equations of motion.
    pub(crate) fn set_prescribed(&mut self, prescribed: &[[bool; D]]) {
        self.prescribed.clear();
        self.prescribed.extend(prescribed);
        self.changes += 1;
        let inverse = |(mass, prescribed): (&f64, &[bool; D])| {
            prescribed.map(|is_prescribed| if is_prescribed { 0.0 } else { 1.0 / mass })
        };
        self.inverse = self.mass.iter().zip(prescribed).map(inverse).collect();
        for dense in &mut self.dense {
            dense.set_prescribed(&prescribed[dense.first..dense.first + dense.size]);
        }
    }

    /// Returns the masses of the nodes, kg.
    pub(crate) fn mass(&self) -> &[f64] {
        &self.mass
    }

    /// Returns the memory of the dense matrices and their inverses, bytes.
    pub(crate) fn dense_memory(&self) -> usize {
        let matrices = |dense: &Dense<D>| (1 + dense.inverses.len()) * dense.size * dense.size;
        size_of::<f64>() * self.dense.iter().map(matrices).sum::<usize>()
    }

    /// True if the node belongs to a block with a dense matrix.
    pub(crate) fn is_dense(&self, node: usize) -> bool {
        self.dense_of[node] != LUMPED
    }

    /// Returns the prescribed components of a node.
    pub(crate) fn prescribed(&self, node: usize) -> [bool; D] {
        self.prescribed[node]
    }

    /// True if all components of a node are prescribed.
    pub(crate) fn is_prescribed(&self, node: usize) -> bool {
        self.prescribed[node] == [true; D]
    }

    /// Returns the number of times that prescribed components have been set.
    pub(crate) fn changes(&self) -> u64 {
        self.changes
    }

    /// Sets the velocity of a prescribed node. In a dense block the other nodes get the change of
    /// velocity that the mass matrix couples to it.
    pub(crate) fn set(&self, node: usize, wanted: &[f64; D], velocity: &mut [[f64; D]]) {
        let change: [f64; D] = std::array::from_fn(|c| wanted[c] - velocity[node][c]);
        if let Some(dense) = self.dense_at(node) {
            let column = node - dense.first;
            for b in 0..dense.size {
                let drag = change.map(|v| -dense.matrix[b * dense.size + column] * v);
                self.apply_impulse(dense.first + b, &drag, velocity);
            }
        }
        velocity[node] = *wanted;
    }

    /// Returns the dense block of a node, if it has one.
    fn dense_at(&self, node: usize) -> Option<&Dense<D>> {
        self.dense.get(self.dense_of[node] as usize)
    }

    /// Returns the nodes whose velocity an impulse on `node` changes.
    pub(crate) fn coupled(&self, node: usize) -> std::ops::Range<usize> {
        match self.dense_at(node) {
            Some(dense) => dense.first..dense.first + dense.size,
            None => node..node + 1,
        }
    }

    /// Returns the inverse mass of a lumped node by component, 1/kg; 0 where prescribed.
    pub(crate) fn lumped(&self, node: usize) -> &[f64; D] {
        &self.inverse[node]
    }

    /// Returns a column of M⁻¹, 1/kg: the velocities of the nodes [coupled](Self::coupled) to
    /// `node`, in `component`, after a unit impulse on `node` in that component.
    pub(crate) fn column(&self, node: usize, component: usize) -> &[f64] {
        match self.dense_at(node) {
            None => &self.inverse[node][component..=component],
            Some(dense) => dense.column(node - dense.first, component),
        }
    }

    /// Returns the largest velocity that a unit impulse on a node gives it, 1/kg: 0 if it is prescribed.
    pub(crate) fn mobility(&self, node: usize) -> f64 {
        let own = node - self.coupled(node).start;
        let velocities = (0..D).map(|component| self.column(node, component)[own]);
        velocities.fold(0.0, f64::max)
    }

    /// Returns the first component whose [column](Self::column) for this node equals that of
    /// `component`.
    pub(crate) fn first_equal_column(&self, node: usize, component: usize) -> usize {
        let dense = self.dense_at(node);
        let is_alike = |dense: &Dense<D>, other: &usize| {
            dense.inverse_of[*other] == dense.inverse_of[component]
        };
        let found = dense.and_then(|dense| (0..component).find(|other| is_alike(dense, other)));
        found.unwrap_or(component)
    }

    /// Returns the largest number of nodes that one mass matrix couples.
    pub(crate) fn most_coupled(&self) -> usize {
        self.most_coupled
    }

    /// velocity ← velocity + M⁻¹·(impulse on one node, N·s).
    pub(crate) fn apply_impulse(&self, node: usize, impulse: &[f64; D], velocity: &mut [[f64; D]]) {
        match self.dense_at(node) {
            None => {
                for c in 0..D {
                    velocity[node][c] += self.inverse[node][c] * impulse[c];
                }
            }
            Some(dense) => {
                let moved = &mut velocity[self.coupled(node)];
                for c in 0..D {
                    let column = dense.column(node - dense.first, c);
                    for (velocity, inverse) in moved.iter_mut().zip(column) {
                        velocity[c] += inverse * impulse[c];
                    }
                }
            }
        }
    }

    /// velocity ← velocity + M⁻¹·impulse for consecutive nodes from `first` on. A dense block is
    /// included whole or not at all.
    pub(crate) fn kick(&self, first: usize, impulse: &[[f64; D]], velocity: &mut [[f64; D]]) {
        if self.dense.is_empty() {
            let masses = impulse.iter().zip(&self.inverse[first..]);
            for (velocity, (impulse, inverse)) in velocity.iter_mut().zip(masses) {
                for c in 0..D {
                    velocity[c] += inverse[c] * impulse[c];
                }
            }
            return;
        }
        Arch::new().dispatch(ImpulseKick {
            inertia: self,
            first,
            impulse,
            velocity,
        });
    }

    /// Sets the free components of the velocities of nodes from `first` on to those of `motion`:
    /// its rigid velocities + M⁻¹·(momenta of the vibration).
    pub(crate) fn solve(&self, first: usize, motion: SplitMotion<D>, velocity: &mut [[f64; D]]) {
        for (k, of_node) in velocity.iter_mut().enumerate() {
            let prescribed = self.prescribed(first + k);
            let mut wanted = motion.rigid[k];
            for c in 0..D {
                let others = self.coupled(first + k).zip(self.column(first + k, c));
                for (other, inverse) in others {
                    wanted[c] += inverse * motion.vibration_momenta[other - first][c];
                }
            }
            for c in (0..D).filter(|&c| !prescribed[c]) {
                of_node[c] = wanted[c];
            }
        }
    }

    /// Returns the momentum of `node`, N·s: its row of M·v.
    pub(crate) fn momentum(&self, node: usize, velocity: &[[f64; D]]) -> [f64; D] {
        self.weighted(node, |node| velocity[node])
    }

    /// Returns the row of M of `node` times the vectors that `of` gives for the nodes.
    pub(crate) fn weighted(&self, node: usize, of: impl Fn(usize) -> [f64; D]) -> [f64; D] {
        match self.dense_at(node) {
            None => of(node).map(|v| self.mass[node] * v),
            Some(dense) => {
                let row = (node - dense.first) * dense.size;
                let mut sum = [0.0; D];
                for b in 0..dense.size {
                    let vector = of(dense.first + b);
                    for c in 0..D {
                        sum[c] += dense.matrix[row + b] * vector[c];
                    }
                }
                sum
            }
        }
    }
}

/// An impulse on consecutive nodes, compiled for the SIMD instructions of the machine.
struct ImpulseKick<'a, const D: usize> {
    inertia: &'a InverseMass<D>,
    /// Index of the first node. A dense block is included whole or not at all.
    first: usize,
    impulse: &'a [[f64; D]],
    velocity: &'a mut [[f64; D]],
}

impl<const D: usize> WithSimd for ImpulseKick<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let mut next = 0;
        while next < self.velocity.len() {
            let node = self.first + next;
            debug_assert_eq!(self.inertia.coupled(node).start, node, "a block is cut");
            let own = next..next + self.inertia.coupled(node).len();
            next = own.end;
            let (impulse, velocity) = (&self.impulse[own.clone()], &mut self.velocity[own]);
            let Some(dense) = self.inertia.dense_at(node) else {
                let inverse = self.inertia.lumped(node);
                for c in 0..D {
                    velocity[0][c] += inverse[c] * impulse[0][c];
                }
                continue;
            };
            if dense.size > FEW_NODES {
                kick_by_columns(dense, impulse, velocity);
                continue;
            }
            let (some, rest) = velocity.as_chunks_mut::<ABREAST>();
            let first = ABREAST * some.len();
            for (velocity, first) in some.iter_mut().zip((0..).step_by(ABREAST)) {
                kick_abreast(dense, first, impulse, velocity);
            }
            for (velocity, first) in rest.iter_mut().zip(first..) {
                kick_abreast(dense, first, impulse, std::array::from_mut(velocity));
            }
        }
    }
}

/// Adds the impulses to all nodes of a dense block, column by column: the order in which memory
/// holds the inverse. The sums have the same order as in [`kick_abreast`].
#[inline(always)]
fn kick_by_columns<const D: usize>(
    dense: &Dense<D>,
    impulse: &[[f64; D]],
    velocity: &mut [[f64; D]],
) {
    for (node, impulse) in impulse.iter().enumerate() {
        for c in 0..D {
            for (velocity, inverse) in velocity.iter_mut().zip(dense.column(node, c)) {
                velocity[c] += inverse * impulse[c];
            }
        }
    }
}

/// Adds the impulses to `N` nodes of a dense block; `first` is the index of the first one in the
/// block.
#[inline(always)]
fn kick_abreast<const D: usize, const N: usize>(
    dense: &Dense<D>,
    first: usize,
    impulse: &[[f64; D]],
    velocity: &mut [[f64; D]; N],
) {
    for c in 0..D {
        let mut sum = [0.0; N];
        for n in 0..N {
            sum[n] = velocity[n][c];
        }
        for (column, impulse) in dense.inverse(c).chunks_exact(dense.size).zip(impulse) {
            for (sum, inverse) in sum.iter_mut().zip(&column[first..first + N]) {
                *sum += inverse * impulse[c];
            }
        }
        for n in 0..N {
            velocity[n][c] = sum[n];
        }
    }
}

/// The response to contact impulses in a kick: M⁻¹ times the factor 1/(1 + ½αΔ) of
/// mass-proportional damping α, which acts in the middle of the kick.
#[derive(Clone, Copy)]
pub(crate) struct KickMobility<'a, const D: usize> {
    pub(crate) inertia: &'a InverseMass<D>,
    /// Block of each node, and α of each block, 1/s.
    pub(crate) block_of: &'a [u32],
    pub(crate) damping: &'a [f64],
    /// Δ, s; 0 at an instant.
    pub(crate) interval: f64,
}

impl<const D: usize> KickMobility<'_, D> {
    /// Returns the fraction of an impulse on a node that damping leaves.
    pub(crate) fn damping_factor(&self, node: u32) -> f64 {
        let alpha = self.damping[self.block_of[node as usize] as usize];
        1.0 / (1.0 + 0.5 * alpha * self.interval)
    }

    /// velocity ← velocity + M⁻¹·(impulse on one node, N·s), reduced by damping.
    pub(crate) fn push(&self, node: u32, impulse: &[f64; D], velocity: &mut [[f64; D]]) {
        let factor = self.damping_factor(node);
        let impulse = impulse.map(|x| factor * x);
        self.inertia
            .apply_impulse(node as usize, &impulse, velocity);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A kick gives the same bits as impulses on one node after the other. The blocks have fewer
    /// and more nodes than [`ABREAST`] and [`FEW_NODES`], and some components are prescribed.
    #[test]
    fn a_kick_is_a_push_on_each_node_in_turn() {
        let mut random = fastrand::Rng::with_seed(3);
        let blocks: [&[usize]; 2] = [&[1, 3, 8, 12, 17, FEW_NODES + 1], &[1; 41]];
        for sizes in blocks {
            let (mut mass, mut dense) = (Vec::new(), Vec::new());
            for &n in sizes {
                let mut matrix = vec![0.1; n * n];
                (0..n).for_each(|a| matrix[a * (n + 1)] += 1.0 + random.f64());
                if n > 1 {
                    dense.push((mass.len(), matrix));
                }
                mass.resize(mass.len() + n, 1.0);
            }
            let mut vectors = || -> Vec<[f64; 3]> {
                let vector = |_| [(); 3].map(|()| random.f64() - 0.5);
                (0..mass.len()).map(vector).collect()
            };
            let (impulse, start) = (vectors(), vectors());
            let mut inertia = InverseMass::<3>::new(mass.clone(), dense);
            let prescribed: Vec<_> = (0..mass.len())
                .map(|n| {
                    [
                        n.is_multiple_of(5),
                        n.is_multiple_of(5),
                        n.is_multiple_of(7),
                    ]
                })
                .collect();
            for prescribed in [vec![[false; 3]; mass.len()], prescribed] {
                inertia.set_prescribed(&prescribed);
                let [mut kicked, mut pushed] = [start.clone(), start.clone()];
                inertia.kick(0, &impulse, &mut kicked);
                for (node, impulse) in impulse.iter().enumerate() {
                    inertia.apply_impulse(node, impulse, &mut pushed);
                }
                assert_eq!(kicked, pushed);
                // The same in pieces that end at block limits.
                kicked.clone_from(&start);
                for [first, end] in [[0, 1], [1, 12], [12, 24], [24, mass.len()]] {
                    inertia.kick(first, &impulse[first..end], &mut kicked[first..end]);
                }
                assert_eq!(kicked, pushed);
            }
        }
    }
}
