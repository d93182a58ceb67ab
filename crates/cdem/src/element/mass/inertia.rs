//! Mass moments of blocks, and the error of nodal masses in them.

use nalgebra::DMatrix;

use crate::element::ElementSet;
use crate::element::mass::in_block;
use crate::mesh::Mesh;

/// Exact mass, centre and second moments of a block at rest.
///
/// Its frame has its origin in the centre, its axes along the principal axes of the second moments,
/// and the radii of gyration as units. So the second moments over mass are near the unit tensor,
/// however thin or oblique the block is. In 2-D only the polar moment counts, and both axes take
/// the polar radius of gyration.
pub(super) struct SecondMoments<const D: usize> {
    mass: f64,
    centre: [f64; D],
    axes: [[f64; D]; D],
    radii: [f64; D],
    second: [[f64; D]; D],
}

/// Returns the exact inertia of every block; `lumped` are the row-sum masses, kg.
pub(super) fn exact<const D: usize>(
    mesh: &Mesh<D>,
    sets: &[Box<dyn ElementSet<D>>],
    lumped: &[f64],
) -> Vec<SecondMoments<D>> {
    (0..mesh.blocks.len())
        .map(|block| SecondMoments::new(mesh, sets, lumped, block))
        .collect()
}

impl<const D: usize> SecondMoments<D> {
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
        let from_centre = |x: &[f64; D]| std::array::from_fn(|k| x[k] - centre[k]);
        let second =
            second_moments(mesh, sets, block, from_centre).map(|row| row.map(|x| x / mass));
        let (axes, radii) = principal_frame(&second);
        let mut inertia = Self {
            mass,
            centre,
            axes,
            radii,
            second,
        };
        // Computed again in the frame: a thin axis has lost digits to the long ones.
        let local = second_moments(mesh, sets, block, |x| inertia.local(x));
        inertia.second = local.map(|row| row.map(|x| x / mass));
        inertia
    }

    /// Returns the total mass, kg.
    pub(super) fn mass(&self) -> f64 {
        self.mass
    }

    /// Returns the exact mean of ξ_k ξ_l over the mass.
    pub(super) fn second(&self, k: usize, l: usize) -> f64 {
        self.second[k][l]
    }

    /// Returns a point in the frame of the block.
    pub(super) fn local(&self, point: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|k| {
            let axis = &self.axes[k];
            let along: f64 = (0..D).map(|i| axis[i] * (point[i] - self.centre[i])).sum();
            along / self.radii[k]
        })
    }

    /// Returns the largest relative error of the moments of inertia of point masses (kg) at `rest`:
    /// of the polar moment in 2-D; in 3-D of all entries of the tensor in principal axes, relative
    /// to the root of the product of the exact moments of the two axes.
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
        let squares = self.radii.map(|radius| radius * radius);
        let moment = |second: &[[f64; D]; D], k: usize| -> f64 {
            let others = (0..D).filter(|&l| l != k || D == 2);
            others.map(|l| squares[l] * second[l][l]).sum()
        };
        if D == 2 {
            return (moment(&second, 0) / moment(&self.second, 0) - 1.0).abs();
        }
        let mut largest: f64 = 0.0;
        for k in 0..D {
            let exact = moment(&self.second, k);
            largest = largest.max((moment(&second, k) / exact - 1.0).abs());
            for l in 0..k {
                let missed = (second[k][l] - self.second[k][l]) * self.radii[k] * self.radii[l];
                largest = largest.max(missed.abs() / (exact * moment(&self.second, l)).sqrt());
            }
        }
        largest
    }
}

/// Returns axes and radii of gyration of second moments over mass.
fn principal_frame<const D: usize>(second: &[[f64; D]; D]) -> ([[f64; D]; D], [f64; D]) {
    if D == 2 {
        let polar = second[0][0] + second[1][1];
        let axis = |k: usize| std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
        return (std::array::from_fn(axis), [polar.sqrt(); D]);
    }
    let eigen = DMatrix::from_fn(D, D, |i, j| second[i][j]).symmetric_eigen();
    let axis = |k: usize| std::array::from_fn(|i| eigen.eigenvectors[(i, k)]);
    let radius = |k: usize| eigen.eigenvalues[k].max(0.0).sqrt();
    (std::array::from_fn(axis), std::array::from_fn(radius))
}

/// Returns ∫ρ Y ⊗ Y of the linear map Y of positions, exact for the interpolated geometry: Σ M_ab
/// Y_a ⊗ Y_b.
fn second_moments<const D: usize>(
    mesh: &Mesh<D>,
    sets: &[Box<dyn ElementSet<D>>],
    block: usize,
    map: impl Fn(&[f64; D]) -> [f64; D],
) -> [[f64; D]; D] {
    let mut moments = [[0.0; D]; D];
    let mut mass = [0.0; 64];
    for set in sets {
        for i in in_block(mesh, set.as_ref(), block) {
            set.consistent_mass(i, mesh, &mut mass);
            let nodes = set.nodes(mesh, i);
            let arms: Vec<_> = nodes
                .iter()
                .map(|&n| map(&mesh.nodes[n as usize]))
                .collect();
            for (a, arm) in arms.iter().enumerate() {
                for (b, other) in arms.iter().enumerate() {
                    let entry = mass[a * nodes.len() + b];
                    for k in 0..D {
                        for l in 0..D {
                            moments[k][l] += entry * arm[k] * other[l];
                        }
                    }
                }
            }
        }
    }
    moments
}
