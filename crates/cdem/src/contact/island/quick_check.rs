//! Quick check of an open pair: its state in a drift, or the need of a time of impact.

use crate::contact::constraint::context::ContactContext;
use crate::contact::surface::kicked::ConstantMotion;
use crate::contact::surface::{GapAllowance, Pair, Surface};
use crate::contact::tolerances::{IGNORED_PENETRATION, LEAST_DEPTH, RESTING_SINK};
use crate::math::vector::{norm, sub};

/// Rule for closing pairs that touch already.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ClosureRule {
    /// In a kick, before the drift: all that penetrate.
    InKick,
    /// In the drift: those that cannot wait for the next kick.
    InDrift,
}

impl ClosureRule {
    /// Returns the depth, over the contact resolution, up to which a pair does not count as
    /// penetrating.
    fn depth(self) -> f64 {
        match self {
            Self::InKick => LEAST_DEPTH,
            Self::InDrift => IGNORED_PENETRATION,
        }
    }

    /// Returns the gap, over the contact resolution, above which a slow pair waits for the next
    /// kick.
    fn waits_above(self) -> f64 {
        match self {
            Self::InKick => LEAST_DEPTH,
            Self::InDrift => -IGNORED_PENETRATION,
        }
    }

    /// Returns the sink in a drift, over the contact resolution, up to which a slow pair with this
    /// `gap` rests. A pair deeper than [`IGNORED_PENETRATION`] does not.
    fn resting_sink(self, gap: f64) -> f64 {
        if gap > -IGNORED_PENETRATION {
            (gap + self.depth()).max(RESTING_SINK * self.depth())
        } else {
            0.0
        }
    }
}

/// Result of the quick check of a pair.
#[derive(Clone, Copy, Debug)]
pub(crate) enum QuickCheck {
    /// It has a contact point.
    Closed,
    /// It does not touch in this drift.
    Never,
    /// It touches now.
    Now,
    /// It may touch within this many seconds.
    Within(f64),
}

/// Checks an open pair quickly for the `remaining` seconds of a drift at constant velocities, in
/// which its features move by at most `travel` against each other, m. Returns also the distance of
/// its features now, m, if the check has measured it.
pub(crate) fn quick_check<const D: usize>(
    context: &ContactContext<D>,
    motion: ConstantMotion<D>,
    pair: Pair,
    rule: ClosureRule,
    [remaining, travel]: [f64; 2],
    is_near: impl FnOnce() -> bool,
) -> (QuickCheck, Option<f64>) {
    // Slower pairs cannot get deep: they touch now or wait for the next kick.
    let slow = IGNORED_PENETRATION * context.resolution;
    let travel = if travel > slow {
        remaining * fastest(context.surface, motion, pair)
    } else {
        travel
    };
    if travel > slow {
        check_pair(context, motion, pair, rule, [remaining, travel])
    } else {
        check_slow_pair(context, motion, pair, rule, remaining, is_near)
    }
}

/// Checks a pair: its distance first.
fn check_pair<const D: usize>(
    context: &ContactContext<D>,
    motion: ConstantMotion<D>,
    pair: Pair,
    rule: ClosureRule,
    [remaining, travel]: [f64; 2],
) -> (QuickCheck, Option<f64>) {
    let (surface, resolution, at) = (context.surface, context.resolution, motion.at);
    let apart = surface.distance(pair, at);
    let end = at.after(motion.velocity, remaining);
    if apart > resolution + travel || !surface.may_touch_in_drift(pair, at, end) {
        return (QuickCheck::Never, Some(apart));
    }
    let slack = GapAllowance {
        within: IGNORED_PENETRATION * resolution,
        depth: rule.depth() * resolution,
    };
    let check = if surface.stays_in_contact(pair, motion, remaining, slack) {
        QuickCheck::Never
    } else {
        QuickCheck::Within(remaining)
    };
    (check, Some(apart))
}

/// Checks a slow pair. At rest most pairs are slow, so the cheapest tests come first: the gap, then
/// its rate. The distance is measured if the pair sinks in, and unless the pair `is_near`.
fn check_slow_pair<const D: usize>(
    context: &ContactContext<D>,
    motion: ConstantMotion<D>,
    pair: Pair,
    rule: ClosureRule,
    remaining: f64,
    is_near: impl FnOnce() -> bool,
) -> (QuickCheck, Option<f64>) {
    let (surface, resolution) = (context.surface, context.resolution);
    // Parallel edges have no gap.
    let gap = surface.gap(pair, motion.at, None);
    let touching = gap.filter(|gap| *gap <= rule.waits_above() * resolution);
    let sinks = touching.is_some_and(|gap| {
        let rests_below = rule.resting_sink(gap / resolution) * resolution / remaining;
        surface.sinks(pair, motion, resolution, rests_below)
    });
    let is_near = !sinks && (gap.is_some_and(|gap| gap.abs() <= resolution) || is_near());
    let apart = (!is_near).then(|| surface.distance(pair, motion.at));
    // The foot may be far beyond the end of a target in a re-entrant corner.
    if sinks && apart.is_some_and(|apart| apart <= resolution) {
        (QuickCheck::Now, apart)
    } else {
        (QuickCheck::Never, apart)
    }
}

/// Returns a bound of the speed at which nodes of the two features approach, m/s: the largest
/// speeds of either feature's nodes relative to one node, added up.
fn fastest<const D: usize>(surface: &dyn Surface<D>, motion: ConstantMotion<D>, pair: Pair) -> f64 {
    let of = |node: &u32| &motion.velocity[*node as usize];
    let (main, target) = (
        surface.main_nodes(pair.main),
        surface.target_nodes(pair.target),
    );
    let seen = |nodes: &[u32]| {
        let speeds = nodes.iter().map(|node| norm(&sub(of(node), of(&main[0]))));
        speeds.fold(0.0, f64::max)
    };
    seen(main) + seen(target)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_pair_rests_unless_it_sinks() {
        let depth = LEAST_DEPTH;
        for (rule, gap, sink) in [
            // It may come as deep as it may lie.
            (ClosureRule::InKick, 0.0, depth),
            (ClosureRule::InKick, -0.25 * depth, 0.75 * depth),
            // Left to sink in before, it does so again.
            (ClosureRule::InKick, -1e4 * depth, RESTING_SINK * depth),
            // Too deep to be left.
            (ClosureRule::InKick, -2.0 * IGNORED_PENETRATION, 0.0),
            (ClosureRule::InDrift, -IGNORED_PENETRATION, 0.0),
        ] {
            assert_eq!(rule.resting_sink(gap), sink, "{rule:?} {gap:e}");
        }
    }
}
