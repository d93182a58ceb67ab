//! Contact Jacobians in 3-D.

use crate::contact::narrow_phase::edge_edge::NormalRotation;
use crate::contact::narrow_phase::point_triangle::TriangleMotion;
use crate::contact::surface::boundary_3d::Boundary3d;
use crate::contact::surface::{Configuration, ContactJacobian, JacobianAnchor, Pair};
use crate::math::vector::{add_scaled, cross, dot, norm, scale, sub};

impl Boundary3d {
    /// Assembles the Jacobian of a pair of a vertex and a triangle, with the point of the triangle
    /// at `foot`.
    pub(crate) fn jacobian_of_point_triangle(
        &self,
        jacobian: &mut ContactJacobian<3>,
        pair: Pair,
        foot: &[f64; 2],
        at: Configuration<3>,
    ) {
        let p = self.triangulation.point(pair.main, at);
        let points = self.triangulation.triangle(pair.target, at);
        let weights = [1.0 - foot[0] - foot[1], foot[0], foot[1]];
        let material = TriangleMotion::new(&p, &points, &weights);
        let frame = frame(material.normal(), &sub(&points[1], &points[0]));
        let corners = self.triangulation.triangles[pair.target as usize].corners;
        let corners = [pair.main, corners[0], corners[1], corners[2]];
        let rows = |direction: &[f64; 3]| {
            let [a, b, c] = material.rows(direction).map(|row| scale(-1.0, &row));
            [*direction, a, b, c]
        };
        set_frame(jacobian, frame, material.offset());
        self.set_rows(jacobian, corners, &frame.map(|direction| rows(&direction)));
    }

    /// Assembles the Jacobian of the points at an anchor of two edges.
    pub(crate) fn jacobian_of_edge_edge(
        &self,
        jacobian: &mut ContactJacobian<3>,
        [main, target]: [u32; 2],
        anchor: JacobianAnchor<3>,
        at: Configuration<3>,
    ) {
        let [one, other] = [main, target].map(|edge| self.triangulation.edge(edge, at));
        let outward = anchor.along.copied();
        let outward = outward.unwrap_or_else(|| self.outward(main, target, at));
        let lines = self.lines(main, target, at);
        let crossing = lines.map(|lines| lines.between(&outward));
        let along = sub(&one[1], &one[0]);
        let are_parallel = crossing.is_none();
        let normal = crossing.map_or_else(
            || {
                let outward = self.triangulation.outward(target, at);
                scale(1.0 / norm(&outward), &outward)
            },
            |crossing| crossing.normal,
        );
        let pivot = NormalRotation::new([&one, &other], anchor.foot, &normal, are_parallel);
        let [main, target] =
            [main, target].map(|edge| self.triangulation.edges[edge as usize].ends);
        let corners = [main[0], main[1], target[0], target[1]];
        let frame = frame(&normal, &along);
        set_frame(jacobian, frame, pivot.offset());
        self.set_rows(
            jacobian,
            corners,
            &frame.map(|direction| pivot.rows(&direction)),
        );
    }

    /// Sets the rows of a Jacobian by the coefficients of four corners, one list for each direction
    /// of the frame.
    fn set_rows(
        &self,
        jacobian: &mut ContactJacobian<3>,
        corners: [u32; 4],
        rows: &[[[f64; 3]; 4]; 3],
    ) {
        jacobian.count = 0;
        for (c, corner) in corners.into_iter().enumerate() {
            let nodes = self.triangulation.nodes_of_corner(corner);
            let share = 1.0 / nodes.len() as f64;
            for &node in nodes {
                let known = jacobian.nodes().iter().position(|&other| other == node);
                let k = known.unwrap_or(jacobian.count);
                if known.is_none() {
                    jacobian.nodes[k] = node;
                    jacobian.rows[k] = [[0.0; 3]; 3];
                    jacobian.count += 1;
                }
                for r in 0..3 {
                    add_scaled(&mut jacobian.rows[k][r], share, &rows[r][c]);
                }
            }
        }
    }
}

/// Sets the frame of a Jacobian, and its offset from the target point to the main point, m.
fn set_frame(jacobian: &mut ContactJacobian<3>, frame: [[f64; 3]; 3], offset: &[f64; 3]) {
    jacobian.frame = frame;
    jacobian.offset = frame.map(|direction| dot(&direction, offset));
}

/// Returns a unit normal and two unit tangents, the first in the plane of `along`.
pub(super) fn frame(normal: &[f64; 3], along: &[f64; 3]) -> [[f64; 3]; 3] {
    let mut tangent = *along;
    add_scaled(&mut tangent, -dot(along, normal), normal);
    let tangent = scale(1.0 / norm(&tangent), &tangent);
    [*normal, tangent, cross(normal, &tangent)]
}
