//! The narrow phase in 3-D: vertices against triangles, edges against edges.

use std::ops::Range;

use crate::contact::narrow_phase::classification::FeatureSet;
use crate::contact::narrow_phase::edge_edge::{self, EdgeEdge, LinePair};
use crate::contact::narrow_phase::point_triangle::PointTriangle;
use crate::contact::surface::boundary_3d::{Boundary3d, FeaturePair};
use crate::contact::surface::contact_kind::ContactKind;
use crate::contact::surface::{
    Configuration, ContactGeometry, ContactJacobian, Distance, JacobianAnchor, MaterialPoint, Pair,
    Pairs, Projection,
};
use crate::contact::tolerances::FLUSH;
use crate::math::vector::{add_scaled, dot, norm, scale, sub};
use crate::mesh::distance_to;

impl Boundary3d {
    pub(crate) fn point_triangle(
        &self,
        vertex: u32,
        triangle: u32,
        at: Configuration<3>,
    ) -> PointTriangle {
        let p = self.triangulation.point(vertex, at);
        PointTriangle::new(&p, &self.triangulation.triangle(triangle, at))
    }

    pub(crate) fn edge_edge(
        &self,
        main: u32,
        target: u32,
        at: Configuration<3>,
    ) -> Option<EdgeEdge> {
        let lines = self.lines(main, target, at)?;
        Some(lines.between(&self.outward(main, target, at)))
    }

    pub(crate) fn lines(&self, main: u32, target: u32, at: Configuration<3>) -> Option<LinePair> {
        let [one, other] = [main, target].map(|edge| self.triangulation.edge(edge, at));
        let slope = || {
            let [one, other] = [main, target].map(|edge| self.triangulation.slope(edge, at));
            f64::max(one, other)
        };
        LinePair::new(&one, &other, self.triangulation.resolution, slope)
    }

    /// Returns a direction out of the target edge and into the main edge.
    pub(crate) fn outward(&self, main: u32, target: u32, at: Configuration<3>) -> [f64; 3] {
        sub(
            &self.triangulation.outward(target, at),
            &self.triangulation.outward(main, at),
        )
    }

    /// Returns the length of an edge, m.
    pub(crate) fn length(&self, edge: u32, at: Configuration<3>) -> f64 {
        let [a, b] = self.triangulation.edge(edge, at);
        norm(&sub(&b, &a))
    }
}

impl Distance<3> for Boundary3d {
    fn distance(&self, pair: Pair, at: Configuration<3>) -> f64 {
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { vertex, triangle } => {
                let p = self.triangulation.point(vertex, at);
                distance_to(&self.triangulation.triangle(triangle, at), p)
            }
            FeaturePair::EdgeEdge { main, target } => {
                let [main, target] = [main, target].map(|edge| self.triangulation.edge(edge, at));
                edge_edge::distance(&main, &target)
            }
        }
    }

    fn exclusion(&self, pair: Pair, at: Configuration<3>, resolution: f64) -> f64 {
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { .. } => self.exclusion_of_point(pair, at, resolution),
            FeaturePair::EdgeEdge { main, target } => {
                self.exclusion_of_edges([main, target], at, resolution)
            }
        }
    }

    fn is_reentrant_pair(&self, one: Pair, other: Pair, at: Configuration<3>) -> bool {
        match [one, other].map(|pair| self.feature_pair(pair)) {
            [
                FeaturePair::PointTriangle { vertex, triangle },
                FeaturePair::PointTriangle {
                    vertex: second,
                    triangle: beside,
                },
            ] => vertex == second && self.face_each_other([triangle, beside], at),
            [
                FeaturePair::EdgeEdge { main, target },
                FeaturePair::EdgeEdge {
                    main: second,
                    target: beside,
                },
            ] => {
                let outward = [one, other].map(|pair| self.normal(pair, at));
                let [Some(normal), Some(other)] = outward else {
                    return false;
                };
                let into_main = [normal, other];
                main == second && self.rims_face_each_other([target, beside], into_main, at)
                    || target == beside
                        && self.rims_face_each_other(
                            [main, second],
                            into_main.map(|normal| scale(-1.0, &normal)),
                            at,
                        )
            }
            _ => false,
        }
    }

    fn project(&self, pair: Pair, at: Configuration<3>) -> Projection {
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { vertex, triangle } => {
                let facing = self.point_triangle(vertex, triangle, at);
                Projection {
                    gap: facing.gap,
                    foot: [facing.weights[1], facing.weights[2]],
                    outside: facing.foot_distance().1,
                }
            }
            FeaturePair::EdgeEdge { main, target } => match self.edge_edge(main, target, at) {
                Some(crossing) => Projection {
                    gap: crossing.gap,
                    foot: crossing.foot,
                    outside: crossing.foot_distance([main, target].map(|e| self.length(e, at))),
                },
                None => Projection {
                    gap: 0.0,
                    foot: [0.5; 2],
                    outside: f64::INFINITY,
                },
            },
        }
    }

    fn gap(&self, pair: Pair, at: Configuration<3>, along: Option<&[f64; 3]>) -> Option<f64> {
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { vertex, triangle } => {
                let corner = self.triangulation.triangles[triangle as usize].corners[0];
                let [p, a] = [vertex, corner].map(|of| self.triangulation.point(of, at));
                Some(dot(&sub(&p, &a), &self.triangulation.normal(triangle, at)))
            }
            FeaturePair::EdgeEdge { main, target } => {
                let lines = self.lines(main, target, at)?;
                let outward = along.map_or_else(|| self.outward(main, target, at), |along| *along);
                Some(lines.between(&outward).gap)
            }
        }
    }

    fn normal(&self, pair: Pair, at: Configuration<3>) -> Option<[f64; 3]> {
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { triangle, .. } => {
                Some(self.triangulation.normal(triangle, at))
            }
            FeaturePair::EdgeEdge { main, target } => self
                .edge_edge(main, target, at)
                .map(|crossing| crossing.normal),
        }
    }

    fn in_normal_cone(&self, pair: Pair, at: Configuration<3>) -> bool {
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { vertex, triangle } => {
                let normal = self.triangulation.normal(triangle, at);
                self.least_cone_margin_at_vertex(vertex, &normal, at) >= -FLUSH
            }
            FeaturePair::EdgeEdge { main, target } => {
                let crossing = self.edge_edge(main, target, at);
                crossing.is_some_and(|crossing| {
                    self.least_cone_margin_at_edges([main, target], &crossing.normal, at) >= -FLUSH
                        && self.is_between([main, target], &crossing.normal, at)
                })
            }
        }
    }

    fn normal_separates(&self, pair: Pair, at: Configuration<3>) -> bool {
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { .. } => true,
            FeaturePair::EdgeEdge { .. } => self.in_normal_cone(pair, at),
        }
    }

    fn target_size(&self, target: u32, at: Configuration<3>) -> f64 {
        match target.checked_sub(self.triangulation.triangles.len() as u32) {
            None => {
                let edges = self.triangulation.triangles[target as usize].edges;
                edges
                    .map(|edge| self.length(edge, at))
                    .into_iter()
                    .fold(0.0, f64::max)
            }
            Some(edge) => self.length(edge, at),
        }
    }

    fn point(&self, pair: Pair, at: Configuration<3>) -> [f64; 3] {
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { vertex, .. } => self.triangulation.point(vertex, at),
            FeaturePair::EdgeEdge { main, target } => {
                let lines = self.lines(main, target, at);
                let foot = lines.map_or(0.5, |lines| lines.foot[0]);
                let [a, b] = self.triangulation.edge(main, at);
                let mut point = a;
                add_scaled(&mut point, foot, &sub(&b, &a));
                point
            }
        }
    }
}

impl ContactGeometry<3> for Boundary3d {
    fn adjacent_pairs(&self, pair: Pair, at: Configuration<3>, resolution: f64) -> Pairs {
        FeatureSet::pairs(self, pair, at, resolution)
    }

    fn pairs_of_edge_ends(&self, pair: Pair, at: Configuration<3>) -> Pairs {
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { vertex, triangle } => {
                let (k, _) = self.point_triangle(vertex, triangle, at).foot_distance();
                let edge = self.triangulation.triangles[triangle as usize].edges[k];
                let ends = self.triangulation.edges[edge as usize].ends.into_iter();
                let ends = ends.filter(|&end| end < self.triangulation.vertex_count);
                let faces = self.triangulation.triangles_at(vertex).iter();
                ends.flat_map(|end| faces.clone().map(move |&face| Self::face_pair(end, face)))
                    .collect()
            }
            // The end is near the crossing, so its pairs are adjacent.
            FeaturePair::EdgeEdge { .. } => Pairs::new(),
        }
    }

    fn neighbour(&self, pair: Pair, foot: &[f64; 2], at: Configuration<3>) -> Option<Pair> {
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { vertex, triangle } => {
                self.next_triangle(vertex, triangle, at)
            }
            FeaturePair::EdgeEdge { main, target } => self.next_edge([main, target], foot, at),
        }
    }

    fn assemble_jacobian(
        &self,
        jacobian: &mut ContactJacobian<3>,
        pair: Pair,
        anchor: JacobianAnchor<3>,
        at: Configuration<3>,
    ) {
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { .. } => {
                self.jacobian_of_point_triangle(jacobian, pair, anchor.foot, at);
            }
            FeaturePair::EdgeEdge { main, target } => {
                self.jacobian_of_edge_edge(jacobian, [main, target], anchor, at);
            }
        }
    }

    fn material_points(
        &self,
        pair: Pair,
        foot: &[f64; 2],
        rest: Configuration<3>,
    ) -> [MaterialPoint<3>; 2] {
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { vertex, triangle } => [
                self.material_point_at_vertex(vertex, rest),
                self.material_point_on_triangle(triangle, foot, rest),
            ],
            FeaturePair::EdgeEdge { main, target } => [
                self.material_point_on_edge(main, foot[0], rest),
                self.material_point_on_edge(target, foot[1], rest),
            ],
        }
    }

    fn locate(
        &self,
        marks: &[MaterialPoint<3>; 2],
        nodes: [Range<u32>; 2],
        rest: Configuration<3>,
    ) -> Option<(Pair, [f64; 2])> {
        self.find_material_points(marks, nodes, rest)
    }

    fn classify(&self, pair: Pair, at: Configuration<3>, resolution: f64) -> (ContactKind, f64) {
        let places = FeatureSet::both(self, pair, at, resolution);
        (
            FeatureSet::kind(self, pair, &places, at),
            self.tributary_area(pair, &places, at, resolution),
        )
    }
}
