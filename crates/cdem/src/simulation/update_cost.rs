//! Cost of element forces in bytes and operations, to compare with the limits of a machine.

use crate::element::ElementSet;
use crate::mesh::Mesh;
use crate::simulation::{Simulation, each};

/// Cost of one element update: the mean over all elements of a model, without regard to time
/// levels. Damping and contact are left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UpdateCost {
    /// Bytes to and from memory. Each element: reference data and node numbers, read; data kept
    /// from step to step, read and written. Each node, once and shared by its elements:
    /// displacement, read; force, read and written.
    pub bytes: f64,
    /// Additions, subtractions, multiplications and divisions, each counted as one.
    pub operations: f64,
}

impl Simulation {
    /// Returns the mean cost of an element update in the current mesh; 0 without elements.
    #[must_use]
    pub fn update_cost(&self) -> UpdateCost {
        each!(self, driven => of_mesh(&driven.run.model.mesh, &driven.run.model.sets))
    }
}

fn of_mesh<const D: usize>(mesh: &Mesh<D>, sets: &[Box<dyn ElementSet<D>>]) -> UpdateCost {
    let (mut bytes, mut operations) = (mesh.nodes.len() * 3 * size_of::<[f64; D]>(), 0);
    for set in sets {
        let [moved, worked_out] = set.update_cost();
        bytes += set.len() * moved;
        operations += set.len() * worked_out;
    }
    let elements = mesh.elements.len().max(1) as f64;
    UpdateCost {
        bytes: bytes as f64 / elements,
        operations: operations as f64 / elements,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::tests::{box_mesh, kinds, rock, sets_of};
    use crate::scene::{Kinematics, Plane};

    /// Returns the element count of a box of one cell and the cost of an update.
    fn cost<const D: usize>(kind: usize, kinematics: Kinematics) -> (f64, UpdateCost) {
        let mesh = box_mesh([1.0; D], [1; D], kinds::<D>()[kind], 0.0);
        let sets = sets_of(&mesh, rock(), kinematics, Plane::Strain);
        (mesh.elements.len() as f64, of_mesh(&mesh, &sets))
    }

    #[test]
    fn bytes_are_those_of_elements_and_of_their_share_of_nodes() {
        // Two triangles, four nodes: gradients of two nodes, a volume, three node numbers.
        let (count, triangles) = cost::<2>(0, Kinematics::Total);
        assert_eq!((count, triangles.bytes), (2.0, 46.0 + 4.0 * 48.0 / 2.0));
        // In addition, read and written: gradient of displacement, stress and work.
        let (_, incremental) = cost::<2>(0, Kinematics::Incremental);
        assert_eq!(
            incremental.bytes - triangles.bytes,
            2.0 * 8.0 * (4.0 + 3.0 + 1.0)
        );
        // A hexahedron with eight nodes and eight Gauss points.
        let (count, hexahedron) = cost::<3>(2, Kinematics::Total);
        assert_eq!(
            (count, hexahedron.bytes),
            (1.0, 8.0 * 22.0 * 8.0 + 16.0 + 8.0 * 72.0)
        );
    }

    #[test]
    fn operations_at_nodes_are_counted_too() {
        let (_, tetrahedra) = cost::<3>(0, Kinematics::Total);
        assert_eq!(tetrahedra.operations, 219.0 + 9.0 + 24.0);
    }
}
