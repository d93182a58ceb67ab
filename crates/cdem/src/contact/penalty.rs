//! Penalty model, the conventional one, for comparison: normal and shear springs at points that
//! overlap at the start of a step (section 2 of the paper).

use crate::contact::constraint::contact_constraint::shear_norm;
use crate::contact::constraint::contact_history::ContactHistory;
use crate::contact::constraint::contact_point::ContactPoint;
use crate::contact::constraint::context::ContactContext;
use crate::contact::constraint::duplicate::DriftInterval;
use crate::contact::constraint::target_tracking::Tracking;
use crate::contact::energy::ContactEnergies;
use crate::contact::island::Island;
use crate::contact::island::parallel::IslandKicks;
use crate::contact::surface::kicked::KickedView;
use crate::contact::surface::{Configuration, ContactJacobian, Pair, Surface};

impl<const D: usize> ContactPoint<D> {
    /// Returns the energy of the normal and shear springs, J.
    pub(crate) fn spring_energy(&self, surface: &dyn Surface<D>, at: Configuration<D>) -> f64 {
        let overlap = (self.offset[0] - surface.gap_or_zero(self.pair, at)).max(0.0);
        let shear = shear_norm(&self.shear_spring);
        0.5 * self.law.normal_stiffness * overlap * overlap
            + 0.5 * self.law.shear_stiffness * shear * shear
    }
}

impl<const D: usize> Island<D> {
    /// Applies the spring forces of the pairs that overlap now over the interval of the kick.
    /// Adds the impulses on nodes to a list, N·s. Returns the contacts that have ended.
    pub(crate) fn kick_penalty(
        &mut self,
        context: &ContactContext<D>,
        motion: &mut KickedView<D>,
        kick: &IslandKicks<D>,
        interval: f64,
        received: &mut Vec<(u32, [f64; D])>,
        energies: &mut ContactEnergies,
    ) -> Vec<ContactHistory> {
        let surface = context.surface;
        let at = motion.positions();
        let overlaps = |&pair: &Pair| {
            let projection = surface.project(pair, at);
            projection.gap < 0.0 && projection.outside <= 0.0 && surface.in_normal_cone(pair, at)
        };
        let pairs: Vec<Pair> = self.separation_bounds.pairs().filter(overlaps).collect();
        let known = self.contact_points.len();
        energies.touch_count +=
            self.activate_pairs(context, DriftInterval::at_rest(at), &pairs, kick.times.time);
        for contact in &mut self.contact_points[known..] {
            contact.offset[0] = 0.0;
        }
        let mut ended = Vec::new();
        self.contact_points.retain_mut(|contact| {
            contact.is_sticking = false; // the foot follows the point; the springs do not
            let tracking = contact.track_target(context, motion.positions(), |_| false);
            let kick = if matches!(tracking, Tracking::Goes) {
                contact.spring(context, motion, kick, interval, energies)
            } else {
                contact.book_springs(surface, motion.positions(), energies);
                None
            };
            let Some(jacobian) = kick else {
                ended.push(contact.history.clone());
                return false;
            };
            let mobility = context.mobility(interval);
            jacobian.apply_transpose(&contact.impulse, |node, impulse| {
                mobility.push(node, impulse, motion.velocity);
                received.push((node, *impulse));
            });
            true
        });
        ended
    }
}

impl<const D: usize> ContactPoint<D> {
    /// Finds the impulse of the springs of one contact. Returns its Jacobian, or `None` if it has
    /// opened. The kick lasts `interval` seconds.
    fn spring(
        &mut self,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        kick: &IslandKicks<D>,
        interval: f64,
        energies: &mut ContactEnergies,
    ) -> Option<ContactJacobian<D>> {
        let surface = context.surface;
        let jacobian = self.jacobian(surface, motion.positions());
        self.normal = jacobian.frame[0];
        let overlap = self.offset[0] - jacobian.offset[0];
        energies
            .penetration
            .include(self.penetration_at(&jacobian, kick.times.time));
        let bond = if self.is_joint {
            self.history.area
        } else {
            0.0
        };
        let normal = self.law.normal_stiffness * overlap;
        if normal <= -self.law.tensile_strength * bond {
            self.book_springs(surface, motion.positions(), energies);
            return None;
        }
        let stiffness = self.law.shear_stiffness;
        let last = self.shear_spring;
        let mut force = [0.0; D];
        force[0] = normal;
        for r in 1..D {
            // The velocity before the kick is that of the previous drift.
            self.shear_spring[r] += jacobian.relative_velocity(r, kick.before) * interval;
            force[r] = -stiffness * self.shear_spring[r];
        }
        let bound = (normal * self.law.friction + self.law.cohesion * bond).max(0.0);
        if shear_norm(&force) >= bound && shear_norm(&force) > 0.0 {
            self.slip_springs(&mut force, &last, energies);
        }
        self.impulse = force.map(|force| force * interval);
        self.interval = interval;
        self.history.count(&[0.0; D], &self.impulse);
        Some(jacobian)
    }

    /// Books the energy left in the springs, which is lost with the contact.
    fn book_springs(
        &self,
        surface: &dyn Surface<D>,
        at: Configuration<D>,
        energies: &mut ContactEnergies,
    ) {
        *energies.slip_loss(self.is_joint) += self.spring_energy(surface, at);
    }

    /// Reduces the shear of `force` to the friction limit, and the springs with it. `last` are
    /// their elongations before, m.
    fn slip_springs(
        &mut self,
        force: &mut [f64; D],
        last: &[f64; D],
        energies: &mut ContactEnergies,
    ) {
        let stiffness = self.law.shear_stiffness;
        let was_joint = self.is_joint;
        self.is_joint = false;
        let bound = (force[0] * self.law.friction).max(0.0);
        let kept = (bound / shear_norm(force)).min(1.0);
        self.history.slip += (1.0 - kept) * shear_norm(&self.shear_spring);
        for r in 1..D {
            let [old, trial] = [last[r], self.shear_spring[r]];
            let new = kept * trial;
            // Work of the mean force, less the increase of spring energy.
            let work = 0.5 * stiffness * (old + new) * (trial - old);
            let loss = work - 0.5 * stiffness * (new * new - old * old);
            *energies.slip_loss(was_joint) += loss;
            self.shear_spring[r] = new;
            force[r] *= kept;
        }
    }
}
