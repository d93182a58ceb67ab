//! Prediction of impacts: where, when and how fast open pairs will touch.

use rayon::prelude::*;

use crate::contact::Contacts;
use crate::contact::constraint::contact_constraint::shear_norm;
use crate::contact::constraint::contact_point::ContactPoint;
use crate::contact::constraint::initial_overlap::ordered;
use crate::contact::surface::{Configuration, ConstantMotion, FeatureKind, Pair};
use crate::contact::tolerances::{PREDICTIONS_PER_TASK, SAME_TOUCH};

/// A predicted impact, or a present contact, of two blocks.
#[derive(Clone, Debug)]
pub(crate) struct PredictedImpact<const D: usize> {
    /// Feature pair, and its blocks.
    pub(crate) pair: Pair,
    pub(crate) blocks: [u32; 2],
    /// Points at rest, m, and a node of the feature at each: main and target.
    pub(crate) rest: [[f64; D]; 2],
    pub(crate) nodes: [u32; 2],
    /// For each feature: true if it is an edge in 3-D.
    pub(crate) are_edges: [bool; 2],
    /// Present or predicted point, m, and normal out of the target.
    pub(crate) point: [f64; D],
    pub(crate) normal: [f64; D],
    /// Approach velocity, m/s.
    pub(crate) speed: f64,
    /// Time until the touch, s.
    pub(crate) wait: f64,
    /// Time at which the contact began, s; `None` for a predicted impact.
    pub(crate) since: Option<f64>,
    /// Slip since then, m; and its present rate, m/s.
    pub(crate) slip: f64,
    pub(crate) slip_rate: f64,
}

/// Predicted impacts of open pairs, grouped by blocks. Kept to reuse their memory.
#[derive(Debug, Default)]
pub(crate) struct PredictedImpacts<const D: usize> {
    impacts: Vec<PredictedImpact<D>>,
    /// Time until each near pair touches, s; the pairs that will touch; the closed pairs,
    /// sorted.
    waits: Vec<Option<f64>>,
    touching: Vec<(Pair, f64)>,
    closed: Vec<Pair>,
}

impl<const D: usize> PredictedImpacts<D> {
    /// Returns the predicted impacts of each two blocks.
    pub(crate) fn by_blocks(&self) -> impl Iterator<Item = ([u32; 2], &[PredictedImpact<D>])> {
        let same = |one: &PredictedImpact<D>, other: &PredictedImpact<D>| {
            ordered(one.blocks) == ordered(other.blocks)
        };
        let impacts = self.impacts.chunk_by(same);
        impacts.map(|impacts| (ordered(impacts[0].blocks), impacts))
    }

    /// Sorts the impacts by blocks, then by time. The first of two zones that overlap decides where
    /// elements are cut, and it must not depend on the order of the blocks. Impacts with times that
    /// differ by at most `same` from one to the next, s, stay in the order of their numbers.
    fn sort(&mut self, same: f64) {
        let later = |a: &PredictedImpact<D>, b: &PredictedImpact<D>| a.wait.total_cmp(&b.wait);
        let blocks = |impact: &PredictedImpact<D>| ordered(impact.blocks);
        self.impacts
            .sort_by(|a, b| blocks(a).cmp(&blocks(b)).then(later(a, b)));
        let at_once = |a: &PredictedImpact<D>, b: &PredictedImpact<D>| {
            blocks(a) == blocks(b) && b.wait - a.wait <= same
        };
        for impacts in self.impacts.chunk_by_mut(at_once) {
            impacts.sort_by_key(|impact| impact.pair);
        }
    }
}

impl<const D: usize> Contacts<D> {
    /// Predicts the impacts of open pairs within `duration` seconds at constant velocities.
    pub(crate) fn predict_impacts(
        &self,
        at: Configuration<D>,
        velocity: &[[f64; D]],
        rest: Configuration<D>,
        duration: f64,
        predicted: &mut PredictedImpacts<D>,
    ) {
        let motion = ConstantMotion { at, velocity };
        let closed = &mut predicted.closed;
        closed.clear();
        closed.extend(self.contact_points().map(|contact| contact.pair));
        closed.sort_unstable();
        let surface = &*self.model_data.surface;
        let wait = |&pair: &Pair| {
            let is_closed = closed.binary_search(&pair).is_ok();
            if is_closed || !surface.may_touch_in_drift(pair, at, motion.after(duration)) {
                return None;
            }
            surface.time_of_impact(pair, motion, duration, self.model_data.resolution)
        };
        let near = self
            .state
            .near_pairs
            .par_iter()
            .with_min_len(PREDICTIONS_PER_TASK);
        near.map(wait).collect_into_vec(&mut predicted.waits);
        let impact = |&(pair, wait): &(Pair, f64)| {
            let then = motion.after(wait);
            let foot = surface.project(pair, then).clamped_foot();
            let jacobian = surface.jacobian(pair, &foot, then);
            let speed = -jacobian.relative_velocity(0, velocity);
            PredictedImpact {
                speed,
                wait,
                point: surface.point(pair, then),
                normal: jacobian.frame[0],
                ..self.impact_at(pair, &foot, rest)
            }
        };
        let near = self.state.near_pairs.iter().zip(&predicted.waits);
        predicted.touching.clear();
        let touching = near.filter_map(|(&pair, wait)| Some((pair, (*wait)?)));
        predicted.touching.extend(touching);
        let touching = predicted
            .touching
            .par_iter()
            .with_min_len(PREDICTIONS_PER_TASK);
        touching
            .map(impact)
            .collect_into_vec(&mut predicted.impacts);
        predicted.sort(SAME_TOUCH * duration);
    }

    /// Returns the contacts of closed pairs.
    pub(crate) fn touching_pairs<'a>(
        &'a self,
        at: Configuration<'a, D>,
        velocity: &'a [[f64; D]],
        rest: Configuration<'a, D>,
    ) -> impl Iterator<Item = PredictedImpact<D>> + 'a {
        let surface = &*self.model_data.surface;
        let impact = move |contact: &ContactPoint<D>| {
            let jacobian = contact.jacobian(surface, at);
            PredictedImpact {
                since: Some(contact.history.time_on),
                slip: contact.history.slip,
                slip_rate: shear_norm(&jacobian.relative_velocities(velocity)),
                point: surface.point(contact.pair, at),
                normal: jacobian.frame[0],
                ..self.impact_at(contact.pair, &contact.foot, rest)
            }
        };
        self.contact_points().map(impact)
    }

    /// Returns the impact of a pair with this `foot`, at rest: its place, normal, speed and times
    /// are not set.
    fn impact_at(&self, pair: Pair, foot: &[f64; 2], rest: Configuration<D>) -> PredictedImpact<D> {
        let surface = &*self.model_data.surface;
        let nodes = [
            surface.main_nodes(pair.main),
            surface.target_nodes(pair.target),
        ];
        let nodes = nodes.map(|nodes| nodes[0]);
        let points = surface.material_points(pair, foot, rest);
        PredictedImpact {
            pair,
            blocks: nodes.map(|node| self.model_data.block_of[node as usize]),
            are_edges: points.map(|point| matches!(point.kind, FeatureKind::Edge(_))),
            rest: points.map(|point| point.position),
            nodes,
            point: [0.0; D],
            normal: [0.0; D],
            speed: 0.0,
            wait: 0.0,
            since: None,
            slip: 0.0,
            slip_rate: 0.0,
        }
    }
}
