//! Conservation in a change of mesh: a block keeps its momenta and gains no energy (design, section
//! 6: coming and going).

use crate::math::vector::{add_scaled, cross, dot, pad, scale, sub};
use crate::refinement::{MovingBody, RigidModes, RigidMomenta};
use crate::step::Run;

/// A block before a change of its mesh.
pub(super) struct BlockBefore<const D: usize> {
    pub(super) rigid: RigidState<D>,
    energy: f64,
}

/// Momenta of a block about its centre of mass, and this centre, m.
#[derive(Clone, Copy)]
pub(super) struct RigidState<const D: usize> {
    momenta: RigidMomenta,
    centre: [f64; D],
}

impl<const D: usize> BlockBefore<D> {
    /// Returns the same block with `energy` J less.
    pub(super) fn with_less_energy(self, energy: f64) -> Self {
        Self {
            energy: self.energy - energy,
            ..self
        }
    }
}

/// Motion of a block.
pub(super) struct BlockMotion<const D: usize> {
    /// Velocities of the nodes, m/s.
    velocities: Vec<[f64; D]>,
    /// Part of the velocities with neither linear nor angular momentum, on free components.
    vibration: Vec<[f64; D]>,
}

impl<const D: usize> BlockMotion<D> {
    /// Returns the velocities minus a `fraction` of the vibration, m/s.
    pub(super) fn without_vibration(&self, fraction: f64) -> Vec<[f64; D]> {
        let all = self.velocities.iter().zip(&self.vibration);
        all.map(|(velocity, vibration)| sub(velocity, &scale(fraction, vibration)))
            .collect()
    }
}

impl<const D: usize> Run<D> {
    /// Returns a block with its nodes at `points`.
    pub(super) fn body<'a>(
        &'a self,
        block: usize,
        points: &'a [[f64; D]],
    ) -> MovingBody<'a, D, impl Fn(usize, &[[f64; D]]) -> [f64; D] + 'a> {
        let first = self.model.nodes(block).start;
        MovingBody {
            points,
            momentum: move |node: usize, velocities: &[[f64; D]]| {
                let inertia = &self.model.inertia;
                inertia.weighted(first + node, |node| velocities[node - first])
            },
        }
    }

    /// Returns the prescribed components of the nodes of a block.
    pub(super) fn prescribed_components(&self, block: usize) -> Vec<[bool; D]> {
        let nodes = self.model.nodes(block);
        nodes
            .map(|node| self.model.inertia.prescribed(node))
            .collect()
    }

    /// Returns true if a component of a node of a block is prescribed.
    pub(super) fn has_prescribed(&self, block: usize) -> bool {
        let mut nodes = self.model.nodes(block);
        nodes.any(|node| self.model.inertia.prescribed(node).contains(&true))
    }

    /// Returns the momenta and energy of a block, to be restored on another mesh.
    pub(super) fn before(&self, block: usize) -> BlockBefore<D> {
        BlockBefore {
            rigid: self.rigid_state(block),
            energy: self.energy_of(block),
        }
    }

    fn rigid_state(&self, block: usize) -> RigidState<D> {
        let (points, velocities) = self.motion_of(block);
        let body = self.body(block, &points);
        let (_, centre) = body.centre();
        RigidState {
            momenta: body.momenta(&velocities, &centre),
            centre,
        }
    }

    /// Adds angular momentum to a block by a rotation, as far as it is free, N·m·s.
    pub(in crate::step) fn add_angular_momentum(&mut self, block: usize, change: &[f64; 3]) {
        let before = self.rigid_state(block);
        let mut wanted = before;
        add_scaled(&mut wanted.momenta.angular, 1.0, change);
        let motion = self.with_momenta(block, &wanted);
        let nodes = self.model.nodes(block);
        self.state.velocity[nodes].copy_from_slice(&motion.velocities);
        self.book_remesh(block, &before.momenta);
    }

    /// Returns the work of gravity on a block by the move of its centre since `before`, J.
    pub(super) fn work_of_gravity(&self, block: usize, before: &BlockBefore<D>) -> f64 {
        let (points, _) = self.motion_of(block);
        let (mass, centre) = self.body(block, &points).centre();
        let gravity = self.model.gravity_at(self.time());
        mass * dot(&gravity, &sub(&centre, &before.rigid.centre))
    }

    /// Returns the positions, m, and velocities, m/s, of the nodes of a block.
    fn motion_of(&self, block: usize) -> (Vec<[f64; D]>, Vec<[f64; D]>) {
        let at = self.model.positions(&self.state);
        let nodes = self.model.nodes(block);
        let points = nodes.clone().map(|node| at.at(node as u32)).collect();
        (points, self.state.velocity[nodes].to_vec())
    }

    /// Returns the kinetic and strain energy of a block, J. As in the reports the kinetic energy is
    /// ½v⁻·M·v⁺, but without the impulses of loads and contact.
    pub(super) fn energy_of(&self, block: usize) -> f64 {
        let velocities = &self.state.velocity[self.model.nodes(block)];
        self.kinetic_energy_of(block, velocities)
            + 0.5 * self.power_of(block, velocities)
            + self.model.strain_energy_of(block, &self.state.displacement)
    }

    /// Returns the work of the element forces of a block over the last kick, at these velocities,
    /// J.
    fn power_of(&self, block: usize, velocities: &[[f64; D]]) -> f64 {
        let first = self.model.nodes(block).start;
        let work = self.model.elements(block).map(|element| {
            let (set, i) = self.model.numbering.of(element);
            let set = &self.model.sets[set];
            let force = set.force(i, &self.state.displacement);
            let nodes = self.model.mesh.elements[element].nodes().iter().zip(&force);
            let power = nodes.map(|(&node, force)| dot(force, &velocities[node as usize - first]));
            self.state.element_interval[element] * power.sum::<f64>()
        });
        work.sum()
    }

    /// Returns the kinetic energy of a block for these nodal velocities, J.
    fn kinetic_energy_of(&self, block: usize, velocities: &[[f64; D]]) -> f64 {
        let first = self.model.nodes(block).start;
        let energy = |(node, velocity): (usize, &[f64; D])| {
            let of = |node: usize| velocities[node - first];
            0.5 * dot(velocity, &self.model.inertia.weighted(first + node, of))
        };
        velocities.iter().enumerate().map(energy).sum()
    }

    /// Returns the kinetic energy of a block without its vibration, J.
    pub(super) fn rigid_energy_of(&self, block: usize) -> f64 {
        let motion = self.with_momenta(block, &self.rigid_state(block));
        self.kinetic_energy_of(block, &motion.without_vibration(1.0))
    }

    /// Restores the momenta of a block and removes the energy that it has gained. Returns the part
    /// of that energy that it cannot give now, J. If nodes are prescribed, the missing momentum
    /// comes from outside.
    pub(super) fn restore_momenta(&mut self, block: usize, before: &BlockBefore<D>) -> f64 {
        let nodes = self.model.nodes(block);
        let motion = self.with_momenta(block, &before.rigid);
        self.state.velocity[nodes].copy_from_slice(&motion.velocities);
        self.book_remesh(block, &before.rigid.momenta);
        let gained = self.energy_of(block) - before.energy;
        gained.max(0.0) - self.repay_energy(block, gained)
    }

    /// Books the change of momentum of a block with prescribed nodes as an external impulse.
    fn book_remesh(&mut self, block: usize, before: &RigidMomenta) {
        if self.has_prescribed(block) {
            let given = sub(&self.rigid_state(block).momenta.linear, &before.linear);
            self.state.ledger.impulse.add_scaled(1.0, &given);
        }
    }

    /// Removes `energy`, J, from the vibration of a block; returns the energy removed.
    pub(super) fn repay_energy(&mut self, block: usize, energy: f64) -> f64 {
        if energy <= 0.0 {
            return 0.0;
        }
        let before = self.before(block);
        let motion = self.with_momenta(block, &before.rigid);
        // Scaling the vibration by s leaves s² of its kinetic energy and s of the work.
        let rigid = motion.without_vibration(1.0);
        let kinetic = self.kinetic_energy_of(block, &motion.vibration);
        let both = self.kinetic_energy_of(block, &motion.velocities);
        let mixed = both - kinetic - self.kinetic_energy_of(block, &rigid);
        let work = 0.5 * self.power_of(block, &motion.vibration);
        let Some(factor) = scale_factor(kinetic, mixed + work, energy) else {
            return 0.0;
        };
        let nodes = self.model.nodes(block);
        self.state.velocity[nodes].copy_from_slice(&motion.without_vibration(1.0 - factor));
        self.book_remesh(block, &before.rigid.momenta);
        before.energy - self.energy_of(block)
    }

    /// Returns the motion of a block with the momenta `wanted`, as far as it is free.
    pub(super) fn with_momenta(&self, block: usize, wanted: &RigidState<D>) -> BlockMotion<D> {
        let (points, mut velocities) = self.motion_of(block);
        let body = self.body(block, &points);
        let old_centre = wanted.centre;
        let mut wanted = wanted.momenta;
        if !self.has_prescribed(block) {
            let (_, centre) = body.centre();
            let arm = pad(&sub(&centre, &old_centre));
            add_scaled(&mut wanted.angular, -1.0, &cross(&arm, &wanted.linear));
            body.restore_momenta(&mut velocities, &wanted);
            let mut rigid = vec![[0.0; D]; velocities.len()];
            body.restore_momenta(&mut rigid, &wanted);
            let vibration = velocities.iter().zip(&rigid).map(|(v, r)| sub(v, r));
            return BlockMotion {
                vibration: vibration.collect(),
                velocities,
            };
        }
        let prescribed = self.prescribed_components(block);
        let modes = RigidModes::new(&body, old_centre, &prescribed);
        modes.restore_momenta(&mut velocities, &wanted);
        let mut rigid = follow_prescribed(&velocities, &prescribed);
        modes.restore_momenta(&mut rigid, &wanted);
        let vibration = velocities.iter().zip(&rigid).map(|(v, r)| sub(v, r));
        let vibration = vibration.collect();
        BlockMotion {
            velocities,
            vibration,
        }
    }
}

/// Returns the velocities of nodes that follow the prescribed components: these keep theirs, the
/// others have the mean of the prescribed ones.
fn follow_prescribed<const D: usize>(
    velocities: &[[f64; D]],
    prescribed: &[[bool; D]],
) -> Vec<[f64; D]> {
    let mean: [f64; D] = std::array::from_fn(|c| {
        let of_prescribed = velocities
            .iter()
            .zip(prescribed)
            .filter(|(_, prescribed)| prescribed[c]);
        let (sum, count) = of_prescribed.fold((0.0, 0), |(sum, n), (v, _)| (sum + v[c], n + 1));
        if count == 0 {
            0.0
        } else {
            sum / f64::from(count)
        }
    });
    let nodes = velocities.iter().zip(prescribed);
    let of_node = |(velocity, prescribed): (&[f64; D], &[bool; D])| {
        std::array::from_fn(|c| if prescribed[c] { velocity[c] } else { mean[c] })
    };
    nodes.map(of_node).collect()
}

/// Returns the factor s between 0 and 1 for which `kinetic` s² + `work` s is less than `kinetic` +
/// `work` by `gained`; if there is none, the s of the minimum.
pub(super) fn scale_factor(kinetic: f64, work: f64, gained: f64) -> Option<f64> {
    let least = -0.5 * work / kinetic;
    let square = least * least + (kinetic + work - gained) / kinetic;
    let factor = least + square.max(0.0).sqrt();
    factor.is_finite().then(|| factor.clamp(0.0, 1.0))
}
