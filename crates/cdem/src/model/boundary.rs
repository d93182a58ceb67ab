//! Prescribed velocities: prescribed components of nodes and their values.

use crate::math::vector::{cross, dot, pad, scale, sub, truncate};
use crate::mesh::MeshError;
use crate::model::{Model, ModelError, block_names};
use crate::scene::{Boundary, BoundaryTarget, Motion, Scene};

/// A prescribed motion of some nodes.
pub(crate) struct PrescribedMotion {
    /// The nodes, sorted.
    pub(crate) nodes: Vec<u32>,
    boundary: Boundary,
}

/// Time of a prescribed velocity, s.
#[derive(Clone, Copy, Debug)]
pub(crate) enum VelocityTime {
    /// Velocity at an instant.
    Instant(f64),
    /// Mean velocity over a drift, which ends where the exact motion takes the node.
    Drift { start: f64, duration: f64 },
}

impl PrescribedMotion {
    /// Creates the motion `boundary` of `nodes`.
    pub(crate) fn new(boundary: &Boundary, nodes: Vec<u32>) -> Self {
        Self {
            nodes,
            boundary: boundary.clone(),
        }
    }

    /// True if the motion acts in a step that begins at `time`.
    pub(crate) fn acts(&self, time: f64) -> bool {
        time >= self.boundary.start && self.boundary.end.is_none_or(|end| time < end)
    }

    /// Returns the components that it prescribes.
    pub(crate) fn components<const D: usize>(&self) -> [bool; D] {
        match &self.boundary.motion {
            Motion::Velocity(components) => std::array::from_fn(|c| components[c].is_some()),
            Motion::Turn { .. } => [true; D],
        }
    }

    /// Returns a component that both motions prescribe at some time with different velocities.
    pub(crate) fn contradicts<const D: usize>(&self, other: &Self) -> Option<usize> {
        let begins_before_end = |a: &Boundary, b: &Boundary| b.end.is_none_or(|end| a.start < end);
        let (a, b) = (&self.boundary, &other.boundary);
        if !begins_before_end(a, b) || !begins_before_end(b, a) || a.motion == b.motion {
            return None;
        }
        let prescribed: [[bool; D]; 2] = [self.components(), other.components()];
        let same = |c: usize| match (&a.motion, &b.motion) {
            (Motion::Velocity(a), Motion::Velocity(b)) => a[c] == b[c],
            _ => false,
        };
        (0..D).find(|&c| prescribed[0][c] && prescribed[1][c] && !same(c))
    }

    /// Sets the prescribed components of the velocity of a node at `position`.
    pub(crate) fn set_velocity<const D: usize>(
        &self,
        at: VelocityTime,
        position: &[f64; D],
        velocity: &mut [f64; D],
    ) {
        match &self.boundary.motion {
            Motion::Velocity(components) => {
                for (v, schedule) in velocity.iter_mut().zip(components) {
                    if let Some(schedule) = schedule {
                        *v = match at {
                            VelocityTime::Instant(time) => schedule.value(time),
                            VelocityTime::Drift { start, duration } => {
                                schedule.integral(start, start + duration) / duration
                            }
                        };
                    }
                }
            }
            Motion::Turn {
                axis,
                point,
                angular_velocity,
            } => {
                let arm = sub(&pad(position), point);
                let around = cross(axis, &arm);
                *velocity = truncate(&match at {
                    VelocityTime::Instant(time) => scale(angular_velocity.value(time), &around),
                    VelocityTime::Drift { start, duration } => {
                        let angle = angular_velocity.integral(start, start + duration);
                        // Rodrigues: the chord from the position to the rotated position.
                        let across = sub(&scale(dot(axis, &arm), axis), &arm);
                        let chord: [f64; 3] = std::array::from_fn(|c| {
                            angle.sin() * around[c] + 2.0 * (0.5 * angle).sin().powi(2) * across[c]
                        });
                        scale(1.0 / duration, &chord)
                    }
                });
            }
        }
    }
}

impl<const D: usize> Model<D> {
    /// Returns the prescribed motions of a scene on the nodes of the mesh.
    ///
    /// # Errors
    /// If a group is unknown, a block is fixed, or two motions contradict each other.
    pub(crate) fn prescribed_motions(
        &self,
        scene: &Scene,
    ) -> Result<Vec<PrescribedMotion>, ModelError> {
        let mut motions = Vec::new();
        for (number, boundary) in scene.boundary.iter().enumerate() {
            let key = |name: &str| format!("boundary[{number}].{name}");
            let nodes: Vec<u32> = match &boundary.target {
                BoundaryTarget::Group(name) => {
                    let blame = |source: MeshError| ModelError::Group {
                        key: key("group"),
                        source,
                    };
                    self.mesh.group(name).map_err(blame)?.nodes.clone()
                }
                BoundaryTarget::Block(name) => {
                    let parts = block_names::parts(scene, &self.mesh, name);
                    parts
                        .flat_map(|part| self.mesh.blocks[part].nodes.clone())
                        .collect()
                }
            };
            if let Some(&node) = nodes.iter().find(|&&node| self.is_fixed(node)) {
                let block = self.block_of[node as usize] as usize;
                return Err(ModelError::FixedBoundary {
                    key: key(match boundary.target {
                        BoundaryTarget::Group(_) => "group",
                        BoundaryTarget::Block(_) => "block",
                    }),
                    block: self.mesh.blocks[block].name.clone(),
                });
            }
            let motion = PrescribedMotion::new(boundary, nodes);
            self.refuse_contradiction(number, &motion, &motions)?;
            motions.push(motion);
        }
        Ok(motions)
    }

    fn refuse_contradiction(
        &self,
        number: usize,
        motion: &PrescribedMotion,
        earlier: &[PrescribedMotion],
    ) -> Result<(), ModelError> {
        for (other_number, other) in earlier.iter().enumerate() {
            let Some(axis) = motion.contradicts::<D>(other) else {
                continue;
            };
            let both = |node: &&u32| other.nodes.binary_search(node).is_ok();
            if let Some(&node) = motion.nodes.iter().find(both) {
                let block = self.block_of[node as usize] as usize;
                return Err(ModelError::Contradiction {
                    key: format!("boundary[{number}]"),
                    earlier: other_number,
                    node: node - self.nodes(block).start as u32,
                    block: self.mesh.blocks[block].name.clone(),
                    axis: ['x', 'y', 'z'][axis],
                });
            }
        }
        Ok(())
    }

    /// Takes the components that are prescribed from `time` on out of the equations of motion.
    pub(crate) fn set_prescribed_nodes(&mut self, time: f64) {
        let mut prescribed = vec![[false; D]; self.mesh.nodes.len()];
        for (number, block) in self.blocks.iter().enumerate() {
            if block.fixed {
                prescribed[self.nodes(number)].fill([true; D]);
            }
        }
        for motion in self.boundaries.iter().filter(|motion| motion.acts(time)) {
            let components: [bool; D] = motion.components();
            for &node in &motion.nodes {
                for c in 0..D {
                    prescribed[node as usize][c] |= components[c];
                }
            }
        }
        self.inertia.set_prescribed(&prescribed);
    }
}
