//! Duplicates: open pairs that are the same physical contact as a closed one.

use crate::contact::constraint::contact_point::ContactPoint;
use crate::contact::constraint::context::ContactContext;
use crate::contact::narrow_phase::feature_selection::are_one_contact;
use crate::contact::surface::{Configuration, Pair, Surface};
use crate::contact::tolerances::{CCD_SAMPLES, GAP_ERROR};
use crate::math::vector::{dot, norm, sub};

/// A touch and the rest of the drift that it falls in.
#[derive(Clone, Copy)]
pub(crate) struct DriftInterval<'a, const D: usize> {
    /// Configuration at the touch.
    pub(crate) at_touch: Configuration<'a, D>,
    /// Configuration at the end of the drift, at the present velocities.
    pub(crate) at_end: Configuration<'a, D>,
    /// True if the present velocities satisfy the constraints of the closed contacts, except
    /// [new](ContactPoint::is_new) ones.
    pub(crate) is_solved: bool,
}

impl<'a, const D: usize> DriftInterval<'a, D> {
    /// Returns an interval of zero length, for a test of the present configuration.
    pub(crate) fn at_rest(at: Configuration<'a, D>) -> Self {
        Self {
            at_touch: at,
            at_end: at,
            is_solved: false,
        }
    }

    /// Returns the interval of a touch in `wait` seconds, with `remaining` seconds left in the
    /// drift, at velocities for which the closed contacts are solved.
    pub(crate) fn in_drift(
        at: Configuration<'a, D>,
        velocity: &'a [[f64; D]],
        [wait, remaining]: [f64; 2],
    ) -> Self {
        Self {
            at_touch: if wait > 0.0 {
                at.after(velocity, wait)
            } else {
                at
            },
            at_end: at.after(velocity, remaining),
            is_solved: true,
        }
    }

    /// Returns a bound of the change of the gap of a pair, m: how far nodes of the two features move
    /// against each other.
    fn relative_motion(&self, surface: &dyn Surface<D>, pair: Pair) -> f64 {
        let motion = |&node: &u32| sub(&self.at_end.at(node), &self.at_touch.at(node));
        let main = surface.main_nodes(pair.main);
        let first = motion(&main[0]);
        let of = |nodes: &[u32]| {
            let relative = nodes.iter().map(|node| norm(&sub(&motion(node), &first)));
            relative.fold(0.0, f64::max)
        };
        of(main) + of(surface.target_nodes(pair.target))
    }
}

impl<const D: usize> ContactPoint<D> {
    /// True if `pair`, between the same two blocks, would be the same physical contact as this
    /// one, both at its touch and at the end of the drift.
    pub(crate) fn is_duplicate_of(
        &self,
        context: &ContactContext<D>,
        pair: Pair,
        drift_interval: DriftInterval<D>,
    ) -> bool {
        let (surface, resolution) = (context.surface, context.resolution);
        if self.pair == pair {
            return true;
        }
        let continues = || {
            let projection = surface.project(self.pair, drift_interval.at_end);
            let foot = &projection.foot;
            projection.outside <= resolution
                || surface
                    .neighbour(self.pair, foot, drift_interval.at_end)
                    .is_some()
        };
        let (pairs, blocks) = (
            [self.pair, pair],
            [self.history.blocks, context.blocks(pair)],
        );
        are_one_contact(surface, pairs, blocks, drift_interval.at_touch, resolution)
            && continues()
            && !self.leaves_uncovered(context, pair, drift_interval)
    }

    /// True if this contact lets a pair beside it penetrate deeper than itself by the end of
    /// the drift: its point goes into a dent, or an edge moves from one ridge onto two.
    pub(crate) fn leaves_uncovered(
        &self,
        context: &ContactContext<D>,
        pair: Pair,
        drift_interval: DriftInterval<D>,
    ) -> bool {
        if !drift_interval.is_solved || self.is_new {
            return false;
        }
        let (surface, at_touch) = (context.surface, drift_interval.at_touch);
        // Most pairs, at rest all, cannot come that deep in a drift.
        let change = drift_interval.relative_motion(surface, pair);
        if surface.gap_or_zero(pair, at_touch).abs() + change < GAP_ERROR * context.resolution {
            return false;
        }
        if surface.project(pair, drift_interval.at_end).outside <= 0.0 {
            return self.is_shallower_than(context, pair, drift_interval.at_end);
        }
        // A pair that has passed by then may have been deep on the way.
        (1..CCD_SAMPLES).any(|look| {
            let share = f64::from(look) / f64::from(CCD_SAMPLES);
            self.is_shallower_than(
                context,
                pair,
                at_touch.towards(drift_interval.at_end, share),
            )
        })
    }

    /// True if a pair beside this contact is deeper than this contact, by more than [`GAP_ERROR`].
    fn is_shallower_than(
        &self,
        context: &ContactContext<D>,
        pair: Pair,
        at: Configuration<D>,
    ) -> bool {
        let surface = context.surface;
        let beside = surface.project(pair, at);
        let deep = -GAP_ERROR * context.resolution;
        if beside.outside > 0.0 || beside.gap >= deep {
            return false;
        }
        // The plane of a target that this contact has left by then does not hold the pair.
        let held = if self.is_sticking {
            self.pair
        } else {
            match self.followed(context, at, |_| false) {
                Some((held, _)) => held,
                None => return true,
            }
        };
        let normals = [held, pair].map(|pair| surface.normal(pair, at));
        let [Some(own_normal), Some(normal)] = normals else {
            return false;
        };
        // A pair that is apart along the normal of this contact does not penetrate.
        let is_swapped = context.blocks(pair) != self.history.blocks;
        let along = if is_swapped { -1.0 } else { 1.0 } * dot(&own_normal, &normal) * beside.gap;
        along - surface.gap_or_zero(held, at).min(0.0) < deep
    }
}
