//! Refinement zones.

use serde::{Deserialize, Serialize};

use crate::math::vector::{norm, sub};

/// A place where a block is in contact or about to be, with the element sizes around it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Zone<const D: usize> {
    /// Centre at rest, m.
    #[serde(with = "crate::math::serde_pod")]
    pub(crate) centre: [f64; D],
    /// Radius of the region of the finest elements, m.
    pub(crate) radius: f64,
    /// Size of the finest elements, m.
    pub(crate) finest: f64,
    /// Maximum size of other elements over their distance from that region.
    pub(crate) grading: f64,
    /// The last coarse step that needs it.
    pub(crate) until: u64,
}

/// Maximum size of an element over its distance from the finest region. It is twice that of the
/// design, section 6, which takes a quarter to a tenth of the elements in 3-D for the same
/// velocities (book, "How finely").
pub(crate) const GRADING: f64 = 1.0;

/// The same for flush contacts in 2-D. A plane wave does not decay with distance, and each halving
/// of the mesh reflects the part of a front that is too short for it. With a grading of 0.5 the
/// reflection is twice as large.
pub(crate) const FLUSH_GRADING: f64 = 0.125;

impl<const D: usize> Zone<D> {
    /// Returns the maximum size of an element with these corners, m. Elements within the radius and
    /// in two rings around it are as fine as `finest`; others grow with the distance.
    pub(crate) fn size_at(&self, corners: &[[f64; D]]) -> f64 {
        let apart = corners
            .iter()
            .map(|corner| norm(&sub(corner, &self.centre)));
        let apart = apart.fold(f64::INFINITY, f64::min);
        self.finest.max(self.grading * (apart - self.radius))
    }

    /// Returns true if the zone makes `other` superfluous.
    pub(crate) fn covers(&self, other: &Self) -> bool {
        self.finest <= other.finest * (1.0 + SAME_LENGTH)
            && self.grading <= other.grading
            && self.apart(&other.centre) + other.radius
                <= (self.radius + 0.5 * other.finest) * (1.0 + SAME_LENGTH)
    }

    /// Returns true if a place lies in the middle of the zone: a zone of its own would be no
    /// different.
    pub(crate) fn has(&self, place: &[f64; D]) -> bool {
        self.apart(place) <= (self.radius + 0.5 * self.finest) * (1.0 + SAME_LENGTH)
    }

    /// Returns true if a contact near the middle of the zone has slid out of it. The slip, m, is
    /// that since the contact began and that in a coarse step.
    pub(crate) fn is_left_by(&self, place: &[f64; D], [since, in_step]: [f64; 2]) -> bool {
        let middle = 0.5 * self.finest;
        let out = self.apart(place) - self.radius;
        let farthest = middle + middle.max(2.0 * in_step);
        (middle..=farthest).contains(&out) && since > middle
    }

    fn apart(&self, place: &[f64; D]) -> f64 {
        norm(&sub(place, &self.centre))
    }
}

/// Relative difference of two lengths that count as equal. In regular meshes, sizes of elements
/// equal their distance from a touch, or the size that is wanted. The last digits of coordinates
/// must not decide which elements are cut. Those of meshes far from the origin differ by 1e-12.
pub(crate) const SAME_LENGTH: f64 = 1e-6;

/// Returns the size of an element, m: the side of the square or cube of the same diameter.
pub(crate) fn size<const D: usize>(corners: &[[f64; D]]) -> f64 {
    let pairs = (0..corners.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
    let lengths = pairs.map(|(i, j)| norm(&sub(&corners[i], &corners[j])));
    lengths.fold(0.0, f64::max) / (D as f64).sqrt()
}
