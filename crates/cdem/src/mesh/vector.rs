//! Points in any dimension: distances, centres, bounding boxes.

use crate::math::vector::{norm, sub};

/// Returns a + t·(b − a).
pub(super) fn between<const D: usize>(a: [f64; D], b: [f64; D], t: f64) -> [f64; D] {
    std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
}

/// Returns |a − b|.
pub(super) fn distance<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    norm(&sub(&a, &b))
}

/// Returns the mean of the points; the origin if there is none.
pub(super) fn centre<const D: usize>(points: impl Iterator<Item = [f64; D]>) -> [f64; D] {
    let mut sum = [0.0; D];
    let mut count = 0.0_f64;
    for point in points {
        (0..D).for_each(|i| sum[i] += point[i]);
        count += 1.0;
    }
    sum.map(|s| s / count.max(1.0))
}

/// Returns the lower and upper corner of the smallest box around the points.
pub(super) fn bounds<const D: usize>(
    points: impl Iterator<Item = [f64; D]>,
) -> ([f64; D], [f64; D]) {
    let empty = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
    points.fold(empty, |(low, high), p| {
        (
            std::array::from_fn(|i| low[i].min(p[i])),
            std::array::from_fn(|i| high[i].max(p[i])),
        )
    })
}
