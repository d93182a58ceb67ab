//! Vectors of `D` components as plain arrays.

use serde::{Deserialize, Serialize};

/// Returns the scalar product.
#[inline]
pub(crate) fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    let mut sum = 0.0;
    for c in 0..D {
        sum += a[c] * b[c];
    }
    sum
}

/// Returns a + b.
#[inline]
pub(crate) fn add<const D: usize>(a: &[f64; D], b: &[f64; D]) -> [f64; D] {
    let mut sum = *a;
    for c in 0..D {
        sum[c] += b[c];
    }
    sum
}

/// Returns a − b.
#[inline]
pub(crate) fn sub<const D: usize>(a: &[f64; D], b: &[f64; D]) -> [f64; D] {
    let mut difference = *a;
    for c in 0..D {
        difference[c] -= b[c];
    }
    difference
}

/// Returns s·a.
#[inline]
pub(crate) fn scale<const D: usize>(s: f64, a: &[f64; D]) -> [f64; D] {
    let mut scaled = *a;
    for x in &mut scaled {
        *x *= s;
    }
    scaled
}

/// a ← a + s·b.
#[inline]
pub(crate) fn add_scaled<const D: usize>(a: &mut [f64; D], s: f64, b: &[f64; D]) {
    for c in 0..D {
        a[c] += s * b[c];
    }
}

/// Returns the Euclidean length.
#[inline]
pub(crate) fn norm<const D: usize>(a: &[f64; D]) -> f64 {
    dot(a, a).sqrt()
}

/// A compensated sum of vectors: its rounding error does not grow with their number (Kahan 1965,
/// Communications of the ACM 8).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sum<const D: usize> {
    #[serde(with = "crate::math::serde_pod")]
    value: [f64; D],
    /// Rounding error contained in `value`.
    #[serde(with = "crate::math::serde_pod")]
    excess: [f64; D],
}

impl<const D: usize> Default for Sum<D> {
    fn default() -> Self {
        Self {
            value: [0.0; D],
            excess: [0.0; D],
        }
    }
}

impl<const D: usize> Sum<D> {
    pub(crate) fn value(&self) -> [f64; D] {
        self.value
    }

    /// Adds `s` times another sum.
    pub(crate) fn add_sum(&mut self, s: f64, other: &Self) {
        self.add_scaled(s, &other.value);
        add_scaled(&mut self.excess, s, &other.excess);
    }

    /// Adds s·b.
    #[inline]
    pub(crate) fn add_scaled(&mut self, s: f64, b: &[f64; D]) {
        for c in 0..D {
            let change = s * b[c] - self.excess[c];
            let new = self.value[c] + change;
            self.excess[c] = (new - self.value[c]) - change;
            self.value[c] = new;
        }
    }
}

/// Returns three components; the missing ones are 0.
#[inline]
pub(crate) fn pad<const D: usize>(a: &[f64; D]) -> [f64; 3] {
    std::array::from_fn(|c| if c < D { a[c] } else { 0.0 })
}

/// Returns the first `D` components.
#[inline]
pub(crate) fn truncate<const D: usize>(a: &[f64]) -> [f64; D] {
    std::array::from_fn(|c| a[c])
}

/// Returns the vector product in 3-D. For vectors in the plane it points along z.
#[inline]
pub(crate) fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Returns the z component of the vector product in the plane.
#[inline]
pub(crate) fn cross2(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
