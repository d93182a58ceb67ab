//! When a pair touches, at constant velocities: the first time at which its features
//! lie in one plane, and in each other.

use super::Shell;
use crate::contact::orientation::{Orientation, last};
use crate::contact::surface::Positions;
use crate::vector::{add_scaled, cross, norm, sub};

impl Shell {
    /// When a vertex touches a triangle within `duration` seconds, no deeper in it than
    /// `depth` then.
    pub(super) fn time_of_facing(
        &self,
        (vertex, triangle): (u32, u32),
        at: Positions<3>,
        velocity: &[[f64; 3]],
        (duration, depth): (f64, f64),
    ) -> Option<f64> {
        let between = |from: u32, to: u32| self.between(from, to, at, velocity);
        let [a, b, c] = self.skin.triangles[triangle as usize].corners;
        let volume = Orientation::of_volume([between(a, vertex), between(a, b), between(a, c)]);
        let sides = [b, c].map(|corner| between(a, corner)[0]);
        let deep = depth * norm(&cross(&sides[0], &sides[1]));
        volume.first_fall(duration, deep, |time| {
            let then = at.after(velocity, time);
            let facing = self.facing(vertex, triangle, then);
            self.lies_on((vertex, triangle), &facing, then, depth)
        })
    }

    /// The same of two edges.
    pub(super) fn time_of_crossing(
        &self,
        [main, target]: [u32; 2],
        at: Positions<3>,
        velocity: &[[f64; 3]],
        (duration, depth): (f64, f64),
    ) -> Option<f64> {
        if !self.are_sharp_within([main, target], at, velocity, duration) {
            return None;
        }
        let between = |from: u32, to: u32| self.between(from, to, at, velocity);
        let [one, other] = [main, target].map(|edge| self.skin.edges[edge as usize].ends);
        let edges = [one, other].map(|ends| between(ends[0], ends[1]));
        let volume = Orientation::of_volume([between(other[0], one[0]), edges[0], edges[1]]);
        // Edges that turn have another volume to the same gap at the end.
        let area = |time: f64| {
            let [one, other] = edges.map(|[now, rate]| {
                let mut then = now;
                add_scaled(&mut then, time, &rate);
                then
            });
            norm(&cross(&one, &other))
        };
        let crossing = |time: f64| self.crossing(main, target, at.after(velocity, time));
        // Edges that turn out of one line touch as soon as they are no longer parallel,
        // unless they stay so near that the next kick will do.
        let sinks = crossing(0.0).is_none()
            && crossing(duration).is_some_and(|crossing| crossing.gap < -depth);
        let margin = volume.round_off(duration);
        let touches = |forward: bool| {
            move |time: f64| {
                let then = at.after(velocity, time);
                self.crossing(main, target, then).is_some_and(|crossing| {
                    crossing.forward == forward
                        && crossing.gap * crossing.area >= -margin.max(depth * crossing.area)
                        && self.cross_on([main, target], &crossing.foot, then, depth)
                })
            }
        };
        let within = |duration: f64, volume: Orientation, forward| {
            let deep = depth * f64::max(area(0.0), area(duration));
            volume.first_fall(duration, deep, touches(forward))
        };
        let first = |volume: Orientation, forward| {
            let whole = within(duration, volume, forward);
            // The area grows while they sink in: a look at the time until they are deep.
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

    /// Whether two edges can meet each other in a drift: edges within faces that bulge
    /// meanwhile are sharp by its end.
    fn are_sharp_within(
        &self,
        [one, other]: [u32; 2],
        at: Positions<3>,
        velocity: &[[f64; 3]],
        duration: f64,
    ) -> bool {
        let end = at.after(velocity, duration);
        let is_sharp = |edge: u32, under: u32| {
            let length = self.length(under, at);
            self.skin.is_sharp_under(edge, length, at)
                || self.skin.may_sharpen(edge, length, at, velocity, duration)
                    && self.skin.is_sharp_under(edge, length, end)
        };
        is_sharp(one, other) && is_sharp(other, one)
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
}
