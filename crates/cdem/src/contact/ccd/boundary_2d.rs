//! Times of impact in 2-D: a vertex against an edge.

use crate::contact::ccd::signed_volume::{SignedVolume, moved};
use crate::contact::surface::boundary_2d::Boundary2d;
use crate::contact::surface::{
    Configuration, ConstantMotion, Distance, GapAllowance, Pair, TimeOfImpact, beyond_reentrant,
};
use crate::contact::tolerances::FOOT_ROUND_OFF;
use crate::math::vector::{cross2, dot, norm, sub};

impl Boundary2d {
    /// Returns the length of the target edge times the gap, as a function of time, m². Also returns
    /// the vector of the edge, m, and its rate, m/s.
    fn area_before(&self, pair: Pair, motion: ConstantMotion<2>) -> (SignedVolume, [[f64; 2]; 2]) {
        let ConstantMotion { at, velocity } = motion;
        let [a, b] = self.edges[pair.target as usize];
        let between = |from: u32, to: u32| {
            let rate = sub(&velocity[to as usize], &velocity[from as usize]);
            [sub(&at.at(to), &at.at(from)), rate]
        };
        let edge = between(a, b);
        let area = SignedVolume::of_area([between(a, self.main_node(pair)), edge]);
        (area, edge)
    }

    /// Returns true if a foot lies on its edge, for contact no deeper than `depth`, m.
    fn foot_is_on(&self, edge: u32, foot: f64, at: Configuration<2>, depth: f64) -> bool {
        let slack = self.foot_slack(edge, foot > 0.5, at, depth);
        (-slack..=1.0 + slack).contains(&foot)
    }

    /// Returns the distance beyond an end of `edge` at which a foot still lies on it, relative to
    /// the length of the edge: more in a [re-entrant](beyond_reentrant) corner.
    fn foot_slack(&self, edge: u32, beyond_end: bool, at: Configuration<2>, depth: f64) -> f64 {
        let Some(other) = self.next(edge, beyond_end) else {
            return FOOT_ROUND_OFF;
        };
        let (one, two) = if beyond_end {
            (edge, other)
        } else {
            (other, edge)
        };
        let ways = [one, two].map(|edge| self.direction(edge, at));
        let turn = f64::atan2(cross2(&ways[0], &ways[1]), dot(&ways[0], &ways[1]));
        beyond_reentrant(turn, depth) / self.target_size(edge, at) + FOOT_ROUND_OFF
    }
}

impl TimeOfImpact<2> for Boundary2d {
    fn sinks(&self, pair: Pair, motion: ConstantMotion<2>, depth: f64, speed: f64) -> bool {
        let (area, [edge, _]) = self.area_before(pair, motion);
        let length = norm(&edge);
        area.sinks(depth * length, speed * length) && {
            let foot = self.project(pair, motion.at).foot[0];
            self.foot_is_on(pair.target, foot, motion.at, depth)
        }
    }

    fn stays_in_contact(
        &self,
        pair: Pair,
        motion: ConstantMotion<2>,
        duration: f64,
        slack: GapAllowance,
    ) -> bool {
        let (area, edge) = self.area_before(pair, motion);
        let lengths = [0.0, duration].map(|time| norm(&moved(&edge, time)));
        area.stays_in_contact(lengths, duration, slack)
    }

    fn time_of_impact(
        &self,
        pair: Pair,
        motion: ConstantMotion<2>,
        duration: f64,
        depth: f64,
    ) -> Option<f64> {
        let (area, edge) = self.area_before(pair, motion);
        let deep = depth * norm(&edge[0]);
        area.first_root(duration, deep, |time| {
            let then = motion.after(time);
            let foot = self.project(pair, then).foot[0];
            self.foot_is_on(pair.target, foot, then, depth)
        })
    }
}
