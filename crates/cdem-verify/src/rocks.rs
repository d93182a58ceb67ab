//! Irregular rocks in rows, to be dropped into a box.

use cdem::mesh::{CellKind, ElementKind, RawMesh};
use cdem::scene::Geometry;

use crate::{Case, Random};

/// Seed of the rocks in `verification/rocks-in-a-box`.
pub const SEED: u64 = 20;

/// Smallest and largest circumradius of the rocks, m. Their centres are 1 m apart.
const RADII: [f64; 2] = [0.3, 0.45];

/// Smallest and largest stretch along the axes of a regular shape, and taper of its upper end.
const LENGTHS: [f64; 2] = [0.7, 1.0];

const SHAPES: [ElementKind; 3] = [ElementKind::Tet4, ElementKind::Wedge6, ElementKind::Hex8];

/// Returns tetrahedra that fill a 3-D element, as numbers of its nodes.
///
/// # Panics
/// For a 2-D element.
#[must_use]
pub fn tetrahedra(kind: ElementKind) -> &'static [[usize; 4]] {
    match kind {
        ElementKind::Tet4 => &[[0, 1, 2, 3]],
        ElementKind::Wedge6 => &[[0, 1, 2, 3], [1, 2, 3, 4], [2, 3, 4, 5]],
        ElementKind::Hex8 => &[
            [0, 1, 2, 6],
            [0, 2, 3, 6],
            [0, 3, 7, 6],
            [0, 7, 4, 6],
            [0, 4, 5, 6],
            [0, 5, 1, 6],
        ],
        other => panic!("{other:?} fills no space"),
    }
}

/// Builds convex tetrahedra, wedges and hexahedra of random size and rotation, `across` of them
/// along each axis. The first centre is half a metre from the origin along each axis. Each rock is
/// one element, or one to six tetrahedra if `cut`. Rocks share no nodes.
#[must_use]
pub fn rocks(seed: u64, across: [usize; 3], cut: bool) -> RawMesh {
    rocks_of(&SHAPES, seed, across, cut)
}

/// Builds rocks as [`rocks`] does, of the given shapes only.
#[must_use]
pub fn rocks_of(shapes: &[ElementKind], seed: u64, across: [usize; 3], cut: bool) -> RawMesh {
    let mut random = Random(seed);
    let mut mesh = RawMesh {
        origin: "rocks".to_owned(),
        group_sets: vec![Vec::new()],
        ..RawMesh::default()
    };
    for z in 0..across[2] {
        for y in 0..across[1] {
            for x in 0..across[0] {
                let centre = [x, y, z].map(|i| i as f64 + 0.5);
                let shape = shapes[random.whole(0, shapes.len() - 1)];
                add_rock(&mut mesh, &mut random, shape, centre, cut);
            }
        }
    }
    mesh.point_tags = (1..=mesh.points.len() as u64).collect();
    mesh
}

/// Sets the box of `verification/rocks-in-a-box` to the size that rocks `across` need.
///
/// # Panics
/// If the scene has no such box.
pub fn box_around(case: &mut Case, across: [usize; 3]) {
    let [x, y, z] = across.map(|count| count as f64);
    let sides = [
        ("floor", [-1.0, -1.0, -1.0], [x + 1.0, y + 1.0, 0.0]),
        ("west", [-1.0, -1.0, 0.0], [0.0, y + 1.0, z + 3.0]),
        ("east", [x, -1.0, 0.0], [x + 1.0, y + 1.0, z + 3.0]),
        ("south", [0.0, -1.0, 0.0], [x, 0.0, z + 3.0]),
        ("north", [0.0, y, 0.0], [x, y + 1.0, z + 3.0]),
    ];
    for (name, low, high) in sides {
        if let Geometry::Box { min, max, .. } = &mut case.block(name).geometry {
            (*min, *max) = (low.to_vec(), high.to_vec());
        }
    }
}

fn add_rock(
    mesh: &mut RawMesh,
    random: &mut Random,
    shape: ElementKind,
    centre: [f64; 3],
    cut: bool,
) {
    let radius = random.between(RADII[0], RADII[1]);
    let turn = rotation(random);
    let first = mesh.points.len();
    // Stretch and taper keep the faces plane.
    let stretch = [0; 3].map(|_| random.between(LENGTHS[0], LENGTHS[1]));
    let taper = random.between(LENGTHS[0], LENGTHS[1]);
    for [x, y, z] in corners(shape) {
        let width = if z > 0.0 { taper } else { 1.0 };
        let corner = [
            width * x * stretch[0],
            width * y * stretch[1],
            z * stretch[2],
        ];
        let corner = corner.map(|x| radius * x);
        let turned = turn.map(|row| (0..3).map(|c| row[c] * corner[c]).sum::<f64>());
        mesh.points
            .push(std::array::from_fn(|c| centre[c] + turned[c]));
    }
    let cells: Vec<Vec<usize>> = if cut {
        tetrahedra(shape).iter().map(|cell| cell.to_vec()).collect()
    } else {
        vec![(0..shape.node_count()).collect()]
    };
    let kind = CellKind::Element(if cut { ElementKind::Tet4 } else { shape });
    for cell in cells {
        let nodes = cell.into_iter().map(|node| (first + node) as u32);
        let cells = mesh.cells_mut(kind);
        cells.nodes.extend(nodes);
        cells.tags.push(cells.tags.len() as u64 + 1);
        cells.sets.push(0);
    }
}

/// Returns the corners of a regular shape on the unit sphere, in Gmsh's order.
fn corners(shape: ElementKind) -> Vec<[f64; 3]> {
    let on_sphere = |x: [f64; 3]| {
        let length = x.iter().map(|x| x * x).sum::<f64>().sqrt();
        x.map(|x| x / length)
    };
    let sine = 0.75_f64.sqrt();
    let base = match shape {
        ElementKind::Tet4 => {
            let corners = [[1, 1, 1], [1, -1, -1], [-1, -1, 1], [-1, 1, -1]];
            return corners.map(|x| on_sphere(x.map(f64::from))).into();
        }
        ElementKind::Wedge6 => vec![[1.0, 0.0], [-0.5, sine], [-0.5, -sine]],
        _ => vec![[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]],
    };
    let at = |z: f64| base.iter().map(move |&[x, y]| on_sphere([x, y, z]));
    at(-0.8).chain(at(0.8)).collect()
}

/// Returns a uniformly distributed rotation (Shoemake 1992, in Graphics Gems III).
fn rotation(random: &mut Random) -> [[f64; 3]; 3] {
    let u = random.between(0.0, 1.0);
    let [a, b] = [0, 1].map(|_| random.between(0.0, std::f64::consts::TAU));
    let [p, q] = [(1.0 - u).sqrt(), u.sqrt()];
    let [x, y, z, w] = [p * a.sin(), p * a.cos(), q * b.sin(), q * b.cos()];
    [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - z * w),
            2.0 * (x * z + y * w),
        ],
        [
            2.0 * (x * y + z * w),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - x * w),
        ],
        [
            2.0 * (x * z - y * w),
            2.0 * (y * z + x * w),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ]
}
