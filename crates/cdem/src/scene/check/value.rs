//! Checks of single values: ranges, numbers of components, tables, keys that exclude each other.

use crate::scene::check::Check;
use crate::scene::input::{
    Angle, Dimension, Duration, Quantity, QuantityOr, Ratio, TimeRow, Varying, VaryingVector,
};
use crate::scene::{Help, KeyPath, Problem, Schedule};

/// Range of numbers that a key accepts.
#[derive(Clone, Copy)]
pub(super) struct Range {
    words: &'static str,
    contains: fn(f64) -> bool,
}

pub(super) const POSITIVE: Range = Range {
    words: "larger than 0",
    contains: |x| x > 0.0,
};
pub(super) const NOT_NEGATIVE: Range = Range {
    words: "at least 0",
    contains: |x| x >= 0.0,
};
/// (0, 1]
pub(super) const FRACTION: Range = Range {
    words: "larger than 0 and at most 1",
    contains: |x| x > 0.0 && x <= 1.0,
};
/// [0, 1)
pub(super) const BELOW_ONE: Range = Range {
    words: "at least 0 and smaller than 1",
    contains: |x| (0.0..1.0).contains(&x),
};
/// (0, 1)
pub(super) const BETWEEN_ZERO_AND_ONE: Range = Range {
    words: "larger than 0 and smaller than 1",
    contains: |x| x > 0.0 && x < 1.0,
};
/// Poisson's ratio of a stable isotropic solid that is not incompressible.
pub(super) const POISSON: Range = Range {
    words: "larger than -1 and smaller than 0.5",
    contains: |x| x > -1.0 && x < 0.5,
};
/// Radians of [0°, 90°): the tangent exists.
pub(super) const FRICTION: Range = Range {
    words: "at least 0 and smaller than 90 degrees",
    contains: |x| (0.0..std::f64::consts::FRAC_PI_2).contains(&x),
};

impl Check {
    /// Reports a problem with a value.
    pub(super) fn report(&mut self, path: KeyPath, message: impl Into<String>) {
        self.problems.push(Problem::new(path, message));
    }

    /// Reports a missing key.
    pub(super) fn missing(&mut self, at: &KeyPath, key: &str, help: impl Into<Help>) {
        let problem = Problem::new(at.key(key), "this key is missing");
        self.problems.push(problem.of_key().help(help));
    }

    /// Returns the value of a required key, or reports that it is missing.
    pub(super) fn required<T>(
        &mut self,
        at: &KeyPath,
        key: &str,
        value: Option<T>,
        example: &str,
    ) -> Option<T> {
        if value.is_none() {
            self.missing(at, key, Help::example(example));
        }
        value
    }

    /// Checks all items of an array.
    pub(super) fn each<T, U>(
        &mut self,
        at: &KeyPath,
        items: &[T],
        check: fn(&mut Self, &KeyPath, &T) -> Option<U>,
    ) -> Option<Vec<U>> {
        let items = items.iter().enumerate();
        let checked: Vec<Option<U>> = items
            .map(|(i, item)| check(self, &at.index(i), item))
            .collect();
        checked.into_iter().collect()
    }

    /// Checks that a number is in its range; returns it in SI units.
    pub(super) fn number<M: Dimension>(
        &mut self,
        path: &KeyPath,
        value: Quantity<M>,
        range: Range,
    ) -> Option<f64> {
        if (range.contains)(value.si()) {
            return Some(value.si());
        }
        self.report(
            path.clone(),
            format!("must be {}, got {value}", range.words),
        );
        None
    }

    /// Checks an optional number; the outer `None` is a problem.
    #[allow(clippy::option_option)] // left out and wrong are two things
    pub(super) fn optional<M: Dimension>(
        &mut self,
        path: &KeyPath,
        value: Option<Quantity<M>>,
        range: Range,
    ) -> Option<Option<f64>> {
        match value {
            None => Some(None),
            Some(value) => self.number(path, value, range).map(Some),
        }
    }

    /// Checks that a vector has as many components as the scene has dimensions.
    pub(super) fn vector<M: Dimension>(
        &mut self,
        path: &KeyPath,
        value: &[Quantity<M>],
    ) -> Option<Vec<f64>> {
        self.components(path, value.len())?;
        Some(value.iter().map(|component| component.si()).collect())
    }

    /// Checks that the number of components is that of dimensions.
    pub(super) fn components(&mut self, path: &KeyPath, count: usize) -> Option<()> {
        if count == self.dimension {
            return Some(());
        }
        let dimension = self.dimension;
        self.report(
            path.clone(),
            format!(
                "expected {dimension} components, because dimension = {dimension}, got {count}"
            ),
        );
        None
    }

    /// Checks an optional vector, which defaults to 0.
    pub(super) fn vector_or_zero<M: Dimension>(
        &mut self,
        path: &KeyPath,
        value: Option<&Vec<Quantity<M>>>,
    ) -> Option<Vec<f64>> {
        match value {
            None => Some(vec![0.0; self.dimension]),
            Some(value) => self.vector(path, value),
        }
    }

    /// Checks a point or direction and returns three components; the third is 0 in 2-D.
    pub(super) fn spatial<M: Dimension>(
        &mut self,
        path: &KeyPath,
        value: &[Quantity<M>],
    ) -> Option<[f64; 3]> {
        let value = self.vector(path, value)?;
        let mut point = [0.0; 3];
        point[..value.len()].copy_from_slice(&value);
        Some(point)
    }

    /// Returns the unit vector along an axis of any length but 0 (3-D).
    pub(super) fn axis(&mut self, path: &KeyPath, value: &[Quantity<Ratio>]) -> Option<[f64; 3]> {
        let axis = self.spatial(path, value)?;
        // The axis is scaled first: squares of very long or short axes leave the range of f64.
        let largest = axis
            .iter()
            .fold(0.0, |largest: f64, x| largest.max(x.abs()));
        if largest == 0.0 {
            self.report(path.clone(), "an axis of length 0 has no direction");
            return None;
        }
        let squared: f64 = axis.iter().map(|x| x * x).sum();
        // A unit vector is kept bit for bit, so that it is the same when written and read again.
        if (squared - 1.0).abs() <= 8.0 * f64::EPSILON {
            return Some(axis);
        }
        let scaled = axis.map(|x| x / largest);
        let length = scaled.iter().map(|x| x * x).sum::<f64>().sqrt();
        Some(scaled.map(|x| x / length))
    }

    /// Checks a number or a table in time.
    pub(super) fn schedule<M: Dimension>(
        &mut self,
        path: &KeyPath,
        value: &Varying<M>,
    ) -> Option<Schedule<f64>> {
        match value {
            QuantityOr::Quantity(value) => Some(Schedule::Constant(value.si())),
            QuantityOr::Other(rows) => self
                .table(path, rows, |_, _, value| Some(value.si()))
                .map(Schedule::Table),
        }
    }

    /// Checks a vector or a table of vectors in time.
    pub(super) fn vector_schedule<M: Dimension>(
        &mut self,
        path: &KeyPath,
        value: &VaryingVector<M>,
    ) -> Option<Schedule<Vec<f64>>> {
        match value {
            VaryingVector::Constant(value) => self.vector(path, value).map(Schedule::Constant),
            VaryingVector::Table(rows) => self
                .table(path, rows, |check, at, value| check.vector(at, value))
                .map(Schedule::Table),
        }
    }

    /// Checks rows of time and value; times must increase.
    fn table<T, U>(
        &mut self,
        path: &KeyPath,
        rows: &[TimeRow<T>],
        value: fn(&mut Self, &KeyPath, &T) -> Option<U>,
    ) -> Option<Vec<(f64, U)>> {
        if rows.is_empty() {
            self.report(
                path.clone(),
                "the table is empty; it needs a row [time, value]",
            );
            return None;
        }
        let mut checked = Vec::new();
        let mut before: Option<Quantity<Duration>> = None;
        for (i, (time, item)) in rows.iter().enumerate() {
            let at = path.index(i);
            if let Some(before) = before
                && time.si() <= before.si()
            {
                let message = format!("times must increase: {time} does not come after {before}");
                self.report(at.index(0), message);
                return None;
            }
            before = Some(*time);
            checked.push(value(self, &at.index(1), item).map(|item| (time.si(), item)));
        }
        checked.into_iter().collect()
    }

    /// Checks start and end of an interval.
    #[allow(clippy::option_option)] // left out and wrong are two things
    pub(super) fn interval(
        &mut self,
        at: &KeyPath,
        start: Quantity<Duration>,
        end: Option<Quantity<Duration>>,
    ) -> Option<(f64, Option<f64>)> {
        let start = self.number(&at.key("start"), start, NOT_NEGATIVE)?;
        let end = end.map(Quantity::si);
        if let Some(end) = end
            && end <= start
        {
            let message = format!("must be later than start = {start} s, got {end} s");
            self.report(at.key("end"), message);
            return None;
        }
        Some((start, end))
    }

    /// Returns the one given key of two that exclude each other.
    pub(super) fn one_of<A, B>(
        &mut self,
        at: &KeyPath,
        first: OptionalKey<'_, A>,
        second: OptionalKey<'_, B>,
    ) -> Option<OneOf<A, B>> {
        match (first.value, second.value) {
            (Some(value), None) => Some(OneOf::First(value)),
            (None, Some(value)) => Some(OneOf::Second(value)),
            (None, None) => {
                let message = format!("needs `{}` or `{}`", first.name, second.name);
                self.report(at.clone(), message);
                None
            }
            (Some(_), Some(_)) => {
                self.exclude(at, first.name, second.name);
                None
            }
        }
    }

    /// Reports that `second` is not allowed together with `first`.
    pub(super) fn exclude(&mut self, at: &KeyPath, first: &str, second: &str) {
        let message = format!("`{first}` and `{second}` exclude each other");
        let problem = Problem::new(at.key(second), message).of_key();
        self.problems.push(problem.help("keep one of them"));
    }

    /// Reports a key that is given without the `condition` it needs.
    pub(super) fn only_with(&mut self, at: &KeyPath, key: &str, given: bool, condition: &str) {
        if given {
            let problem = Problem::new(at.key(key), format!("only with {condition}")).of_key();
            self.problems.push(problem.help("leave it out"));
        }
    }

    /// Warns of a key that has no effect without a `condition`.
    pub(super) fn ignored_without(
        &mut self,
        at: &KeyPath,
        key: &str,
        given: bool,
        condition: &str,
    ) {
        if given {
            let message = format!("has no effect unless {condition}");
            self.warnings
                .push(Problem::new(at.key(key), message).of_key());
        }
    }

    /// Reports a key that has no meaning in this dimension.
    pub(super) fn only_in(&mut self, dimension: usize, at: &KeyPath, key: &str, given: bool) {
        let wrong = given && self.dimension != dimension;
        self.only_with(at, key, wrong, &format!("dimension = {dimension}"));
    }

    /// Checks a friction angle, rad.
    pub(super) fn friction(&mut self, at: &KeyPath, angle: Quantity<Angle>) -> Option<f64> {
        self.number(&at.key("friction_angle"), angle, FRICTION)
    }
}

/// A key that a scene may leave out, with its value.
#[derive(Clone, Copy)]
pub(super) struct OptionalKey<'a, T> {
    /// Name of the key.
    pub(super) name: &'a str,
    /// Value; `None` if the key is left out.
    pub(super) value: Option<T>,
}

impl<'a, T> OptionalKey<'a, T> {
    pub(super) const fn new(name: &'a str, value: Option<T>) -> Self {
        Self { name, value }
    }
}

/// One of two values.
pub(super) enum OneOf<A, B> {
    /// The first is given.
    First(A),
    /// The second is given.
    Second(B),
}
