//! Material points on features, found again on another mesh of the same blocks.

use std::ops::Range;

use crate::contact::narrow_phase::point_triangle::PointTriangle;
use crate::contact::surface::boundary_3d::Boundary3d;
use crate::contact::surface::{Configuration, FeatureKind, MaterialPoint, Pair};
use crate::contact::tolerances::SAME_FEATURE_ANGLE;
use crate::math::vector::{add, add_scaled, cross, dot, norm, scale, sub};

impl Boundary3d {
    pub(super) fn material_point_at_vertex(
        &self,
        vertex: u32,
        rest: Configuration<3>,
    ) -> MaterialPoint<3> {
        MaterialPoint {
            position: self.triangulation.point(vertex, rest),
            kind: FeatureKind::Vertex,
            outward: self.outward_at(vertex, rest),
        }
    }

    pub(super) fn material_point_on_edge(
        &self,
        edge: u32,
        foot: f64,
        rest: Configuration<3>,
    ) -> MaterialPoint<3> {
        let [a, b] = self.triangulation.edge(edge, rest);
        let along = sub(&b, &a);
        let mut place = a;
        add_scaled(&mut place, foot, &along);
        MaterialPoint {
            position: place,
            kind: FeatureKind::Edge(scale(1.0 / norm(&along), &along)),
            outward: self.triangulation.outward(edge, rest),
        }
    }

    pub(super) fn material_point_on_triangle(
        &self,
        triangle: u32,
        foot: &[f64; 2],
        rest: Configuration<3>,
    ) -> MaterialPoint<3> {
        let [a, b, c] = self.triangulation.triangle(triangle, rest);
        let mut place = a;
        add_scaled(&mut place, foot[0], &sub(&b, &a));
        add_scaled(&mut place, foot[1], &sub(&c, &a));
        MaterialPoint {
            position: place,
            kind: FeatureKind::Face,
            outward: self.triangulation.normal(triangle, rest),
        }
    }

    /// Returns the sum of the normals of the triangles at a vertex.
    fn outward_at(&self, vertex: u32, rest: Configuration<3>) -> [f64; 3] {
        let triangles = self.triangulation.triangles_at(vertex).iter();
        let normals = triangles.map(|&triangle| self.triangulation.normal(triangle, rest));
        normals.fold([0.0; 3], |sum, normal| add(&sum, &normal))
    }

    /// Returns the pair at two material points, on the blocks with these node ranges, and its foot
    /// point.
    pub(super) fn find_material_points(
        &self,
        [main, target]: &[MaterialPoint<3>; 2],
        [own, others]: [Range<u32>; 2],
        rest: Configuration<3>,
    ) -> Option<(Pair, [f64; 2])> {
        match (main.kind, target.kind) {
            (FeatureKind::Vertex, FeatureKind::Face) => {
                let vertices = 0..self.triangulation.vertex_count;
                let vertices =
                    self.of_block(vertices, &own, |v| self.triangulation.nodes_of_corner(v)[0]);
                let is_there =
                    |&vertex: &u32| self.triangulation.point(vertex, rest) == main.position;
                let unlike = |&vertex: &u32| main.is_on_other_side(&self.outward_at(vertex, rest));
                let vertex = vertices.filter(is_there).min_by_key(unlike)?;
                let (triangle, foot) = self.triangle_at(target, &others, rest)?;
                Some((Self::face_pair(vertex, triangle), foot))
            }
            (FeatureKind::Edge(along), FeatureKind::Edge(other)) => {
                let (one, s) = self.edge_at(main, &along, &own, rest)?;
                let (two, t) = self.edge_at(target, &other, &others, rest)?;
                let foot = if one < two { [s, t] } else { [t, s] };
                Some((self.edge_pair(one, two), foot))
            }
            _ => None,
        }
    }

    /// Returns the features among `all` that belong to the block of `nodes`. The features of a
    /// block are contiguous in all lists. `node_of` returns a node of a feature.
    fn of_block(
        &self,
        all: Range<u32>,
        nodes: &Range<u32>,
        node_of: impl Fn(u32) -> u32,
    ) -> Range<u32> {
        let before = |limit: u32| {
            let (mut low, mut high) = (all.start, all.end);
            while low < high {
                let middle = low.midpoint(high);
                if node_of(middle) < limit {
                    low = middle + 1;
                } else {
                    high = middle;
                }
            }
            low
        };
        before(nodes.start)..before(nodes.end)
    }

    fn triangle_at(
        &self,
        mark: &MaterialPoint<3>,
        nodes: &Range<u32>,
        rest: Configuration<3>,
    ) -> Option<(u32, [f64; 2])> {
        let all = 0..self.triangulation.triangles.len() as u32;
        let own = self.of_block(all, nodes, |t| self.triangulation.nodes_of_triangle(t)[0]);
        let beside = own.filter_map(|triangle| {
            let corners = self.triangulation.triangle(triangle, rest);
            if !is_about(&mark.position, &corners) {
                return None;
            }
            let facing = PointTriangle::new(&mark.position, &corners);
            let size = facing.heights.into_iter().fold(f64::INFINITY, f64::min);
            let turned = norm(&sub(&facing.normal, &mark.outward));
            let outside = -facing.weights.into_iter().fold(f64::INFINITY, f64::min);
            let is_part = turned <= SAME_FEATURE_ANGLE
                && facing.gap.abs() <= SAME_FEATURE_ANGLE * size
                && outside <= SAME_FEATURE_ANGLE;
            is_part.then_some((triangle, facing.weights, outside))
        });
        let (triangle, weights, _) = beside.min_by(|a, b| a.2.total_cmp(&b.2))?;
        Some((
            triangle,
            [weights[1], weights[2]].map(|w| w.clamp(0.0, 1.0)),
        ))
    }

    fn edge_at(
        &self,
        mark: &MaterialPoint<3>,
        direction: &[f64; 3],
        nodes: &Range<u32>,
        rest: Configuration<3>,
    ) -> Option<(u32, f64)> {
        let all = 0..self.triangulation.edges.len() as u32;
        let own = self.of_block(all, nodes, |e| self.triangulation.nodes_of_edge(e)[0]);
        let along = own.filter_map(|edge| {
            let [a, b] = self.triangulation.edge(edge, rest);
            if !is_about(&mark.position, &[a, b]) {
                return None;
            }
            let (side, from) = (sub(&b, &a), sub(&mark.position, &a));
            let length = norm(&side);
            let foot = dot(&from, &side) / (length * length);
            let turned = norm(&cross(&side, direction)) / length;
            let beside = norm(&cross(&from, direction));
            let outside = (-foot).max(foot - 1.0);
            let is_part = turned <= SAME_FEATURE_ANGLE
                && beside <= SAME_FEATURE_ANGLE * length
                && outside <= SAME_FEATURE_ANGLE;
            let unlike = || mark.is_on_other_side(&self.triangulation.outward(edge, rest));
            is_part.then(|| (edge, foot.clamp(0.0, 1.0), (unlike(), outside)))
        });
        let better = |a: &(bool, f64), b: &(bool, f64)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1));
        let (edge, foot, _) = along.min_by(|a, b| better(&a.2, &b.2))?;
        Some((edge, foot))
    }
}

/// Returns true if a position is in the box around some corners, or as near to it as
/// [`SAME_FEATURE_ANGLE`] allows. This rejects far positions at less cost than a normal.
fn is_about<const N: usize>(place: &[f64; 3], corners: &[[f64; 3]; N]) -> bool {
    let spans = [0, 1, 2].map(|c| {
        let along = corners.iter().map(|corner| corner[c]);
        let low = along.clone().fold(f64::INFINITY, f64::min);
        [low, along.fold(f64::NEG_INFINITY, f64::max)]
    });
    let size: f64 = spans.iter().map(|[low, high]| high - low).sum();
    let beside = 8.0 * SAME_FEATURE_ANGLE * size;
    let within = |(x, [low, high]): (&f64, &[f64; 2])| low - beside <= *x && *x <= high + beside;
    place.iter().zip(&spans).all(within)
}
