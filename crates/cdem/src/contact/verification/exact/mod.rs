//! Times of impact in exact arithmetic, for pairs of features with integer positions and
//! velocities.

pub(crate) mod polynomial;
pub(crate) mod query;
pub(crate) mod root;

use std::cmp::Ordering;

use crate::contact::surface::{ConstantMotion, Pair, Surface};
use crate::contact::tolerances::{FOOT_ROUND_OFF, VOLUME_ROUND_OFF};

pub(crate) use crate::contact::verification::exact::polynomial::{
    Polynomial, cross, difference, dot,
};
pub(crate) use crate::contact::verification::exact::query::{Query, QueryKind};
pub(crate) use crate::contact::verification::exact::root::{Dyadic, Root};

/// Largest penetration in a target, m.
pub(crate) const DEPTH: f64 = 1e-9;

/// Largest distance of a foot outside features, m. None is longer than 80 m along each axis at the
/// start, and as much after a second.
pub(crate) const FOOT: f64 = DEPTH + 300.0 * FOOT_ROUND_OFF;

/// Depth up to which a pair may touch from behind, m: a 20th of the longest feature.
const SINKING_DEPTH: f64 = 4.0;

/// Checks that a pair sinks in if and only if it touches at once. Returns true if it does. A gap
/// that does not change may do either.
pub(crate) fn judge_sinking<const D: usize>(
    surface: &dyn Surface<D>,
    pair: Pair,
    motion: ConstantMotion<D>,
) -> bool {
    let touches = surface.time_of_impact(pair, motion, 0.0, SINKING_DEPTH) == Some(0.0);
    let sinks = |speed: f64| surface.sinks(pair, motion, SINKING_DEPTH, speed);
    assert!(touches || !sinks(0.0), "{pair:?} sinks in without a touch");
    assert!(
        !touches || sinks(-1e-12),
        "{pair:?} touches and does not sink in"
    );
    touches
}

/// Round-off of the time at which a measure has an extremum, s: √ε for a flat one.
const TURN: f64 = 1e-7;

/// A pair of features that move at constant velocities.
pub(crate) struct Features {
    /// Positive while they are apart.
    pub(crate) measure: Polynomial,
    /// None negative while the foot lies on both.
    pub(crate) within: Vec<Polynomial>,
    /// 0 if they have no normal.
    pub(crate) size: Polynomial,
    /// Bound of the terms of the measure.
    pub(crate) bound: f64,
}

/// An instant at which a pair touches.
#[derive(Debug)]
pub(crate) struct ExactTouch {
    pub(crate) time: Root,
    /// True if the foot lies at the rim of a feature.
    pub(crate) on_rim: bool,
}

impl Features {
    /// Returns the features with the opposite normal.
    pub(crate) fn reversed(self) -> Self {
        Self {
            measure: -&self.measure,
            ..self
        }
    }

    /// Returns all instants of the first second at which the features come to touch, in order: the
    /// measure falls through 0 or, at the start, from 0, and the foot is on them.
    pub(crate) fn touches(&self) -> Vec<ExactTouch> {
        let roots = Root::all(&self.measure).into_iter();
        let touches = roots.filter_map(|mut time| {
            let falls = time.sign_after(&self.measure) < 0
                && (time.is_at_start() || time.sign_before(&self.measure) > 0);
            if !falls || time.sign_of(&self.size) == 0 {
                return None;
            }
            let signs: Vec<i32> = self.within.iter().map(|p| time.sign_of(p)).collect();
            let on_rim = signs.contains(&0);
            (!signs.contains(&-1)).then_some(ExactTouch { time, on_rim })
        });
        touches.collect()
    }

    /// Returns true if a pair is about to touch at the time found. It must still be on its own
    /// side. Or it is no deeper than round-off or `deepest`, while its foot comes in or the measure
    /// begins to fall again. It must be no farther from a touch than the margin of round-off, with
    /// its foot on the features.
    ///
    /// The search subtracts one margin. The round-off of its measure is a third of a margin, and
    /// that of this one is as much.
    pub(crate) fn touch_at(&self, found: f64, deepest: f64, outside: impl Fn(f64) -> f64) -> bool {
        let margin = VOLUME_ROUND_OFF * self.bound;
        let exactly = self.measure.sign_at(&Dyadic::from(found));
        let is_shallow = self.measure.about(found) >= -deepest.max(2.0 * margin);
        let about = [found - TURN, found + TURN];
        let begins =
            outside(found).abs() <= FOOT || has_root_within(&self.measure.derivative(), about);
        let is_near =
            (exactly >= 0 || is_shallow && begins) && self.measure.about(found) <= 2.0 * margin;
        // The foot may come in while the measure falls from one margin to the other. In a grazing
        // touch that takes up to 1 + √2 times as long as at the first rate.
        let rate = self.measure.derivative().about(found).abs();
        let last = (5.0 * margin + deepest) / rate;
        let times = (0..=5).map(|k| found + f64::from(k) * margin / rate);
        let is_on = rate <= 0.0 || times.map(outside).any(|outside| outside <= FOOT);
        // A feature that shrinks to nothing has no foot, and is inverted after that.
        let about = [(found - last).max(0.0), found + last];
        is_near && is_on || has_root_within(&self.size, about)
    }
}

/// Returns true if a polynomial has a root in an interval.
fn has_root_within(polynomial: &Polynomial, interval: [f64; 2]) -> bool {
    let [from, until] = interval.map(Dyadic::from);
    let roots = Root::all(polynomial);
    roots.iter().any(|root| {
        root.compare(&from) != Ordering::Less && root.compare(&until) != Ordering::Greater
    })
}

impl ExactTouch {
    /// Returns true if the time found is no later.
    pub(crate) fn is_found_by(&self, found: Option<f64>) -> bool {
        found.is_some_and(|found| self.time.compare(&Dyadic::from(found)) != Ordering::Less)
    }
}

/// Returns the bound of the terms of the measure over a second, from lengths and rates of its
/// edges.
pub(crate) fn bound<const D: usize>(edges: &[&[Polynomial; D]]) -> f64 {
    let norm = |edge: &[Polynomial; D], k: usize| {
        let squares = edge.iter().map(|p| p.coefficient(k).powi(2));
        squares.sum::<f64>().sqrt()
    };
    edges
        .iter()
        .map(|edge| norm(edge, 0) + norm(edge, 1))
        .product()
}
