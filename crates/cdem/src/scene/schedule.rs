//! Values that may change in time.

/// A constant, or a table of `(time, value)`: linear between its rows, held
/// beyond its ends. Times increase strictly; a table has at least one row.
#[derive(Clone, Debug, PartialEq)]
pub enum Schedule<T> {
    /// The same at all times.
    Constant(T),
    /// Rows of time, s, and value.
    Table(Vec<(f64, T)>),
}
