//! Signed volume of a moving point and plane, or signed area of a moving point and line, at
//! constant velocities of all points. Its sign tells the side on which the point is.

use crate::contact::surface::GapAllowance;
use crate::contact::tolerances::{
    BISECTIONS, CCD_SAMPLES, LEAST_TARGET_SIZE, RESTING_SINK, VOLUME_ROUND_OFF,
};
use crate::math::quadratic::roots;
use crate::math::vector::{add, add_scaled, cross, cross2, dot, norm};

/// Volume a·(b × c) of three edges, or area a × b of two, that change linearly in time: a cubic.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SignedVolume {
    /// Coefficients of 1, t, t² and t³.
    coefficients: [f64; 4],
    /// Norms of the edges at t = 0 and of their rates, for the bound of round-off.
    size: [[f64; 2]; 3],
}

/// A time interval from the last instant above round-off to the end of the descent, s.
#[derive(Clone, Copy, Debug)]
struct DescentInterval {
    start: f64,
    end: f64,
}

impl SignedVolume {
    /// Returns the volume of the edges, m, with their rates, m/s.
    pub(super) fn of_volume([a, b, c]: [[[f64; 3]; 2]; 3]) -> Self {
        let face = cross(&b[0], &c[0]);
        let turns = add(&cross(&b[1], &c[0]), &cross(&b[0], &c[1]));
        let swirl = cross(&b[1], &c[1]);
        Self {
            coefficients: [
                dot(&a[0], &face),
                dot(&a[1], &face) + dot(&a[0], &turns),
                dot(&a[1], &turns) + dot(&a[0], &swirl),
                dot(&a[1], &swirl),
            ],
            size: [a, b, c].map(|edge| edge.map(|vector| norm(&vector))),
        }
    }

    /// Returns the area of the edges, m, with their rates, m/s.
    pub(crate) fn of_area([a, b]: [[[f64; 2]; 2]; 2]) -> Self {
        let [one, other] = [a, b].map(|edge| edge.map(|vector| norm(&vector)));
        Self {
            coefficients: [
                cross2(&a[0], &b[0]),
                cross2(&a[1], &b[0]) + cross2(&a[0], &b[1]),
                cross2(&a[1], &b[1]),
                0.0,
            ],
            size: [one, other, [1.0, 0.0]],
        }
    }

    /// Returns the value at a time.
    pub(super) fn at(&self, t: f64) -> f64 {
        let [c0, c1, c2, c3] = self.coefficients;
        c0 + t * (c1 + t * (c2 + t * c3))
    }

    /// Returns true if a gap is within a [`GapAllowance`] and stays so for `duration`. The value is
    /// the gap times the size of the target, which has these `sizes` at the start and the end.
    pub(crate) fn stays_in_contact(
        &self,
        sizes: [f64; 2],
        duration: f64,
        slack: GapAllowance,
    ) -> bool {
        let [now, then] = [0.0, duration].map(|time| self.at(time));
        let (gap, next) = (now / sizes[0], then / sizes[1]);
        let lowest = LEAST_TARGET_SIZE * slack.within * sizes[0].min(sizes[1]);
        gap <= slack.within
            && next >= -slack.depth.max(RESTING_SINK * slack.depth - gap)
            && self.stays_above(-lowest, duration)
    }

    /// Returns true if the value [is behind](Self::is_behind) now, above -`deep`, and falls faster
    /// than at a `rate`.
    pub(super) fn sinks(&self, deep: f64, rate: f64) -> bool {
        let margin = self.round_off(0.0);
        let [_, own, ..] = self.coefficients;
        -own > rate && self.is_behind(deep.max(margin), margin)
    }

    /// Returns true if the value is now no more than `margin`, and no less than -`deep`.
    fn is_behind(&self, deep: f64, margin: f64) -> bool {
        (-deep..=margin).contains(&self.at(0.0))
    }

    /// Returns true if the value surely stays above a level for `duration`: if its Bernstein
    /// coefficients do, whose convex hull contains it.
    fn stays_above(&self, level: f64, duration: f64) -> bool {
        let mut power = 1.0;
        let [c0, c1, c2, c3] = self.coefficients.map(|coefficient| {
            let term = coefficient * power;
            power *= duration;
            term
        });
        let inner = [c0 + c1 / 3.0, c0 + (2.0 * c1 + c2) / 3.0];
        let outer = [c0, c0 + c1 + c2 + c3];
        inner.into_iter().chain(outer).all(|value| value >= level)
    }

    /// Returns true if the value falls at a time, by its first derivative that is not 0.
    pub(super) fn falls_at(&self, t: f64) -> bool {
        let [_, c1, c2, c3] = self.coefficients;
        let rates = [c1 + t * (2.0 * c2 + t * 3.0 * c3), c2 + 3.0 * t * c3, c3];
        rates.into_iter().find(|&rate| rate != 0.0).unwrap_or(0.0) < 0.0
    }

    /// Returns the volume with the sign of the gap of two edges whose normal is `forward` or not.
    pub(super) fn outward(self, forward: bool) -> Self {
        if forward { self } else { self.reversed() }
    }

    /// Returns the volume with the opposite sign.
    pub(super) fn reversed(self) -> Self {
        Self {
            coefficients: self.coefficients.map(|c| -c),
            ..self
        }
    }

    /// Returns the round-off of the value up to `duration`.
    pub(super) fn round_off(&self, duration: f64) -> f64 {
        let bound = self.size.map(|[now, rate]| now + duration * rate);
        VOLUME_ROUND_OFF * bound[0] * bound[1] * bound[2]
    }

    /// Returns the first time at which the value has fallen to 0 and `touches` is true; never a
    /// later time. An open pair has a positive value. A point that comes round the end of its
    /// target has a value below 0; it touches at the first time at which the value falls, is above
    /// -`deep`, and `touches` is true.
    pub(crate) fn first_root(
        &self,
        duration: f64,
        deep: f64,
        touches: impl Fn(f64) -> bool,
    ) -> Option<f64> {
        let margin = self.round_off(duration);
        let deep = deep.max(margin);
        if self.is_behind(deep, margin) && self.falls_at(0.0) && touches(0.0) {
            return Some(0.0);
        }
        let falls = self
            .descents(duration, [margin, deep])
            .into_iter()
            .flatten();
        let mut times = falls.filter_map(|DescentInterval { start, end }| {
            let shallow = self.last_above(-deep, start, end);
            first(start, shallow, &touches)
        });
        times.next()
    }

    /// Returns the intervals within `duration` in which the value falls to `margin`, or falls from
    /// a value between `margin` and -`deep` by more than `margin`; at most three. A value that
    /// stays within the margins rests.
    fn descents(&self, duration: f64, [margin, deep]: [f64; 2]) -> [Option<DescentInterval>; 3] {
        let [_, c1, c2, c3] = self.coefficients;
        let mut ends = [0.0, duration, duration, duration];
        let mut count = 1;
        for turn in roots([c1, 2.0 * c2, 3.0 * c3]).into_iter().flatten() {
            if turn > 0.0 && turn < duration {
                ends[count] = turn;
                count += 1;
            }
        }
        std::array::from_fn(|k| {
            let (start, end) = (ends[k], ends[k + 1]);
            let [high, low] = [start, end].map(|time| self.at(time));
            let from_above = high > margin && low <= margin;
            let from_behind = high <= margin && high >= -deep && low < high.min(0.0) - margin;
            (k < count && (from_above || from_behind)).then(|| DescentInterval {
                start: self.last_above(margin, start, end),
                end,
            })
        })
    }

    /// Returns the last time at which the value is above a `level`, in an interval in which it
    /// falls. The values at both ends save most of the bisections.
    fn last_above(&self, level: f64, low: f64, high: f64) -> f64 {
        let holds = |t: f64| self.at(t) > level;
        if !holds(low) {
            low
        } else if low < high && holds(high) {
            high.next_down()
        } else {
            last(low, high, holds)
        }
    }
}

/// Returns a vector with a rate after some time.
pub(crate) fn moved<const D: usize>([now, rate]: &[[f64; D]; 2], time: f64) -> [f64; D] {
    let mut then = *now;
    add_scaled(&mut then, time, rate);
    then
}

/// Returns the time at which a condition begins to hold in an interval, by [`CCD_SAMPLES`]
/// instants: an instant just before the first at which it `holds`.
fn first(start: f64, end: f64, holds: impl Fn(f64) -> bool) -> Option<f64> {
    if holds(start) {
        return Some(start);
    }
    let instant = |k: u32| start + (end - start) * f64::from(k) / f64::from(CCD_SAMPLES);
    let k = (1..=CCD_SAMPLES).find(|&k| holds(instant(k)))?;
    Some(last(instant(k - 1), instant(k), |t| !holds(t)))
}

/// Returns the last instant of an interval until which a condition `holds`.
pub(super) fn last(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Area of a vertex from the start of an edge, and of the edge, which is 1 m upright.
    fn area(from: [f64; 2], rate: [f64; 2], stretch: [f64; 2]) -> SignedVolume {
        SignedVolume::of_area([[from, rate], [[0.0, 1.0], stretch]])
    }

    #[test]
    fn what_rises_by_less_than_round_off_before_it_falls_touches() {
        // 1e-17 t − t²: only exact arithmetic tells if it rises at all.
        let falls = area([0.0, 0.0], [1e-17, 1.0], [1.0, 0.0]);
        let found = falls.first_root(1.0, 1.0, |_| true);
        assert!(found.is_some_and(|time| time < 1e-16), "{found:?}");
    }

    #[test]
    fn what_rests_or_parts_within_round_off_does_not_touch() {
        for (rate, stretch) in [
            ([0.0, 0.0], [0.0, 0.0]),
            ([1e-17, 0.0], [0.0, 0.0]),
            ([1.0, 0.0], [0.0, 0.0]),
            ([1e-17, 1.0], [1e-17, 0.0]), // rises, falls, and stays within
        ] {
            let found = area([0.0, 0.5], rate, stretch).first_root(1.0, 1.0, |_| true);
            assert_eq!(found, None, "{rate:?} {stretch:?}");
        }
    }

    #[test]
    fn what_grazes_touches_though_the_foot_comes_in_meanwhile() {
        // (t − ½)² is within round-off for 1e-7 s before it is 0.
        let grazes = area([0.25, 0.0], [-1.0, -1.0], [1.0, 0.0]);
        let found = grazes.first_root(1.0, 1.0, |time| time > 0.5 - 1e-9);
        let comes_in = 0.5 - 1e-9;
        assert!(
            found.is_some_and(|time| time <= comes_in && time > comes_in - 1e-15),
            "{found:?}"
        );
    }

    #[test]
    fn what_comes_in_from_behind_touches_unless_it_is_too_deep() {
        for (start, deep, touches) in [
            (0.1, 0.3, true), // falls to -0.1 before it comes in
            (-0.1, 0.4, true),
            (0.1, 0.05, false),
            (-0.1, 0.25, false),
        ] {
            let falls = area([start, 0.0], [-1.0, 0.0], [0.0, 0.0]);
            let found = falls.first_root(1.0, deep, |time| time > 0.2);
            let expected = touches.then_some(0.2);
            let apart = found.zip(expected).map(|(one, other)| (one - other).abs());
            assert!(
                found.is_some() == touches && apart.is_none_or(|d| d < 1e-15),
                "{found:?}"
            );
        }
    }

    #[test]
    fn what_comes_in_from_behind_for_a_while_touches() {
        let falls = area([0.2, 0.0], [-1.0, 0.0], [0.0, 0.0]);
        let found = falls.first_root(1.2, 1.0, |time| (0.3..0.6).contains(&time));
        assert!(
            found.is_some_and(|time| (time - 0.3).abs() < 1e-15),
            "{found:?}"
        );
    }

    #[test]
    fn what_turns_behind_touches_when_it_falls_again() {
        // -0.1 + 0.2 t - t²
        let falls = area([-0.1, 0.0], [0.1, 0.0], [0.0, 0.0]);
        assert_eq!(falls.first_root(1.0, 0.3, |_| true), None);
        let turns = SignedVolume {
            coefficients: [-0.1, 0.2, -1.0, 0.0],
            ..falls
        };
        let found = turns.first_root(1.0, 0.3, |_| true);
        assert!(
            found.is_some_and(|time| (time - 0.1).abs() < 1e-15),
            "{found:?}"
        );
    }

    #[test]
    fn what_leaves_from_behind_does_not_touch_as_it_comes_in() {
        let rises = area([-0.5, 0.0], [1.0, 0.0], [0.0, 0.0]);
        assert_eq!(rises.first_root(1.0, 1.0, |time| time > 0.2), None);
    }

    #[test]
    fn what_touches_rests_unless_it_sinks() {
        let slack = GapAllowance {
            within: 1e-2,
            depth: 1e-6,
        };
        for (gap, sinks, rests) in [
            (0.0, 0.0, true),
            (0.0, 0.5e-6, true),
            (0.0, 2e-6, false),
            (0.0, -1.0, true), // parts
            (-1e-3, 0.5e-9, true),
            (-1e-3, 1e-8, false), // left to sink in before, and does so again
            (-2e-2, 0.0, false),  // too deep to be left
            (2e-2, 0.0, false),   // does not touch
        ] {
            let falls = area([gap, 0.5], [-sinks, 0.0], [0.0, 0.0]);
            assert_eq!(
                falls.stays_in_contact([1.0; 2], 1.0, slack),
                rests,
                "{gap} {sinks}"
            );
        }
        // -0.04 t (1 - t) of the whole: back at its end, and deep on its way.
        let dips = SignedVolume {
            coefficients: [0.0, -0.04, 0.04, 0.0],
            ..area([0.0, 0.5], [0.0; 2], [0.0; 2])
        };
        assert!(!dips.stays_in_contact([1.0; 2], 1.0, slack));
        // The same volume at half the target size is twice the depth.
        let falls = area([0.0, 0.5], [-0.8e-6, 0.0], [0.0, 0.0]);
        assert!(
            falls.stays_in_contact([1.0, 1.0], 1.0, slack)
                && !falls.stays_in_contact([1.0, 0.5], 1.0, slack)
        );
    }
}
