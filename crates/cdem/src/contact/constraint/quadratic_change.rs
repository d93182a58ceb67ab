//! Quadratic changes of gaps in a drift: ½ J̇v δ². Points slide over bends, and faces turn.

use rayon::prelude::*;

use crate::contact::constraint::contact_constraint::Constraint;
use crate::contact::constraint::contact_point::ContactPoint;
use crate::contact::constraint::context::ContactContext;
use crate::contact::surface::Pair;
use crate::contact::surface::kicked::ConstantMotion;
use crate::contact::tolerances::{
    CONTACTS_PER_TASK, GAP_ERROR, MOST_REPEATED_SOLVES, MOST_TURN, PARTING_BISECTIONS,
};
use crate::math::vector::dot;

/// Pairs of the contacts of an island. They mostly stay from kick to kick.
#[derive(Debug, Default)]
pub(crate) struct ContactPairs {
    listed: Vec<Pair>,
    sorted: Vec<Pair>,
}

impl ContactPairs {
    /// Replaces the content by the pairs of these contacts.
    pub(crate) fn list<const D: usize>(&mut self, contacts: &[ContactPoint<D>]) {
        let pairs = contacts.iter().map(|contact| contact.pair);
        if self.listed.iter().copied().eq(pairs.clone()) {
            return;
        }
        self.listed.clear();
        self.listed.extend(pairs);
        self.sorted.clone_from(&self.listed);
        self.sorted.sort_unstable();
    }

    /// True if a contact has this pair.
    pub(crate) fn contains(&self, pair: Pair) -> bool {
        self.sorted.binary_search(&pair).is_ok()
    }
}

/// Quadratic changes of the gaps, one for each contact, m: those that the targets of a solve allow
/// for, and those found at the solved velocities, if there are any.
#[derive(Debug, Default)]
pub(crate) struct GapChanges {
    pub(crate) allowed: Vec<f64>,
    pub(crate) found: Vec<Option<f64>>,
    /// Found minus allowed changes; 0 where they do not count.
    differences: Vec<f64>,
    /// The number of corrections so far of the present contacts, in a kick or an impact.
    count: usize,
}

impl GapChanges {
    /// Begins a kick or an impact, in which no change is allowed for yet.
    pub(crate) fn begin(&mut self) {
        self.allowed.clear();
        self.found.clear();
        self.count = 0;
    }

    /// Adds the changes that new contacts allow for. Corrections begin anew.
    pub(crate) fn add(&mut self, allowed: impl Iterator<Item = f64>) {
        self.allowed.extend(allowed);
        self.count = 0;
    }

    /// Allows for the changes found, at most [`MOST_REPEATED_SOLVES`] times in a solve, if any that
    /// counts is too far from the allowed one. `tolerated` gets the index of a contact, the found and
    /// the allowed change, and returns the largest difference tolerated, m, or `None` if the change does
    /// not count. Returns the differences that the targets must now allow for, m, as far as they can;
    /// `None` if no change was too far.
    pub(crate) fn correct(
        &mut self,
        tolerated: impl Fn(usize, f64, f64) -> Option<f64>,
    ) -> Option<&[f64]> {
        let mut is_far = false;
        self.differences.clear();
        for (i, (found, &allowed)) in self.found.iter().zip(&self.allowed).enumerate() {
            let difference = found.and_then(|found| {
                let most = tolerated(i, found, allowed)?;
                is_far |= (found - allowed).abs() > most;
                Some(found - allowed)
            });
            self.differences.push(difference.unwrap_or_default());
        }
        if !is_far || self.count >= MOST_REPEATED_SOLVES {
            return None;
        }
        self.count += 1;
        for (allowed, difference) in self.allowed.iter_mut().zip(&self.differences) {
            *allowed += difference;
        }
        Some(&self.differences)
    }
}

/// A drift at constant velocities, in which gaps change.
#[derive(Clone, Copy)]
pub(crate) struct GapDrift<'a, const D: usize> {
    pub(crate) context: &'a ContactContext<'a, D>,
    pub(crate) motion: ConstantMotion<'a, D>,
    /// Duration, s.
    pub(crate) duration: f64,
    pub(crate) pairs: &'a ContactPairs,
}

impl<const D: usize> GapDrift<'_, D> {
    /// Finds the quadratic change of the gap of each contact, whose constraint holds its Jacobian and
    /// impulse.
    pub(crate) fn find(
        &self,
        contacts: &[ContactPoint<D>],
        constraints: &[Constraint<D>],
        changes: &mut GapChanges,
    ) {
        let pairs = contacts.par_iter().zip(constraints);
        pairs
            .with_min_len(CONTACTS_PER_TASK)
            .map(|(contact, constraint)| self.change(contact, constraint))
            .collect_into_vec(&mut changes.found);
    }

    /// Returns the quadratic change of one gap, m; `None` for parallel edges, and for a contact without
    /// pressure that leaves its target, unless it sinks into the next one. A contact that parts in the
    /// drift counts until then only. It asks for the velocity that it needs until then, but for at most
    /// twice the one that the whole drift would need, as in an impact: without this limit two edges got 2.8
    /// times their energy.
    fn change(&self, contact: &ContactPoint<D>, constraint: &Constraint<D>) -> Option<f64> {
        let least = self.context.least_speed(self.duration);
        let slides = !contact.is_sticking || constraint.slips(self.motion.velocity, least);
        let change = self.change_until(1.0, contact, constraint, slides);
        let is_small = change.map_or(!constraint.presses(), |change| {
            change.abs() <= GAP_ERROR * self.context.resolution
        });
        if !slides || is_small {
            return change;
        }
        let part = self.part_together(contact, &constraint.jacobian.frame[0])?;
        self.change_until(part, contact, constraint, slides)
            .map(|change| change / part.max(0.5))
    }

    /// Returns the quadratic change of a gap in a part of the drift, m.
    fn change_until(
        &self,
        part: f64,
        contact: &ContactPoint<D>,
        constraint: &Constraint<D>,
        slides: bool,
    ) -> Option<f64> {
        let Self {
            context,
            motion,
            duration,
            pairs,
        } = *self;
        let then = motion.after(part * duration);
        let (jacobian, path) = (&constraint.jacobian, [motion.at, then]);
        let taken = |pair| pairs.contains(pair);
        let gap = contact.gap_after(context, jacobian, path, slides, taken)?;
        let leaves = || context.surface.project(contact.pair, then).outside > context.resolution;
        if !constraint.presses() && gap >= contact.offset[0] && leaves() {
            return None;
        }
        Some(jacobian.quadratic_change(gap, motion.velocity, part * duration))
    }

    /// Returns the part of the drift, at most 1, in which a sliding contact stays on the surface, its
    /// normal separates the blocks, and turns from `normal` by less than [`MOST_TURN`]; `None` if it
    /// parts at once.
    fn part_together(&self, contact: &ContactPoint<D>, normal: &[f64; D]) -> Option<f64> {
        let surface = self.context.surface;
        let taken = |pair| self.pairs.contains(pair);
        let stays = |part: f64| {
            let then = self.motion.after(part * self.duration);
            let followed = contact.followed(self.context, then, taken);
            followed.is_some_and(|(pair, _)| {
                let turned = surface.normal(pair, then);
                turned.is_some_and(|turned| dot(&turned, normal) >= MOST_TURN.cos())
                    && surface.normal_separates(pair, then)
            })
        };
        if stays(1.0) {
            return Some(1.0);
        }
        let [mut together, mut apart] = [0.0, 1.0];
        for _ in 0..PARTING_BISECTIONS {
            let middle = 0.5 * (together + apart);
            if stays(middle) {
                together = middle;
            } else {
                apart = middle;
            }
        }
        (together > 0.0).then_some(together)
    }
}

impl<const D: usize> ContactPoint<D> {
    /// Returns the quadratic change of the gap to expect in a drift of `drift` seconds, m, which the
    /// constraint allows for. If it did not, gaps would shrink at each step, and what opens them
    /// again would work against the pressure. At most [`GAP_ERROR`]: where edges are almost
    /// parallel, the acceleration changes at each step.
    pub(crate) fn expected_change(&self, context: &ContactContext<D>, drift: f64) -> f64 {
        let most = GAP_ERROR * context.resolution;
        (0.5 * self.gap_acceleration * drift * drift).clamp(-most, most)
    }

    /// Records the quadratic change of the gap in a drift of `drift` seconds, m, if there is one. The
    /// next kick expects it again, so what a kick has not allowed for is made good in the next one.
    pub(crate) fn record_quadratic_change(&mut self, change: Option<f64>, drift: f64) {
        self.gap_acceleration = 2.0 * change.unwrap_or_default() / (drift * drift);
    }
}
