//! Differences of encounters in 2-D and 3-D.

use crate::contact::surface::Surface;
use crate::contact::surface::boundary_2d::Boundary2d;
use crate::contact::surface::boundary_3d::Boundary3d;
use crate::contact::verification::oracle::TOLERANCE;
use crate::math::vector::{cross, sub};
use crate::mesh::{ElementKind, Mesh};

/// A dimension: its cells, surfaces and possible separating axes.
pub(super) trait OracleSpace<const D: usize> {
    const KINDS: &'static [ElementKind];
    /// Element kind of squares and cubes.
    const BOX: ElementKind;
    fn surface(mesh: &Mesh<D>) -> Box<dyn Surface<D>>;
    /// Returns the points in 2-D; in 3-D those at height −½, then at ½.
    fn layers(base: &[[f64; 2]]) -> Vec<[f64; D]>;
    fn corners(kind: ElementKind) -> Vec<[f64; D]>;
    /// Returns the possible normals of a separating plane.
    fn axes(faces: [Vec<Vec<[f64; D]>>; 2]) -> Vec<[f64; D]>;
    /// Returns the vector rotated by some angles.
    fn turn(x: &[f64; D], angles: [f64; 3]) -> [f64; D];
}

const SQUARE: [[f64; 2]; 4] = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
const TRIANGLE: [[f64; 2]; 3] = [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5]];

pub(super) struct InPlane;

impl OracleSpace<2> for InPlane {
    const KINDS: &'static [ElementKind] = &[ElementKind::Tri3, ElementKind::Quad4];
    const BOX: ElementKind = ElementKind::Quad4;

    fn surface(mesh: &Mesh<2>) -> Box<dyn Surface<2>> {
        Box::new(Boundary2d::new(mesh, 1.0))
    }

    fn layers(base: &[[f64; 2]]) -> Vec<[f64; 2]> {
        base.to_vec()
    }

    fn corners(kind: ElementKind) -> Vec<[f64; 2]> {
        match kind {
            ElementKind::Tri3 => TRIANGLE.to_vec(),
            _ => SQUARE.to_vec(),
        }
    }

    fn axes(faces: [Vec<Vec<[f64; 2]>>; 2]) -> Vec<[f64; 2]> {
        let along = |face: &Vec<[f64; 2]>| sub(&face[1], &face[0]);
        let edges = faces.iter().flatten().map(along);
        edges.map(|[x, y]| [y, -x]).collect()
    }

    fn turn([x, y]: &[f64; 2], [angle, ..]: [f64; 3]) -> [f64; 2] {
        let (s, c) = angle.sin_cos();
        [c * x - s * y, s * x + c * y]
    }
}

pub(super) struct InSpace;

impl OracleSpace<3> for InSpace {
    const KINDS: &'static [ElementKind] =
        &[ElementKind::Tet4, ElementKind::Wedge6, ElementKind::Hex8];
    const BOX: ElementKind = ElementKind::Hex8;

    fn surface(mesh: &Mesh<3>) -> Box<dyn Surface<3>> {
        Box::new(Boundary3d::new(mesh, TOLERANCE))
    }

    fn layers(base: &[[f64; 2]]) -> Vec<[f64; 3]> {
        let at = |z: f64| base.iter().map(move |[x, y]| [*x, *y, z]);
        at(-0.5).chain(at(0.5)).collect()
    }

    fn corners(kind: ElementKind) -> Vec<[f64; 3]> {
        match kind {
            ElementKind::Tet4 => Self::layers(&TRIANGLE)[..4].to_vec(),
            ElementKind::Wedge6 => Self::layers(&TRIANGLE),
            _ => Self::layers(&SQUARE),
        }
    }

    fn axes(faces: [Vec<Vec<[f64; 3]>>; 2]) -> Vec<[f64; 3]> {
        let normal =
            |face: &Vec<[f64; 3]>| cross(&sub(&face[1], &face[0]), &sub(&face[2], &face[0]));
        let mut axes: Vec<[f64; 3]> = faces.iter().flatten().map(normal).collect();
        // Each edge belongs to two faces, in opposite directions.
        let edges = faces.map(|faces| {
            let along = |face: Vec<[f64; 3]>| {
                let next = face.clone().into_iter().cycle().skip(1);
                let sides = face.into_iter().zip(next).filter(|(a, b)| a < b);
                sides.map(|(a, b)| sub(&b, &a)).collect::<Vec<_>>()
            };
            faces.into_iter().flat_map(along).collect::<Vec<_>>()
        });
        for one in &edges[0] {
            axes.extend(edges[1].iter().map(|other| cross(one, other)));
        }
        axes
    }

    fn turn(x: &[f64; 3], angles: [f64; 3]) -> [f64; 3] {
        let mut x = *x;
        for (axis, angle) in angles.into_iter().enumerate() {
            let (s, c) = angle.sin_cos();
            let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
            (x[i], x[j]) = (c * x[i] - s * x[j], s * x[i] + c * x[j]);
        }
        x
    }
}
