//! Which pair a touch belongs to: a corner that meets a corner may touch all of its
//! faces, or edges, and it is one contact.

use crate::contact::surface::{Configuration, Pair, Pairs, Surface};
use crate::contact::tolerances::{FLUSH, SHALLOW};
use crate::math::vector::{add_scaled, dot, norm, sub};

/// The pair that a touch of `pair` belongs to, if any, `at` the positions of the touch:
/// of all that touch within `tolerance` of its point, that the surroundings and `may`
/// allow and that lie in each other least, the one that does so `then`. Two of different
/// normals would hold corners together sideways. None where a corner goes past another, or
/// `pair` may not touch and that one, in front, has a touch of its own to come.
pub(crate) fn select_feature_pair<const D: usize>(
    surface: &dyn Surface<D>,
    pair: Pair,
    [at, then]: [Configuration<D>; 2],
    tolerance: f64,
    may: &dyn Fn(Pair) -> bool,
) -> Option<Pair> {
    let slack = SHALLOW * tolerance;
    let mut rivals = competing_pairs(surface, pair, at, tolerance);
    rivals.retain(|rival| may(*rival));
    // What a block that lands beside a joint is in the side of the next one by, within the
    // tolerance, it did not get into now.
    let now = |pair: Pair| surface.project(pair, at).gap;
    let gaps = rivals.iter().map(|&rival| now(rival));
    let least = gaps.fold(f64::NEG_INFINITY, f64::max) - slack;
    let shallow = rivals.iter().copied().filter(|&rival| now(rival) >= least);
    let gap = |pair: Pair| surface.project(pair, then).gap;
    let less_deep = |best, rival| if gap(rival) > gap(best) { rival } else { best };
    let best = shallow.reduce(less_deep)?;
    if !rivals.contains(&pair) && now(best) > slack {
        return None;
    }
    // A corner that meets a corner sinks into all of its faces, or goes past.
    let one_way = rivals
        .iter()
        .all(|&rival| are_aligned(surface, [best, rival], at));
    if one_way || gap(best) <= -slack {
        return Some(best);
    }
    // Where edges cross that are all but parallel moves fast: away from a corner that goes
    // past, what is near no longer is.
    let point = surface.point(pair, then);
    let stays = |rival: &Pair| norm(&sub(&surface.point(*rival, then), &point)) <= tolerance;
    let mut near = rivals.iter().filter(|rival| stays(rival));
    let sinks = surface.project(pair, then).outside <= 0.0
        && rivals.contains(&pair)
        && !stays(&best)
        && near.all(|&rival| gap(rival) <= -slack);
    sinks.then_some(pair)
}

/// The pairs that touch within the tolerance of the point of `pair`, itself first.
fn competing_pairs<const D: usize>(
    surface: &dyn Surface<D>,
    pair: Pair,
    at: Configuration<D>,
    tolerance: f64,
) -> Pairs {
    let touches = |rival: &Pair| {
        let projection = surface.project(*rival, at);
        projection.gap.abs() <= tolerance
            && projection.outside <= tolerance
            && surface.in_normal_cone(*rival, at)
            && !surface.is_reentrant_pair(pair, *rival, at)
    };
    let beside = surface.adjacent_pairs(pair, at, tolerance).into_iter();
    let others = beside.filter(|rival| *rival != pair && touches(rival));
    let own = surface.in_normal_cone(pair, at).then_some(pair);
    own.into_iter().chain(others).collect()
}

/// Whether two pairs press the same way up to a small angle, whichever is the main block.
fn are_aligned<const D: usize>(
    surface: &dyn Surface<D>,
    pairs: [Pair; 2],
    at: Configuration<D>,
) -> bool {
    let normals = pairs.map(|pair| surface.normal(pair, at));
    let [Some(one), Some(mut other)] = normals else {
        return false;
    };
    let cosine = dot(&one, &other);
    add_scaled(&mut other, -cosine, &one);
    norm(&other) <= FLUSH
}
