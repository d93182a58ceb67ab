//! Places on blocks that are refined, and how finely.

use crate::vector::{norm, sub};

/// A place on a block where it is in contact, or about to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Zone<const D: usize> {
    /// Where at rest, m.
    pub(crate) centre: [f64; D],
    /// Size of the elements there, m.
    pub(crate) finest: f64,
    /// The last coarse step that needs it.
    pub(crate) until: u64,
}

/// Size of an element over its distance from the centre of a zone, at most (design,
/// section 6): masses of coarser ones cannot be fitted.
const GRADING: f64 = 0.5;

impl<const D: usize> Zone<D> {
    /// How large an element may be with corners there, m: the two rings around the
    /// centre are as fine as its finest, others grow with the distance.
    pub(crate) fn size_at(&self, corners: &[[f64; D]]) -> f64 {
        let apart = corners
            .iter()
            .map(|corner| norm(&sub(corner, &self.centre)));
        let apart = apart.fold(f64::INFINITY, f64::min);
        self.finest.max(GRADING * apart)
    }

    /// Whether it gives what another at `centre` of elements as fine would.
    pub(crate) fn covers(&self, centre: &[f64; D], finest: f64) -> bool {
        self.finest <= finest && norm(&sub(centre, &self.centre)) <= 0.5 * finest
    }
}

/// Size of an element, m: the side of the cube that is as wide across.
pub(crate) fn size<const D: usize>(corners: &[[f64; D]]) -> f64 {
    let pairs = (0..corners.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
    let lengths = pairs.map(|(i, j)| norm(&sub(&corners[i], &corners[j])));
    lengths.fold(0.0, f64::max) / (D as f64).sqrt()
}
