//! Normal-cone tests of feature pairs, and the walk to neighbouring features.

use crate::contact::narrow_phase::point_triangle::PointTriangle;
use crate::contact::surface::boundary_3d::Boundary3d;
use crate::contact::surface::{Configuration, Distance, Pair, beyond_reentrant};
use crate::contact::tolerances::{FARTHEST_BEYOND, FLUSH, FOOT_ROUND_OFF};
use crate::math::vector::{add, cross, dot, norm, scale, sub};
use crate::mesh::distance_to;

impl Boundary3d {
    /// Returns true if the foot of a vertex lies on a triangle, or beyond its edges in one of two
    /// cases:
    /// - The edge is [re-entrant](beyond_reentrant), and the vertex may be up to `depth` in the
    ///   face on its other side.
    /// - The vertex is within `depth` of the triangle, and a face of it lies flush on the triangle.
    ///   The rims of two faces that end together are nearly parallel and cross many times.
    pub(crate) fn foot_is_on(
        &self,
        pair: Pair,
        facing: &PointTriangle,
        at: Configuration<3>,
        depth: f64,
    ) -> bool {
        let (vertex, triangle) = (pair.main, pair.target);
        let is_near = || {
            let points = self.triangulation.triangle(triangle, at);
            distance_to(&points, self.triangulation.point(vertex, at)) <= depth
        };
        let inward = |k: usize| {
            let points = self.triangulation.triangle(triangle, at);
            let along = sub(&points[(k + 1) % 3], &points[k]);
            cross(&facing.normal, &scale(1.0 / norm(&along), &along))
        };
        (0..3).all(|k| {
            let inside = facing.inside(k);
            let slack = FOOT_ROUND_OFF * facing.heights[k];
            let edge = self.triangulation.triangles[triangle as usize].edges[k];
            inside >= -slack
                || inside >= -slack - beyond_reentrant(self.triangulation.turn(edge, at), depth)
                || inside >= -slack - depth
                    && is_near()
                    && self.has_flush_edge_into(vertex, &facing.normal, &inward(k), at)
        })
    }

    /// Returns true if the feet of two edges that cross lie on them. Also returns true if a foot
    /// lies beyond an end at which a [re-entrant](beyond_reentrant) edge begins, by no more than
    /// `depth` in a face beside that edge allows.
    pub(crate) fn feet_are_on(
        &self,
        edges: [u32; 2],
        foot: &[f64; 2],
        at: Configuration<3>,
        depth: f64,
    ) -> bool {
        edges.iter().zip(foot).all(|(&edge, &foot)| {
            let beyond = (-foot).max(foot - 1.0) - FOOT_ROUND_OFF;
            let end = self.triangulation.edges[edge as usize].ends[usize::from(foot > 0.5)];
            let beyond = beyond * self.length(edge, at);
            beyond <= 0.0
                || beyond <= FARTHEST_BEYOND * depth
                    && beyond <= beyond_reentrant(self.least_turn(end, at), depth)
        })
    }

    /// Returns true if two triangles face each other, as those of a re-entrant corner.
    pub(crate) fn face_each_other(&self, triangles: [u32; 2], at: Configuration<3>) -> bool {
        let faces = |from: u32, to: u32| {
            let [a, b, c] = self.triangulation.triangle(to, at);
            let middle = scale(1.0 / 3.0, &add(&add(&a, &b), &c));
            let way = sub(&middle, &self.triangulation.triangle(from, at)[0]);
            dot(&way, &self.triangulation.normal(from, at)) > FLUSH * norm(&way)
        };
        let [one, other] = triangles;
        let edges = triangles.map(|triangle| self.triangulation.triangles[triangle as usize].edges);
        match edges[0].iter().find(|edge| edges[1].contains(edge)) {
            Some(&shared) if one != other => self.triangulation.turn(shared, at) < -FLUSH,
            _ => faces(one, other) && faces(other, one),
        }
    }

    /// Returns true if two edges that meet in a corner are rims of triangles that face each other,
    /// seen along the `outward` normals of their contacts.
    pub(crate) fn rims_face_each_other(
        &self,
        edges: [u32; 2],
        outward: [[f64; 3]; 2],
        at: Configuration<3>,
    ) -> bool {
        let [ends, others] = edges.map(|edge| self.triangulation.edges[edge as usize].ends);
        let Some(&corner) = ends.iter().find(|end| others.contains(end)) else {
            return false;
        };
        let rises = |edge: u32, normal: &[f64; 3]| {
            let away = self.triangulation.away(corner, edge, at);
            dot(&away, normal) > FLUSH * norm(&away)
        };
        edges[0] != edges[1] && rises(edges[1], &outward[0]) && rises(edges[0], &outward[1])
    }

    /// Returns the least turn of the edges at a corner, rad.
    fn least_turn(&self, corner: u32, at: Configuration<3>) -> f64 {
        let edges = self.triangulation.edges_at(corner).iter();
        let turns = edges.map(|&edge| self.triangulation.turn(edge, at));
        turns.fold(f64::MAX, f64::min)
    }

    /// Returns true if an edge of a vertex lies in the plane with a normal, and leads to the side of
    /// the direction `inward` in it.
    fn has_flush_edge_into(
        &self,
        vertex: u32,
        normal: &[f64; 3],
        inward: &[f64; 3],
        at: Configuration<3>,
    ) -> bool {
        self.triangulation.edges_at(vertex).iter().any(|&edge| {
            let away = self.triangulation.away(vertex, edge, at);
            let slack = FLUSH * norm(&away);
            dot(&away, normal).abs() <= slack && dot(&away, inward) > slack
        })
    }

    /// Returns the least height of the edges from a vertex over a plane with this normal: the sine
    /// of the angle with the plane.
    pub(crate) fn least_cone_margin_at_vertex(
        &self,
        vertex: u32,
        normal: &[f64; 3],
        at: Configuration<3>,
    ) -> f64 {
        let edges = self.triangulation.edges_at(vertex).iter();
        let heights = edges.map(|&edge| {
            let away = self.triangulation.away(vertex, edge, at);
            dot(&away, normal) / norm(&away)
        });
        heights.fold(f64::MAX, f64::min)
    }

    /// Returns the least height of the faces beside the main edge over a plane with this normal,
    /// and of those beside the target edge under it: the sine of the angle with the plane.
    pub(crate) fn least_cone_margin_at_edges(
        &self,
        edges: [u32; 2],
        normal: &[f64; 3],
        at: Configuration<3>,
    ) -> f64 {
        let of = |(edge, sign): (u32, f64)| {
            let sides = self.triangulation.directions_into_sides(edge, at);
            let heights = sides.into_iter().flatten();
            heights.map(move |into| sign * dot(&into, normal))
        };
        let both = edges.into_iter().zip([1.0, -1.0]);
        both.flat_map(of).fold(f64::MAX, f64::min)
    }

    /// Returns true if a normal points out of the block of the target edge and into that of the main
    /// edge. Without this test, flat edges beside each other in faces that end together, as those of
    /// a wall, press against each other: a wall got ten times its energy.
    pub(crate) fn is_between(
        &self,
        edges: [u32; 2],
        normal: &[f64; 3],
        at: Configuration<3>,
    ) -> bool {
        let [main, target] = edges.map(|edge| dot(&self.triangulation.outward(edge, at), normal));
        // Two unit normals each.
        main <= 2.0 * FLUSH && target >= -2.0 * FLUSH
    }

    /// Returns the pair of a vertex that leaves a triangle with the next triangle beyond the edge;
    /// `None` if the surface turns by a right angle or more there.
    pub(crate) fn next_triangle(
        &self,
        vertex: u32,
        triangle: u32,
        at: Configuration<3>,
    ) -> Option<Pair> {
        let (k, _) = self.point_triangle(vertex, triangle, at).foot_distance();
        let next = self.triangulation.across(triangle, k)?;
        let pair = Self::face_pair(vertex, next);
        let turn = dot(
            &self.triangulation.normal(triangle, at),
            &self.triangulation.normal(next, at),
        );
        (turn > 0.0 && self.in_normal_cone(pair, at)).then_some(pair)
    }

    /// Returns the pair of a point that leaves one of two edges at an end with the next edge there.
    /// The next edge turns by less than half a right angle, and is the one nearest to the point.
    pub(crate) fn next_edge(
        &self,
        edges: [u32; 2],
        foot: &[f64; 2],
        at: Configuration<3>,
    ) -> Option<Pair> {
        let beyond = |k: usize| (-foot[k]).max(foot[k] - 1.0) * self.length(edges[k], at);
        let k = usize::from(beyond(1) > beyond(0));
        let end = self.triangulation.edges[edges[k] as usize].ends[usize::from(foot[k] > 0.5)];
        let back = self.triangulation.away(end, edges[k], at);
        let straight = |edge: u32| {
            let on = self.triangulation.away(end, edge, at);
            -dot(&on, &back) / (norm(&on) * norm(&back))
        };
        let length = self.length(edges[1 - k], at);
        let beside = self.triangulation.edges_at(end).iter().copied();
        let others = beside.filter(|&edge| {
            edge != edges[k]
                && straight(edge) > std::f64::consts::FRAC_1_SQRT_2
                && self.triangulation.is_sharp_under(edge, length, at)
        });
        // The rim of a thin plate bends, and on its narrow side a diagonal goes on too.
        let pairs = others.map(|edge| self.edge_pair(edge, edges[1 - k]));
        let outside = |pair: &Pair| self.project(*pair, at).outside;
        let admitted = pairs.filter(|&pair| self.in_normal_cone(pair, at));
        admitted.min_by(|one, other| outside(one).total_cmp(&outside(other)))
    }
}
