//! Target tracking: the foot of a sliding contact follows its point.

use crate::contact::constraint::contact_point::{ContactPoint, rotate_tangents};
use crate::contact::constraint::context::ContactContext;
use crate::contact::surface::{Configuration, Pair, Surface};
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
        let (surface, resolution) = (context.surface, context.resolution);
        if self.is_sticking {
            return true;
        }
        let mut projection = surface.project(self.pair, at);
        let size = surface.target_size(self.pair.target, at);
        while projection.outside > FOOT_ROUND_OFF * size {
            let next = surface.neighbour(self.pair, &projection.foot, at);
            // In a re-entrant corner each side keeps its own contact.
            let is_free =
                |next: &Pair| !(taken(*next) && surface.is_reentrant_pair(self.pair, *next, at));
            let Some(next) = next.filter(is_free) else {
                if projection.outside > resolution {
                    return false;
                }
                break;
            };
            let before = projection.outside;
            projection = surface.project(next, at);
            self.rotate_frame(surface, next, at);
            // Deep in a re-entrant edge, the point lies outside the faces on both sides.
            if projection.outside >= before {
                break;
            }
        }
        self.foot = projection.clamped_foot();
        true
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
