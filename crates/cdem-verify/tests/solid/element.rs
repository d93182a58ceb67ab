//! Exact mechanics of one element, computed from its corners alone.

use cdem::Simulation;
use cdem::mesh::ElementKind;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// A free block of one element: a tetrahedron, a right prism or a box.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub(crate) block: String,
    pub(crate) mass: f64,
    pub(crate) velocity: Vector3<f64>,
    pub(crate) kind: ElementKind,
    pub(crate) nodes: Vec<Vector3<f64>>,
}

impl Element {
    /// Returns all blocks, each of one element.
    pub(crate) fn all(simulation: &mut Simulation) -> Vec<Self> {
        let frame = simulation.frame();
        let mut rest = frame.connectivity.as_slice();
        let rows = simulation.block_rows();
        let blocks = rows.iter().zip(&frame.kinds);
        let element = blocks.map(|(row, &kind)| {
            let (nodes, after) = rest.split_at(kind.node_count());
            rest = after;
            let nodes = nodes.iter().map(|&node| frame.points[node as usize].into());
            Self {
                block: row.block.clone(),
                mass: row.mass,
                velocity: row.velocity.into(),
                kind,
                nodes: nodes.collect(),
            }
        });
        element.collect()
    }

    /// Returns ∫ρ N_a N_b dV, from the integrals over a line and a triangle.
    pub(crate) fn mass_matrix(&self) -> DMatrix<f64> {
        let same = |a: usize, b: usize| f64::from(u8::from(a == b));
        let line = |a: usize, b: usize| (1.0 + same(a, b)) / 6.0;
        let count = self.nodes.len();
        DMatrix::from_fn(count, count, |a, b| {
            self.mass
                * match self.kind {
                    ElementKind::Tet4 => (1.0 + same(a, b)) / 20.0,
                    ElementKind::Wedge6 => (1.0 + same(a % 3, b % 3)) / 12.0 * line(a / 3, b / 3),
                    ElementKind::Hex8 => {
                        // Around the bottom: x is 0 1 1 0, y is 0 0 1 1.
                        let place =
                            |k: usize| [usize::from(matches!(k % 4, 1 | 2)), k % 4 / 2, k / 4];
                        (0..3).map(|c| line(place(a)[c], place(b)[c])).product()
                    }
                    other => panic!("{other:?} fills no space"),
                }
        })
    }

    pub(crate) fn centre(&self) -> Vector3<f64> {
        let shares = self.mass_matrix().column_sum() / self.mass;
        let nodes = self.nodes.iter().zip(shares.iter());
        nodes.map(|(node, share)| node * *share).sum()
    }

    /// Returns the moments of inertia about the centre.
    pub(crate) fn inertia(&self) -> Matrix3<f64> {
        let (mass, centre) = (self.mass_matrix(), self.centre());
        let mut second = Matrix3::zeros();
        for (a, from) in self.nodes.iter().enumerate() {
            for (b, to) in self.nodes.iter().enumerate() {
                second += mass[(a, b)] * (from - centre) * (to - centre).transpose();
            }
        }
        Matrix3::identity() * second.trace() - second
    }

    /// Returns the weights of the nodes at a point of the boundary. A quadrilateral is split into
    /// four triangles around its mean.
    pub(crate) fn weights(&self, point: &Vector3<f64>) -> DVector<f64> {
        let count = self.nodes.len();
        let mut best = (f64::INFINITY, DVector::zeros(count));
        let unit = |k: u8| DVector::from_fn(count, |a, _| f64::from(u8::from(a == usize::from(k))));
        for facet in self.kind.facets() {
            let corners: Vec<_> = facet.iter().map(|&k| unit(k)).collect();
            let mean = corners.iter().sum::<DVector<f64>>() / corners.len() as f64;
            for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
                let triangle = [a, b, &mean];
                let at = triangle.map(|weights| self.at(weights));
                let edges = Matrix3::from_columns(&[
                    at[1] - at[0],
                    at[2] - at[0],
                    (at[1] - at[0]).cross(&(at[2] - at[0])).normalize(),
                ]);
                let Some(inverse) = edges.try_inverse() else {
                    continue;
                };
                let [u, v, height] = (inverse * (point - at[0])).into();
                let outside = [-u, -v, u + v - 1.0]
                    .into_iter()
                    .fold(height.abs(), f64::max);
                if outside < best.0 {
                    best = (outside, a * (1.0 - u - v) + b * u + &mean * v);
                }
            }
        }
        assert!(best.0 < 1e-9, "{point} is off the boundary by {}", best.0);
        best.1
    }

    fn at(&self, weights: &DVector<f64>) -> Vector3<f64> {
        let nodes = self.nodes.iter().zip(weights.iter());
        nodes.map(|(node, weight)| node * *weight).sum()
    }
}
