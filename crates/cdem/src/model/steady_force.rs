//! Steady force of elements on a node of a finer time level.

use serde::{Deserialize, Serialize};

use crate::math::serde_pod;
use crate::math::vector::{add, dot, scale};

/// Kicks of the coarser elements over which their force is averaged (count). With this window, a bar
/// of 40 elements whose lowest period is 150 kicks has the same energy after 20 000 kicks as without
/// steady forces, to 0.1 %, and with a fourth of it to 0.2 %.
const WINDOW: u32 = 512;

/// The steady force of elements of one level on a node of a finer level.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SteadyForce<const D: usize> {
    /// Force in the interval up to the last kick of the elements, N.
    #[serde(with = "serde_pod")]
    pub(crate) force: [f64; D],
    /// Sum of the impulses since the force has changed, N·s, and the number of kicks.
    #[serde(with = "serde_pod")]
    sum: [f64; D],
    count: u32,
    /// Moment of its impulses in the present coarse step about the origin, N·m·s.
    pub(crate) moment: [f64; 3],
}

impl<const D: usize> SteadyForce<D> {
    pub(crate) const NONE: Self = Self {
        force: [0.0; D],
        sum: [0.0; D],
        count: 0,
        moment: [0.0; 3],
    };

    /// Adds the impulse of a kick over `interval` seconds to the mean. Returns the force in the
    /// kick: half of it belongs to the interval before, half to the next one. A steady force that is
    /// farther from the present force than no force ends.
    pub(crate) fn update(&mut self, impulse: &[f64; D], interval: f64) -> [f64; D] {
        let before = self.force;
        self.sum = add(&self.sum, impulse);
        self.count += 1;
        if 2.0 * dot(&before, impulse) < interval * dot(&before, &before) {
            self.begin([0.0; D]);
        } else if self.count == WINDOW {
            self.begin(scale(1.0 / (interval * f64::from(WINDOW)), &self.sum));
        }
        scale(0.5, &add(&before, &self.force))
    }

    /// Begins another force, and another mean.
    fn begin(&mut self, force: [f64; D]) {
        *self = Self {
            force,
            moment: self.moment,
            ..Self::NONE
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const INTERVAL: f64 = 0.5;

    /// Returns a steady force after a window of kicks by a constant force, N.
    fn after_a_window(force: [f64; 2]) -> SteadyForce<2> {
        let mut steady = SteadyForce::NONE;
        for _ in 0..WINDOW {
            steady.update(&force.map(|f| INTERVAL * f), INTERVAL);
        }
        steady
    }

    #[test]
    fn a_constant_force_becomes_steady_after_a_window() {
        let mut steady = SteadyForce::<2>::NONE;
        for kick in 1..=WINDOW {
            // Half of the last kick belongs to the interval after it.
            let share = if kick == WINDOW { 0.5 } else { 0.0 };
            let acting = steady.update(&[INTERVAL * 3.0, 0.0], INTERVAL);
            assert_eq!(acting, [share * 3.0, 0.0], "{kick}");
        }
        assert_eq!(steady, after_a_window([3.0, 0.0]));
        assert_eq!(steady.force, [3.0, 0.0]);
    }

    #[test]
    fn a_force_that_is_farther_from_the_present_one_than_none_ends() {
        for (now, is_kept) in [
            ([2.0, 0.0], true),
            ([1.0, 5.0], false),
            ([-3.0, 0.0], false),
        ] {
            let mut steady = after_a_window([3.0, 0.0]);
            let acting = steady.update(&now.map(|f| INTERVAL * f), INTERVAL);
            let next = if is_kept { [3.0, 0.0] } else { [0.0; 2] };
            assert_eq!(steady.force, next, "{now:?}");
            assert_eq!(acting, [0.5 * (3.0 + next[0]), 0.0], "{now:?}");
        }
    }
}
