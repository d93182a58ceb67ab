//! Target tracking: the foot of a sliding contact follows its point.

use crate::contact::constraint::contact_point::{ContactPoint, rotate_tangents};
use crate::contact::constraint::context::ContactContext;
use crate::contact::narrow_phase::target_walk::{TargetWalk, walk_to_target};
use crate::contact::surface::{Configuration, ContactJacobian, Pair, Projection, Surface};
use crate::contact::tolerances::GAP_ERROR;

/// A straight path from one target to the next, over the ridge between them: its height over the next
/// one at the end, and its depths under the last one at the end and under the next one at the start, m.
struct RidgePath {
    above_next: f64,
    below_last: f64,
    below_next_before: f64,
}

impl RidgePath {
    /// Returns the height by which the end may be lower, m, without being below the next target, and
    /// without the path passing beneath the ridge by more than `most`. Below 0, it must be higher.
    fn possible_fall(&self, most: f64) -> f64 {
        let Self {
            above_next,
            below_last,
            below_next_before,
        } = *self;
        // In a dent, the next target rises over the last one.
        let falls = below_last + above_next;
        if falls <= 0.0 || below_next_before <= 0.0 {
            return above_next;
        }
        // Over the ridge the path is below both by the same depth.
        above_next.min(most * (1.0 + falls / below_next_before) - below_last)
    }
}

/// Result of tracking a target.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Tracking {
    /// The contact goes on.
    Goes,
    /// The point has left the surface beside the target of this pair.
    HasLeft(Pair),
    /// The normal no longer separates the two blocks.
    HasTurned,
}

impl<const D: usize> ContactPoint<D> {
    /// Moves the foot of a sliding contact to its point, and on to neighbouring target
    /// features. `taken` is true for the pairs of other contacts. The contact does not move on
    /// to such a pair around a re-entrant corner, nor past an end of the surface. It ends if the point
    /// has left the surface, or if the normal no longer
    /// [separates](crate::contact::surface::Distance::normal_separates) the two blocks.
    pub(crate) fn track_target(
        &mut self,
        context: &ContactContext<D>,
        at: Configuration<D>,
        taken: impl Fn(Pair) -> bool,
    ) -> Tracking {
        if self.is_sticking {
            return Tracking::Goes;
        }
        let TargetWalk {
            pair,
            projection,
            is_on_surface,
        } = self.walk(context, at, taken);
        if !is_on_surface {
            return Tracking::HasLeft(pair);
        }
        if !context.surface.normal_separates(pair, at) {
            return Tracking::HasTurned;
        }
        if pair != self.pair {
            self.rotate_frame(context.surface, pair, at);
        }
        self.foot = projection.clamped_foot();
        Tracking::Goes
    }

    /// Returns the pair of a sliding contact that has [walked](walk_to_target) to the target under its
    /// point, and its projection; `None` if the point has left the surface.
    pub(crate) fn followed(
        &self,
        context: &ContactContext<D>,
        at: Configuration<D>,
        taken: impl Fn(Pair) -> bool,
    ) -> Option<(Pair, Projection)> {
        let walk = self.walk(context, at, taken);
        walk.is_on_surface.then_some((walk.pair, walk.projection))
    }

    fn walk(
        &self,
        context: &ContactContext<D>,
        at: Configuration<D>,
        taken: impl Fn(Pair) -> bool,
    ) -> TargetWalk {
        walk_to_target(context.surface, self.pair, at, context.resolution, taken)
    }

    /// Returns the gap at the end of a straight path, m, to the target that the contact has moved on to
    /// if it `slides`. Returns `None` for parallel edges, and if the normal on the side of that of the
    /// `jacobian` is not the one out of the target. A point whose path leads over a ridge passes beneath
    /// it: if by more than [`GAP_ERROR`], the gap is negative, by the height that the end must gain. The
    /// ridge is taken as flat, and the path as one over one ridge.
    pub(crate) fn gap_after(
        &self,
        context: &ContactContext<D>,
        jacobian: &ContactJacobian<D>,
        [start, end]: [Configuration<D>; 2],
        slides: bool,
        taken: impl Fn(Pair) -> bool,
    ) -> Option<f64> {
        let surface = context.surface;
        let moved = slides.then(|| self.followed(context, end, taken)).flatten();
        let pair = moved.map_or(self.pair, |(pair, _)| pair);
        let along = Some(&jacobian.frame[0]);
        let next = surface.gap(pair, end, None)?;
        let last = surface.gap(self.pair, end, along);
        if pair == self.pair {
            // The normal of edges that pass the parallel position turns by up to 180 degrees.
            return last.filter(|last| *last == next);
        }
        let [Some(last), Some(next_before)] = [last, surface.gap(pair, start, None)] else {
            return Some(next);
        };
        let kept = self.offset[0];
        let path = RidgePath {
            above_next: next - kept,
            below_last: kept - last,
            below_next_before: kept - next_before,
        };
        Some(kept + path.possible_fall(GAP_ERROR * context.resolution))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_over_a_ridge_must_end_so_high_that_it_passes_just_beneath() {
        let most = 0.1;
        // Slopes up to the ridge and down from it, and the lengths of the path before and after it.
        for [up, down, before, after] in [
            [0.5, 1.0, 3.0, 2.0],
            [0.0, 0.3, 0.4, 5.0],
            [0.2, -0.1, 9.0, 9.0],
            [0.01, 0.01, 3.0, 3.0],
        ] {
            let path = |above_next: f64| RidgePath {
                above_next,
                below_last: (up + down) * after - above_next,
                below_next_before: (up + down) * before,
            };
            let depth_at_ridge = |above_next: f64| {
                let [start, end] = [-up * before, above_next - down * after];
                -(start * after + end * before) / (before + after)
            };
            for above_next in [-1.0, 0.0, 10.0] {
                let end = above_next - path(above_next).possible_fall(most);
                let depth = depth_at_ridge(end);
                assert!(
                    (depth - most.min(depth_at_ridge(0.0))).abs() < 1e-12,
                    "{depth}"
                );
            }
        }
        let dent = RidgePath {
            above_next: -2.0,
            below_last: 1e-3,
            below_next_before: 1e-3,
        };
        assert_eq!(dent.possible_fall(most), -2.0);
    }
}
