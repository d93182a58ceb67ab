//! Times of impact in 3-D, at constant velocities: the first time at which the features of a pair
//! lie in one plane and touch.

use crate::contact::ccd::signed_volume::{SignedVolume, last, moved};
use crate::contact::narrow_phase::edge_edge::LinePair;
use crate::contact::surface::boundary_3d::{Boundary3d, FeaturePair};
use crate::contact::surface::{Configuration, ConstantMotion, GapAllowance, Pair, TimeOfImpact};
use crate::contact::tolerances::{EDGE_OUTWARD, EDGE_STEADY};
use crate::math::vector::{cross, dot, norm, sub};

impl TimeOfImpact<3> for Boundary3d {
    fn may_touch_in_drift(&self, pair: Pair, at: Configuration<3>, end: Configuration<3>) -> bool {
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { .. } => true,
            FeaturePair::EdgeEdge { main, target } => {
                self.may_be_sharp_within([main, target], at, end)
            }
        }
    }

    fn sinks(&self, pair: Pair, motion: ConstantMotion<3>, depth: f64, speed: f64) -> bool {
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { .. } => {
                self.point_triangle_sinks(pair, motion, depth, speed)
            }
            FeaturePair::EdgeEdge { main, target } => {
                self.edge_edge_sinks([main, target], motion, depth, speed)
            }
        }
    }

    fn stays_in_contact(
        &self,
        pair: Pair,
        motion: ConstantMotion<3>,
        duration: f64,
        slack: GapAllowance,
    ) -> bool {
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { .. } => {
                self.point_triangle_stays(pair, motion, duration, slack)
            }
            FeaturePair::EdgeEdge { main, target } => {
                self.edge_edge_stays([main, target], motion, duration, slack)
            }
        }
    }

    fn time_of_impact(
        &self,
        pair: Pair,
        motion: ConstantMotion<3>,
        duration: f64,
        depth: f64,
    ) -> Option<f64> {
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { .. } => {
                self.time_of_point_triangle(pair, motion, duration, depth)
            }
            FeaturePair::EdgeEdge { main, target } => {
                self.time_of_edge_edge([main, target], motion, duration, depth)
            }
        }
    }
}

impl Boundary3d {
    /// Returns the time of impact of a vertex on a triangle within `duration`, s, with a
    /// penetration of at most `depth` then, m.
    pub(crate) fn time_of_point_triangle(
        &self,
        pair: Pair,
        motion: ConstantMotion<3>,
        duration: f64,
        depth: f64,
    ) -> Option<f64> {
        let (volume, sides) = self.volume_before(pair, motion);
        let deep = depth * area(&sides, 0.0);
        volume.first_root(duration, deep, |time| {
            let then = motion.after(time);
            let facing = self.point_triangle(pair.main, pair.target, then);
            self.foot_is_on(pair, &facing, then, depth)
        })
    }

    /// Returns the time of impact of two edges in the same way.
    pub(crate) fn time_of_edge_edge(
        &self,
        [main, target]: [u32; 2],
        motion: ConstantMotion<3>,
        duration: f64,
        depth: f64,
    ) -> Option<f64> {
        let on = |lines: &LinePair, at: Configuration<3>| {
            self.feet_are_on([main, target], &lines.foot, at, depth)
        };
        if !self.are_sharp_within([main, target], motion, duration) {
            return None;
        }
        let (volume, edges) = self.volume_between([main, target], motion);
        // If the edges turn, the same gap has another volume at the end.
        let area = |time: f64| area(&edges, time);
        let crossing = |time: f64| self.edge_edge(main, target, motion.after(time));
        // Parallel edges touch as soon as they are no longer parallel, unless they come no deeper
        // than `depth` until the next kick.
        let is_parallel = crossing(0.0).is_none();
        let sinks = is_parallel && crossing(duration).is_some_and(|crossing| crossing.gap < -depth);
        let margin = volume.round_off(duration);
        let touches = |forward: bool| {
            move |time: f64| {
                let then = motion.after(time);
                let lines = self.lines(main, target, then);
                lines.filter(|lines| on(lines, then)).is_some_and(|lines| {
                    let crossing = lines.between(&self.outward(main, target, then));
                    crossing.forward == forward
                        && crossing.gap * crossing.area >= -margin.max(depth * crossing.area)
                })
            }
        };
        let within = |duration: f64, volume: SignedVolume, forward| {
            let deep = depth * f64::max(area(0.0), area(duration));
            volume.first_root(duration, deep, touches(forward))
        };
        let first = |volume: SignedVolume, forward| {
            let whole = within(duration, volume, forward);
            // The area grows while they sink in, so the time until they are deep is searched too.
            let shallow = |t: f64| volume.at(t) >= -margin - depth * area(t);
            let soon = sinks.then(|| within(last(0.0, duration, shallow), volume, forward));
            whole.into_iter().chain(soon.flatten())
        };
        let times = first(volume, true).chain(first(volume.reversed(), false));
        let time = times.min_by(f64::total_cmp)?;
        let is_parallel = || crossing(time).is_none();
        Some(if sinks && is_parallel() {
            time.next_up()
        } else {
            time
        })
    }

    /// Returns true if a vertex touches a triangle now, no deeper than `depth`, m, and sinks in
    /// faster than `speed`, m/s.
    fn point_triangle_sinks(
        &self,
        pair: Pair,
        motion: ConstantMotion<3>,
        depth: f64,
        speed: f64,
    ) -> bool {
        let (volume, sides) = self.volume_before(pair, motion);
        let size = area(&sides, 0.0);
        volume.sinks(depth * size, speed * size) && {
            let facing = self.point_triangle(pair.main, pair.target, motion.at);
            self.foot_is_on(pair, &facing, motion.at, depth)
        }
    }

    /// Returns true if two sharp edges touch now and sink in, in the same way.
    fn edge_edge_sinks(
        &self,
        [main, target]: [u32; 2],
        motion: ConstantMotion<3>,
        depth: f64,
        speed: f64,
    ) -> bool {
        let Some(crossing) = self.edge_edge(main, target, motion.at) else {
            return false;
        };
        let sinks = || {
            let (volume, _) = self.volume_between([main, target], motion);
            let volume = volume.outward(crossing.forward);
            volume.sinks(depth * crossing.area, speed * crossing.area)
        };
        let is_sharp = |edge: u32, under: u32| {
            let length = self.length(under, motion.at);
            self.triangulation.is_sharp_under(edge, length, motion.at)
        };
        self.feet_are_on([main, target], &crossing.foot, motion.at, depth)
            && sinks()
            && is_sharp(main, target)
            && is_sharp(target, main)
    }

    /// Returns true if a vertex in contact with a triangle stays so for `duration` seconds.
    pub(crate) fn point_triangle_stays(
        &self,
        pair: Pair,
        motion: ConstantMotion<3>,
        duration: f64,
        slack: GapAllowance,
    ) -> bool {
        let (volume, sides) = self.volume_before(pair, motion);
        let areas = [0.0, duration].map(|time| area(&sides, time));
        volume.stays_in_contact(areas, duration, slack)
    }

    /// Returns true if two edges in contact stay so for `duration` seconds and far from parallel.
    pub(crate) fn edge_edge_stays(
        &self,
        [main, target]: [u32; 2],
        motion: ConstantMotion<3>,
        duration: f64,
        slack: GapAllowance,
    ) -> bool {
        let Some(crossing) = self.edge_edge(main, target, motion.at) else {
            return false;
        };
        let (volume, edges) = self.volume_between([main, target], motion);
        let [now, then] = [0.0, duration].map(|time| {
            let [one, other] = edges.map(|edge| moved(&edge, time));
            cross(&one, &other)
        });
        let areas = [&now, &then].map(norm);
        let turns = dot(&now, &then) < EDGE_STEADY * areas[0] * areas[1];
        let volume = volume.outward(crossing.forward);
        crossing.outward > EDGE_OUTWARD && !turns && volume.stays_in_contact(areas, duration, slack)
    }

    /// Returns the volume of a vertex and a triangle, and two sides of the triangle with their
    /// rates.
    fn volume_before(
        &self,
        pair: Pair,
        motion: ConstantMotion<3>,
    ) -> (SignedVolume, [[[f64; 3]; 2]; 2]) {
        let [a, b, c] = self.triangulation.triangles[pair.target as usize].corners;
        let [vertex, b, c] = [pair.main, b, c].map(|corner| self.between([a, corner], motion));
        (SignedVolume::of_volume([vertex, b, c]), [b, c])
    }

    /// Returns the volume of the ends of two edges, and the edges with their rates.
    fn volume_between(
        &self,
        edges: [u32; 2],
        motion: ConstantMotion<3>,
    ) -> (SignedVolume, [[[f64; 3]; 2]; 2]) {
        let between = |corners: [u32; 2]| self.between(corners, motion);
        let [one, other] = edges.map(|edge| self.triangulation.edges[edge as usize].ends);
        let edges = [one, other].map(between);
        let volume = SignedVolume::of_volume([between([other[0], one[0]]), edges[0], edges[1]]);
        (volume, edges)
    }

    /// Returns true if two edges can meet each other in a drift. Edges within faces that bulge
    /// during the drift are sharp by its end.
    fn are_sharp_within(
        &self,
        [one, other]: [u32; 2],
        motion: ConstantMotion<3>,
        duration: f64,
    ) -> bool {
        let (at, end) = (motion.at, motion.after(duration));
        let is_sharp = |edge: u32, under: u32| {
            let length = self.length(under, at);
            self.triangulation.is_sharp_under(edge, length, at)
                || self
                    .triangulation
                    .may_sharpen(edge, length, motion, duration)
                    && self.triangulation.is_sharp_under(edge, length, end)
        };
        is_sharp(one, other) && is_sharp(other, one)
    }

    /// Returns false if a cheap test shows that two edges cannot meet each other in a drift.
    pub(crate) fn may_be_sharp_within(
        &self,
        [one, other]: [u32; 2],
        at: Configuration<3>,
        end: Configuration<3>,
    ) -> bool {
        let is_flat = |edge: u32, under: u32| {
            let length = self.length(under, at);
            let mut moments = [at, end].into_iter();
            moments.all(|at| self.triangulation.is_flat_under(edge, length, at))
        };
        !is_flat(one, other) && !is_flat(other, one)
    }

    /// Returns the velocity of a corner, m/s.
    fn velocity(&self, corner: u32, velocity: &[[f64; 3]]) -> [f64; 3] {
        self.triangulation
            .mean(corner, |node| velocity[node as usize])
    }

    /// Returns the vector between two corners, m, and its rate, m/s.
    fn between(&self, corners: [u32; 2], motion: ConstantMotion<3>) -> [[f64; 3]; 2] {
        let [start, end] = corners.map(|corner| self.triangulation.point(corner, motion.at));
        let [slow, fast] = corners.map(|corner| self.velocity(corner, motion.velocity));
        [sub(&end, &start), sub(&fast, &slow)]
    }
}

/// Returns the area between two vectors with their rates after some time, m².
fn area(sides: &[[[f64; 3]; 2]; 2], time: f64) -> f64 {
    let [one, other] = sides.each_ref().map(|side| moved(side, time));
    norm(&cross(&one, &other))
}
