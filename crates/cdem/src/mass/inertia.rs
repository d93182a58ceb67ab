//! Mass moments of blocks, and how far nodal masses miss them.

use nalgebra::DMatrix;

use super::in_block;
use crate::element::ElementSet;
use crate::mesh::Mesh;

/// Exact mass, centre and second moments of a block at rest.
///
/// Its frame has its origin in the centre, its axes along the principal axes
/// of the second moments, and the radii of gyration as units, so that the
/// second moments over mass are the unit tensor however thin or oblique the
/// block is. In 2-D, where only the polar moment counts, both axes take the
/// polar radius of gyration.
pub(super) struct Inertia<const D: usize> {
    mass: f64,
    centre: [f64; D],
    axes: [[f64; D]; D],
    radii: [f64; D],
}

/// Exact inertia of every block; `lumped` are the row-sum masses, kg.
pub(super) fn exact<const D: usize>(
    mesh: &Mesh<D>,
    sets: &[Box<dyn ElementSet<D>>],
    lumped: &[f64],
) -> Vec<Inertia<D>> {
    (0..mesh.blocks.len())
        .map(|block| Inertia::new(mesh, sets, lumped, block))
        .collect()
}

impl<const D: usize> Inertia<D> {
    fn new(mesh: &Mesh<D>, sets: &[Box<dyn ElementSet<D>>], lumped: &[f64], block: usize) -> Self {
        // Row sums have the exact mass and centre.
        let (mut mass, mut first) = (0.0, [0.0; D]);
        let start = mesh.blocks[block].nodes.start as usize;
        for a in start..mesh.blocks[block].nodes.end as usize {
            mass += lumped[a];
            for k in 0..D {
                first[k] += lumped[a] * (mesh.nodes[a][k] - mesh.nodes[start][k]);
            }
        }
        let centre = std::array::from_fn(|k| mesh.nodes[start][k] + first[k] / mass);
        let second = second_moments(mesh, sets, block, centre) / mass;
        if D == 2 {
            let axes = [[1.0, 0.0], [0.0, 1.0]];
            return Self {
                mass,
                centre,
                axes: std::array::from_fn(|i| std::array::from_fn(|j| axes[i][j])),
                radii: [second.trace().sqrt(); D],
            };
        }
        let eigen = second.symmetric_eigen();
        Self {
            mass,
            centre,
            axes: std::array::from_fn(|k| std::array::from_fn(|i| eigen.eigenvectors[(i, k)])),
            radii: std::array::from_fn(|k| eigen.eigenvalues[k].max(0.0).sqrt()),
        }
    }

    /// Total mass, kg.
    pub(super) fn mass(&self) -> f64 {
        self.mass
    }

    /// A point in the block's frame.
    pub(super) fn local(&self, point: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|k| {
            let axis = &self.axes[k];
            let along: f64 = (0..D).map(|i| axis[i] * (point[i] - self.centre[i])).sum();
            along / self.radii[k]
        })
    }

    /// Largest error of the moments of inertia of point masses (kg) at `rest`:
    /// the polar moment in 2-D; in 3-D all entries of the tensor in principal
    /// axes, relative to the root of the exact moments of the two axes.
    pub(super) fn error(&self, rest: &[[f64; D]], masses: &[f64]) -> f64 {
        let mut second = [[0.0; D]; D];
        for (point, mass) in rest.iter().zip(masses) {
            let local = self.local(point);
            for k in 0..D {
                for l in 0..D {
                    second[k][l] += mass / self.mass * local[k] * local[l];
                }
            }
        }
        if D == 2 {
            return (second[0][0] + second[1][1] - 1.0).abs();
        }
        let squares = self.radii.map(|radius| radius * radius);
        let exact = |k: usize| squares.iter().sum::<f64>() - squares[k];
        let mut largest: f64 = 0.0;
        for k in 0..D {
            let moment: f64 = (0..D)
                .filter(|&l| l != k)
                .map(|l| squares[l] * second[l][l])
                .sum();
            largest = largest.max((moment / exact(k) - 1.0).abs());
            for l in 0..k {
                let product = second[k][l] * self.radii[k] * self.radii[l];
                largest = largest.max(product.abs() / (exact(k) * exact(l)).sqrt());
            }
        }
        largest
    }
}

/// ∫ρ (X − c) ⊗ (X − c), exact for the interpolated geometry:
/// Σ M_ab (X_a − c) ⊗ (X_b − c), kg·m².
fn second_moments<const D: usize>(
    mesh: &Mesh<D>,
    sets: &[Box<dyn ElementSet<D>>],
    block: usize,
    centre: [f64; D],
) -> DMatrix<f64> {
    let mut moments = DMatrix::zeros(D, D);
    let mut mass = [0.0; 64];
    for set in sets {
        for i in in_block(mesh, set.as_ref(), block) {
            set.consistent_mass(i, &mut mass);
            let nodes = set.nodes(i);
            let arm = |a: usize, k: usize| mesh.nodes[nodes[a] as usize][k] - centre[k];
            for a in 0..nodes.len() {
                for b in 0..nodes.len() {
                    let entry = mass[a * nodes.len() + b];
                    for k in 0..D {
                        for l in 0..D {
                            moments[(k, l)] += entry * arm(a, k) * arm(b, l);
                        }
                    }
                }
            }
        }
    }
    moments
}
