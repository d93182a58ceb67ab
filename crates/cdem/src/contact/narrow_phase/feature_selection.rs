//! Selects the feature pair of a touch. A corner that meets a corner may touch all of its faces or
//! edges, but it is one contact.

use crate::contact::narrow_phase::target_walk::walk_to_target;
use crate::contact::surface::{Configuration, Pair, Pairs, Surface};
use crate::contact::tolerances::{FLUSH, GAP_ERROR, IGNORED_PENETRATION};
use crate::math::vector::{add_scaled, dot, norm, sub};

/// Returns the feature pair of a touch of `pair` at the positions `at`. The candidates touch within
/// `resolution`, m, of the point of `pair`, and pass the normal-cone test and `may`. Among those
/// with the least penetration now, up to [`GAP_ERROR`], the result has the least penetration at the
/// positions `then`. Only one pair is taken, because two of different normals would lock corners
/// sideways.
///
/// Returns `None` if a corner goes past another. Also returns `None` if `pair` itself is not
/// admissible and the best pair is still open, so that it has a touch of its own later.
pub(crate) fn select_feature_pair<const D: usize>(
    surface: &dyn Surface<D>,
    pair: Pair,
    [at, then]: [Configuration<D>; 2],
    resolution: f64,
    may: impl Fn(Pair) -> bool,
) -> Option<Pair> {
    let slack = IGNORED_PENETRATION * resolution;
    let mut rivals = competing_pairs(surface, pair, at, resolution);
    rivals.retain(|rival| may(*rival));
    // A block that lands beside a joint may already lie in the side of the next block. That is not
    // this touch, unless it is by a gap error: then which side it is on hangs on that error.
    let now = |pair: Pair| surface.gap_or_zero(pair, at);
    let gaps = rivals.iter().map(|&rival| now(rival));
    let least = gaps.fold(f64::NEG_INFINITY, f64::max) - GAP_ERROR * resolution;
    let shallow = rivals.iter().copied().filter(|&rival| now(rival) >= least);
    let gap = |pair: Pair| surface.gap_or_zero(pair, then);
    let less_deep = |best, rival| if gap(rival) > gap(best) { rival } else { best };
    let best = shallow.reduce(less_deep)?;
    if !rivals.contains(&pair) && now(best) > slack {
        return None;
    }
    // A corner that meets a corner sinks into all of its faces, or goes past.
    let one_way = rivals
        .iter()
        .all(|&rival| cosine_of_parallel(surface, [best, rival], at).is_some());
    if one_way || gap(best) <= -slack {
        return Some(best);
    }
    // The crossing point of nearly parallel edges moves fast. It may leave a corner that goes past,
    // so that pairs near it now are no longer near it then.
    let point = surface.point(pair, then);
    let stays = |rival: &Pair| norm(&sub(&surface.point(*rival, then), &point)) <= resolution;
    let mut near = rivals.iter().filter(|rival| stays(rival));
    let sinks = surface.project(pair, then).outside <= 0.0
        && rivals.contains(&pair)
        && !stays(&best)
        && near.all(|&rival| gap(rival) <= -slack);
    sinks.then_some(pair)
}

/// Returns the pairs that touch within the resolution of the point of `pair`, itself first.
fn competing_pairs<const D: usize>(
    surface: &dyn Surface<D>,
    pair: Pair,
    at: Configuration<D>,
    resolution: f64,
) -> Pairs {
    let beside = surface.adjacent_pairs(pair, at, resolution).into_iter();
    let touches = |rival: &Pair| rival_touches(surface, pair, *rival, at, resolution);
    let others = beside.filter(|rival| *rival != pair && touches(rival));
    let own = surface.in_normal_cone(pair, at).then_some(pair);
    own.into_iter().chain(others).collect()
}

/// Returns true if a rival of a pair touches, within `resolution`, m, and not as the other side of a
/// re-entrant corner.
fn rival_touches<const D: usize>(
    surface: &dyn Surface<D>,
    pair: Pair,
    rival: Pair,
    at: Configuration<D>,
    resolution: f64,
) -> bool {
    let projection = surface.project(rival, at);
    projection.gap.abs() <= resolution
        && projection.outside <= resolution
        && surface.in_normal_cone(rival, at)
        && !surface.is_reentrant_pair(pair, rival, at)
}

/// Returns true if all pairs that touch within `resolution`, m, of the point of `pair` have its
/// normal, up to a small angle. Where corners or edges only just meet, as those of stones side by
/// side and one above the other, there are several normals, and only a motion tells which acts.
/// Edges within flat faces are not sharp and cannot press. The normal of `pair` is in its cone.
pub(crate) fn has_one_normal<const D: usize>(
    surface: &dyn Surface<D>,
    pair: Pair,
    at: Configuration<D>,
    resolution: f64,
) -> bool {
    let has_normal_of = |rival: &Pair| cosine_of_parallel(surface, [pair, *rival], at).is_some();
    surface.may_touch_in_drift(pair, at, at)
        && competing_pairs(surface, pair, at, resolution)
            .iter()
            .all(has_normal_of)
}

/// Returns the pairs that carry on where the point of `pair` has left its target, with its normal up
/// to a small angle: pairs within `reach`, m, of the point, and those of the ends of the edge that it
/// has crossed.
pub(crate) fn successors<const D: usize>(
    surface: &dyn Surface<D>,
    pair: Pair,
    at: Configuration<D>,
    reach: f64,
    resolution: f64,
) -> Pairs {
    let is_parallel = |rival: &Pair| cosine_of_parallel(surface, [pair, *rival], at).is_some();
    let under = |end: Pair| walk_to_target(surface, end, at, resolution, |_| false).pair;
    let ends = surface.pairs_of_edge_ends(pair, at).into_iter();
    let mut pairs = surface.adjacent_pairs(pair, at, reach);
    pairs.extend(ends.filter(is_parallel).map(under));
    pairs.sort_unstable();
    pairs.dedup();
    pairs.retain(|rival| {
        *rival != pair && rival_touches(surface, pair, *rival, at, resolution) && is_parallel(rival)
    });
    pairs
}

/// Returns true if two pairs, between these `blocks`, are one physical contact, whose constraint
/// counts once: they have the same gap and normal, and the same point where the gap is closed, within
/// `resolution`, m.
pub(crate) fn are_one_contact<const D: usize>(
    surface: &dyn Surface<D>,
    pairs: [Pair; 2],
    blocks: [[u32; 2]; 2],
    at: Configuration<D>,
    resolution: f64,
) -> bool {
    let [of_one, of_other] = blocks;
    let is_swapped = of_one != of_other;
    if is_swapped && of_one != [of_other[1], of_other[0]] {
        return false;
    }
    let [gap, other_gap] = pairs.map(|pair| surface.gap_or_zero(pair, at));
    let [mut point, other_point] = pairs.map(|pair| surface.point(pair, at));
    // Most pairs are farther apart than that, and normals cost more.
    if norm(&sub(&point, &other_point)) > resolution + gap.abs() {
        return false;
    }
    let Some(cosine) = cosine_of_parallel(surface, pairs, at) else {
        return false;
    };
    if is_swapped && let Some(normal) = surface.normal(pairs[0], at) {
        add_scaled(&mut point, -gap, &normal);
    }
    norm(&sub(&point, &other_point)) <= resolution
        && (cosine < 0.0) == is_swapped
        && (gap - other_gap).abs() <= resolution
}

/// Returns the cosine of the angle between the normals of two pairs, if they are parallel up to a
/// small angle, whichever is the main block.
fn cosine_of_parallel<const D: usize>(
    surface: &dyn Surface<D>,
    pairs: [Pair; 2],
    at: Configuration<D>,
) -> Option<f64> {
    let [one, other] = pairs.map(|pair| surface.normal(pair, at));
    let (one, mut other) = (one?, other?);
    let cosine = dot(&one, &other);
    add_scaled(&mut other, -cosine, &one);
    (norm(&other) <= FLUSH).then_some(cosine)
}
