//! Values that may vary in time.

use crate::math::vector::truncate;

/// A constant, or a table of `(time, value)`: linear between its rows, constant beyond its ends.
/// Times increase strictly; a table has at least one row.
#[derive(Clone, Debug, PartialEq)]
pub enum Schedule<T> {
    /// One value at all times.
    Constant(T),
    /// Rows of time, s, and value.
    Table(Vec<(f64, T)>),
}

impl Schedule<Vec<f64>> {
    /// Returns the first `D` components of the value at `time`, s.
    ///
    /// # Panics
    /// As [`value`](Self::value), or if there are fewer components.
    pub(crate) fn vector<const D: usize>(&self, time: f64) -> [f64; D] {
        self.value_of(time, |vector| truncate(vector))
    }
}

/// Values that a schedule can interpolate: numbers, and vectors of equal length.
pub trait Linear: Clone {
    /// Returns `self + factor · (other − self)`; exactly `self` if both are equal.
    #[must_use]
    fn towards(&self, other: &Self, factor: f64) -> Self;

    /// Returns `self + factor · other`.
    #[must_use]
    fn plus(&self, other: &Self, factor: f64) -> Self;

    /// Returns `factor · self`.
    #[must_use]
    fn times(&self, factor: f64) -> Self;
}

impl Linear for f64 {
    fn towards(&self, other: &Self, factor: f64) -> Self {
        self + factor * (other - self)
    }

    fn plus(&self, other: &Self, factor: f64) -> Self {
        self + factor * other
    }

    fn times(&self, factor: f64) -> Self {
        factor * self
    }
}

impl<T: Linear, const N: usize> Linear for [T; N] {
    fn towards(&self, other: &Self, factor: f64) -> Self {
        std::array::from_fn(|n| self[n].towards(&other[n], factor))
    }

    fn plus(&self, other: &Self, factor: f64) -> Self {
        std::array::from_fn(|n| self[n].plus(&other[n], factor))
    }

    fn times(&self, factor: f64) -> Self {
        std::array::from_fn(|n| self[n].times(factor))
    }
}

impl<T: Linear> Linear for Vec<T> {
    fn towards(&self, other: &Self, factor: f64) -> Self {
        let pairs = self.iter().zip(other);
        pairs.map(|(a, b)| a.towards(b, factor)).collect()
    }

    fn plus(&self, other: &Self, factor: f64) -> Self {
        let pairs = self.iter().zip(other);
        pairs.map(|(a, b)| a.plus(b, factor)).collect()
    }

    fn times(&self, factor: f64) -> Self {
        self.iter().map(|a| a.times(factor)).collect()
    }
}

impl<T: Linear> Schedule<T> {
    /// Returns the value at `time`, s. At the time of a row it is exactly the value of the row.
    ///
    /// # Panics
    /// If a table has no rows; a checked scene has no such table.
    #[must_use]
    pub fn value(&self, time: f64) -> T {
        self.value_of(time, T::clone)
    }

    /// Returns the value at `time`, s, of the part `of` of each row's value.
    fn value_of<U: Linear>(&self, time: f64, of: impl Fn(&T) -> U) -> U {
        let rows = match self {
            Self::Constant(value) => return of(value),
            Self::Table(rows) => rows,
        };
        let next = rows.partition_point(|(t, _)| *t <= time);
        if next == 0 {
            return of(&rows[0].1);
        }
        let (before, low) = &rows[next - 1];
        match rows.get(next) {
            None => of(low),
            Some((after, high)) => of(low).towards(&of(high), (time - before) / (after - before)),
        }
    }

    /// Returns the schedule that equals `self` before `time`, s, and `other` from then on.
    #[must_use]
    pub fn until(&self, time: f64, other: &Self) -> Self {
        let mut rows = match self {
            _ if time <= 0.0 => return other.clone(),
            Self::Constant(_) => Vec::new(),
            Self::Table(rows) => rows.clone(),
        };
        // Two rows cannot have one time, so `self` ends one floating-point number earlier.
        let last = time.next_down();
        rows.retain(|(t, _)| *t < last);
        rows.push((last, self.value(last)));
        rows.push((time, other.value(time)));
        if let Self::Table(other) = other {
            rows.extend(other.iter().filter(|(t, _)| *t > time).cloned());
        }
        Self::Table(rows)
    }

    /// Returns the integral from `start` to `end`, s: exact for the piecewise linear table, up to
    /// rounding; of opposite sign if `end` is before `start`.
    ///
    /// The integral of a prescribed velocity is the prescribed displacement.
    ///
    /// # Panics
    /// As [`Schedule::value`].
    #[must_use]
    pub fn integral(&self, start: f64, end: f64) -> T {
        if end < start {
            return self.integral(end, start).times(-1.0);
        }
        let rows = match self {
            Self::Constant(value) => return value.times(end - start),
            Self::Table(rows) => rows,
        };
        // The trapezoid rule is exact between two neighbouring rows.
        let first = rows.partition_point(|(t, _)| *t <= start);
        let last = rows.partition_point(|(t, _)| *t < end).max(first);
        let mut here = (start, self.value(start));
        let mut sum = here.1.times(0.0);
        let corners = rows[first..last].iter().cloned();
        for next in corners.chain([(end, self.value(end))]) {
            let half = 0.5 * (next.0 - here.0);
            sum = sum.plus(&here.1, half).plus(&next.1, half);
            here = next;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ramp() -> Schedule<f64> {
        Schedule::Table(vec![(1.0, 2.0), (2.0, 6.0), (4.0, 0.0)])
    }

    #[test]
    fn a_table_is_linear_between_its_rows_and_held_beyond() {
        let values: Vec<f64> = [0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0]
            .iter()
            .map(|&t| ramp().value(t))
            .collect();
        assert_eq!(values, [2.0, 2.0, 4.0, 6.0, 3.0, 0.0, 0.0]);
    }

    #[test]
    fn a_single_row_is_a_constant() {
        let single = Schedule::Table(vec![(1.0, 7.0)]);
        assert_eq!([single.value(0.0), single.value(5.0)], [7.0, 7.0]);
        assert_eq!(single.integral(0.0, 3.0), 21.0);
    }

    #[test]
    fn the_integral_is_the_area_under_the_table() {
        // By hand: constant 2·1, trapezoids 4 and 6, constant 0.
        assert_eq!(ramp().integral(0.0, 6.0), 12.0);
        assert_eq!(ramp().integral(1.25, 1.75), 2.0);
        assert_eq!(ramp().integral(6.0, 0.0), -12.0);
        assert_eq!(ramp().integral(2.0, 2.0), 0.0);
        assert_eq!(Schedule::Constant(3.0).integral(1.0, 3.0), 6.0);
    }

    #[test]
    fn vectors_are_interpolated_by_component() {
        let table = Schedule::Table(vec![(0.0, vec![0.0, 4.0]), (2.0, vec![2.0, 0.0])]);
        assert_eq!(table.value(0.5), [0.5, 3.0]);
        assert_eq!(table.vector(0.5), [0.5, 3.0]);
        assert_eq!(table.integral(0.0, 2.0), [2.0, 4.0]);
    }

    fn table() -> impl Strategy<Value = Schedule<f64>> {
        let rows = prop::collection::vec((0.01..2.0, -10.0..10.0), 1..6);
        rows.prop_map(|rows| {
            let mut time = -1.0;
            let rows = rows.into_iter().map(|(gap, value)| {
                time += gap;
                (time, value)
            });
            Schedule::Table(rows.collect())
        })
    }

    // Values are at most 10 and spans at most 15, so sums stay below 150 and
    // rounding below about 150 · 20 operations · 1e-16.
    const ROUNDING: f64 = 1e-12;

    proptest! {
        #[test]
        fn values_stay_within_the_rows(table in table(), time in -3.0..15.0) {
            prop_assert!(table.value(time).abs() <= 10.0);
        }

        #[test]
        fn integrals_add_up(
            table in table(), a in -3.0..12.0, b in -3.0..12.0, c in -3.0..12.0,
        ) {
            let (whole, parts) = (table.integral(a, c), table.integral(a, b) + table.integral(b, c));
            prop_assert!((whole - parts).abs() < ROUNDING);
        }

        #[test]
        fn the_value_is_the_rate_of_the_integral(table in table(), time in -3.0..12.0) {
            // Slopes reach 20/0.01 = 2000 per second, times half the step of 1e-6.
            let step = 1e-6;
            let rate = table.integral(time, time + step) / step;
            prop_assert!((rate - table.value(time)).abs() < 2e-3);
        }
    }

    #[test]
    fn one_schedule_gives_way_to_another() {
        let ramp = Schedule::Table(vec![(0.0, 0.0), (2.0, 4.0)]);
        let spliced = ramp.until(1.0, &Schedule::Constant(7.0));
        // Round-off of an interpolation.
        assert!((spliced.value(0.5) - 1.0).abs() <= 4.0 * f64::EPSILON);
        assert!((spliced.value(1.0_f64.next_down()) - 2.0).abs() <= 4.0 * f64::EPSILON);
        assert_eq!([1.0, 2.0, 9.0].map(|t| spliced.value(t)), [7.0; 3]);
        let later = Schedule::Constant(1.0).until(1.0, &ramp);
        assert_eq!([0.0, 0.5].map(|t| later.value(t)), [1.0; 2]);
        assert_eq!([1.0, 1.5, 3.0].map(|t| later.value(t)), [2.0, 3.0, 4.0]);
        assert_eq!(ramp.until(0.0, &later), later);
    }
}
