//! Times of impact in exact arithmetic: pairs of features whose places and velocities
//! are whole numbers, and the instants at which they touch.

use crate::contact::tolerances::{FOOT_ROUND_OFF, VOLUME_ROUND_OFF};

pub(crate) mod polynomial;
pub(crate) mod query;
pub(crate) mod root;

use std::cmp::Ordering;

pub(crate) use crate::contact::verification::exact::polynomial::{
    Polynomial, cross, difference, dot,
};
pub(crate) use crate::contact::verification::exact::query::{Query, QueryKind};
pub(crate) use crate::contact::verification::exact::root::{Dyadic, Root};

/// What may be inside of a target, m.
pub(crate) const DEPTH: f64 = 1e-9;

/// How far outside features a foot may be, m: none is longer than 80 m along each axis
/// at the start, and as much after a second.
pub(crate) const FOOT: f64 = DEPTH + 300.0 * FOOT_ROUND_OFF;

/// Round-off of the time at which a measure turns, s: √ε where it hardly does.
const TURN: f64 = 1e-7;

/// A pair of features that move at constant velocities.
pub(crate) struct Features {
    /// Positive as long as they are apart.
    pub(crate) measure: Polynomial,
    /// None negative as long as the foot lies on both.
    pub(crate) within: Vec<Polynomial>,
    /// 0 where they have no normal.
    pub(crate) size: Polynomial,
    /// Bound of the measure's terms.
    pub(crate) bound: f64,
}

/// An instant at which a pair touches.
#[derive(Debug)]
pub(crate) struct ExactTouch {
    pub(crate) time: Root,
    /// The foot lies at the rim of a feature.
    pub(crate) on_rim: bool,
}

impl Features {
    /// Seen with the normal turned round.
    pub(crate) fn reversed(self) -> Self {
        Self {
            measure: -&self.measure,
            ..self
        }
    }

    /// All instants of the first second at which they come to touch, in order: the
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

    /// Whether a pair is about to touch where it is found to: still on its own side, or
    /// no deeper than round-off or some measure where its foot comes in or it turns to
    /// fall again; no farther from touching than the margin of round-off, with its foot
    /// on it.
    ///
    /// One margin is taken off before; a third of one is the round-off of what it was
    /// taken from, and as much of this.
    pub(crate) fn touch_at(&self, found: f64, deepest: f64, outside: impl Fn(f64) -> f64) -> bool {
        let margin = VOLUME_ROUND_OFF * self.bound;
        let exactly = self.measure.sign_at(&Dyadic::from(found));
        let is_shallow = self.measure.about(found) >= -deepest.max(2.0 * margin);
        let about = [found - TURN, found + TURN];
        let begins =
            outside(found).abs() <= FOOT || has_root_within(&self.measure.derivative(), about);
        let is_near =
            (exactly >= 0 || is_shallow && begins) && self.measure.about(found) <= 2.0 * margin;
        // The foot may come in while the measure falls from one margin to the other:
        // where it grazes that takes up to 1 + √2 times as long as at the first rate.
        let rate = self.measure.derivative().about(found).abs();
        let last = (5.0 * margin + deepest) / rate;
        let times = (0..=5).map(|k| found + f64::from(k) * margin / rate);
        let is_on = rate <= 0.0 || times.map(outside).any(|outside| outside <= FOOT);
        // A feature that shrinks to nothing has no foot, and is turned about after that.
        let about = [(found - last).max(0.0), found + last];
        is_near && is_on || has_root_within(&self.size, about)
    }
}

/// Whether a polynomial is 0 in an interval.
fn has_root_within(polynomial: &Polynomial, interval: [f64; 2]) -> bool {
    let [from, until] = interval.map(Dyadic::from);
    let roots = Root::all(polynomial);
    roots.iter().any(|root| {
        root.compare(&from) != Ordering::Less && root.compare(&until) != Ordering::Greater
    })
}

impl ExactTouch {
    /// Whether what was found is no later.
    pub(crate) fn is_found_by(&self, found: Option<f64>) -> bool {
        found.is_some_and(|found| self.time.compare(&Dyadic::from(found)) != Ordering::Less)
    }
}

/// Bound of the measure's terms over a second: of lengths and rates of its edges.
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
