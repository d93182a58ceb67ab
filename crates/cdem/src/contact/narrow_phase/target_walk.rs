//! Walk over neighbouring targets: from that of a pair to the one under its point.

use crate::contact::surface::{Configuration, Pair, Projection, Surface};
use crate::contact::tolerances::FOOT_ROUND_OFF;

/// End of a walk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TargetWalk {
    /// The pair with the last target, and its projection.
    pub(crate) pair: Pair,
    pub(crate) projection: Projection,
    /// False if the point has left the surface by more than the resolution.
    pub(crate) is_on_surface: bool,
}

/// Walks from the target of a pair to the one under its point. The margin of `resolution`, m, keeps
/// flush corners from flickering. The walk does not go on to a `taken` pair around a re-entrant corner.
pub(crate) fn walk_to_target<const D: usize>(
    surface: &dyn Surface<D>,
    mut pair: Pair,
    at: Configuration<D>,
    resolution: f64,
    taken: impl Fn(Pair) -> bool,
) -> TargetWalk {
    let mut projection = surface.project(pair, at);
    let size = surface.target_size(pair.target, at);
    let mut is_on_surface = true;
    while projection.outside > FOOT_ROUND_OFF * size {
        let next = surface.neighbour(pair, &projection.foot, at);
        // In a re-entrant corner each side keeps its own contact.
        let is_free = |next: &Pair| !(taken(*next) && surface.is_reentrant_pair(pair, *next, at));
        let Some(next) = next.filter(is_free) else {
            is_on_surface = projection.outside <= resolution;
            break;
        };
        let before = projection.outside;
        projection = surface.project(next, at);
        pair = next;
        // Deep in a re-entrant edge, the point lies outside the faces on both sides.
        if projection.outside >= before {
            break;
        }
    }
    TargetWalk {
        pair,
        projection,
        is_on_surface,
    }
}
