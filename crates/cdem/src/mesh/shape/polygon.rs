//! Polygons meshed with constrained Delaunay triangles, or with three quadrilaterals in each
//! triangle.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use spade::handles::{FixedFaceHandle, FixedVertexHandle, InnerTag};
use spade::{
    AngleLimit, ConstrainedDelaunayTriangulation, Point2, RefinementParameters, Triangulation,
};

use crate::math::format::{short, significant};
use crate::math::vector::{cross2, dot, sub};
use crate::mesh::error::FARTHEST;
use crate::mesh::shape::{facet_kind, fault, push, with_sides};
use crate::mesh::vector::{between, centre, distance};
use crate::mesh::{BlockFault, CellKind, ElementKind, RawMesh, coordinates};
use crate::scene::check::block::MOST_ELEMENTS;

type Delaunay = ConstrainedDelaunayTriangulation<Point2<f64>>;

/// Meshes a simple polygon. Boundary edges are no longer than `size`; areas are at most that of an
/// equilateral triangle with side `size`.
///
/// Corners may be in either orientation; side k runs from corner k to the next.
///
/// # Errors
/// If the polygon is not simple, or if `size` is not positive or far too small.
pub(super) fn mesh_polygon(
    corners: &[[f64; 2]],
    size: f64,
    element: ElementKind,
) -> Result<RawMesh, BlockFault> {
    check(corners, size)?;
    // A quadrilateral has half the edge length of the triangle it is cut from.
    let size = if element == ElementKind::Quad4 {
        2.0 * size
    } else {
        size
    };
    let triangles = triangulate(corners, size)?;
    let names = (1..=corners.len()).map(|k| format!("edge{k}"));
    let mut mesh = with_sides(names, 2);
    mesh.points = triangles.points.iter().map(|&[x, y]| [x, y, 0.0]).collect();
    let edges = triangles.boundary();
    if element == ElementKind::Quad4 {
        push_quadrilaterals(&mut mesh, corners, &triangles, &edges);
    } else {
        for corners in &triangles.corners {
            push(
                &mut mesh,
                CellKind::Element(ElementKind::Tri3),
                corners,
                None,
            );
        }
        for edge in edges {
            push_side(&mut mesh, corners, edge);
        }
    }
    mesh.point_tags = (1..=mesh.points.len() as u64).collect();
    Ok(mesh)
}

/// Triangles, counter-clockwise.
struct Triangles {
    points: Vec<[f64; 2]>,
    corners: Vec<[u32; 3]>,
}

impl Triangles {
    /// Returns the edges that belong to one triangle only, with it to their left, sorted.
    fn boundary(&self) -> Vec<[u32; 2]> {
        let edges = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]];
        let mut all: Vec<_> = self.corners.iter().copied().flat_map(edges).collect();
        all.sort_unstable();
        let single = |&[a, b]: &[u32; 2]| all.binary_search(&[b, a]).is_err();
        all.iter().copied().filter(single).collect()
    }
}

fn check(corners: &[[f64; 2]], size: f64) -> Result<(), BlockFault> {
    let wrong = |problem: String| Err(fault("shape.polygon", problem));
    let count = corners.len();
    if count < 3 {
        return wrong(format!("{count} corners; expected at least 3"));
    }
    let far = |corner: &&[f64; 2]| !corner.iter().all(|x| x.abs() <= FARTHEST);
    if let Some(corner) = corners.iter().find(far) {
        return wrong(format!(
            "corner {} is not within {} m of the origin",
            coordinates(corner),
            short(FARTHEST)
        ));
    }
    if !(size.is_finite() && size > 0.0) {
        return Err(fault(
            "shape.size",
            format!("{} m must be a positive length", short(size)),
        ));
    }
    check_sides(corners)?;
    let estimate = estimate(corners, size);
    // NaN counts as too many.
    if !matches!(estimate.partial_cmp(&MOST_ELEMENTS), Some(Ordering::Less)) {
        let problem = format!(
            "{} m makes about {} elements, more than {}; choose a larger size",
            short(size),
            significant(estimate, 2),
            short(MOST_ELEMENTS)
        );
        return Err(fault("shape.size", problem));
    }
    Ok(())
}

/// Refuses sides without length and sides that touch each other.
fn check_sides(corners: &[[f64; 2]]) -> Result<(), BlockFault> {
    let wrong = |problem: String| Err(fault("shape.polygon", problem));
    let count = corners.len();
    for k in 0..count {
        let [a, b, c] = [0, 1, 2].map(|i| corners[(k + i) % count]);
        if a == b {
            let problem = format!(
                "side {} has no length: corner {} stands twice in a row; leave out one (the last \
                 side, from the last corner to the first, closes the polygon)",
                k + 1,
                coordinates(&a)
            );
            return wrong(problem);
        }
        let straight = turn(a, b, c) == 0.0;
        if straight && dot(&sub(&b, &a), &sub(&c, &b)) < 0.0 {
            let corner = coordinates(&b);
            return wrong(format!(
                "the boundary turns back on itself at corner {corner}"
            ));
        }
    }
    for i in 0..count {
        for j in i + 2..count - usize::from(i == 0) {
            let side = |k: usize| [corners[k], corners[(k + 1) % count]];
            if touch(side(i), side(j)) {
                let [i, j] = [i + 1, j + 1];
                return wrong(format!(
                    "sides {i} and {j} cross or touch; list the corners in order around it"
                ));
            }
        }
    }
    Ok(())
}

/// Estimates the number of elements: the number of equilateral triangles that fill the polygon,
/// plus the number of pieces of its sides, which is the larger one if the polygon is thin.
fn estimate(corners: &[[f64; 2]], size: f64) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let sides: f64 = corners
        .iter()
        .zip(next)
        .map(|(&a, &b)| distance(a, b))
        .sum();
    let triangles = area(corners) / (0.25 * 3.0_f64.sqrt() * size * size);
    // A sum, because a maximum would drop NaN.
    triangles + sides / size
}

/// Returns twice the signed area of the triangle abc; the sign is exact.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let [a, b, c] = [a, b, c].map(|[x, y]| robust::Coord { x, y });
    robust::orient2d(a, b, c)
}

/// True if two segments have a point in common.
fn touch([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
    let apart = |i: usize| a[i].max(b[i]) < c[i].min(d[i]) || c[i].max(d[i]) < a[i].min(b[i]);
    let opposite = |s: f64, t: f64| s == 0.0 || t == 0.0 || (s < 0.0) != (t < 0.0);
    !apart(0)
        && !apart(1)
        && opposite(turn(a, b, c), turn(a, b, d))
        && opposite(turn(c, d, a), turn(c, d, b))
}

fn area(corners: &[[f64; 2]]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let origin = corners[0];
    let cross = |(&a, &b): (&[f64; 2], &[f64; 2])| {
        let [a, b] = [sub(&a, &origin), sub(&b, &origin)];
        cross2(&a, &b)
    };
    (corners.iter().zip(next).map(cross).sum::<f64>() / 2.0).abs()
}

/// Smallest angles that are tried in turn, degrees. 30 nearly always works; below 20.7 the
/// refinement is proven to end (Ruppert 1995, as stated by spade).
const ANGLES: [f64; 2] = [30.0, 20.0];

fn triangulate(corners: &[[f64; 2]], size: f64) -> Result<Triangles, BlockFault> {
    let largest = 0.25 * 3.0_f64.sqrt() * size * size;
    // Enough for triangles of a tenth of the allowed area, and for fine corners.
    let most_vertices = (10.0 * area(corners) / largest) as usize + 100 * corners.len() + 10_000;
    for angle in ANGLES {
        let mut delaunay = outline(corners, size)?;
        let parameters = RefinementParameters::new()
            .exclude_outer_faces(true)
            .with_angle_limit(AngleLimit::from_deg(angle))
            // A triangle of exactly the allowed area is not refined.
            .with_max_allowed_area(largest * (1.0 + 1e-9))
            .with_max_additional_vertices(most_vertices);
        let result = delaunay.refine(parameters);
        if result.refinement_complete {
            return Ok(inside(&delaunay, &result.excluded_faces));
        }
    }
    let problem = "the polygon could not be meshed: corners or sides are much closer together \
                   than size; choose a smaller size or fewer corners";
    Err(fault("shape.polygon", problem.into()))
}

/// Triangulates the polygon with its sides as constraints, in pieces no longer than `size`.
fn outline(corners: &[[f64; 2]], size: f64) -> Result<Delaunay, BlockFault> {
    let mut delaunay = Delaunay::new();
    let mut ring = Vec::new();
    for (k, &corner) in corners.iter().enumerate() {
        let next = corners[(k + 1) % corners.len()];
        // A side of exactly n sizes gets n pieces, in spite of rounding.
        let pieces = (distance(corner, next) / size * (1.0 - 1e-9))
            .ceil()
            .max(1.0);
        for piece in 0..pieces as usize {
            let [x, y] = between(corner, next, piece as f64 / pieces);
            let vertex = delaunay.insert(Point2::new(x, y)).map_err(|error| {
                fault("shape.polygon", format!("a corner is not usable: {error}"))
            })?;
            ring.push(vertex);
        }
    }
    for (k, &from) in ring.iter().enumerate() {
        let to = ring[(k + 1) % ring.len()];
        if from == to || !delaunay.can_add_constraint(from, to) {
            let problem = "two sides are closer together than floating-point numbers can resolve";
            return Err(fault("shape.polygon", problem.into()));
        }
        delaunay.add_constraint(from, to);
    }
    Ok(delaunay)
}

/// Returns the triangles that are not `outside`, and only their vertices.
fn inside(delaunay: &Delaunay, outside: &[FixedFaceHandle<InnerTag>]) -> Triangles {
    let mut excluded: Vec<_> = outside.iter().map(|face| face.index()).collect();
    excluded.sort_unstable();
    let mut numbers: BTreeMap<FixedVertexHandle, u32> = BTreeMap::new();
    let mut triangles = Triangles {
        points: Vec::new(),
        corners: Vec::new(),
    };
    for face in delaunay.inner_faces() {
        if excluded.binary_search(&face.fix().index()).is_ok() {
            continue;
        }
        let corners = face.vertices().map(|vertex| {
            *numbers.entry(vertex.fix()).or_insert_with(|| {
                let Point2 { x, y } = vertex.position();
                triangles.points.push([x, y]);
                triangles.points.len() as u32 - 1
            })
        });
        triangles.corners.push(corners);
    }
    triangles
}

/// Cuts each triangle into three quadrilaterals that meet at its centre and at the midpoints of its
/// edges.
fn push_quadrilaterals(
    mesh: &mut RawMesh,
    corners: &[[f64; 2]],
    triangles: &Triangles,
    boundary: &[[u32; 2]],
) {
    let mut middles: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    let mut middle = |mesh: &mut RawMesh, a: u32, b: u32| {
        *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
            let [p, q] = [a, b].map(|n| mesh.points[n as usize]);
            mesh.points.push(between(p, q, 0.5));
            mesh.points.len() as u32 - 1
        })
    };
    for &[a, b, c] in &triangles.corners {
        let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[p, q]| middle(mesh, p, q));
        let inner = mesh.points.len() as u32;
        mesh.points
            .push(centre([a, b, c].iter().map(|&n| mesh.points[n as usize])));
        for quad in [[a, ab, inner, ca], [b, bc, inner, ab], [c, ca, inner, bc]] {
            push(mesh, CellKind::Element(ElementKind::Quad4), &quad, None);
        }
    }
    for &[a, b] in boundary {
        let half = middle(mesh, a, b);
        push_side(mesh, corners, [a, half]);
        push_side(mesh, corners, [half, b]);
    }
}

/// Adds a boundary edge to the group of the polygon side that it lies on.
fn push_side(mesh: &mut RawMesh, corners: &[[f64; 2]], edge: [u32; 2]) {
    let [p, q] = edge.map(|n| mesh.points[n as usize]);
    let [x, y, _] = between(p, q, 0.5);
    let away = |k: usize| {
        let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
        let along = sub(&b, &a);
        let share = dot(&sub(&[x, y], &a), &along) / dot(&along, &along);
        distance([x, y], between(a, b, share.clamp(0.0, 1.0)))
    };
    let side = (0..corners.len()).min_by(|&i, &j| away(i).total_cmp(&away(j)));
    push(mesh, facet_kind(2), &edge, side);
}
