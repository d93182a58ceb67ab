//! From impulses to velocities: M⁻¹, lumped or dense by block, with the
//! prescribed components of nodes held.

use pulp::{Arch, Simd, WithSimd};

/// A block whose mass matrix is dense.
#[derive(Clone, Debug)]
struct Dense<const D: usize> {
    first: usize,
    size: usize,
    /// n×n, kg.
    matrix: Vec<f64>,
    /// n×n inverses, zero in the rows of held nodes; symmetric to the bit. Components that are
    /// held alike share one: mostly all of them.
    inverses: Vec<Vec<f64>>,
    /// Which of these is that of each component.
    inverse_of: [usize; D],
    /// Held components of its nodes, for which the inverse is; none before the first.
    held: Vec<[bool; D]>,
}

impl<const D: usize> Dense<D> {
    /// A block whose nodes begin at `first`, not yet to be used.
    fn new(first: usize, matrix: Vec<f64>) -> Self {
        Self {
            first,
            size: matrix.len().isqrt(),
            matrix,
            inverses: Vec::new(),
            inverse_of: [0; D],
            held: Vec::new(),
        }
    }

    /// Takes `held` components out of the inverse: made anew only where these are others.
    fn set_prescribed(&mut self, held: &[[bool; D]]) {
        if self.held == held {
            return;
        }
        self.inverses.clear();
        for c in 0..D {
            let is_alike = |other: &usize| held.iter().all(|held| held[*other] == held[c]);
            self.inverse_of[c] = match (0..c).find(is_alike) {
                Some(other) => self.inverse_of[other],
                None => {
                    self.inverses.push(self.inverse_without(|a| held[a][c]));
                    self.inverses.len() - 1
                }
            };
        }
        self.held = held.to_vec();
    }

    /// Inverse of a component.
    #[inline]
    fn inverse(&self, component: usize) -> &[f64] {
        &self.inverses[self.inverse_of[component]]
    }

    /// Column of the inverse in a component: it is a row.
    #[inline]
    fn column(&self, node: usize, component: usize) -> &[f64] {
        &self.inverse(component)[node * self.size..][..self.size]
    }

    /// Inverse of the rows and columns that are not held, zero in the others.
    fn inverse_without(&self, is_held: impl Fn(usize) -> bool) -> Vec<f64> {
        let n = self.size;
        let free: Vec<usize> = (0..n).filter(|&a| !is_held(a)).collect();
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
    /// 1/kg by component; 0 where the node is held.
    inverse: Vec<[f64; D]>,
    dense: Vec<Dense<D>>,
    /// Index into `dense` of each node, or `LUMPED`; and the most nodes that one has.
    dense_of: Vec<u32>,
    most_coupled: usize,
    /// Components of nodes that are held, and how often that has changed.
    prescribed: Vec<[bool; D]>,
    changes: u64,
}

const LUMPED: u32 = u32::MAX;

/// Nodes of a dense block that are kicked side by side.
const ABREAST: usize = 8;

impl<const D: usize> InverseMass<D> {
    /// `dense`: first node and n×n mass matrix of each block that has one.
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

    /// Goes on with other nodes of these masses, kg; to be held then. `dense`: first node
    /// before and now, and n×n mass matrix, of each block that has one. Those that had it
    /// before keep their inverse.
    pub(crate) fn remesh<'a>(
        &mut self,
        mass: Vec<f64>,
        dense: impl Iterator<Item = ([usize; 2], &'a [f64])>,
    ) {
        let old = std::mem::take(&mut self.dense).into_iter();
        let mut old: Vec<Option<Dense<D>>> = old.map(Some).collect();
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

    /// Takes `held` components of nodes out of the equations of motion.
    pub(crate) fn set_prescribed(&mut self, held: &[[bool; D]]) {
        self.prescribed.clear();
        self.prescribed.extend(held);
        self.changes += 1;
        let inverse =
            |(mass, held): (&f64, &[bool; D])| held.map(|held| if held { 0.0 } else { 1.0 / mass });
        self.inverse = self.mass.iter().zip(held).map(inverse).collect();
        for dense in &mut self.dense {
            dense.set_prescribed(&held[dense.first..dense.first + dense.size]);
        }
    }

    /// Mass of the nodes, kg.
    pub(crate) fn mass(&self) -> &[f64] {
        &self.mass
    }

    /// Memory of the dense matrices and their inverses, bytes.
    pub(crate) fn dense_memory(&self) -> usize {
        let matrices = |dense: &Dense<D>| (1 + dense.inverses.len()) * dense.size * dense.size;
        size_of::<f64>() * self.dense.iter().map(matrices).sum::<usize>()
    }

    /// Whether the node belongs to a block with a dense matrix.
    pub(crate) fn is_dense(&self, node: usize) -> bool {
        self.dense_of[node] != LUMPED
    }

    /// Components of a node that are held.
    pub(crate) fn prescribed(&self, node: usize) -> [bool; D] {
        self.prescribed[node]
    }

    /// Whether all components of a node are held.
    pub(crate) fn is_prescribed(&self, node: usize) -> bool {
        self.prescribed[node] == [true; D]
    }

    /// How often other components than before have been held.
    pub(crate) fn changes(&self) -> u64 {
        self.changes
    }

    /// Gives a held node a velocity, and its neighbours in a dense block what
    /// that does to them.
    pub(crate) fn set(&self, node: usize, wanted: &[f64; D], velocity: &mut [[f64; D]]) {
        let change: [f64; D] = std::array::from_fn(|c| wanted[c] - velocity[node][c]);
        if let Some(dense) = self.dense_at(node) {
            let column = node - dense.first;
            for b in 0..dense.size {
                let drag = change.map(|v| -dense.matrix[b * dense.size + column] * v);
                self.push(dense.first + b, &drag, velocity);
            }
        }
        velocity[node] = *wanted;
    }

    /// The block with a dense matrix that a node belongs to, if it does.
    fn dense_at(&self, node: usize) -> Option<&Dense<D>> {
        self.dense.get(self.dense_of[node] as usize)
    }

    /// Nodes that an impulse on `node` sets in motion.
    pub(crate) fn coupled(&self, node: usize) -> std::ops::Range<usize> {
        match self.dense_at(node) {
            Some(dense) => dense.first..dense.first + dense.size,
            None => node..node + 1,
        }
    }

    /// 1/kg by component of a node of lumped mass, 0 where it is held.
    pub(crate) fn alone(&self, node: usize) -> &[f64; D] {
        &self.inverse[node]
    }

    /// Column of M⁻¹ of a node, 1/kg: the velocity in a component of each node that is
    /// [coupled](Self::coupled) to it for a unit impulse in that.
    pub(crate) fn column(&self, node: usize, component: usize) -> &[f64] {
        match self.dense_at(node) {
            None => &self.inverse[node][component..=component],
            Some(dense) => dense.column(node - dense.first, component),
        }
    }

    /// The first component in which the [column](Self::column) of a node is that in this one.
    pub(crate) fn first_alike(&self, node: usize, component: usize) -> usize {
        let dense = self.dense_at(node);
        let is_alike = |dense: &Dense<D>, other: &usize| {
            dense.inverse_of[*other] == dense.inverse_of[component]
        };
        let found = dense.and_then(|dense| (0..component).find(|other| is_alike(dense, other)));
        found.unwrap_or(component)
    }

    /// The most nodes that one mass matrix couples.
    pub(crate) fn most_coupled(&self) -> usize {
        self.most_coupled
    }

    /// velocity ← velocity + M⁻¹·(impulse on one node), N·s.
    pub(crate) fn push(&self, node: usize, impulse: &[f64; D], velocity: &mut [[f64; D]]) {
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

    /// velocity ← velocity + M⁻¹·impulse for nodes that follow each other from `first` on, all
    /// or none of a block with a dense matrix.
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

    /// Gives the free components of the nodes from `first` on the velocities that these
    /// momenta ask for, N·s, beside some others, m/s, of which they are none.
    pub(crate) fn solve(
        &self,
        first: usize,
        (momenta, beside): (&[[f64; D]], &[[f64; D]]),
        velocity: &mut [[f64; D]],
    ) {
        for (k, of_node) in velocity.iter_mut().enumerate() {
            let held = self.prescribed(first + k);
            let mut wanted = beside[k];
            for c in 0..D {
                let others = self.coupled(first + k).zip(self.column(first + k, c));
                for (other, inverse) in others {
                    wanted[c] += inverse * momenta[other - first][c];
                }
            }
            for c in (0..D).filter(|&c| !held[c]) {
                of_node[c] = wanted[c];
            }
        }
    }

    /// Momentum M·v that belongs to `node`, N·s.
    pub(crate) fn momentum(&self, node: usize, velocity: &[[f64; D]]) -> [f64; D] {
        self.weighted(node, |node| velocity[node])
    }

    /// Row of M of `node` times a vector `of` each node.
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

/// Nodes that get impulses, with whatever instructions the machine has.
struct ImpulseKick<'a, const D: usize> {
    inertia: &'a InverseMass<D>,
    /// Number of the first; all or none of a dense block.
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
                let inverse = self.inertia.alone(node);
                for c in 0..D {
                    velocity[0][c] += inverse[c] * impulse[0][c];
                }
                continue;
            };
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

/// Kicks `N` nodes of a block with a dense matrix, the first of which has a number in it.
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

/// What contact impulses do in a kick: M⁻¹, less what mass-proportional damping
/// α takes from them in its middle, 1/(1 + ½αΔ).
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
    /// What damping leaves of an impulse on a node.
    pub(crate) fn damping_factor(&self, node: u32) -> f64 {
        let alpha = self.damping[self.block_of[node as usize] as usize];
        1.0 / (1.0 + 0.5 * alpha * self.interval)
    }

    /// velocity ← velocity + M⁻¹·(impulse on one node), N·s.
    pub(crate) fn push(&self, node: u32, impulse: &[f64; D], velocity: &mut [[f64; D]]) {
        let share = self.damping_factor(node);
        let impulse = impulse.map(|x| share * x);
        self.inertia.push(node as usize, &impulse, velocity);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A kick gives the bits of impulses on one node after the other, of blocks of fewer and of
    /// more nodes than go side by side, some held.
    #[test]
    fn a_kick_is_a_push_on_each_node_in_turn() {
        let mut random = fastrand::Rng::with_seed(3);
        let blocks: [&[usize]; 2] = [&[1, 3, 8, 12, 17], &[1; 41]];
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
            let held: Vec<_> = (0..mass.len())
                .map(|n| {
                    [
                        n.is_multiple_of(5),
                        n.is_multiple_of(5),
                        n.is_multiple_of(7),
                    ]
                })
                .collect();
            for held in [vec![[false; 3]; mass.len()], held] {
                inertia.set_prescribed(&held);
                let [mut kicked, mut pushed] = [start.clone(), start.clone()];
                inertia.kick(0, &impulse, &mut kicked);
                for (node, impulse) in impulse.iter().enumerate() {
                    inertia.push(node, impulse, &mut pushed);
                }
                assert_eq!(kicked, pushed);
                // The same in pieces that end where blocks do.
                kicked.clone_from(&start);
                for [first, end] in [[0, 1], [1, 12], [12, 24], [24, mass.len()]] {
                    inertia.kick(first, &impulse[first..end], &mut kicked[first..end]);
                }
                assert_eq!(kicked, pushed);
            }
        }
    }
}
