//! The narrow phase in 2-D: vertices against edges.

use std::ops::Range;

use crate::contact::surface::boundary_2d::Boundary2d;
use crate::contact::surface::contact_kind::ContactKind;
use crate::contact::surface::{
    Configuration, ContactGeometry, ContactJacobian, Distance, FeatureKind, JacobianAnchor,
    MaterialPoint, Pair, Pairs, Projection,
};
use crate::contact::tolerances::{FLUSH, SAME_FEATURE_ANGLE};
use crate::math::vector::{add, cross2, dot, norm, scale, sub};

impl Boundary2d {
    /// Returns half the length over which the edges of the main vertex lie flush on the target
    /// edge, m. The other half belongs to the other end of the overlap.
    pub(crate) fn flush_share(&self, pair: Pair, at: Configuration<2>, resolution: f64) -> f64 {
        let Some(own) = self.vertices[pair.main as usize].edges else {
            return 0.0;
        };
        let mut targets = vec![pair.target];
        let foot = self.project(pair, at).foot[0] * self.target_size(pair.target, at);
        let length = self.target_size(pair.target, at);
        if foot < resolution {
            targets.extend(self.next(pair.target, false));
        } else if foot > length - resolution {
            targets.extend(self.next(pair.target, true));
        }
        let mut share = 0.0;
        for &target in &targets {
            for &edge in &own {
                share += 0.5 * self.overlap(edge, target, at, resolution);
            }
        }
        share
    }

    /// Returns the length over which two edges of different blocks lie flush, m.
    pub(crate) fn overlap(
        &self,
        one: u32,
        other: u32,
        at: Configuration<2>,
        resolution: f64,
    ) -> f64 {
        let along = self.direction(other, at);
        if cross2(&self.direction(one, at), &along).abs() > FLUSH
            || dot(&self.direction(one, at), &along) > 0.0
        {
            return 0.0;
        }
        let (a, b) = self.edge(other, at);
        let (p, q) = self.edge(one, at);
        let [s, t] = [q, p].map(|point| dot(&sub(&point, &a), &along));
        let (low, high) = (s.max(0.0), t.min(norm(&sub(&b, &a))));
        // Flush edges must also be near each other where they overlap.
        let middle = scale(0.5, &add(&p, &q));
        let gap = dot(&sub(&middle, &a), &self.outward(other, at));
        if high <= low || gap.abs() > resolution + FLUSH * norm(&sub(&q, &p)) {
            return 0.0;
        }
        high - low
    }
}

impl Distance<2> for Boundary2d {
    fn distance(&self, pair: Pair, at: Configuration<2>) -> f64 {
        let Projection { gap, outside, .. } = self.project(pair, at);
        norm(&[gap, outside.max(0.0)])
    }

    fn is_reentrant_pair(&self, one: Pair, other: Pair, at: Configuration<2>) -> bool {
        let faces = |from: u32, to: u32| {
            let (a, b) = self.edge(from, at);
            let (c, d) = self.edge(to, at);
            let middle = scale(0.5, &add(&c, &d));
            // From the corner that the edges share, if any: the boundary turns there.
            let ways = [a, b].map(|end| sub(&middle, &end));
            let way = if norm(&ways[0]) < norm(&ways[1]) {
                ways[0]
            } else {
                ways[1]
            };
            dot(&way, &self.outward(from, at)) > FLUSH * norm(&way)
        };
        one.main == other.main && faces(one.target, other.target) && faces(other.target, one.target)
    }

    fn project(&self, pair: Pair, at: Configuration<2>) -> Projection {
        let (a, b) = self.edge(pair.target, at);
        let along = sub(&b, &a);
        let length = norm(&along);
        let from_start = sub(&at.at(self.main_node(pair)), &a);
        let normal = [along[1] / length, -along[0] / length];
        let foot = dot(&from_start, &along) / (length * length);
        Projection {
            gap: dot(&from_start, &normal),
            foot: [foot, 0.0],
            outside: (-foot).max(foot - 1.0) * length,
        }
    }

    fn normal(&self, pair: Pair, at: Configuration<2>) -> Option<[f64; 2]> {
        Some(self.outward(pair.target, at))
    }

    fn in_normal_cone(&self, pair: Pair, at: Configuration<2>) -> bool {
        let Some([before, after]) = self.vertices[pair.main as usize].edges else {
            return true;
        };
        let inward = scale(-1.0, &self.outward(pair.target, at));
        let (first, last) = (self.outward(before, at), self.outward(after, at));
        let turn = cross2(&first, &last);
        if dot(&inward, &add(&first, &last)) <= 0.0 || turn < -FLUSH {
            return false; // faces away, or a re-entrant vertex
        }
        cross2(&first, &inward) >= -FLUSH && cross2(&inward, &last) >= -FLUSH
    }

    fn target_size(&self, target: u32, at: Configuration<2>) -> f64 {
        let (a, b) = self.edge(target, at);
        norm(&sub(&b, &a))
    }
}

impl ContactGeometry<2> for Boundary2d {
    fn adjacent_pairs(&self, pair: Pair, at: Configuration<2>, resolution: f64) -> Pairs {
        let foot = self.project(pair, at).foot[0];
        let length = self.target_size(pair.target, at);
        if foot.min(1.0 - foot) * length > resolution {
            return Pairs::new();
        }
        // Each corner with both edges at the other corner.
        let end = self.ends[pair.target as usize][usize::from(foot > 0.5)];
        let mut pairs = Pairs::new();
        for (main, corner) in [(pair.main, end), (end, pair.main)] {
            let edges = self.vertices[corner as usize].edges.into_iter().flatten();
            pairs.extend(edges.map(|target| Pair { main, target }));
        }
        pairs
    }

    fn neighbour(&self, pair: Pair, foot: &[f64; 2], at: Configuration<2>) -> Option<Pair> {
        let target = self.next(pair.target, foot[0] > 0.5)?;
        let moved = Pair {
            main: pair.main,
            target,
        };
        // The surface goes on at a corner that turns by less than a right angle.
        let turn = dot(&self.outward(pair.target, at), &self.outward(target, at));
        (turn > 0.0 && self.in_normal_cone(moved, at)).then_some(moved)
    }

    fn assemble_jacobian(
        &self,
        jacobian: &mut ContactJacobian<2>,
        pair: Pair,
        anchor: JacobianAnchor<2>,
        at: Configuration<2>,
    ) {
        let [a, b] = self.edges[pair.target as usize];
        let p = self.main_node(pair);
        let (start, end) = (at.at(a), at.at(b));
        let along = sub(&end, &start);
        let length = norm(&along);
        let tangent = scale(1.0 / length, &along);
        let normal = [tangent[1], -tangent[0]];
        let w = anchor.foot[0];
        let target: [f64; 2] = std::array::from_fn(|c| start[c] + w * along[c]);
        let offset = sub(&at.at(p), &target);
        let frame = [normal, tangent];
        jacobian.frame = frame;
        jacobian.offset = frame.map(|direction| dot(&direction, &offset));
        jacobian.count = 3;
        jacobian.nodes[..3].copy_from_slice(&[p, a, b]);
        jacobian.rows[0] = frame;
        for (r, direction) in frame.iter().enumerate() {
            // A rotation ω = −normal·(v_b − v_a)/length moves the material of the target at the
            // main point by ω × offset.
            let turning = (direction[1] * offset[0] - direction[0] * offset[1]) / length;
            for c in 0..2 {
                jacobian.rows[1][r][c] = -(1.0 - w) * direction[c] - turning * normal[c];
                jacobian.rows[2][r][c] = -w * direction[c] + turning * normal[c];
            }
        }
    }

    fn material_points(
        &self,
        pair: Pair,
        foot: &[f64; 2],
        rest: Configuration<2>,
    ) -> [MaterialPoint<2>; 2] {
        let (a, b) = self.edge(pair.target, rest);
        let main = MaterialPoint {
            position: rest.at(self.main_node(pair)),
            kind: FeatureKind::Vertex,
            outward: self.outward_at(pair.main, rest),
        };
        let target = MaterialPoint {
            position: std::array::from_fn(|c| a[c] + foot[0] * (b[c] - a[c])),
            kind: FeatureKind::Face,
            outward: self.outward(pair.target, rest),
        };
        [main, target]
    }

    fn locate(
        &self,
        [main, target]: &[MaterialPoint<2>; 2],
        [own, others]: [Range<u32>; 2],
        rest: Configuration<2>,
    ) -> Option<(Pair, [f64; 2])> {
        let first = self.vertices.partition_point(|v| v.node[0] < own.start);
        let end = self.vertices.partition_point(|v| v.node[0] < own.end);
        let is_there = |&v: &usize| rest.at(self.vertices[v].node[0]) == main.position;
        let unlike = |&v: &usize| main.is_on_other_side(&self.outward_at(v as u32, rest));
        let vertex = (first..end).filter(is_there).min_by_key(unlike)?;
        let first = self.edges.partition_point(|edge| edge[0] < others.start);
        let end = self.edges.partition_point(|edge| edge[0] < others.end);
        let best = (first as u32..end as u32).filter_map(|edge| {
            let (a, b) = self.edge(edge, rest);
            let (along, from) = (sub(&b, &a), sub(&target.position, &a));
            let length = norm(&along);
            let foot = dot(&from, &along) / (length * length);
            let beside = cross2(&along, &from).abs() / length;
            let turned = norm(&sub(&self.outward(edge, rest), &target.outward));
            let outside = (-foot).max(foot - 1.0);
            let is_part = turned <= SAME_FEATURE_ANGLE
                && beside <= SAME_FEATURE_ANGLE * length
                && outside <= SAME_FEATURE_ANGLE;
            is_part.then_some((edge, foot.clamp(0.0, 1.0), outside))
        });
        let (edge, foot, _) = best.min_by(|a, b| a.2.total_cmp(&b.2))?;
        let pair = Pair {
            main: vertex as u32,
            target: edge,
        };
        Some((pair, [foot, 0.0]))
    }

    fn classify(&self, pair: Pair, at: Configuration<2>, resolution: f64) -> (ContactKind, f64) {
        let share = self.flush_share(pair, at, resolution);
        let foot = self.project(pair, at).foot[0];
        let length = self.target_size(pair.target, at);
        let is_corner = |next: u32| {
            let [one, other] = [pair.target, next].map(|edge| self.direction(edge, at));
            cross2(&one, &other).abs() > FLUSH || dot(&one, &other) < 0.0
        };
        // Edges that are only collinear overlap by round-off.
        let kind = if share > 0.5 * resolution {
            ContactKind::EdgeEdge
        } else if foot.min(1.0 - foot) * length <= resolution
            && self.next(pair.target, foot > 0.5).is_none_or(is_corner)
        {
            ContactKind::VertexVertex
        } else {
            ContactKind::VertexEdge
        };
        (kind, share * self.thickness)
    }
}
