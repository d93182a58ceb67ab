//! Output of a run's synchronised state: rows and contact points.

use std::sync::Arc;

use crate::contact::constraint::contact_history::ContactHistory;
use crate::math::vector::{add_scaled, cross, dot, pad, scale, sub};
use crate::mesh::Mesh;
use crate::simulation::output::{BlockRow, ContactFrame, ContactRow, HistoryRow, ProbeRow};
use crate::step::{Run, Synchronised};

/// A synchronised state, and the number of its step.
pub(crate) struct SynchronisedInstant<const D: usize> {
    pub(crate) number: u64,
    pub(crate) state: Synchronised<D>,
}

impl<const D: usize> Run<D> {
    /// Returns the synchronised state at the current time.
    pub(crate) fn instant(&mut self) -> Arc<SynchronisedInstant<D>> {
        Arc::new(SynchronisedInstant {
            number: self.state.number,
            state: self.synchronise(),
        })
    }

    /// Returns the time for reports, s. A whole number of steps misses the end of the scene by
    /// round-off; the last row has the exact end.
    pub(crate) fn report_time(&self) -> f64 {
        if self.state.number == self.model.step_count {
            self.model.end
        } else {
            self.time()
        }
    }

    /// Returns the deepest penetration, m: at the start of any kick so far, or now.
    pub(crate) fn max_penetration(&self) -> f64 {
        let at = self.model.positions(&self.state);
        let contacts = self.contacts.as_ref();
        contacts.map_or(0.0, |contacts| {
            contacts.deepest_penetration(at.into(), self.time()).depth
        })
    }

    /// Returns energies and momenta; `start_energy` is the kinetic plus strain energy at t = 0, J.
    pub(crate) fn history(
        &self,
        instant: &SynchronisedInstant<D>,
        start_energy: f64,
    ) -> HistoryRow {
        let at = self.model.positions(&self.state);
        let balance = self.energy_balance(&instant.state);
        let contacts = self.contacts.as_ref();
        let mut row = HistoryRow {
            step: self.state.number,
            time: self.report_time(),
            kinetic_energy: balance.kinetic_energy,
            strain_energy: balance.strain_energy,
            external_work: balance.external_work,
            gravity_work: balance.gravity_work,
            impact_loss: balance.impact_loss,
            friction_loss: balance.friction_loss,
            damping_loss: balance.damping_loss,
            fracture_loss: balance.fracture_loss,
            remesh_loss: balance.remesh_loss,
            correction_loss: balance.correction_loss,
            energy_residual: balance.residual(start_energy),
            impulse: instant.state.ledger.impulse.value(),
            contacts: contacts.map_or(0, |contacts| contacts.contact_points().count() as u64),
            elements: self.workspace.schedule.histogram().iter().sum(),
            refined_blocks: self.refined_blocks(),
            ..HistoryRow::default()
        };
        for (number, block) in self.model.blocks.iter().enumerate() {
            if block.fixed {
                continue;
            }
            for node in self.model.nodes(number) {
                let momentum = pad(&self.model.inertia.momentum(node, &instant.state.velocity));
                add_scaled(&mut row.momentum, 1.0, &momentum);
                let turning = cross(&pad(&at.at(node as u32)), &momentum);
                add_scaled(&mut row.angular_momentum, 1.0, &turning);
            }
        }
        row
    }

    /// Returns the kinetic plus strain energy, J.
    pub(crate) fn energy(&self, instant: &SynchronisedInstant<D>) -> f64 {
        instant.state.kinetic_energy + self.model.strain_energy(&self.state.displacement)
    }

    /// Returns the rows of the blocks for which `wanted` is true. Contact forces are means since
    /// the last call, `since` seconds ago.
    pub(crate) fn block_rows(
        &mut self,
        instant: &SynchronisedInstant<D>,
        since: f64,
        wanted: impl Fn(usize) -> bool,
    ) -> Vec<BlockRow> {
        let mut rows = Vec::new();
        for block in (0..self.model.blocks.len()).filter(|&block| wanted(block)) {
            let force = if since > 0.0 {
                scale(1.0 / since, &self.state.block_impulse[block])
            } else {
                [0.0; 3]
            };
            self.state.block_impulse[block] = [0.0; 3];
            rows.push(BlockRow {
                force,
                ..self.block_row(instant, block)
            });
        }
        rows
    }

    /// Returns the row of a block, without its contact force.
    pub(crate) fn block_row(&self, instant: &SynchronisedInstant<D>, block: usize) -> BlockRow {
        let at = self.model.positions(&self.state);
        let centre = self.model.centre(block, |node| at.at(node as u32));
        let mut mass = 0.0;
        let (mut momentum, mut turning) = ([0.0; 3], [0.0; 3]);
        let mut second = [[0.0; 3]; 3];
        // The mass matrix is applied to lever arms as it is to velocities, so angular momentum and
        // inertia use the same matrix.
        let arm_of = |node: usize| sub(&at.at(node as u32), &centre);
        for node in self.model.nodes(block) {
            mass += self.model.inertia.mass()[node];
            let p = pad(&self.model.inertia.momentum(node, &instant.state.velocity));
            add_scaled(&mut momentum, 1.0, &p);
            let arm = pad(&arm_of(node));
            add_scaled(&mut turning, 1.0, &cross(&arm, &p));
            let weighted = pad(&self.model.inertia.weighted(node, arm_of));
            for i in 0..3 {
                add_scaled(&mut second[i], arm[i], &weighted);
            }
        }
        let fixed = self.model.blocks[block].fixed;
        BlockRow {
            time: self.report_time(),
            block: self.model.mesh.blocks[block].name.clone(),
            mass,
            position: pad(&centre),
            velocity: if fixed {
                [0.0; 3]
            } else {
                scale(1.0 / mass, &momentum)
            },
            angular_velocity: if fixed {
                [0.0; 3]
            } else {
                spin::<D>(&second, &turning)
            },
            force: [0.0; 3],
        }
    }

    /// Returns the rows of the probes.
    pub(crate) fn probe_rows(
        &self,
        instant: &SynchronisedInstant<D>,
        probes: &[FollowedNode],
    ) -> Vec<ProbeRow> {
        let at = self.model.positions(&self.state);
        let row = |probe: &FollowedNode| {
            let node = self.model.nodes(probe.block).start + probe.node;
            ProbeRow {
                time: self.report_time(),
                probe: probe.name.clone(),
                position: pad(&at.at(node as u32)),
                displacement: pad(&self.state.displacement[node]),
                velocity: pad(&instant.state.velocity[node]),
            }
        };
        probes.iter().map(row).collect()
    }

    /// Returns the current contact points.
    pub(crate) fn contact_frame(&self) -> ContactFrame {
        let mut frame = ContactFrame {
            time: self.report_time(),
            ..ContactFrame::default()
        };
        let Some(contacts) = &self.contacts else {
            return frame;
        };
        let at = self.model.positions(&self.state);
        for contact in contacts.contact_points() {
            let jacobian = contact.jacobian(contacts.surface(), at.into());
            let mut force = [0.0; D];
            for r in 0..D {
                let share = if contact.interval > 0.0 {
                    contact.impulse[r] / contact.interval
                } else {
                    0.0
                };
                add_scaled(&mut force, share, &jacobian.frame[r]);
            }
            frame
                .points
                .push(pad(&contacts.surface().point(contact.pair, at.into())));
            frame.normals.push(pad(&jacobian.frame[0]));
            frame.forces.push(pad(&force));
            frame.slips.push(contact.history.slip);
            frame.areas.push(contact.history.area);
        }
        frame
    }

    /// Returns a contact history as a row of `contacts.csv`.
    pub(crate) fn contact_row(&self, record: &ContactHistory) -> ContactRow {
        let name = |block: u32| self.model.mesh.blocks[block as usize].name.clone();
        ContactRow {
            main: name(record.blocks[0]),
            target: name(record.blocks[1]),
            kind: record.kind,
            time_on: record.time_on,
            time_off: record.time_off,
            position: record.position,
            peak_normal_force: record.peak_normal_force,
            normal_impulse: record.normal_impulse,
            shear_impulse: record.shear_impulse,
            slip: record.slip,
            level: record.level,
        }
    }
}

/// Returns the angular velocity from Σ m r⊗r and angular momentum, both about the centre.
fn spin<const D: usize>(second: &[[f64; 3]; 3], turning: &[f64; 3]) -> [f64; 3] {
    let trace = second[0][0] + second[1][1] + second[2][2];
    if D == 2 {
        return [0.0, 0.0, turning[2] / trace];
    }
    let inertia = nalgebra::Matrix3::from_fn(|i, j| {
        let own = 0.5 * (second[i][j] + second[j][i]);
        if i == j { trace - own } else { -own }
    });
    let momentum = nalgebra::Vector3::from(*turning);
    inertia
        .cholesky()
        .map_or([0.0; 3], |factor| factor.solve(&momentum).into())
}

/// A node followed by a probe.
#[derive(Clone, Debug)]
pub(crate) struct FollowedNode {
    name: String,
    block: usize,
    /// Number in its block; refinement appends its nodes after those of the base mesh.
    node: usize,
}

impl FollowedNode {
    /// Follows the node of `blocks` nearest to `point` at t = 0; `None` if there is no node.
    pub(crate) fn new<const D: usize>(
        name: &str,
        mesh: &Mesh<D>,
        blocks: impl Iterator<Item = usize>,
        point: &[f64; D],
    ) -> Option<Self> {
        let nodes = blocks.flat_map(|block| {
            let nodes = mesh.blocks[block].nodes.clone();
            nodes
                .enumerate()
                .map(move |(node, global)| (block, node, global))
        });
        let distance = |&(_, _, global): &(usize, usize, u32)| {
            let arm = sub(&mesh.nodes[global as usize], point);
            dot(&arm, &arm)
        };
        let nearest = nodes.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map(|(block, node, _)| Self {
            name: name.to_owned(),
            block,
            node,
        })
    }
}
