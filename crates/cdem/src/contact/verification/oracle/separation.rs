//! Distance of two blocks by separating planes, and the time until which they surely are apart.

use crate::contact::verification::oracle::meeting::BlockEncounter;
use crate::contact::verification::oracle::space::OracleSpace;
use crate::math::vector::{add_scaled, dot, norm, scale, sub};
use crate::mesh::Element;

/// Remaining distance at which a depth counts as reached, relative to the depth.
const REACHED: f64 = 1e-3;

/// Most steps of a pair of cells; a grazing one takes some thousands.
const STEPS: usize = 1_000_000;

/// A plane between two cells, with a constant normal while they move.
struct Gap {
    width: f64,
    /// Largest decrease of the width in a second, m/s.
    closing: f64,
}

/// Returns the least and largest component along an axis.
fn range<const D: usize>(vectors: &[[f64; D]], axis: &[f64; D]) -> [f64; 2] {
    let along = vectors.iter().map(|x| dot(x, axis));
    along.fold([f64::MAX, f64::MIN], |[low, high], x| {
        [low.min(x), high.max(x)]
    })
}

impl<const D: usize> BlockEncounter<D> {
    /// Returns the pairs of cells of different blocks.
    fn cells(&self) -> impl Iterator<Item = [&Element; 2]> {
        let [one, other] = [0, 1].map(|block: usize| {
            let elements = self.mesh.blocks[block].elements.clone();
            &self.mesh.elements[elements.start as usize..elements.end as usize]
        });
        one.iter()
            .flat_map(move |one| other.iter().map(move |other| [one, other]))
    }

    /// Returns the planes between two cells; either of them may be the one in front.
    fn gaps<S: OracleSpace<D>>(&self, cells: [&Element; 2], time: f64) -> Vec<Gap> {
        let at = |node: u32| {
            let mut x = self.mesh.nodes[node as usize];
            add_scaled(&mut x, time, &self.velocity[node as usize]);
            x
        };
        let places = cells.map(|cell| cell.nodes().iter().map(|&n| at(n)).collect::<Vec<_>>());
        let rates = cells.map(|cell| {
            let nodes = cell.nodes().iter();
            nodes
                .map(|&n| self.velocity[n as usize])
                .collect::<Vec<_>>()
        });
        let faces = [0, 1].map(|k: usize| {
            let facets = cells[k].kind.facets().iter();
            let corners = |facet: &&[u8]| {
                let corners = facet.iter().map(|&i| places[k][i as usize]);
                corners.collect::<Vec<_>>()
            };
            facets.map(corners).collect::<Vec<_>>()
        });
        let axes = S::axes(faces).into_iter().filter(|axis| norm(axis) > 1e-9);
        let gaps = axes.flat_map(|axis| {
            let axis = scale(1.0 / norm(&axis), &axis);
            let [x, v] = [&places, &rates].map(|of| [0, 1].map(|k: usize| range(&of[k], &axis)));
            [[0, 1], [1, 0]].map(|[back, front]| Gap {
                width: x[front][0] - x[back][1],
                closing: v[back][1] - v[front][0],
            })
        });
        gaps.collect()
    }

    /// Returns the distance of the nearest two cells along the axis of their largest distance, m;
    /// negative if no plane separates them.
    pub(super) fn separation<S: OracleSpace<D>>(&self, time: f64) -> f64 {
        let apart = |cells| {
            let gaps = self.gaps::<S>(cells, time).into_iter();
            gaps.map(|gap| gap.width).fold(f64::MIN, f64::max)
        };
        self.cells().map(apart).fold(f64::MAX, f64::min)
    }

    /// Returns the first time before `until` at which blocks may penetrate by `depth`.
    ///
    /// Conservative advancement: cells do not meet while a plane separates them. The plane that
    /// separates them for longest is followed for that time.
    pub(super) fn deepens<S: OracleSpace<D>>(&self, depth: f64, until: f64) -> Option<f64> {
        let fastest = 2.0 * self.fastest();
        let first = |cells: [&Element; 2]| {
            let mut time = 0.0;
            for _ in 0..STEPS {
                let gaps = self.gaps::<S>(cells, time).into_iter();
                let open = gaps.filter(|gap| gap.width + depth > 0.0);
                let wait = open.map(|gap| (gap.width + depth) / gap.closing.max(f64::MIN_POSITIVE));
                let wait = wait.fold(0.0, f64::max);
                if wait * fastest <= REACHED * depth {
                    return Some(time);
                }
                time += wait;
                if time >= until {
                    return None;
                }
            }
            panic!("cells that graze for ever: {self:?}");
        };
        self.cells().filter_map(first).min_by(f64::total_cmp)
    }

    /// Returns the largest speed of a node relative to the first, m/s.
    pub(super) fn fastest(&self) -> f64 {
        let speeds = self
            .velocity
            .iter()
            .map(|v| norm(&sub(v, &self.velocity[0])));
        speeds.fold(f64::MIN_POSITIVE, f64::max)
    }
}
