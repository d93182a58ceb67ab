//! What the nodes and elements of a block have goes over to another mesh of it.

use super::cover::Cover;
use super::nesting::Nesting;
use crate::vector::{add, norm, scale, sub};

/// From one mesh of a block to a finer or a coarser one.
pub(crate) struct Transfer<'a, const D: usize> {
    nesting: Nesting<'a, D>,
    is_finer: bool,
}

impl<'a, const D: usize> Transfer<'a, D> {
    /// `None` is the base mesh; `None` comes out where neither mesh is a refinement of the
    /// other.
    pub(crate) fn between(old: Option<&'a Cover<D>>, new: Option<&'a Cover<D>>) -> Option<Self> {
        let overlay = |cover: Option<&'a Cover<D>>| cover.map(|cover| &cover.overlay);
        let [old, new] = [old, new].map(overlay);
        let to = |fine: Option<&'a _>, coarse, is_finer| {
            let nesting = Nesting::new(fine?, coarse)?;
            Some(Self { nesting, is_finer })
        };
        to(new, old, true).or_else(|| to(old, new, false))
    }

    /// Whether new nodes have come, and none has gone.
    pub(crate) fn is_finer(&self) -> bool {
        self.is_finer
    }

    /// What varies linearly between nodes.
    pub(crate) fn values<const C: usize>(&self, of: &[[f64; C]]) -> Vec<[f64; C]> {
        if self.is_finer {
            self.nesting.spread(of)
        } else {
            self.nesting.pick(of)
        }
    }

    /// Displacements, m: what is coarser is deformed as nearly as it can be.
    pub(crate) fn displacements(&self, of: &[[f64; D]]) -> Vec<[f64; D]> {
        if self.is_finer {
            self.nesting.spread(of)
        } else {
            self.nesting.smooth(of, &self.nesting.stays())
        }
    }

    /// How far the surface of a block moves at most that goes over to a coarser mesh, m.
    pub(crate) fn jump(&self, displacement: &[[f64; D]]) -> f64 {
        if self.is_finer {
            return 0.0;
        }
        let after = self.nesting.spread(&self.displacements(displacement));
        let moves = displacement
            .iter()
            .zip(&after)
            .map(|(old, new)| norm(&sub(new, old)));
        moves.fold(0.0, f64::max)
    }

    /// Momenta of nodes, N·s: of those that go, to those between which they lie. To be had
    /// of velocities of finer nodes for coarser ones alone.
    pub(crate) fn gather(&self, of: Vec<[f64; D]>) -> Vec<[f64; D]> {
        self.nesting.gather(of)
    }
}

/// For each element of a block's new mesh, by its corners at rest and what it has come of,
/// the old ones whose middles lie in it, or that which lay at its own.
pub(crate) fn predecessors<const D: usize>(
    old: &[(u32, Vec<[f64; D]>)],
    new: &[(u32, Vec<[f64; D]>)],
) -> Vec<Vec<usize>> {
    let mut by_root: Vec<usize> = (0..old.len()).collect();
    by_root.sort_by_key(|&e| old[e].0);
    let among = |root: u32| {
        let first = by_root.partition_point(|&e| old[e].0 < root);
        let end = by_root.partition_point(|&e| old[e].0 <= root);
        &by_root[first..end]
    };
    let found = new.iter().map(|(root, corners)| {
        let candidates = among(*root);
        if candidates.len() == 1 || corners.len() != D + 1 {
            return candidates.to_vec();
        }
        let lies_in = |&e: &usize| least_weight(corners, &middle(&old[e].1)) > 0.0;
        let parts: Vec<usize> = candidates.iter().copied().filter(lies_in).collect();
        if !parts.is_empty() {
            return parts;
        }
        let middle = middle(corners);
        let inside = |&&e: &&usize| least_weight(&old[e].1, &middle);
        let whole = candidates
            .iter()
            .max_by(|a, b| inside(a).total_cmp(&inside(b)));
        whole.into_iter().copied().collect()
    });
    found.collect()
}

fn middle<const D: usize>(corners: &[[f64; D]]) -> [f64; D] {
    let sum = corners
        .iter()
        .fold([0.0; D], |sum, corner| add(&sum, corner));
    scale(1.0 / corners.len() as f64, &sum)
}

/// Least of the barycentric coordinates of a point in a simplex; of another element, none.
fn least_weight<const D: usize>(corners: &[[f64; D]], point: &[f64; D]) -> f64 {
    if corners.len() != D + 1 {
        return f64::NEG_INFINITY;
    }
    let sides = nalgebra::DMatrix::from_fn(D, D, |i, k| corners[k + 1][i] - corners[0][i]);
    let from = nalgebra::DVector::from_fn(D, |i, _| point[i] - corners[0][i]);
    let Some(weights) = sides.lu().solve(&from) else {
        return f64::NEG_INFINITY;
    };
    weights.iter().copied().fold(1.0 - weights.sum(), f64::min)
}
