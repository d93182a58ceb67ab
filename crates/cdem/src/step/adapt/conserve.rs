//! What a block keeps when its mesh changes: its momenta, and no more than its energy
//! (design, section 6: coming and going).

use crate::element::MAX_NODES;
use crate::math::vector::{add_scaled, cross, dot, pad, scale, sub};
use crate::refinement::{MovingBody, RigidModes, RigidMomenta};
use crate::step::Run;

/// A block before a change of its mesh.
pub(super) struct BlockBefore<const D: usize> {
    momenta: RigidMomenta,
    centre: [f64; D],
    energy: f64,
}

impl<const D: usize> BlockBefore<D> {
    /// The same with less energy, by so many J.
    pub(super) fn change(self, energy: f64) -> Self {
        Self {
            energy: self.energy - energy,
            ..self
        }
    }
}

/// How a block moves.
pub(super) struct BlockMotion<const D: usize> {
    /// Velocities of its nodes, m/s.
    velocities: Vec<[f64; D]>,
    /// What of them goes with none of its momenta, and is not held.
    loose: Vec<[f64; D]>,
}

impl<const D: usize> BlockMotion<D> {
    /// Velocities without a share of the loose ones, m/s.
    pub(super) fn without_rigid_motion(&self, share: f64) -> Vec<[f64; D]> {
        let all = self.velocities.iter().zip(&self.loose);
        all.map(|(velocity, loose)| sub(velocity, &scale(share, loose)))
            .collect()
    }
}

impl<const D: usize> Run<D> {
    /// A block at its nodes' positions.
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

    /// Components of the nodes of a block whose motion is prescribed.
    pub(super) fn prescribed_components(&self, block: usize) -> Vec<[bool; D]> {
        let nodes = self.model.nodes(block);
        nodes
            .map(|node| self.model.inertia.prescribed(node))
            .collect()
    }

    /// Momenta and energy of a block, to be had again in another mesh.
    pub(super) fn before(&self, block: usize) -> BlockBefore<D> {
        let (points, velocities) = self.motion_of(block);
        let body = self.body(block, &points);
        let (_, centre) = body.centre();
        BlockBefore {
            momenta: body.momenta(&velocities, &centre),
            centre,
            energy: self.energy_of(block),
        }
    }

    /// Work of gravity on a block whose centre has moved since, J.
    pub(super) fn work_of_gravity(&self, block: usize, before: &BlockBefore<D>) -> f64 {
        let (points, _) = self.motion_of(block);
        let (mass, centre) = self.body(block, &points).centre();
        let gravity = self.model.gravity_at(self.time());
        mass * dot(&gravity, &sub(&centre, &before.centre))
    }

    /// Positions, m, and velocities of the nodes of a block, m/s.
    fn motion_of(&self, block: usize) -> (Vec<[f64; D]>, Vec<[f64; D]>) {
        let at = self.model.positions(&self.state);
        let nodes = self.model.nodes(block);
        let points = nodes.clone().map(|node| at.at(node as u32)).collect();
        (points, self.state.velocity[nodes].to_vec())
    }

    /// Kinetic and strain energy of a block, J: as of the reports, ½v⁻·M·v⁺, but for loads
    /// and contact.
    pub(super) fn energy_of(&self, block: usize) -> f64 {
        let velocities = &self.state.velocity[self.model.nodes(block)];
        self.kinetic_energy_of(block, velocities)
            + 0.5 * self.power_of(block, velocities)
            + self.model.strain_energy_of(block, &self.state.displacement)
    }

    /// Work of the last kick's forces of a block's elements, at these velocities, J.
    fn power_of(&self, block: usize, velocities: &[[f64; D]]) -> f64 {
        let first = self.model.nodes(block).start;
        let mut force = [[0.0; D]; MAX_NODES];
        let work = self.model.elements(block).map(|element| {
            let (set, i) = self.model.numbering.of(element);
            let set = &self.model.sets[set];
            set.force(i, &self.state.displacement, &mut force);
            let nodes = self.model.mesh.elements[element].nodes().iter().zip(&force);
            let power = nodes.map(|(&node, force)| dot(force, &velocities[node as usize - first]));
            self.state.element_interval[element] * power.sum::<f64>()
        });
        work.sum()
    }

    /// Kinetic energy of a block with these velocities of its nodes, J.
    fn kinetic_energy_of(&self, block: usize, velocities: &[[f64; D]]) -> f64 {
        let first = self.model.nodes(block).start;
        let energy = |(node, velocity): (usize, &[f64; D])| {
            let of = |node: usize| velocities[node - first];
            0.5 * dot(velocity, &self.model.inertia.weighted(first + node, of))
        };
        velocities.iter().enumerate().map(energy).sum()
    }

    /// Kinetic energy of a block without its loose motion, J.
    pub(super) fn bound_energy_of(&self, block: usize) -> f64 {
        let motion = self.with_momenta(block, &self.before(block));
        self.kinetic_energy_of(block, &motion.without_rigid_motion(1.0))
    }

    /// Gives a block its momenta back, and takes what energy it has gained; returns how much
    /// more that was than it can give now, J. What holds a block gives it the momentum that
    /// it lacks then.
    pub(super) fn restore_momenta(&mut self, block: usize, before: &BlockBefore<D>) -> f64 {
        let nodes = self.model.nodes(block);
        let motion = self.with_momenta(block, before);
        self.state.velocity[nodes].copy_from_slice(&motion.velocities);
        self.book_remesh(block, &before.momenta);
        let gained = self.energy_of(block) - before.energy;
        gained.max(0.0) - self.repay_energy(block, gained)
    }

    /// Books what a block that is held has been given of momentum, and had not before.
    fn book_remesh(&mut self, block: usize, before: &RigidMomenta) {
        if self
            .prescribed_components(block)
            .iter()
            .any(|held| held.contains(&true))
        {
            let given = sub(&self.before(block).momenta.linear, &before.linear);
            self.ledger.impulse.add_scaled(1.0, &given);
        }
    }

    /// Takes some energy, J, of a block's loose motion; returns how much there was.
    pub(super) fn repay_energy(&mut self, block: usize, energy: f64) -> f64 {
        if energy <= 0.0 {
            return 0.0;
        }
        let before = self.before(block);
        let motion = self.with_momenta(block, &before);
        // Of a share s of it, s² of its kinetic energy is left, and s of the work.
        let bound = motion.without_rigid_motion(1.0);
        let kinetic = self.kinetic_energy_of(block, &motion.loose);
        let both = self.kinetic_energy_of(block, &motion.velocities);
        let mixed = both - kinetic - self.kinetic_energy_of(block, &bound);
        let work = 0.5 * self.power_of(block, &motion.loose);
        let Some(share) = share(kinetic, mixed + work, energy) else {
            return 0.0;
        };
        let nodes = self.model.nodes(block);
        self.state.velocity[nodes].copy_from_slice(&motion.without_rigid_motion(1.0 - share));
        self.book_remesh(block, &before.momenta);
        before.energy - self.energy_of(block)
    }

    /// Motion of a block that has been given the momenta it had, as far as it is not held.
    pub(super) fn with_momenta(&self, block: usize, before: &BlockBefore<D>) -> BlockMotion<D> {
        let (points, mut velocities) = self.motion_of(block);
        let body = self.body(block, &points);
        let held = self.prescribed_components(block);
        let mut wanted = before.momenta;
        if !held.iter().any(|held| held.contains(&true)) {
            let (_, centre) = body.centre();
            let arm = pad(&sub(&centre, &before.centre));
            add_scaled(&mut wanted.angular, -1.0, &cross(&arm, &wanted.linear));
            body.give_back(&mut velocities, &wanted);
            let mut rigid = vec![[0.0; D]; velocities.len()];
            body.give_back(&mut rigid, &wanted);
            let loose = velocities.iter().zip(&rigid).map(|(v, r)| sub(v, r));
            return BlockMotion {
                loose: loose.collect(),
                velocities,
            };
        }
        let twists = RigidModes::new(&body, before.centre, &held);
        twists.give_back(&mut velocities, &wanted);
        let mut bound = carried(&velocities, &held);
        twists.give_back(&mut bound, &wanted);
        let loose = velocities.iter().zip(&bound).map(|(v, b)| sub(v, b));
        let loose = loose.collect();
        BlockMotion { velocities, loose }
    }
}

/// Velocities of nodes that go with what is held: these, and on the mean beside it.
fn carried<const D: usize>(velocities: &[[f64; D]], held: &[[bool; D]]) -> Vec<[f64; D]> {
    let mean: [f64; D] = std::array::from_fn(|c| {
        let of_held = velocities.iter().zip(held).filter(|(_, held)| held[c]);
        let (sum, count) = of_held.fold((0.0, 0), |(sum, n), (v, _)| (sum + v[c], n + 1));
        if count == 0 {
            0.0
        } else {
            sum / f64::from(count)
        }
    });
    let nodes = velocities.iter().zip(held);
    let of_node = |(velocity, held): (&[f64; D], &[bool; D])| {
        std::array::from_fn(|c| if held[c] { velocity[c] } else { mean[c] })
    };
    nodes.map(of_node).collect()
}

/// The share s between 0 and 1 for which `kinetic` s² + `work` s is less than all of both
/// by `gained`; where there is none, that for which it is least.
pub(super) fn share(kinetic: f64, work: f64, gained: f64) -> Option<f64> {
    let least = -0.5 * work / kinetic;
    let square = least * least + (kinetic + work - gained) / kinetic;
    let share = least + square.max(0.0).sqrt();
    share.is_finite().then(|| share.clamp(0.0, 1.0))
}
