//! The nodal part of a kick, one range of nodes at a time, so that its data stays in the cache.

use crate::math::vector::{add, add_scaled};
use crate::model::state::LastKick;
use crate::model::{Model, State};
use crate::step::assembly::Assembly;
use crate::step::kick::{ActiveLoads, KickImpulses};
use crate::step::schedule::Substep;

/// The forces of a kick on nodes, except contact.
struct NodalForces<'a, const D: usize> {
    model: &'a Model<D>,
    acting: ActiveLoads,
    gravity: [f64; D],
    assembly: &'a Assembly,
    /// The coarsest level that is due, and the impulses of the element groups, elastic and viscous.
    coarsest: u8,
    group_impulses: &'a [Vec<[f64; D]>; 2],
    /// Kick interval of each node, s.
    interval: &'a [f64],
    /// Impulses of loads, N·s.
    load: &'a [[f64; D]],
    /// Contact forces of the last kick, N.
    contact_force: &'a [[f64; D]],
}

/// The output of a kick for consecutive nodes, beginning with `first`.
struct NodeRangeOutput<'a, const D: usize> {
    first: usize,
    /// Sum of all impulses except contact, viscous impulses, and those of damping, N·s.
    total: &'a mut [[f64; D]],
    viscous: &'a mut [[f64; D]],
    damping: &'a mut [[f64; D]],
    /// Velocities before and after, m/s.
    before: &'a mut [[f64; D]],
    velocity: &'a mut [[f64; D]],
}

impl<const D: usize> NodalForces<'_, D> {
    /// Sums the impulses on the nodes, and stores the velocities before the kick.
    fn sum_impulses(&self, output: &mut NodeRangeOutput<D>) {
        let [elastic, viscous] = self.group_impulses;
        output.before.copy_from_slice(output.velocity);
        self.assembly
            .sums(output.first, self.coarsest, elastic, output.total);
        if self.acting.stiffness_damping {
            self.assembly
                .sums(output.first, self.coarsest, viscous, output.viscous);
            for (total, viscous) in output.total.iter_mut().zip(&*output.viscous) {
                add_scaled(total, 1.0, viscous);
            }
        }
        if self.acting.loads {
            for (total, load) in output.total.iter_mut().zip(&self.load[output.first..]) {
                add_scaled(total, 1.0, load);
            }
        }
        if self.acting.gravity {
            let mass = &self.model.inertia.mass()[output.first..];
            let heavy = mass.iter().zip(&self.interval[output.first..]);
            for (total, (mass, interval)) in output.total.iter_mut().zip(heavy) {
                add_scaled(total, mass * interval, &self.gravity);
            }
        }
        if self.acting.mass_damping || self.acting.local_damping {
            output.damping.fill([0.0; D]);
        }
        if self.acting.local_damping {
            self.add_local_damping(output);
        }
    }

    /// Adds local damping after Cundall: it opposes the velocity with a fraction of the unbalanced
    /// force. The contact force in it is that of the last kick.
    fn add_local_damping(&self, output: &mut NodeRangeOutput<D>) {
        for (k, total) in output.total.iter_mut().enumerate() {
            let n = output.first + k;
            let local = self.model.damping_of(n).local;
            if local > 0.0 {
                for c in 0..D {
                    let unbalanced = total[c] + self.contact_force[n][c] * self.interval[n];
                    let damping = -local * unbalanced.abs() * sign(output.velocity[k][c]);
                    output.damping[k][c] += damping;
                    total[c] += damping;
                }
            }
        }
    }

    /// Applies mass-proportional damping, centred in time: stable at any step. Contact impulses,
    /// which come later, account for it in their [`Mobility`].
    ///
    /// [`Mobility`]: crate::model::inverse_mass::KickMobility
    fn apply_mass_damping(&self, output: &mut NodeRangeOutput<D>) {
        let velocities = output.velocity.iter_mut().zip(&*output.before);
        for (n, (velocity, before)) in (output.first..).zip(velocities) {
            let alpha = self.model.damping_of(n).mass;
            if alpha > 0.0 {
                let factor = 0.5 * alpha * self.interval[n];
                for c in 0..D {
                    velocity[c] = (velocity[c] - factor * before[c]) / (1.0 + factor);
                }
            }
        }
    }
}

impl<const D: usize> Model<D> {
    /// Kicks the nodes that are due. The impulses of elements and loads are known; contact comes
    /// after.
    pub(super) fn kick_nodes(
        &self,
        state: &mut State<D>,
        velocity: &mut [[f64; D]],
        impulses: &mut KickImpulses<D>,
        substep: &Substep,
    ) {
        let acting = impulses.acting;
        let nodal = NodalForces {
            model: self,
            acting,
            gravity: self.gravity_at(substep.time),
            assembly: &substep.schedule.assembly,
            coarsest: substep.coarsest,
            group_impulses: &impulses.group_impulses,
            interval: &state.last_kick.interval,
            load: &impulses.load,
            contact_force: &state.contact_force,
        };
        let arrays = [
            &mut *impulses.total,
            &mut impulses.viscous,
            &mut impulses.damping,
            &mut state.last_kick.velocity_before,
            velocity,
        ];
        substep.each_range(
            arrays,
            &|first, [total, viscous, damping, before, velocity]| {
                let mut output = NodeRangeOutput {
                    first,
                    total,
                    viscous,
                    damping,
                    before,
                    velocity,
                };
                nodal.sum_impulses(&mut output);
                self.inertia.kick(first, output.total, output.velocity);
                if acting.mass_damping {
                    nodal.apply_mass_damping(&mut output);
                }
            },
        );
    }

    /// Computes the impulses of mass-proportional damping, once contact is solved and the
    /// velocities are `after`.
    pub(super) fn book_damping(
        &self,
        last_kick: &LastKick<D>,
        after: &[[f64; D]],
        impulses: &mut KickImpulses<D>,
        substep: &Substep,
    ) {
        if !impulses.acting.mass_damping {
            return;
        }
        let arrays = [&mut *impulses.damping, &mut impulses.total];
        substep.each_node(arrays, &|n, sums| {
            let alpha = self.damping_of(n).mass;
            if alpha == 0.0 {
                return;
            }
            let factor = 0.5 * alpha * last_kick.interval[n];
            let momenta = self.inertia.weighted(n, |other| {
                add(&last_kick.velocity_before[other], &after[other])
            });
            for sum in sums {
                add_scaled(sum, -factor, &momenta);
            }
        });
    }
}

fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        0.0
    }
}
