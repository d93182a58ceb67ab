//! Places on blocks that are refined, and how finely.

use crate::vector::{norm, sub};

/// A place on a block where it is in contact, or about to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Zone<const D: usize> {
    /// Where at rest, m.
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

/// Size of an element over its distance from what is finest, at most (design, section 6):
/// masses of coarser ones cannot be fitted.
pub(crate) const GRADING: f64 = 0.5;

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
        let apart = norm(&sub(&other.centre, &self.centre));
        let reach = self.radius + 0.5 * other.finest;
        self.finest <= other.finest
            && self.grading <= other.grading
            && apart + other.radius <= reach
    }
}

/// Size of an element, m: the side of the cube that is as wide across.
pub(crate) fn size<const D: usize>(corners: &[[f64; D]]) -> f64 {
    let pairs = (0..corners.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
    let lengths = pairs.map(|(i, j)| norm(&sub(&corners[i], &corners[j])));
    lengths.fold(0.0, f64::max) / (D as f64).sqrt()
}
