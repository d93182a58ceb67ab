//! Corner against corner: each may touch both edges of the other, and it is one
//! contact.

use super::Outline;
use crate::contact::island::SHALLOW;
use crate::contact::surface::{FLUSH, Pair, Positions, Surface, keep_shallowest};
use crate::vector::cross2;

impl Outline {
    /// Of the pairs of two corners that meet, the one that lies in each other least
    /// `then`: two of different normals would hold the corners together sideways.
    /// In the middle of an edge the pair itself.
    pub(super) fn rightful_at_corner(
        &self,
        pair: Pair,
        [at, then]: [Positions<2>; 2],
        tolerance: f64,
        may: &dyn Fn(Pair) -> bool,
    ) -> Option<Pair> {
        let gap = |pair: Pair| self.project(pair, then).gap;
        let mut candidates = self.rivals(pair, at, tolerance);
        if self.admits(pair, at) {
            candidates.insert(0, pair);
        }
        candidates.retain(|&candidate| may(candidate));
        let mut shallow = candidates.clone();
        keep_shallowest(self, &mut shallow, at, SHALLOW * tolerance);
        let mut best = None;
        for candidate in shallow {
            let is_less_deep =
                |best| gap(candidate) > gap(best) && !self.is_aligned(candidate, best, at);
            if best.is_none_or(is_less_deep) {
                best = Some(candidate);
            }
        }
        // A corner that meets a corner sinks into all of its edges, or goes past.
        let best = best?;
        let one_way = candidates
            .iter()
            .all(|&candidate| self.is_aligned(best, candidate, at));
        (one_way || gap(best) <= -SHALLOW * tolerance).then_some(best)
    }

    /// The other pairs of two corners that touch within the tolerance: each corner with
    /// both edges at the other.
    fn rivals(&self, pair: Pair, at: Positions<2>, tolerance: f64) -> Vec<Pair> {
        let foot = self.project(pair, at).foot[0];
        let length = self.target_size(pair.target, at);
        if foot.min(1.0 - foot) * length > tolerance {
            return Vec::new();
        }
        let end = self.ends[pair.target as usize][usize::from(foot > 0.5)];
        let mut rivals = Vec::new();
        for (main, corner) in [(pair.main, end), (end, pair.main)] {
            let edges = self.vertices[corner as usize].edges.into_iter().flatten();
            rivals.extend(edges.map(|target| Pair { main, target }));
        }
        let touches = |rival: Pair| {
            let projection = self.project(rival, at);
            projection.gap.abs() <= tolerance
                && projection.outside <= tolerance
                && self.admits(rival, at)
        };
        rivals.retain(|&rival| rival != pair && touches(rival) && !self.both_bear(pair, rival, at));
        rivals
    }

    /// Whether two pairs press the same way, whichever is the main block.
    fn is_aligned(&self, one: Pair, other: Pair, at: Positions<2>) -> bool {
        let [one, other] = [one, other].map(|pair| self.outward(pair.target, at));
        cross2(&one, &other).abs() <= FLUSH
    }
}
