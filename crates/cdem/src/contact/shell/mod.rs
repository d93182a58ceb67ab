//! Surfaces in 3-D: boundary vertices against triangles, and sharp edges
//! against sharp edges.
//!
//! Every contact of polyhedra is a union of these two ([`facing`],
//! [`crossing`]). Main features are the vertices, then the edges; target
//! features the triangles, then the edges.

mod coplanar;
mod crossing;
mod facing;
mod nearness;
mod place;
mod share;
mod skin;
mod surroundings;
#[cfg(test)]
mod tests;

use std::ops::Range;

use coplanar::Volume;
use crossing::Crossing;
use facing::Facing;
use place::Place;
use skin::Skin;

use crate::contact::broad_phase::Aabb;
use crate::contact::island::SHALLOW;
use crate::contact::surface::{
    FLUSH, FOOT_ROUND_OFF, Formed, MAX_NODES, Nearness, Operator, Pair, Positions, Projection,
    Surface,
};
use crate::mesh::{Mesh, distance_to};
use crate::sample::ContactKind;
use crate::vector::{add, add_scaled, cross, dot, norm, scale, sub};

/// Triangles and their edges that are worked out in the time of a look at a pair, about.
const PAIRS: usize = 8;

/// The boundary of all blocks in space.
#[derive(Clone, Debug)]
pub(super) struct Shell {
    skin: Skin,
}

/// The two features of a pair.
#[derive(Clone, Copy, Debug)]
enum Meeting {
    /// A vertex before a triangle.
    Facing { vertex: u32, triangle: u32 },
    /// Two edges.
    Crossing { main: u32, target: u32 },
}

impl Shell {
    /// The boundary of `mesh`, for contact within `tolerance`, m.
    pub(super) fn new(mesh: &Mesh<3>, tolerance: f64) -> Self {
        Self {
            skin: Skin::new(mesh, tolerance),
        }
    }

    fn meeting(&self, pair: Pair) -> Meeting {
        let triangles = self.skin.triangles.len() as u32;
        if pair.main < self.skin.vertex_count {
            Meeting::Facing {
                vertex: pair.main,
                triangle: pair.target,
            }
        } else {
            Meeting::Crossing {
                main: pair.main - self.skin.vertex_count,
                target: pair.target - triangles,
            }
        }
    }

    /// The pair of a vertex and a triangle.
    fn face_pair(vertex: u32, triangle: u32) -> Pair {
        Pair {
            main: vertex,
            target: triangle,
        }
    }

    /// The pair of two edges.
    fn edge_pair(&self, one: u32, other: u32) -> Pair {
        Pair {
            main: self.skin.vertex_count + one.min(other),
            target: self.skin.triangles.len() as u32 + one.max(other),
        }
    }

    fn facing(&self, vertex: u32, triangle: u32, at: Positions<3>) -> Facing {
        let p = self.skin.point(vertex, at);
        Facing::new(&p, &self.skin.triangle(triangle, at))
    }

    fn crossing(&self, main: u32, target: u32, at: Positions<3>) -> Option<Crossing> {
        let outward = sub(&self.skin.outward(target, at), &self.skin.outward(main, at));
        let [main, target] = [main, target].map(|edge| self.skin.edge(edge, at));
        Crossing::new(&main, &target, &outward)
    }

    /// Box around an edge; empty where nothing will cross it soon.
    fn box_of_edge(&self, edge: u32, at: Positions<3>) -> Aabb<3> {
        if self.skin.may_be_sharp(edge, at) {
            Aabb::around(self.skin.edge(edge, at), 0.0)
        } else {
            Aabb::around([], 0.0)
        }
    }

    fn are_sharp(&self, edges: [u32; 2], at: Positions<3>) -> bool {
        edges.iter().all(|&edge| self.skin.is_sharp(edge, at))
    }

    fn length(&self, edge: u32, at: Positions<3>) -> f64 {
        let [a, b] = self.skin.edge(edge, at);
        norm(&sub(&b, &a))
    }

    /// Unit normal of a contact, out of the target; `None` for parallel edges.
    fn normal(&self, pair: Pair, at: Positions<3>) -> Option<[f64; 3]> {
        match self.meeting(pair) {
            Meeting::Facing { triangle, .. } => Some(self.skin.normal(triangle, at)),
            Meeting::Crossing { main, target } => self
                .crossing(main, target, at)
                .map(|crossing| crossing.normal),
        }
    }

    /// Blocks of a pair: main and target.
    fn blocks(&self, pair: Pair) -> [u32; 2] {
        let of_edge = |edge: u32| self.skin.block(self.skin.edges[edge as usize].ends[0]);
        match self.meeting(pair) {
            Meeting::Facing { vertex, triangle } => {
                let corner = self.skin.triangles[triangle as usize].corners[0];
                [self.skin.block(vertex), self.skin.block(corner)]
            }
            Meeting::Crossing { main, target } => [of_edge(main), of_edge(target)],
        }
    }

    /// Velocity of a corner, m/s.
    fn velocity(&self, corner: u32, velocity: &[[f64; 3]]) -> [f64; 3] {
        self.skin.mean(corner, |node| velocity[node as usize])
    }

    /// A vector between two corners, and its rate.
    fn between(
        &self,
        from: u32,
        to: u32,
        at: Positions<3>,
        velocity: &[[f64; 3]],
    ) -> [[f64; 3]; 2] {
        let [start, end] = [from, to].map(|corner| self.skin.point(corner, at));
        let [slow, fast] = [from, to].map(|corner| self.velocity(corner, velocity));
        [sub(&end, &start), sub(&fast, &slow)]
    }

    /// First time at which a volume, positive as long as the pair is apart, has
    /// fallen to 0 and `touches` holds.
    fn first_fall(
        volume: &Volume,
        duration: f64,
        is_shallow: impl Fn() -> bool,
        touches: impl Fn(f64) -> bool,
    ) -> Option<f64> {
        let behind = volume.now() <= volume.round_off(duration) && volume.falls_now();
        if behind && is_shallow() && touches(0.0) {
            return Some(0.0);
        }
        volume.falls_through(duration).find(|&time| touches(time))
    }

    /// Whether two pairs press the same way, up to a small angle.
    fn is_aligned(&self, one: Pair, other: Pair, at: Positions<3>) -> bool {
        let normals = [one, other].map(|pair| self.normal(pair, at));
        let [Some(one), Some(other)] = normals else {
            return false;
        };
        norm(&cross(&one, &other)) <= FLUSH
    }
}

impl Surface<3> for Shell {
    fn main_nodes(&self, main: u32) -> &[u32] {
        match main.checked_sub(self.skin.vertex_count) {
            None => self.skin.nodes_of_corner(main),
            Some(edge) => self.skin.nodes_of_edge(edge),
        }
    }

    fn target_nodes(&self, target: u32) -> &[u32] {
        match target.checked_sub(self.skin.triangles.len() as u32) {
            None => self.skin.nodes_of_triangle(target),
            Some(edge) => self.skin.nodes_of_edge(edge),
        }
    }

    fn form(&self, at: Positions<3>, pairs: usize) -> Option<Formed<3>> {
        (pairs > self.skin.triangles.len() / PAIRS).then(|| self.skin.form(at))
    }

    fn families(&self) -> Vec<[Range<u32>; 2]> {
        let (vertices, edges) = (self.skin.vertex_count, self.skin.edges.len() as u32);
        let triangles = self.skin.triangles.len() as u32;
        vec![
            [0..vertices, 0..triangles],
            [vertices..vertices + edges, triangles..triangles + edges],
        ]
    }

    fn main_box(&self, main: u32, at: Positions<3>) -> Aabb<3> {
        match main.checked_sub(self.skin.vertex_count) {
            None => Aabb::around([self.skin.point(main, at)], 0.0),
            Some(edge) => self.box_of_edge(edge, at),
        }
    }

    fn target_box(&self, target: u32, at: Positions<3>) -> Aabb<3> {
        match target.checked_sub(self.skin.triangles.len() as u32) {
            None => Aabb::around(self.skin.triangle(target, at), 0.0),
            Some(edge) => self.box_of_edge(edge, at),
        }
    }

    fn matches(&self, pair: Pair) -> bool {
        match self.meeting(pair) {
            Meeting::Facing { .. } => true,
            Meeting::Crossing { main, target } => main < target,
        }
    }

    fn apart(&self, pair: Pair, at: Positions<3>) -> f64 {
        match self.meeting(pair) {
            Meeting::Facing { vertex, triangle } => {
                let p = self.skin.point(vertex, at);
                distance_to(&self.skin.triangle(triangle, at), p)
            }
            Meeting::Crossing { main, target } => {
                let [main, target] = [main, target].map(|edge| self.skin.edge(edge, at));
                crossing::distance(&main, &target)
            }
        }
    }

    fn nearness(&self, pair: Pair, at: Positions<3>, reach: f64, tolerance: f64) -> Nearness {
        let range = (reach, tolerance);
        match self.meeting(pair) {
            Meeting::Facing { vertex, triangle } => {
                self.nearness_facing(vertex, triangle, at, range)
            }
            Meeting::Crossing { main, target } => self.nearness_crossing([main, target], at, range),
        }
    }

    fn presses(&self, pair: Pair, at: Positions<3>, tolerance: f64) -> bool {
        let places = Place::both(self, pair, at, tolerance);
        let on_face = || {
            matches!(
                Place::kind(self, pair, &places, at),
                ContactKind::FaceFace | ContactKind::EdgeFace | ContactKind::VertexFace
            )
        };
        match self.meeting(pair) {
            Meeting::Facing { .. } => on_face(),
            Meeting::Crossing { main, target } => {
                let across = places.iter().all(|place| !place.is_at_vertex());
                self.are_sharp([main, target], at) && (across || on_face())
            }
        }
    }

    fn both_bear(&self, one: Pair, other: Pair, at: Positions<3>) -> bool {
        let (
            Meeting::Facing { vertex, triangle },
            Meeting::Facing {
                vertex: second,
                triangle: beside,
            },
        ) = (self.meeting(one), self.meeting(other))
        else {
            return false;
        };
        let faces = |from: u32, to: u32| {
            let [a, b, c] = self.skin.triangle(to, at);
            let middle = scale(1.0 / 3.0, &add(&add(&a, &b), &c));
            let way = sub(&middle, &self.skin.triangle(from, at)[0]);
            dot(&way, &self.skin.normal(from, at)) > FLUSH * norm(&way)
        };
        vertex == second && faces(triangle, beside) && faces(beside, triangle)
    }

    fn project(&self, pair: Pair, at: Positions<3>) -> Projection {
        match self.meeting(pair) {
            Meeting::Facing { vertex, triangle } => {
                let facing = self.facing(vertex, triangle, at);
                Projection {
                    gap: facing.gap,
                    foot: [facing.weights[1], facing.weights[2]],
                    outside: facing.outside().1,
                }
            }
            Meeting::Crossing { main, target } => match self.crossing(main, target, at) {
                Some(crossing) => Projection {
                    gap: crossing.gap,
                    foot: crossing.foot,
                    outside: crossing.outside([main, target].map(|e| self.length(e, at))),
                },
                None => Projection {
                    gap: 0.0,
                    foot: [0.5; 2],
                    outside: f64::INFINITY,
                },
            },
        }
    }

    fn admits(&self, pair: Pair, at: Positions<3>) -> bool {
        match self.meeting(pair) {
            Meeting::Facing { vertex, triangle } => {
                let normal = self.skin.normal(triangle, at);
                self.lowest_edge(vertex, &normal, at) >= -FLUSH
            }
            Meeting::Crossing { main, target } => {
                let crossing = self.crossing(main, target, at);
                crossing.is_some_and(|crossing| {
                    self.lowest_side([main, target], &crossing.normal, at) >= -FLUSH
                })
            }
        }
    }

    fn target_size(&self, target: u32, at: Positions<3>) -> f64 {
        match target.checked_sub(self.skin.triangles.len() as u32) {
            None => {
                let edges = self.skin.triangles[target as usize].edges;
                edges
                    .map(|edge| self.length(edge, at))
                    .into_iter()
                    .fold(0.0, f64::max)
            }
            Some(edge) => self.length(edge, at),
        }
    }

    fn time_of_impact(
        &self,
        pair: Pair,
        at: Positions<3>,
        velocity: &[[f64; 3]],
        duration: f64,
        depth: f64,
    ) -> Option<f64> {
        let between = |from: u32, to: u32| self.between(from, to, at, velocity);
        match self.meeting(pair) {
            Meeting::Facing { vertex, triangle } => {
                let [a, b, c] = self.skin.triangles[triangle as usize].corners;
                let volume = Volume::new([between(a, vertex), between(a, b), between(a, c)]);
                let shallow = || self.facing(vertex, triangle, at).gap >= -depth;
                Self::first_fall(&volume, duration, shallow, |time| {
                    let then = at.after(velocity, time);
                    let facing = self.facing(vertex, triangle, then);
                    self.lies_on((vertex, triangle), &facing, then, depth)
                })
            }
            Meeting::Crossing { main, target } => {
                // Edges within faces that bulge in this drift are sharp by its end.
                let end = at.after(velocity, duration);
                let sharpens = |edge: u32| {
                    self.skin.may_sharpen(edge, at, velocity, duration)
                        && self.skin.is_sharp(edge, end)
                };
                let sharp = |&edge: &u32| self.skin.is_sharp(edge, at) || sharpens(edge);
                if ![main, target].iter().all(sharp) {
                    return None;
                }
                let [one, other] = [main, target].map(|edge| self.skin.edges[edge as usize].ends);
                let edges = [one, other].map(|ends| between(ends[0], ends[1]));
                let volume = Volume::new([between(other[0], one[0]), edges[0], edges[1]]);
                let touches = |forward: bool| {
                    move |time: f64| {
                        let then = at.after(velocity, time);
                        self.crossing(main, target, then).is_some_and(|crossing| {
                            let range = -FOOT_ROUND_OFF..=1.0 + FOOT_ROUND_OFF;
                            crossing.forward == forward
                                && crossing.foot.iter().all(|foot| range.contains(foot))
                        })
                    }
                };
                let shallow = || {
                    let now = self.crossing(main, target, at);
                    now.is_some_and(|crossing| crossing.gap >= -depth)
                };
                let first = |volume: &Volume, forward| {
                    Self::first_fall(volume, duration, shallow, touches(forward))
                };
                let [one, other] = [first(&volume, true), first(&volume.reversed(), false)];
                one.into_iter().chain(other).min_by(f64::total_cmp)
            }
        }
    }

    fn rightful(&self, pair: Pair, [at, then]: [Positions<3>; 2], tolerance: f64) -> Option<Pair> {
        let touches = |pair: &Pair| {
            let projection = self.project(*pair, at);
            projection.gap.abs() <= tolerance
                && projection.outside <= tolerance
                && self.admits(*pair, at)
        };
        let others = Place::pairs(self, pair, at, tolerance).into_iter();
        let mut rivals: Vec<Pair> = others
            .filter(|other| *other != pair && touches(other) && !self.both_bear(pair, *other, at))
            .collect();
        if self.admits(pair, at) {
            rivals.insert(0, pair);
        }
        let mut best: Option<(f64, Pair)> = None;
        for &rival in &rivals {
            let gap = self.project(rival, then).gap;
            if best.is_none_or(|(deepest, _)| gap > deepest) {
                best = Some((gap, rival));
            }
        }
        let (gap, best) = best?;
        // A corner that meets a corner sinks into all of its faces, or goes past.
        let one_way = rivals.iter().all(|&rival| self.is_aligned(best, rival, at));
        (one_way || gap <= -SHALLOW * tolerance).then_some(best)
    }

    fn neighbour(&self, pair: Pair, foot: &[f64; 2], at: Positions<3>) -> Option<Pair> {
        match self.meeting(pair) {
            Meeting::Facing { vertex, triangle } => self.next_triangle(vertex, triangle, at),
            Meeting::Crossing { main, target } => self.next_edge([main, target], foot, at),
        }
    }

    fn same_contact(&self, one: Pair, other: Pair, at: Positions<3>, tolerance: f64) -> bool {
        let (blocks, mut others) = (self.blocks(one), self.blocks(other));
        let swapped = blocks != others;
        others.reverse();
        if swapped && blocks != others {
            return false;
        }
        let apart = sub(&self.point(one, at), &self.point(other, at));
        if norm(&apart) > tolerance {
            return false;
        }
        let [Some(normal), Some(second)] = [one, other].map(|pair| self.normal(pair, at)) else {
            return false;
        };
        let cosine = dot(&normal, &second);
        norm(&cross(&normal, &second)) <= FLUSH && (cosine < 0.0) == swapped
    }

    fn point(&self, pair: Pair, at: Positions<3>) -> [f64; 3] {
        match self.meeting(pair) {
            Meeting::Facing { vertex, .. } => self.skin.point(vertex, at),
            Meeting::Crossing { main, target } => {
                let [a, b] = self.skin.edge(main, at);
                let foot = self.crossing(main, target, at).map_or(0.5, |c| c.foot[0]);
                let mut point = a;
                add_scaled(&mut point, foot, &sub(&b, &a));
                point
            }
        }
    }

    fn operator(&self, pair: Pair, foot: &[f64; 2], at: Positions<3>) -> Operator<3> {
        match self.meeting(pair) {
            Meeting::Facing { vertex, triangle } => {
                self.facing_operator(vertex, triangle, foot, at)
            }
            Meeting::Crossing { main, target } => self.crossing_operator(main, target, foot, at),
        }
    }

    fn classify(&self, pair: Pair, at: Positions<3>, tolerance: f64) -> (ContactKind, f64) {
        let places = Place::both(self, pair, at, tolerance);
        (
            Place::kind(self, pair, &places, at),
            self.share(pair, &places, at, tolerance),
        )
    }
}

impl Shell {
    fn facing_operator(
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

    fn crossing_operator(
        &self,
        main: u32,
        target: u32,
        foot: &[f64; 2],
        at: Positions<3>,
    ) -> Operator<3> {
        let [one, other] = [main, target].map(|edge| self.skin.edge(edge, at));
        let along = sub(&one[1], &one[0]);
        let normal = self.crossing(main, target, at).map_or_else(
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
            let rows = crossing::relative_rows(&one, &other, (foot, &normal), direction);
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
fn frame(normal: &[f64; 3], along: &[f64; 3]) -> [[f64; 3]; 3] {
    let mut tangent = *along;
    add_scaled(&mut tangent, -dot(along, normal), normal);
    let tangent = scale(1.0 / norm(&tangent), &tangent);
    [*normal, tangent, cross(normal, &tangent)]
}
