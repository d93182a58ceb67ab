//! Tributary area of a contact point of flush faces.
//!
//! Two flush facets overlap in a polygon. Its corners are vertices of either facet and crossings of
//! their edges. They are contact points, except the crossings of flat edges, and they share the
//! area of the polygon. If no corner is a contact point, the area goes, in this order,
//! 1. to the touching vertices of both facets, by their shape functions;
//! 2. to the crossings at the rim of the main facet;
//! 3. to the crossings at the rim of the target facet.
//!
//! So the tributary areas of all contact points of a joint add up to its area, except for two
//! facets inside a joint that have none of these.

use smallvec::SmallVec;

use crate::contact::narrow_phase::classification::{FeatureList, FeatureSet};
use crate::contact::surface::boundary_3d::{Boundary3d, FeaturePair};
use crate::contact::surface::{Configuration, Distance, Pair};
use crate::contact::tolerances::FLUSH;
use crate::math::vector::{add_scaled, cross, cross2, dot, norm, scale, sub};

/// A facet in the plane of a contact.
struct ProjectedFacet {
    /// Its vertices, by number and position.
    vertices: SmallVec<[u32; 4]>,
    corners: SmallVec<[[f64; 2]; 4]>,
    /// True for each sharp edge.
    sharp: SmallVec<[bool; 4]>,
    /// Contact resolution of the boundary, m.
    resolution: f64,
}

/// Overlap of two facets; two quadrilaterals have up to eight corners.
type Polygon = SmallVec<[[f64; 2]; 8]>;

/// Coordinates in the plane of a contact.
struct ContactPlane {
    origin: [f64; 3],
    normal: [f64; 3],
    axes: [[f64; 3]; 2],
}

impl ContactPlane {
    fn new(origin: [f64; 3], normal: &[f64; 3], along: &[f64; 3]) -> Self {
        let [_, one, two] = crate::contact::narrow_phase::jacobian::frame(normal, along);
        Self {
            origin,
            normal: *normal,
            axes: [one, two],
        }
    }

    fn at(&self, x: &[f64; 3]) -> [f64; 2] {
        let from = sub(x, &self.origin);
        self.axes.each_ref().map(|axis| dot(axis, &from))
    }
}

/// Flush facets of main and target around a contact point.
struct FlushFacets {
    main: FeatureList,
    target: FeatureList,
    plane: ContactPlane,
}

impl ProjectedFacet {
    /// Makes a facet, counter-clockwise about the contact normal.
    fn new(boundary: &Boundary3d, facet: u32, plane: &ContactPlane, at: Configuration<3>) -> Self {
        let mut vertices = SmallVec::from_slice(boundary.triangulation.facet(facet));
        let mut corners: SmallVec<[[f64; 2]; 4]> = vertices
            .iter()
            .map(|&vertex| plane.at(&boundary.triangulation.point(vertex, at)))
            .collect();
        if area(&corners) < 0.0 {
            vertices.reverse();
            corners.reverse();
        }
        let next = vertices.iter().cycle().skip(1);
        let edges = vertices.iter().zip(next);
        let sharp = edges.map(|(&one, &other): (&u32, &u32)| {
            let edge = boundary.triangulation.edge_between(one, other);
            edge.is_some_and(|edge| boundary.triangulation.is_sharp(edge, at))
        });
        Self {
            sharp: sharp.collect(),
            vertices,
            corners,
            resolution: boundary.triangulation.resolution,
        }
    }

    /// Returns true if a point is a vertex of the facet.
    fn has_vertex(&self, point: &[f64; 2], resolution: f64) -> bool {
        let mut corners = self.corners.iter();
        corners.any(|corner| norm(&sub(corner, point)) <= resolution)
    }

    /// Returns the sharp edges, from end to end.
    fn sharp_edges(&self) -> impl Iterator<Item = [[f64; 2]; 2]> {
        let next = self.corners.iter().cycle().skip(1);
        let edges = self.corners.iter().zip(next).zip(&self.sharp);
        edges.filter_map(|((&a, &b), &sharp)| sharp.then_some([a, b]))
    }

    /// Returns true if a sharp edge crosses one of another facet at a point.
    fn crosses_at(&self, other: &Self, point: &[f64; 2], resolution: f64) -> bool {
        let is_there = |[a, b]: &[[f64; 2]; 2]| {
            let along = sub(b, a);
            cross2(&along, &sub(point, a)).abs() <= resolution * norm(&along)
        };
        self.sharp_edges().filter(is_there).any(|own| {
            let mut others = other.sharp_edges().filter(is_there);
            others.any(|edge| !self.are_parallel(own, edge))
        })
    }

    /// Returns true if two edges are parallel, and so have no contact of their own
    /// ([`LinePair`](crate::contact::narrow_phase::edge_edge::LinePair)).
    fn are_parallel(&self, [a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
        let (one, other) = (sub(&b, &a), sub(&d, &c));
        cross2(&one, &other).abs() <= self.resolution * f64::max(norm(&one), norm(&other))
    }

    /// Returns true if a point lies on the facet.
    fn holds(&self, point: &[f64; 2], resolution: f64) -> bool {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().zip(next).all(|(a, b)| {
            let along = sub(b, a);
            cross2(&along, &sub(point, a)) >= -resolution * norm(&along)
        })
    }

    /// Returns the shape function of a vertex at a point. On a triangle it is that of the element;
    /// on a quadrilateral, that of the four triangles about its mean.
    fn weight(&self, vertex: u32, point: &[f64; 2]) -> f64 {
        let count = self.corners.len();
        let Some(own) = self.vertices.iter().position(|&other| other == vertex) else {
            return 0.0;
        };
        if count == 3 {
            let [a, b] = [1, 2].map(|k| self.corners[(own + k) % 3]);
            return cross2(&sub(&b, &a), &sub(point, &a)) / (2.0 * area(&self.corners));
        }
        let mean = mean(&self.corners);
        for k in 0..count {
            let [a, b] = [self.corners[k], self.corners[(k + 1) % count]];
            let whole = cross2(&sub(&b, &a), &sub(&mean, &a));
            let of_a = cross2(&sub(&mean, &b), &sub(point, &b)) / whole;
            let of_b = cross2(&sub(&a, &mean), &sub(point, &mean)) / whole;
            let of_mean = 1.0 - of_a - of_b;
            if of_a >= -1e-9 && of_b >= -1e-9 && of_mean >= -1e-9 {
                let direct = match own {
                    _ if own == k => of_a,
                    _ if own == (k + 1) % count => of_b,
                    _ => 0.0,
                };
                return direct + of_mean / count as f64;
            }
        }
        0.0
    }
}

impl Boundary3d {
    /// Returns the tributary area of a contact between the feature sets of main and target, m²; 0
    /// if no faces overlap.
    pub(crate) fn tributary_area(
        &self,
        pair: Pair,
        places: &[FeatureSet; 2],
        at: Configuration<3>,
        resolution: f64,
    ) -> f64 {
        let Some(facets) = self.facets_of_contact(pair, places, at) else {
            return 0.0;
        };
        let FlushFacets {
            main,
            target,
            plane,
        } = &facets;
        let vertex = match self.feature_pair(pair) {
            FeaturePair::PointTriangle { vertex, .. } => Some(vertex),
            FeaturePair::EdgeEdge { .. } => None,
        };
        let mut sum = 0.0;
        for &facet in main {
            let one = ProjectedFacet::new(self, facet, plane, at);
            let beneath = self.overlapping_facets(&one, target, plane, at);
            for other in &beneath {
                let piece = clip(&one.corners, &other.corners);
                if area(&piece) <= resolution * resolution {
                    continue;
                }
                sum += area_of_corner(&piece, [&one, other], resolution).unwrap_or_else(|| {
                    let above = self.overlapping_facets(other, main, plane, at);
                    let sides = [(&one, beneath.as_slice()), (other, above.as_slice())];
                    let among = touching_weight(sides, &mean(&piece), resolution);
                    let weight = match vertex {
                        Some(vertex) => {
                            // The vertex counts as touching, whatever the test says.
                            let own = one.weight(vertex, &mean(&piece));
                            if own > 0.0 { own / among.max(own) } else { 0.0 }
                        }
                        None if among == 0.0 => {
                            weight_of_crossing(&crossings(&one, &beneath, resolution), resolution)
                        }
                        None => 0.0,
                    };
                    area(&piece) * weight
                });
            }
        }
        if vertex.is_none() {
            sum += self.tributary_area_of_others(&facets, at, resolution);
        }
        sum
    }

    /// Returns the flush facets around the contact point of a pair; `None` if one side has none.
    fn facets_of_contact(
        &self,
        pair: Pair,
        places: &[FeatureSet; 2],
        at: Configuration<3>,
    ) -> Option<FlushFacets> {
        let normal = self.normal(pair, at)?;
        let point = self.point(pair, at);
        let [main, target] = places
            .each_ref()
            .map(|place| self.flush_facets(&place.triangles, &normal, at));
        let (Some(&first), Some(_)) = (main.first(), target.first()) else {
            return None;
        };
        let [a, b, ..] = self.triangulation.facet(first) else {
            return None;
        };
        let along = sub(
            &self.triangulation.point(*b, at),
            &self.triangulation.point(*a, at),
        );
        Some(FlushFacets {
            main,
            target,
            plane: ContactPlane::new(point, &normal, &along),
        })
    }

    /// Returns the area of a crossing at the rim of the target facets, m²: its fraction of the
    /// overlaps with main facets that have no other contact point.
    fn tributary_area_of_others(
        &self,
        facets: &FlushFacets,
        at: Configuration<3>,
        resolution: f64,
    ) -> f64 {
        let FlushFacets {
            main,
            target,
            plane,
        } = facets;
        let mut sum = 0.0;
        for &facet in target {
            let other = ProjectedFacet::new(self, facet, plane, at);
            let above = self.overlapping_facets(&other, main, plane, at);
            let weight = weight_of_crossing(&crossings(&other, &above, resolution), resolution);
            if weight == 0.0 {
                continue;
            }
            for one in &above {
                let piece = clip(&one.corners, &other.corners);
                if area(&piece) <= resolution * resolution
                    || area_of_corner(&piece, [one, &other], resolution).is_some()
                {
                    continue;
                }
                let beneath = self.overlapping_facets(one, target, plane, at);
                let sides = [(one, beneath.as_slice()), (&other, above.as_slice())];
                if touching_weight(sides, &mean(&piece), resolution) == 0.0
                    && crossings(one, &beneath, resolution).is_empty()
                {
                    sum += area(&piece) * weight;
                }
            }
        }
        sum
    }

    /// Returns the facets of triangles that lie in the plane of a contact, each once.
    fn flush_facets(
        &self,
        triangles: &[u32],
        normal: &[f64; 3],
        at: Configuration<3>,
    ) -> FeatureList {
        let flush = |triangle: &&u32| {
            let own = self.triangulation.normal(**triangle, at);
            norm(&cross(&own, normal)) <= FLUSH
        };
        let of = |triangle: &u32| self.triangulation.triangles[*triangle as usize].facet;
        let mut facets: FeatureList = triangles.iter().filter(flush).map(of).collect();
        facets.sort_unstable();
        facets.dedup();
        facets
    }

    /// Returns the flush facets that overlap a facet, by a walk from those given.
    fn overlapping_facets(
        &self,
        patch: &ProjectedFacet,
        from: &[u32],
        plane: &ContactPlane,
        at: Configuration<3>,
    ) -> Vec<ProjectedFacet> {
        let mut waiting = FeatureList::from_slice(from);
        let mut known = waiting.clone(); // sorted, like `from`
        let mut found = Vec::new();
        let mut next = 0;
        while let Some(&facet) = waiting.get(next) {
            next += 1;
            let other = ProjectedFacet::new(self, facet, plane, at);
            if area(&clip(&patch.corners, &other.corners)) <= 0.0 && next > from.len() {
                continue;
            }
            for &vertex in &other.vertices {
                let neighbours =
                    self.flush_facets(self.triangulation.triangles_at(vertex), &plane.normal, at);
                for facet in neighbours {
                    if let Err(place) = known.binary_search(&facet) {
                        known.insert(place, facet);
                        waiting.push(facet);
                    }
                }
            }
            found.push(other);
        }
        found
    }
}

/// Returns the area that the contact at the origin has in the overlap of two facets, m²; 0 if it is
/// no corner of the overlap. Returns `None` if no corner is a contact point.
fn area_of_corner(
    piece: &[[f64; 2]],
    [one, other]: [&ProjectedFacet; 2],
    resolution: f64,
) -> Option<f64> {
    let touches = |point: &[f64; 2]| {
        one.has_vertex(point, resolution)
            || other.has_vertex(point, resolution)
            || one.crosses_at(other, point, resolution)
    };
    let middle = mean(piece);
    let count = piece.len();
    let beside = |k: usize| 0.5 * area(&[middle, piece[k], piece[(k + 1) % count]]);
    let (mut own, mut left) = (0.0, 0.0);
    let (mut here, mut touching) = (0_u32, 0_u32);
    for (k, corner) in piece.iter().enumerate() {
        let share = beside(k) + beside((k + count - 1) % count);
        if !touches(corner) {
            left += share;
            continue;
        }
        touching += 1;
        if norm(corner) <= resolution {
            own += share;
            here += 1;
        }
    }
    (touching > 0).then(|| own + left * f64::from(here) / f64::from(touching))
}

/// Returns the sum of the shape functions at a point, over the touching vertices of two facets.
/// Each facet comes with the facets that it overlaps.
fn touching_weight(
    sides: [(&ProjectedFacet, &[ProjectedFacet]); 2],
    point: &[f64; 2],
    resolution: f64,
) -> f64 {
    let mut sum = 0.0;
    for (patch, beneath) in sides {
        for (&own, corner) in patch.vertices.iter().zip(&patch.corners) {
            if beneath.iter().any(|other| other.holds(corner, resolution)) {
                sum += patch.weight(own, point);
            }
        }
    }
    sum
}

/// Returns the crossings of the sharp edges of a facet with those of the facets that it overlaps,
/// each once.
fn crossings(patch: &ProjectedFacet, beneath: &[ProjectedFacet], resolution: f64) -> Vec<[f64; 2]> {
    let mut crossings: Vec<[f64; 2]> = Vec::new();
    for own in patch.sharp_edges() {
        for other in beneath.iter().flat_map(ProjectedFacet::sharp_edges) {
            let is_known = |point: &[f64; 2]| {
                let mut known = crossings.iter();
                known.any(|one| norm(&sub(one, point)) <= resolution)
            };
            let found = crossing(own, other).filter(|point| !is_known(point));
            crossings.extend(found.filter(|_| !patch.are_parallel(own, other)));
        }
    }
    crossings
}

/// Returns the fraction of the contact at the origin among crossings; 0 if it is none of them.
fn weight_of_crossing(crossings: &[[f64; 2]], resolution: f64) -> f64 {
    let is_here = |point: &[f64; 2]| norm(point) <= resolution;
    if crossings.iter().any(is_here) {
        1.0 / crossings.len() as f64
    } else {
        0.0
    }
}

/// Returns the point where two segments cross.
fn crossing([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> Option<[f64; 2]> {
    let (along, other) = (sub(&b, &a), sub(&d, &c));
    let above = [a, b].map(|end| cross2(&other, &sub(&end, &c)));
    let beside = [c, d].map(|end| cross2(&along, &sub(&end, &a)));
    (above[0] * above[1] < 0.0 && beside[0] * beside[1] < 0.0).then(|| {
        let mut point = a;
        add_scaled(&mut point, above[0] / (above[0] - above[1]), &along);
        point
    })
}

/// Returns the area of a polygon, m²; positive if it is counter-clockwise.
fn area(polygon: &[[f64; 2]]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    let sum: f64 = polygon.iter().zip(next).map(|(a, b)| cross2(a, b)).sum();
    0.5 * sum
}

/// Returns the area of the overlap of two convex polygons, m².
#[cfg(test)]
pub(crate) fn common_area(one: &[[f64; 2]], other: &[[f64; 2]]) -> f64 {
    area(&clip(one, other))
}

fn mean<const D: usize>(points: &[[f64; D]]) -> [f64; D] {
    let mut sum = [0.0; D];
    for point in points {
        add_scaled(&mut sum, 1.0, point);
    }
    scale(1.0 / points.len() as f64, &sum)
}

/// Returns the part of a convex polygon inside another, both counter-clockwise \[Sutherland1974\].
fn clip(polygon: &[[f64; 2]], window: &[[f64; 2]]) -> Polygon {
    let mut rest = Polygon::from_slice(polygon);
    for (a, b) in window.iter().zip(window.iter().cycle().skip(1)) {
        let along = sub(b, a);
        let inside = |p: &[f64; 2]| cross2(&along, &sub(p, a));
        let mut kept = Polygon::new();
        for (p, q) in rest.iter().zip(rest.iter().cycle().skip(1)) {
            let [from, to] = [inside(p), inside(q)];
            if from >= 0.0 {
                kept.push(*p);
            }
            if from * to < 0.0 {
                let mut cut = *p;
                add_scaled(&mut cut, from / (from - to), &sub(q, p));
                kept.push(cut);
            }
        }
        rest = kept;
    }
    rest
}
