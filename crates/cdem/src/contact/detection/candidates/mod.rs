//! Candidate pairs that may come in contact in a coarse step.
//!
//! Let s be the motion bound of a block: the largest distance that its nodes may move in the step,
//! and r the contact resolution. A pair is near if its features are no farther apart than s₁ + s₂ +
//! r *and* their [exclusion length](crate::contact::surface::Distance::exclusion) is no more than
//! s₁ + s₂: the orientation of most pairs at such distances rules out contact, as of corners of
//! stones side by side and of edges within flat faces. So the near pairs follow from positions, speeds
//! and contacts alone.
//!
//! Nothing is computed twice without need:
//! - A broad phase finds candidates, which serve for many steps. Each block has an allowance for its
//!   travel plus its motion bound. Boxes grow by the allowance, and are searched again before it is
//!   used up.
//! - Each candidate keeps its distance and its exclusion length, each with the travels of its blocks
//!   when it was measured: its [bounds on motion](Candidate). While the blocks travel on by w in
//!   all, the distance changes by no more than w, and the exclusion length by no more than
//!   [`CULLING_RATE`](crate::contact::tolerances::CULLING_RATE) w. Mostly this tells if the pair is
//!   near. Otherwise the length that does not tell is measured again. Both give the same result.
//! - Candidates that cannot be near for some steps are not even compared
//!   ([`active_candidates`](crate::contact::detection::active_candidates)).
//!
//! A motion bound is sound for a block that nothing touches in the step. Blocks that touch, or may
//! touch, each other may take each other's velocity, and hand it on, so they all get the largest
//! bound among them. That may make more pairs near, and so on. Since bounds only grow, the result does not
//! depend on the order.

mod bound;
#[cfg(test)]
mod study;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

pub(crate) use crate::contact::detection::candidates::bound::{Candidate, Travel};
pub(crate) use crate::contact::detection::clusters::Clusters;

use crate::contact::detection::active_candidates::ActiveCandidates;
use crate::contact::detection::candidates::bound::{Bounded, MeasuredLength};
use crate::contact::surface::geometry_cache::GeometryCache;
use crate::contact::surface::{Configuration, Pair, Surface};
use crate::contact::tolerances::{
    BOUND_CHECKS_PER_TASK, CANDIDATES_PER_TASK, LEAST_MOTION_BOUND, SPEED_GAIN,
};
use crate::math::disjoint_sets::DisjointSets;
use crate::math::parallel::NODES_AT_ONCE;
use crate::math::vector::{dot, norm, sub};
use crate::model::block_max::BlockMax;

/// Data of the blocks for a search.
pub(crate) struct SearchContext<'a, const D: usize> {
    pub(crate) surface: &'a dyn Surface<D>,
    pub(crate) clusters: &'a Clusters,
    /// Block of each node; nodes of a block are contiguous.
    pub(crate) block_of: &'a [u32],
    /// True for blocks that never move.
    pub(crate) fixed: &'a [bool],
    /// Contact resolution, m.
    pub(crate) resolution: f64,
}

/// Speed bounds of the blocks in a coarse step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepSpeeds<'a> {
    /// Blocks in contact, which may hand on their speeds across any gap.
    pub(crate) touching: &'a [[u32; 2]],
    /// Speed bound of each block, m/s.
    pub(crate) bounds: &'a [f64],
    /// Coarse step, s.
    pub(crate) step: f64,
}

/// The search for pairs that may come in contact. It decides no result, so it can be rebuilt
/// between any two steps.
#[derive(Default)]
pub(crate) struct CandidateSearch<const D: usize> {
    /// Candidate pairs, sorted by pair.
    pub(crate) candidates: Vec<Candidate>,
    /// Positions of the nodes at the last search, m.
    last: Vec<[f64; D]>,
    pub(crate) blocks: Vec<BlockMotion>,
    /// Numbers of the near candidates.
    pub(crate) found: Vec<u32>,
    /// True for each candidate that is near.
    pub(super) is_near: Vec<bool>,
    /// The candidates that are compared for now.
    pub(super) active_candidates: ActiveCandidates,
    pub(super) lists: SearchLists,
    /// Geometry cache of the surface in a search, once it has paid.
    geometry_cache: Option<GeometryCache<D>>,
}

/// Lists of a search, kept to reuse their memory.
#[derive(Clone, Debug, Default)]
pub(super) struct SearchLists {
    /// Squares of the largest displacement of a node of each block since the last search, m².
    squares: BlockMax<1>,
    /// Travel of each block.
    pub(super) travels: Vec<Travel>,
    /// Chunks of candidates by their bounds, then the candidates to test, and the results of their
    /// tests.
    pub(super) bound_checks: Vec<BoundCheck>,
    pub(super) open: Vec<u32>,
    tests: Vec<CandidateTest>,
    /// Sets of blocks with a common motion bound, and that bound by root, m.
    pub(super) block_sets: DisjointSets,
    pub(super) set_motion_bounds: Vec<f64>,
    /// Blocks of near pairs, and the blocks whose motion bound has increased.
    pub(super) near_blocks: Vec<[u32; 2]>,
    pub(super) raised: Vec<bool>,
}

/// Result of comparing candidates with their bounds: numbers of candidates, ascending.
#[derive(Clone, Debug, Default)]
pub(super) struct BoundCheck {
    /// Candidates that are near without a test.
    near: Vec<u32>,
    /// Candidates to test.
    pub(super) open: Vec<u32>,
}

/// Result of a test, with the lengths that it has measured, m.
#[derive(Clone, Copy, Debug)]
struct CandidateTest {
    distance: Option<f64>,
    exclusion: Option<f64>,
    is_near: bool,
}

/// Motion of a block, m.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BlockMotion {
    /// Motion bound: largest displacement of a node in the step.
    pub(crate) motion_bound: f64,
    /// Travel: sum over the steps since the last broad phase of the largest displacement of a node.
    pub(super) travel: f64,
    /// Largest sum of travel and motion bound before the next broad phase.
    pub(super) allowance: f64,
}

impl<const D: usize> CandidateSearch<D> {
    /// Returns a search of blocks with these positions and motion bounds, m, at the present step.
    pub(crate) fn restored(positions: Vec<[f64; D]>, motion_bounds: &[f64]) -> Self {
        let block = |&motion_bound: &f64| BlockMotion {
            motion_bound,
            ..BlockMotion::default()
        };
        Self {
            last: positions,
            blocks: motion_bounds.iter().map(block).collect(),
            ..Self::default()
        }
    }

    /// Adds the motion since the last search to the travels of the blocks. Returns true if nodes
    /// moved farther than their motion bound where they may have passed through others. `near` are
    /// the near pairs of the last search.
    pub(crate) fn track(
        &mut self,
        blocks: &SearchContext<D>,
        at: Configuration<D>,
        near: &[Pair],
        may_meet: &impl Fn([u32; 2]) -> bool,
    ) -> bool {
        let nodes = 0..blocks.block_of.len() as u32;
        if self.last.len() != nodes.len() {
            self.last = nodes.map(|node| at.at(node)).collect();
            return false;
        }
        let displacement = |node: u32| {
            let displacement = sub(&at.at(node), &self.last[node as usize]);
            [dot(&displacement, &displacement)]
        };
        let squares = &mut self.lists.squares;
        squares.find(blocks.block_of, blocks.fixed.len(), displacement);
        let has_missed = self.may_have_missed_pairs(blocks, at, near, may_meet);
        for (block, [square]) in self.blocks.iter_mut().zip(self.lists.squares.of_blocks()) {
            block.travel += square.sqrt();
        }
        let is_fixed = |node: usize| blocks.fixed[blocks.block_of[node] as usize];
        let nodes = self.last.par_iter_mut().with_min_len(NODES_AT_ONCE);
        let moving = nodes.enumerate().filter(|(node, _)| !is_fixed(*node));
        moving.for_each(|(node, last)| *last = at.at(node as u32));
        has_missed
    }

    /// Finds the pairs `near` at the start of a coarse step, sorted. `may_meet` selects pairs of
    /// blocks. The motion since the last search must be [tracked](Self::track).
    pub(crate) fn find_near(
        &mut self,
        blocks: &SearchContext<D>,
        at: Configuration<D>,
        speeds: StepSpeeds,
        may_meet: &impl Fn([u32; 2]) -> bool,
        near: &mut Vec<Pair>,
    ) {
        self.blocks
            .resize(blocks.fixed.len(), BlockMotion::default());
        let of_blocks = speeds.bounds.iter().zip(blocks.fixed);
        for (block, (speed, &fixed)) in self.blocks.iter_mut().zip(of_blocks) {
            block.motion_bound = if fixed {
                0.0
            } else {
                SPEED_GAIN * speed * speeds.step + LEAST_MOTION_BOUND * blocks.resolution
            };
        }
        let exceeds = |block: &BlockMotion| block.travel + block.motion_bound > block.allowance;
        loop {
            if self.blocks.iter().any(exceeds) {
                self.broad_phase(blocks, at, may_meet);
            }
            self.test_all(blocks, at);
            self.spread_motion_bounds(blocks, at, speeds.touching);
            if !self.blocks.iter().any(exceeds) {
                break;
            }
        }
        self.found.par_sort_unstable();
        let found = self.found.par_iter().with_min_len(BOUND_CHECKS_PER_TASK);
        let pairs = found.map(|&number| self.candidates[number as usize].pair);
        pairs.collect_into_vec(near);
    }

    /// Returns a lower bound of the distance of the features of a near pair, m, by its index; 0 if
    /// it is not known.
    pub(crate) fn distance(&self, index: usize) -> f64 {
        let of = |&number: &u32| {
            let candidate = &self.candidates[number as usize];
            let [a, b] = candidate.blocks.map(|block| &self.blocks[block as usize]);
            candidate.distance_after(a.travel + b.travel)
        };
        self.found.get(index).map_or(0.0, of)
    }

    /// Returns true if blocks that moved farther than their motion bound since the last search may
    /// have passed through others. That is so if, with the true displacements as bounds, more pairs
    /// would have been `near`, and the nodes of such a pair moved as far as its distance.
    fn may_have_missed_pairs(
        &self,
        blocks: &SearchContext<D>,
        at: Configuration<D>,
        near: &[Pair],
        may_meet: &impl Fn([u32; 2]) -> bool,
    ) -> bool {
        let displacement = |block: u32| self.lists.squares.of_blocks()[block as usize][0].sqrt();
        let is_fast = |block: u32| displacement(block) > self.blocks[block as usize].motion_bound;
        if !(0..self.blocks.len() as u32).any(is_fast) {
            return false;
        }
        let travel_of = |nodes: &[u32]| {
            let travels = nodes.iter();
            let travels = travels.map(|&node| norm(&sub(&at.at(node), &self.last[node as usize])));
            travels.fold(0.0, f64::max)
        };
        let (before, surface) = (Configuration::at_rest(&self.last), blocks.surface);
        let margin = |block| displacement(block) + blocks.resolution;
        let wanted = |of: [u32; 2]| may_meet(of) && of.into_iter().any(is_fast);
        let pairs = blocks
            .clusters
            .overlapping(surface, before, &margin, &wanted);
        pairs.into_iter().any(|pair| {
            let own = travel_of(surface.main_nodes(pair.main))
                + travel_of(surface.target_nodes(pair.target));
            let [a, b] = blocks.of(pair).map(displacement);
            near.binary_search(&pair).is_err()
                && surface.distance(pair, before) <= own + blocks.resolution
                && surface.exclusion(pair, before, blocks.resolution) <= a + b
        })
    }

    fn test_all(&mut self, blocks: &SearchContext<D>, at: Configuration<D>) {
        self.update_travels(blocks.resolution);
        self.compare_bounds(blocks.resolution);
        let Self {
            found,
            is_near,
            candidates,
            lists,
            ..
        } = self;
        found.clear();
        is_near.clear();
        is_near.resize(candidates.len(), false);
        lists.open.clear();
        for bound_check in &lists.bound_checks {
            for &number in &bound_check.near {
                is_near[number as usize] = true;
                found.push(number);
            }
            lists.open.extend(&bound_check.open);
        }
        let cache = self.geometry_cache.take();
        let cache = blocks.surface.geometry_cache(self.lists.open.len(), cache);
        self.test_open(blocks, at.with(cache.as_ref()));
        self.geometry_cache = cache;
    }

    /// Lists the travel of each block, and selects the active candidates again if the list is not
    /// valid for them.
    pub(super) fn update_travels(&mut self, resolution: f64) {
        let travels = &mut self.lists.travels;
        travels.clear();
        travels.extend(self.blocks.iter().map(|block| Travel {
            travel: block.travel,
            motion: block.motion_bound,
        }));
        if !self.active_candidates.is_valid_for(travels) {
            self.active_candidates
                .select(&self.candidates, travels, resolution);
        }
    }

    /// Compares the active candidates with their bounds, in parallel chunks.
    fn compare_bounds(&mut self, resolution: f64) {
        let SearchLists {
            bound_checks,
            travels,
            ..
        } = &mut self.lists;
        let numbers = &self.active_candidates.numbers;
        let some = numbers.par_chunks(BOUND_CHECKS_PER_TASK);
        bound_checks.resize_with(some.len(), BoundCheck::default);
        some.zip(bound_checks).for_each(|(numbers, bound_check)| {
            bound_check.near.clear();
            bound_check.open.clear();
            for &number in numbers {
                let candidate = &self.candidates[number as usize];
                let travel = Travel::together(candidate.blocks.map(|b| travels[b as usize]));
                match candidate.bounded(travel, resolution) {
                    Bounded::Apart => {}
                    Bounded::Near => bound_check.near.push(number),
                    Bounded::Open => bound_check.open.push(number),
                }
            }
        });
    }

    /// Tests the open candidates for the listed travels, and records the near ones.
    pub(super) fn test_open(&mut self, blocks: &SearchContext<D>, at: Configuration<D>) {
        let Self {
            candidates,
            found,
            is_near,
            lists,
            ..
        } = self;
        let (surface, resolution) = (blocks.surface, blocks.resolution);
        let SearchLists {
            travels,
            open,
            tests,
            ..
        } = lists;
        let travel_of = |candidate: &Candidate| {
            Travel::together(candidate.blocks.map(|block| travels[block as usize]))
        };
        let test = |&number: &u32| {
            let candidate = &candidates[number as usize];
            let travel = travel_of(candidate);
            let mut test = CandidateTest {
                distance: None,
                exclusion: None,
                is_near: false,
            };
            let distance = candidate
                .distance_bounded(travel, resolution)
                .or_measured(|| {
                    let distance = surface.distance(candidate.pair, at);
                    test.distance = Some(distance);
                    distance <= travel.motion + resolution
                });
            test.is_near = distance
                && candidate
                    .exclusion_bounded(travel, resolution)
                    .or_measured(|| {
                        let exclusion = surface.exclusion(candidate.pair, at, resolution);
                        test.exclusion = Some(exclusion);
                        exclusion <= travel.motion
                    });
            test
        };
        let numbers = open.par_iter().with_min_len(CANDIDATES_PER_TASK);
        numbers.map(test).collect_into_vec(tests);
        for (&number, test) in open.iter().zip(&*tests) {
            let candidate = &mut candidates[number as usize];
            let Travel { travel, .. } = travel_of(candidate);
            for (known, measured) in [
                (&mut candidate.distance, test.distance),
                (&mut candidate.exclusion, test.exclusion),
            ] {
                if let Some(length) = measured {
                    *known = MeasuredLength { length, travel };
                }
            }
            if test.is_near {
                is_near[number as usize] = true;
                found.push(number);
            }
        }
    }
}

impl<const D: usize> SearchContext<'_, D> {
    /// Returns the blocks of the main and the target feature of a pair.
    pub(crate) fn of(&self, pair: Pair) -> [u32; 2] {
        let main = self.surface.main_nodes(pair.main)[0];
        let target = self.surface.target_nodes(pair.target)[0];
        [main, target].map(|node| self.block_of[node as usize])
    }

    /// Returns the pairs of blocks that `may_meet` and that lie within `distance` of each other, m,
    /// and some beyond, sorted.
    pub(crate) fn pairs_within(
        &self,
        at: Configuration<D>,
        distance: f64,
        may_meet: &impl Fn([u32; 2]) -> bool,
    ) -> Vec<Pair> {
        let margin = |_| 0.5 * distance;
        self.clusters
            .overlapping(self.surface, at, &margin, may_meet)
    }
}
