//! Axis-aligned boxes.

/// Axis-aligned box, m. A box with a lower corner above the upper one is empty: no box overlaps it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Aabb<const D: usize> {
    /// Lower corner.
    pub(crate) min: [f64; D],
    /// Upper corner.
    pub(crate) max: [f64; D],
}

impl<const D: usize> Aabb<D> {
    /// Returns the smallest box around points, grown by `margin` on all sides.
    #[inline]
    pub(crate) fn around(points: impl IntoIterator<Item = [f64; D]>, margin: f64) -> Self {
        let mut aabb = Self {
            min: [f64::INFINITY; D],
            max: [f64::NEG_INFINITY; D],
        };
        for point in points {
            for (c, x) in point.into_iter().enumerate() {
                aabb.min[c] = aabb.min[c].min(x - margin);
                aabb.max[c] = aabb.max[c].max(x + margin);
            }
        }
        aabb
    }

    /// Returns true if the box contains no point.
    #[inline]
    pub(crate) fn is_empty(&self) -> bool {
        (0..D).any(|c| self.min[c] > self.max[c])
    }

    /// Returns true if the boxes share a point. Both must be non-empty, or around no points: such
    /// boxes overlap none.
    #[inline]
    pub(crate) fn overlaps(&self, other: &Self) -> bool {
        (0..D).all(|c| self.min[c] <= other.max[c] && other.min[c] <= self.max[c])
    }
}
