//! Boxes: a lattice of cells, each cut into elements.

use crate::math::format::short;
use crate::mesh::shape::{facet_kind, fault, push, with_sides};
use crate::mesh::{BlockFault, CellKind, ElementKind, RawMesh};
use crate::scene::check::block::MOST_ELEMENTS;

/// Meshes a box between two corners, with `divisions` cells along each axis.
///
/// Triangles cut all cells in the same way, so that all nodes of a side except its ends have equal
/// masses; alternating masses would make the force of a flat impact ripple. Tetrahedra and wedges
/// cut neighbouring cells as mirror images (union jack), so that the mesh prefers no direction;
/// otherwise their lumped masses would have products of inertia that a box does not have.
///
/// # Errors
/// If the box has no extent or no divisions, or if there are far too many elements.
pub(super) fn mesh_box<const D: usize>(
    min: &[f64],
    max: &[f64],
    divisions: &[usize],
    element: ElementKind,
) -> Result<RawMesh, BlockFault> {
    let lattice = Lattice::<D>::new(min, max, divisions, element)?;
    let sides = ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"];
    let mut mesh = with_sides(sides.iter().take(2 * D).map(|&side| side.to_owned()), D);
    mesh.points = (0..lattice.point_count())
        .map(|n| lattice.place(n))
        .collect();
    mesh.point_tags = (1..=mesh.points.len() as u64).collect();
    let cells: usize = lattice.divisions.iter().product();
    for cell in 0..cells {
        let cell = unravel(cell, lattice.divisions);
        let parity = (0..D).fold(0, |bits, i| bits | (cell[i] % 2) << i);
        for corners in cut(element, parity) {
            let nodes: Vec<_> = corners
                .iter()
                .map(|&bits| lattice.corner(cell, bits))
                .collect();
            push(&mut mesh, CellKind::Element(element), &nodes, None);
            lattice.push_sides(&mut mesh, element, &nodes);
        }
    }
    Ok(mesh)
}

/// The points of a box.
struct Lattice<const D: usize> {
    min: [f64; D],
    max: [f64; D],
    divisions: [usize; D],
}

impl<const D: usize> Lattice<D> {
    fn new(
        min: &[f64],
        max: &[f64],
        divisions: &[usize],
        element: ElementKind,
    ) -> Result<Self, BlockFault> {
        let count = |key| move |_| fault(key, format!("expected {D} numbers"));
        let min = <[f64; D]>::try_from(min).map_err(count("shape.box.min"))?;
        let max = <[f64; D]>::try_from(max).map_err(count("shape.box.max"))?;
        let divisions = <[usize; D]>::try_from(divisions).map_err(count("shape.box.divisions"))?;
        for i in 0..D {
            let finite = min[i].is_finite() && max[i].is_finite();
            if !finite || max[i] <= min[i] {
                let axis = ["x", "y", "z"][i];
                let (low, high) = (short(min[i]), short(max[i]));
                let problem =
                    format!("{axis} of max must be larger than {axis} of min, {low}, got {high}");
                return Err(fault("shape.box", problem));
            }
        }
        if divisions.contains(&0) {
            return Err(fault(
                "shape.box.divisions",
                "each must be at least 1".into(),
            ));
        }
        let cells: f64 = divisions.iter().map(|&n| n as f64).product();
        let elements = cells * cut(element, 0).len() as f64;
        if elements > MOST_ELEMENTS {
            let problem = format!(
                "{divisions:?} make {} elements, more than {}; use fewer divisions",
                short(elements),
                short(MOST_ELEMENTS)
            );
            return Err(fault("shape.box.divisions", problem));
        }
        Ok(Self {
            min,
            max,
            divisions,
        })
    }

    fn point_count(&self) -> usize {
        self.divisions.iter().map(|n| n + 1).product()
    }

    fn index(&self, point: usize) -> [usize; D] {
        unravel(point, self.divisions.map(|n| n + 1))
    }

    /// Returns the coordinates of a point; a point on a side lies exactly on it.
    fn place(&self, point: usize) -> [f64; 3] {
        let index = self.index(point);
        std::array::from_fn(|i| match index.get(i) {
            None => 0.0,
            Some(&k) if k == self.divisions[i] => self.max[i],
            Some(&k) => {
                let share = k as f64 / self.divisions[i] as f64;
                self.min[i] + share * (self.max[i] - self.min[i])
            }
        })
    }

    /// Returns the point at a corner of a cell. Bit i of `bits` selects the upper side on axis i.
    fn corner(&self, cell: [usize; D], bits: usize) -> u32 {
        let along = |i: usize| cell[i] + (bits >> i & 1);
        let number = (0..D)
            .rev()
            .fold(0, |n, i| n * (self.divisions[i] + 1) + along(i));
        number as u32
    }

    /// Adds the facets of an element that lie on sides of the box.
    fn push_sides(&self, mesh: &mut RawMesh, element: ElementKind, nodes: &[u32]) {
        let places: Vec<_> = nodes.iter().map(|&n| self.index(n as usize)).collect();
        for corners in element.facets() {
            for (axis, &last) in self.divisions.iter().enumerate() {
                for (upper, level) in [0, last].into_iter().enumerate() {
                    if corners.iter().all(|&c| places[c as usize][axis] == level) {
                        let facet: Vec<_> = corners.iter().map(|&c| nodes[c as usize]).collect();
                        push(
                            mesh,
                            facet_kind(facet.len()),
                            &facet,
                            Some(2 * axis + upper),
                        );
                    }
                }
            }
        }
    }
}

/// Returns the lattice indices of item `number` in an array of the given extents, first axis
/// fastest.
fn unravel<const D: usize>(mut number: usize, extents: [usize; D]) -> [usize; D] {
    extents.map(|extent| {
        let along = number % extent;
        number /= extent;
        along
    })
}

/// Returns the elements of one cell, as corners (see [`Lattice::corner`]). In 3-D, cells of odd
/// parity along an axis are mirrored on it.
///
/// The tetrahedra are Kuhn's: one for each order of the axes, from corner 0 to the opposite one.
fn cut(element: ElementKind, parity: usize) -> Vec<Vec<usize>> {
    let mirrored = parity.count_ones() % 2 == 1;
    let triangles = [[0, 1, 3], [0, 3, 2]];
    match element {
        ElementKind::Quad4 => vec![vec![0, 1, 3, 2]],
        ElementKind::Hex8 => vec![vec![0, 1, 3, 2, 4, 5, 7, 6]],
        ElementKind::Tri3 => triangles.map(Vec::from).to_vec(),
        ElementKind::Wedge6 => {
            let in_plane = parity & 3;
            let wedge = |[a, b, c]: [usize; 3]| {
                let turned = in_plane.count_ones() == 1;
                let base = if turned { [a, c, b] } else { [a, b, c] };
                let base = base.map(|bits| bits ^ in_plane);
                [base, base.map(|bits| bits + 4)].concat()
            };
            triangles.map(wedge).to_vec()
        }
        ElementKind::Tet4 => {
            let even = [[1, 3], [2, 6], [4, 5]];
            let odd = [[1, 5], [2, 3], [4, 6]];
            let ways = even
                .map(|way| (way, true))
                .into_iter()
                .chain(odd.map(|way| (way, false)));
            ways.map(|([a, b], even)| {
                if even == mirrored {
                    [0, b, a, 7]
                } else {
                    [0, a, b, 7]
                }
            })
            .map(|corners| corners.map(|bits| bits ^ parity).to_vec())
            .collect()
        }
    }
}
