//! Features around a contact point: the pairs that a touch may belong to, and the contact type.
//!
//! The type is found as with shrunken edges (\[Li2015\], section 2): a corner moved a little along
//! an edge or into a face shows if the edge or face lies in the plane of contact too, and on which
//! feature. Only directions count, so that the result does not depend on the size of the move.

use smallvec::{SmallVec, smallvec};

use crate::contact::narrow_phase::point_triangle::PointTriangle;
use crate::contact::surface::boundary_3d::{Boundary3d, FeaturePair};
use crate::contact::surface::contact_kind::ContactKind;
use crate::contact::surface::{Configuration, Distance, Pair, Pairs};
use crate::contact::tolerances::FLUSH;
use crate::math::vector::{add, cross, dot, norm, scale, sub};

/// The features of one block within the resolution of a contact point.
#[derive(Clone, Debug, Default)]
pub(crate) struct FeatureSet {
    vertex: Option<u32>,
    /// Sharp edges.
    edges: FeatureList,
    pub(super) triangles: FeatureList,
}

/// Numbers of features around a point; the usual number needs no heap memory.
pub(super) type FeatureList = SmallVec<[u32; 8]>;

/// Edges and faces of a block in the plane of a contact, seen from its point.
#[derive(Default)]
struct TangentSectors {
    /// Unit directions of sharp edges.
    rays: SmallVec<[[f64; 3]; 4]>,
    /// Corners of faces: pairs of unit directions, counter-clockwise about the contact normal.
    sectors: SmallVec<[Sector; 4]>,
}

/// Two unit directions, at a right angle at most.
type Sector = [[f64; 3]; 2];

impl FeatureSet {
    fn at_vertex(boundary: &Boundary3d, vertex: u32, at: Configuration<3>) -> Self {
        let edges = boundary.triangulation.edges_at(vertex).iter().copied();
        Self {
            vertex: Some(vertex),
            edges: edges
                .filter(|&edge| boundary.triangulation.is_sharp(edge, at))
                .collect(),
            triangles: boundary.triangulation.triangles_at(vertex).into(),
        }
    }

    /// Returns the features around a point of an edge.
    fn on_edge(
        boundary: &Boundary3d,
        edge: u32,
        foot: f64,
        at: Configuration<3>,
        resolution: f64,
    ) -> Self {
        let length = boundary.length(edge, at);
        let end = boundary.triangulation.edges[edge as usize].ends[usize::from(foot > 0.5)];
        if foot.min(1.0 - foot) * length <= resolution && end < boundary.triangulation.vertex_count
        {
            return Self::at_vertex(boundary, end, at);
        }
        let sides = boundary.triangulation.edges[edge as usize].sides;
        Self {
            vertex: None,
            edges: smallvec![edge],
            triangles: sides.into_iter().flatten().collect(),
        }
    }

    /// Returns the features around the foot point of a vertex on a triangle.
    fn on_triangle(
        boundary: &Boundary3d,
        pair: Pair,
        at: Configuration<3>,
        resolution: f64,
    ) -> Self {
        let (vertex, triangle) = (pair.main, pair.target);
        let facing = boundary.point_triangle(vertex, triangle, at);
        let foot = boundary.triangulation.point(vertex, at);
        let own = &boundary.triangulation.triangles[triangle as usize];
        let is_near = |corner: u32| {
            let apart = sub(&boundary.triangulation.point(corner, at), &foot);
            corner < boundary.triangulation.vertex_count && norm(&apart) <= 2.0 * resolution
        };
        if let Some(corner) = own.corners.into_iter().find(|&corner| is_near(corner)) {
            return Self::at_vertex(boundary, corner, at);
        }
        let mut place = Self {
            triangles: smallvec![triangle],
            ..Self::default()
        };
        for k in (0..3).filter(|&k| facing.inside(k) <= resolution) {
            place
                .triangles
                .extend(boundary.triangulation.across(triangle, k));
            if boundary.triangulation.is_sharp(own.edges[k], at) {
                place.edges.push(own.edges[k]);
            }
        }
        place
    }

    /// Returns the feature sets of main and target around the contact point of a pair.
    pub(crate) fn both(
        boundary: &Boundary3d,
        pair: Pair,
        at: Configuration<3>,
        resolution: f64,
    ) -> [Self; 2] {
        match boundary.feature_pair(pair) {
            FeaturePair::PointTriangle { vertex, .. } => [
                Self::at_vertex(boundary, vertex, at),
                Self::on_triangle(boundary, pair, at, resolution),
            ],
            FeaturePair::EdgeEdge { main, target } => {
                let foot = boundary
                    .edge_edge(main, target, at)
                    .map_or([0.5; 2], |c| c.foot);
                [
                    Self::on_edge(boundary, main, foot[0], at, resolution),
                    Self::on_edge(boundary, target, foot[1], at, resolution),
                ]
            }
        }
    }

    /// Returns the pairs that a touch of `pair` may belong to: those of all features around its
    /// point. In the middle of features that is only `pair` itself.
    pub(crate) fn pairs(
        boundary: &Boundary3d,
        pair: Pair,
        at: Configuration<3>,
        resolution: f64,
    ) -> Pairs {
        let [main, target] = Self::both(boundary, pair, at, resolution);
        let mut pairs = Pairs::new();
        for (one, other) in [(&main, &target), (&target, &main)] {
            if let Some(vertex) = one.vertex {
                let triangles = other.triangles.iter();
                pairs.extend(triangles.map(|&triangle| Boundary3d::face_pair(vertex, triangle)));
            }
        }
        for &edge in &main.edges {
            pairs.extend(
                target
                    .edges
                    .iter()
                    .map(|&other| boundary.edge_pair(edge, other)),
            );
        }
        pairs
    }

    /// Returns the type of a contact between the feature sets of main and target.
    pub(crate) fn kind(
        boundary: &Boundary3d,
        pair: Pair,
        places: &[Self; 2],
        at: Configuration<3>,
    ) -> ContactKind {
        let Some(normal) = boundary.normal(pair, at) else {
            return ContactKind::EdgeEdge;
        };
        let [main, target] = places
            .each_ref()
            .map(|place| place.support(boundary, pair, &normal, at));
        if main.meets(&target, &normal) || target.meets(&main, &normal) {
            return ContactKind::FaceFace;
        }
        if main.follows(&target) {
            return ContactKind::EdgeEdge;
        }
        if main.enters(&target, &normal) || target.enters(&main, &normal) {
            return ContactKind::EdgeFace;
        }
        let [one, other] = places.each_ref().map(|place| place.dimension(boundary, at));
        match (one.min(other), one.max(other)) {
            (0, 0) => ContactKind::VertexVertex,
            (0, 1) => ContactKind::VertexEdge,
            (0, _) => ContactKind::VertexFace,
            _ => ContactKind::EdgeEdge,
        }
    }

    /// Returns 0 at a corner, 1 on an edge, 2 within a face. A vertex of a flat boundary may be on
    /// an edge or within a face.
    fn dimension(&self, boundary: &Boundary3d, at: Configuration<3>) -> u32 {
        let is_straight = |vertex: u32, [one, other]: [u32; 2]| {
            let [one, other] =
                [one, other].map(|edge| boundary.triangulation.away(vertex, edge, at));
            norm(&cross(&one, &other)) <= FLUSH * norm(&one) * norm(&other)
                && dot(&one, &other) < 0.0
        };
        match (self.vertex, self.edges.as_slice()) {
            (_, []) => 2,
            (Some(vertex), &[one, other]) if is_straight(vertex, [one, other]) => 1,
            (Some(_), _) => 0,
            (None, _) => 1,
        }
    }

    fn support(
        &self,
        boundary: &Boundary3d,
        pair: Pair,
        normal: &[f64; 3],
        at: Configuration<3>,
    ) -> TangentSectors {
        let mut support = TangentSectors::default();
        let unit = |v: [f64; 3]| scale(1.0 / norm(&v), &v);
        for &edge in &self.edges {
            let ways: SmallVec<[_; 2]> = match self.vertex {
                Some(vertex) => smallvec![unit(boundary.triangulation.away(vertex, edge, at))],
                None => {
                    let [a, b] = boundary.triangulation.edge(edge, at);
                    smallvec![unit(sub(&b, &a)), unit(sub(&a, &b))]
                }
            };
            let in_plane = ways
                .into_iter()
                .filter(|way| dot(way, normal).abs() <= FLUSH);
            support.rays.extend(in_plane);
        }
        for &triangle in &self.triangles {
            let own = boundary.triangulation.normal(triangle, at);
            if norm(&cross(&own, normal)) > FLUSH {
                continue;
            }
            let sectors = self.sectors(boundary, pair, triangle, at);
            support
                .sectors
                .extend(sectors.into_iter().map(|[one, other]| {
                    if dot(&cross(&one, &other), normal) >= 0.0 {
                        [one, other]
                    } else {
                        [other, one]
                    }
                }));
        }
        support
    }

    /// Returns the directions from the contact point into a triangle, as sectors of at most a right
    /// angle: its corner, a half plane at its edge, or all directions.
    fn sectors(
        &self,
        boundary: &Boundary3d,
        pair: Pair,
        triangle: u32,
        at: Configuration<3>,
    ) -> SmallVec<[Sector; 4]> {
        let own = &boundary.triangulation.triangles[triangle as usize];
        let points = boundary.triangulation.triangle(triangle, at);
        let unit = |v: [f64; 3]| scale(1.0 / norm(&v), &v);
        if let Some(vertex) = self.vertex {
            let corner = own.corners.iter().position(|&corner| corner == vertex);
            let k = corner.unwrap_or(0);
            let to = |j: usize| unit(sub(&points[(k + j) % 3], &points[k]));
            return smallvec![[to(1), to(2)]];
        }
        let point = boundary.point(pair, at);
        let facing = PointTriangle::new(&point, &points);
        let (k, _) = facing.foot_distance();
        let along = unit(sub(&points[(k + 1) % 3], &points[k]));
        let inward = cross(&facing.normal, &along);
        let [back, out] = [scale(-1.0, &along), scale(-1.0, &inward)];
        let mut sectors = smallvec![[along, inward], [inward, back]];
        let at_edge = self.edges.contains(&own.edges[k]) || self.triangles.len() > 1;
        if !at_edge {
            sectors.extend([[back, out], [out, along]]);
        }
        sectors
    }
}

impl TangentSectors {
    /// Returns true if a direction lies in a sector, by more than `margin`.
    fn contains(sector: &Sector, ray: &[f64; 3], normal: &[f64; 3], margin: f64) -> bool {
        dot(&cross(&sector[0], ray), normal) > margin
            && dot(&cross(ray, &sector[1]), normal) > margin
    }

    /// Returns true if a face of one lies on a face of the other.
    fn meets(&self, other: &Self, normal: &[f64; 3]) -> bool {
        self.sectors.iter().any(|[start, end]| {
            let middle = add(start, end);
            let middle = scale(1.0 / norm(&middle), &middle);
            other.sectors.iter().any(|sector| {
                [start, end, &middle]
                    .into_iter()
                    .any(|ray| Self::contains(sector, ray, normal, FLUSH))
            })
        })
    }

    /// Returns true if an edge of one lies along an edge of the other.
    fn follows(&self, other: &Self) -> bool {
        let same =
            |one: &[f64; 3], two: &[f64; 3]| dot(one, two) > 0.0 && norm(&cross(one, two)) <= FLUSH;
        self.rays
            .iter()
            .any(|ray| other.rays.iter().any(|two| same(ray, two)))
    }

    /// Returns true if an edge of one lies on a face of the other.
    fn enters(&self, other: &Self, normal: &[f64; 3]) -> bool {
        self.rays.iter().any(|ray| {
            let mut sectors = other.sectors.iter();
            sectors.any(|sector| Self::contains(sector, ray, normal, -FLUSH))
        })
    }
}
