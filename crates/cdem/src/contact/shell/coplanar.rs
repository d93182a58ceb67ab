//! When four points that move at constant velocities lie in one plane.

use crate::contact::roots::roots;
use crate::vector::{add, cross, dot, norm};

/// Bisections that take an interval down to round-off.
const BISECTIONS: u32 = 64;

/// Round-off of the volume, over the bound of its terms: some thirty operations.
const ROUND_OFF: f64 = 32.0 * f64::EPSILON;

/// Volume a·(b × c) of three edges that change linearly in time: a cubic.
#[derive(Clone, Copy, Debug)]
pub(super) struct Volume {
    /// Of 1, t, t² and t³.
    coefficients: [f64; 4],
    /// Bound of the terms' sum at t = 0, and what is added a second.
    size: [[f64; 2]; 3],
}

impl Volume {
    /// The volume of the edges, m, with their rates, m/s.
    pub(super) fn new([a, b, c]: [[[f64; 3]; 2]; 3]) -> Self {
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

    /// Value at a time.
    pub(super) fn at(&self, t: f64) -> f64 {
        let [c0, c1, c2, c3] = self.coefficients;
        c0 + t * (c1 + t * (c2 + t * c3))
    }

    /// Value at t = 0.
    pub(super) fn now(&self) -> f64 {
        self.coefficients[0]
    }

    /// Whether it falls at t = 0: by its first derivative that is not 0.
    pub(super) fn falls_now(&self) -> bool {
        let rates = self.coefficients[1..].iter();
        rates.copied().find(|&rate| rate != 0.0).unwrap_or(0.0) < 0.0
    }

    /// The same of the other sense.
    pub(super) fn reversed(self) -> Self {
        Self {
            coefficients: self.coefficients.map(|c| -c),
            ..self
        }
    }

    /// Round-off of the value up to `duration`.
    pub(super) fn round_off(&self, duration: f64) -> f64 {
        let bound = self.size.map(|[now, rate]| now + duration * rate);
        ROUND_OFF * bound[0] * bound[1] * bound[2]
    }

    /// Times within `duration` from which on it is no longer above round-off,
    /// where it was before: at most two, never later than it reaches 0.
    pub(super) fn falls_through(&self, duration: f64) -> impl Iterator<Item = f64> {
        let margin = self.round_off(duration);
        let [_, c1, c2, c3] = self.coefficients;
        let mut ends = [0.0, duration, duration, duration];
        let mut count = 1;
        for turn in roots([c1, 2.0 * c2, 3.0 * c3]).into_iter().flatten() {
            if turn > 0.0 && turn < duration {
                ends[count] = turn;
                count += 1;
            }
        }
        let volume = *self;
        let above = move |t: f64| volume.at(t) - margin;
        (0..count).filter_map(move |k| {
            let [mut low, mut high] = [ends[k], ends[k + 1]];
            if above(low) <= 0.0 || above(high) > 0.0 {
                return None;
            }
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (low + high);
                if middle <= low || middle >= high {
                    break;
                }
                if above(middle) > 0.0 {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            Some(low)
        })
    }
}
