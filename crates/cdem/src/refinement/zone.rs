//! Places on blocks that are refined, and how finely.

use serde::{Deserialize, Serialize};

use crate::math::vector::{norm, sub};

/// A place on a block where it is in contact, or about to be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Zone<const D: usize> {
    /// Where at rest, m.
    #[serde(with = "crate::math::serde_pod")]
    pub(crate) centre: [f64; D],
    /// How far around it elements are as fine as its finest, m.
    pub(crate) radius: f64,
    /// Size of these, m.
    pub(crate) finest: f64,
    /// Size of the others over their distance from these, at most.
    pub(crate) grading: f64,
    /// The last coarse step that needs it.
    pub(crate) until: u64,
}

/// Size of an element over its distance from what is finest, at most: twice that of the design,
/// section 6, for a quarter to a tenth of the elements in space and the same velocities (book,
/// "How finely").
pub(crate) const GRADING: f64 = 1.0;

/// The same where blocks meet flush: a plane wave does not thin out, and of a front each
/// halving of the mesh throws back what is too short for it. With half as much it is
/// twice as loud.
pub(crate) const GENTLE: f64 = 0.125;

impl<const D: usize> Zone<D> {
    /// How large an element may be with corners there, m: those within the radius and two
    /// rings around it are as fine as its finest, others grow with the distance.
    pub(crate) fn size_at(&self, corners: &[[f64; D]]) -> f64 {
        let apart = corners
            .iter()
            .map(|corner| norm(&sub(corner, &self.centre)));
        let apart = apart.fold(f64::INFINITY, f64::min);
        self.finest.max(self.grading * (apart - self.radius))
    }

    /// Whether it gives what another would.
    pub(crate) fn covers(&self, other: &Self) -> bool {
        self.finest <= other.finest
            && self.grading <= other.grading
            && self.apart(&other.centre) + other.radius <= self.radius + 0.5 * other.finest
    }

    /// Whether a place lies in its middle: where its own would be no other zone.
    pub(crate) fn has(&self, place: &[f64; D]) -> bool {
        self.apart(place) <= self.radius + 0.5 * self.finest
    }

    /// Whether a contact there, not far from its middle, has slid out of that: it has slipped
    /// so far since it began, m, and in a coarse step.
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

/// Size of an element, m: the side of the cube that is as wide across.
pub(crate) fn size<const D: usize>(corners: &[[f64; D]]) -> f64 {
    let pairs = (0..corners.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
    let lengths = pairs.map(|(i, j)| norm(&sub(&corners[i], &corners[j])));
    lengths.fold(0.0, f64::max) / (D as f64).sqrt()
}
