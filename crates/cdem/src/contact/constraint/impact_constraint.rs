//! The constraint of a contact at the instant of an impact, and what its solution leaves.

use crate::contact::constraint::contact_constraint::Constraint;
use crate::contact::constraint::contact_point::ContactPoint;
use crate::contact::constraint::context::ContactContext;
use crate::contact::surface::Configuration;
use crate::contact::timing::DriftProgress;

impl<const D: usize> ContactPoint<D> {
    /// Returns the constraint at the instant of an impact, at the present positions. A contact closed
    /// before starts with the impulse of its last kick. Its pressure may fall to the share of the drift
    /// that has passed, and its shear is bounded by that. If all could be given back, friction that has
    /// been at work would return at another speed, and such impacts gave up to 5 % of the energy. As long
    /// as the contact carries an impulse, it keeps the relative velocity that it has in `velocity`, with
    /// which its kick has set the gap at the end of the drift. The strength of a joint bounds the sum of
    /// both impulses.
    pub(crate) fn impact_constraint(
        &self,
        context: &ContactContext<D>,
        at: Configuration<D>,
        velocity: &[[f64; D]],
        now: DriftProgress,
    ) -> Constraint<D> {
        let mut constraint = Constraint::default();
        self.assemble_jacobian(&mut constraint.jacobian, context.surface, at);
        if self.is_new {
            constraint.bounds = self.friction_bounds(0.0);
            return constraint;
        }
        self.set_target(&mut constraint, context, now.duration);
        (constraint.impulse, constraint.impulse_before) = (self.impulse, self.impulse);
        constraint.bounds = self.friction_bounds(now.duration.max(self.interval));
        if self.carries_impulse() {
            constraint.target[0] = constraint.jacobian.relative_velocity(0, velocity);
            if !self.is_joint {
                let passed = now.elapsed / now.duration * self.force[0] * self.interval;
                constraint.bounds.tension = -passed.clamp(0.0, self.impulse[0].max(0.0));
            }
        }
        constraint
    }

    /// Applies a solved impact: slip, broken joint and, for the next impact of this drift, the
    /// remaining impulse. A contact that opens has none: what it has carried stays done.
    pub(crate) fn apply_impact(
        &mut self,
        solved: &Constraint<D>,
        velocity: &[[f64; D]],
        least: f64,
    ) {
        if self.is_new {
            self.is_new = false;
        } else {
            self.impulse = solved.impulse;
            self.breaks(solved, velocity, least);
            if !self.is_joint && solved.opens(velocity, least) {
                self.impulse = [0.0; D];
            }
        }
        if solved.slips(velocity, least) && !self.is_joint {
            self.slide();
        }
    }
}
