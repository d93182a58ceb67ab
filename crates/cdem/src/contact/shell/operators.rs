//! Relative motion of the two points of a contact, as its nodes move.

use super::{Shell, crossing, facing};
use crate::contact::surface::{MAX_NODES, Operator, Positions};
use crate::vector::{add_scaled, cross, dot, norm, scale, sub};

impl Shell {
    /// Of a vertex and the point at `foot` of a triangle.
    pub(super) fn facing_operator(
        &self,
        vertex: u32,
        triangle: u32,
        foot: &[f64; 2],
        at: Positions<3>,
    ) -> Operator<3> {
        let p = self.skin.point(vertex, at);
        let points = self.skin.triangle(triangle, at);
        let weights = [1.0 - foot[0] - foot[1], foot[0], foot[1]];
        let mut offset = p;
        for (point, weight) in points.iter().zip(&weights) {
            add_scaled(&mut offset, -weight, point);
        }
        let frame = frame(
            &self.skin.normal(triangle, at),
            &sub(&points[1], &points[0]),
        );
        let corners = self.skin.triangles[triangle as usize].corners;
        self.assemble(frame, &offset, |direction| {
            let rows = facing::material_rows(&p, &points, &weights, direction);
            let target = corners.into_iter().zip(rows.map(|row| scale(-1.0, &row)));
            std::iter::once((vertex, *direction)).chain(target)
        })
    }

    /// Of the points at `foot` of two edges.
    pub(super) fn crossing_operator(
        &self,
        main: u32,
        target: u32,
        foot: &[f64; 2],
        at: Positions<3>,
    ) -> Operator<3> {
        let [one, other] = [main, target].map(|edge| self.skin.edge(edge, at));
        let along = sub(&one[1], &one[0]);
        let crossing = self.crossing(main, target, at);
        let are_parallel = crossing.is_none();
        let normal = crossing.map_or_else(
            || {
                let outward = self.skin.outward(target, at);
                scale(1.0 / norm(&outward), &outward)
            },
            |crossing| crossing.normal,
        );
        let mut offset = sub(&one[0], &other[0]);
        add_scaled(&mut offset, foot[0], &along);
        add_scaled(&mut offset, -foot[1], &sub(&other[1], &other[0]));
        let ends = [main, target].map(|edge| self.skin.edges[edge as usize].ends);
        self.assemble(frame(&normal, &along), &offset, |direction| {
            let rows =
                crossing::relative_rows(&one, &other, (foot, &normal), are_parallel, direction);
            ends.into_iter().flatten().zip(rows)
        })
    }

    /// The operator of what each corner adds along the directions of a frame.
    fn assemble<I: Iterator<Item = (u32, [f64; 3])>>(
        &self,
        frame: [[f64; 3]; 3],
        offset: &[f64; 3],
        of_direction: impl Fn(&[f64; 3]) -> I,
    ) -> Operator<3> {
        let mut operator = Operator {
            count: 0,
            nodes: [0; MAX_NODES],
            rows: [[[0.0; 3]; MAX_NODES]; 3],
            frame,
            offset: frame.map(|direction| dot(&direction, offset)),
        };
        for (r, direction) in frame.iter().enumerate() {
            for (corner, row) in of_direction(direction) {
                let nodes = self.skin.nodes_of_corner(corner);
                let share = 1.0 / nodes.len() as f64;
                for &node in nodes {
                    let known = operator.nodes().iter().position(|&other| other == node);
                    let k = known.unwrap_or(operator.count);
                    operator.nodes[k] = node;
                    operator.count = operator.count.max(k + 1);
                    add_scaled(&mut operator.rows[r][k], share, &row);
                }
            }
        }
        operator
    }
}

/// A unit normal and two unit tangents, the first in the plane of `along`.
pub(super) fn frame(normal: &[f64; 3], along: &[f64; 3]) -> [[f64; 3]; 3] {
    let mut tangent = *along;
    add_scaled(&mut tangent, -dot(along, normal), normal);
    let tangent = scale(1.0 / norm(&tangent), &tangent);
    [*normal, tangent, cross(normal, &tangent)]
}
