//! Target tracking: the foot of a sliding contact follows its point.

use crate::contact::constraint::contact_point::{ContactPoint, rotate_tangents};
use crate::contact::constraint::context::ContactContext;
use crate::contact::surface::{Configuration, ContactJacobian, Pair, Projection, Surface};
use crate::contact::tolerances::FOOT_ROUND_OFF;

impl<const D: usize> ContactPoint<D> {
    /// Moves the foot of a sliding contact to its point, and on to neighbouring target
    /// features. `taken` is true for the pairs of other contacts. The contact does not move on
    /// to such a pair around a re-entrant corner, nor past an end of the surface. Returns false if
    /// the point has left the surface by more than the contact resolution. The margin keeps flush
    /// corners from flickering.
    pub(crate) fn track_target(
        &mut self,
        context: &ContactContext<D>,
        at: Configuration<D>,
        taken: impl Fn(Pair) -> bool,
    ) -> bool {
        if self.is_sticking {
            return true;
        }
        let Some((pair, projection)) = self.pair_at(context, at, taken) else {
            return false;
        };
        if pair != self.pair {
            self.rotate_frame(context.surface, pair, at);
        }
        self.foot = projection.clamped_foot();
        true
    }

    /// Returns the pair that a sliding contact is at these positions, and its projection; `None` if
    /// the point has left the surface.
    pub(crate) fn pair_at(
        &self,
        context: &ContactContext<D>,
        at: Configuration<D>,
        taken: impl Fn(Pair) -> bool,
    ) -> Option<(Pair, Projection)> {
        let (surface, resolution) = (context.surface, context.resolution);
        let mut pair = self.pair;
        let mut projection = surface.project(pair, at);
        let size = surface.target_size(pair.target, at);
        while projection.outside > FOOT_ROUND_OFF * size {
            let next = surface.neighbour(pair, &projection.foot, at);
            // In a re-entrant corner each side keeps its own contact.
            let is_free =
                |next: &Pair| !(taken(*next) && surface.is_reentrant_pair(pair, *next, at));
            let Some(next) = next.filter(is_free) else {
                return (projection.outside <= resolution).then_some((pair, projection));
            };
            let before = projection.outside;
            projection = surface.project(next, at);
            pair = next;
            // Deep in a re-entrant edge, the point lies outside the faces on both sides.
            if projection.outside >= before {
                break;
            }
        }
        Some((pair, projection))
    }

    /// Returns the gap at these positions, m, to the target that a sliding contact has moved on to;
    /// `None` for parallel edges. On the same target the normal is on the side of that of the
    /// `jacobian`.
    pub(crate) fn gap_at(
        &self,
        context: &ContactContext<D>,
        jacobian: &ContactJacobian<D>,
        at: Configuration<D>,
        taken: impl Fn(Pair) -> bool,
    ) -> Option<f64> {
        let slides = Some(self).filter(|contact| !contact.is_sticking);
        let moved = slides.and_then(|contact| contact.pair_at(context, at, taken));
        let pair = moved.map_or(self.pair, |moved| moved.0);
        let along = (pair == self.pair).then_some(&jacobian.frame[0]);
        context.surface.gap(pair, at, along)
    }

    /// Continues the contact as another pair. Rotates the vectors in its frame.
    fn rotate_frame(&mut self, surface: &dyn Surface<D>, next: Pair, at: Configuration<D>) {
        let frame = |pair| {
            let foot = surface.project(pair, at).foot;
            surface.jacobian(pair, &foot, at).frame
        };
        let frames = [self.pair, next].map(frame);
        for vector in self.frame_vectors() {
            *vector = rotate_tangents(vector, &frames);
        }
        (self.pair, self.normal) = (next, frames[1][0]);
    }
}
