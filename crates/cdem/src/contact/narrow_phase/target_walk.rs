//! Walk over neighbouring targets: from that of a pair to the one under its point.

use crate::contact::surface::{Configuration, Pair, Projection, Surface};
use crate::contact::tolerances::FOOT_ROUND_OFF;

/// Returns the pair of the same point with the target under it, and its projection; `None` if the
/// point has left the surface by more than `resolution`, m. The margin keeps flush corners from
/// flickering. The walk does not go on to a `taken` pair around a re-entrant corner.
pub(crate) fn follow_target<const D: usize>(
    surface: &dyn Surface<D>,
    mut pair: Pair,
    at: Configuration<D>,
    resolution: f64,
    taken: impl Fn(Pair) -> bool,
) -> Option<(Pair, Projection)> {
    let mut projection = surface.project(pair, at);
    let size = surface.target_size(pair.target, at);
    while projection.outside > FOOT_ROUND_OFF * size {
        let next = surface.neighbour(pair, &projection.foot, at);
        // In a re-entrant corner each side keeps its own contact.
        let is_free = |next: &Pair| !(taken(*next) && surface.is_reentrant_pair(pair, *next, at));
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
