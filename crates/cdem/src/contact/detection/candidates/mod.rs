//! Candidate pairs that may come in contact in a coarse step.
//!
//! A broad phase finds candidates, which serve for many steps. Let s be the motion bound of a
//! block: the largest distance that its nodes may move in the step. A pair is near if its features
//! are no farther apart than [`DISTANCE_CHECKED`] (s₁ + s₂ + d_tol) *and* the surface calls it
//! near. The distance changes by no more than the nodes of both features move. So no near pair is
//! missed
//! - by skipping a test: a pair at distance d at its last test is not near while the nodes of its
//!   blocks have since travelled w₁ and w₂ at most, and d > w₁ + w₂ + [`DISTANCE_KEPT`] (s₁ + s₂ +
//!   d_tol);
//! - by the broad phase: each block has an allowance a for the distance m of its nodes from their
//!   positions in the broad phase plus its motion bound. Boxes were grown by DISTANCE_KEPT (a + ½
//!   d_tol), and are searched again before m + s exceeds a.
//!
//! The orientation of most pairs at such distances rules out contact: corners of stones side by
//! side, edges within flat faces. The surface returns a length for them. They are not tested again
//! before s₁ + s₂ plus [`CULLING_RATE`] times the increase of w₁ + w₂ exceeds that length.
//!
//! A pair found near stays near without a test until the nodes of its blocks have travelled
//! [`NEAR_MARGIN`] of the tolerance, or [`NEAR_MARGIN_IN_MOTION`] of their motion bounds at the
//! test. So the near pairs depend on the times of the tests, and a resumed run continues with the
//! same search state.
//!
//! A motion bound is sound for a block that nothing touches in the step. Blocks that may touch each
//! other may take each other's velocity, and hand it on, so they all get the largest bound among
//! them. That may make more pairs near, and so on. Since bounds only grow, the result does not
//! depend on the order.

#[cfg(test)]
mod study;
#[cfg(test)]
mod tests;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub(crate) use crate::contact::detection::clusters::Clusters;

use crate::contact::detection::active_candidates::ActiveCandidates;
use crate::contact::surface::{Configuration, CullingRange, CullingResult, Pair, Surface};
use crate::contact::tolerances::{
    BOUND_CHECKS_PER_TASK, CANDIDATES_PER_TASK, CULLING_RATE, CULLING_ROUND_OFF, DISTANCE_CHECKED,
    DISTANCE_KEPT, LEAST_MOTION_BOUND, NEAR_MARGIN, NEAR_MARGIN_IN_MOTION, SPEED_GAIN,
};
use crate::math::disjoint_sets::DisjointSets;
use crate::math::parallel::NODES_AT_ONCE;
use crate::math::serde_pod;
use crate::math::vector::{dot, norm, sub};
use crate::model::block_max::BlockMax;

/// A pair within the allowances of the last broad phase.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Candidate {
    pub(super) pair: Pair,
    pub(crate) blocks: [u32; 2],
    /// Travels of both blocks plus their motion in the step, up to which the pair cannot be near,
    /// m.
    pub(super) far_until: f64,
    /// [`CULLING_RATE`] times the travels of both blocks plus their motion bounds, up to which the
    /// orientation of the pair rules out contact, m.
    pub(super) excluded_until: f64,
    /// Travels of both blocks up to which the pair counts as near, m; below 0 if it is not near.
    pub(crate) near_until: f64,
}

/// Result of comparing candidates with their travel bounds: numbers of candidates, ascending.
#[derive(Clone, Debug, Default)]
pub(crate) struct BoundCheck {
    /// Candidates that stay near without a test.
    still_near: Vec<u32>,
    /// Candidates to test.
    pub(crate) open: Vec<u32>,
}

/// Data of the blocks for a search.
pub(crate) struct SearchContext<'a, const D: usize> {
    pub(crate) surface: &'a dyn Surface<D>,
    pub(crate) clusters: &'a Clusters,
    /// Block of each node; nodes of a block are contiguous.
    pub(crate) block_of: &'a [u32],
    /// True for blocks that never move.
    pub(crate) fixed: &'a [bool],
    /// Contact tolerance d_tol, m.
    pub(crate) tolerance: f64,
}

/// Speed bounds of the blocks in a coarse step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepSpeeds<'a> {
    /// Speed bound of each block, m/s.
    pub(crate) bounds: &'a [f64],
    /// Coarse step, s.
    pub(crate) step: f64,
}

/// The search for pairs that may come in contact.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct CandidateSearch<const D: usize> {
    /// Candidate pairs, sorted by pair.
    pub(crate) candidates: Vec<Candidate>,
    /// Positions of the nodes in the last broad phase and in the last step, m.
    #[serde(with = "serde_pod")]
    pub(super) origin: Vec<[f64; D]>,
    #[serde(with = "serde_pod")]
    pub(super) last: Vec<[f64; D]>,
    pub(crate) blocks: Vec<MotionBound>,
    /// Numbers of the near candidates.
    pub(crate) found: Vec<u32>,
    #[serde(skip)]
    pub(crate) workspace: SearchWorkspace,
    /// True if blocks may have passed through others before the last search.
    exceeded_bounds: bool,
}

/// All of a search that can be rebuilt between two steps, kept to reuse its memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct SearchWorkspace {
    /// Index of the first candidate of each main feature.
    pub(super) of_main: Vec<u32>,
    /// Candidates of each block, as one list, and the index of the first of each block.
    pub(super) of_block: Vec<u32>,
    pub(super) block_start: Vec<u32>,
    /// The candidates that are tested for now.
    pub(crate) active_candidates: ActiveCandidates,
    /// True for each candidate that is near.
    pub(crate) is_near: Vec<bool>,
    /// Squares of the largest displacements of a node of each block since the last search and since
    /// the last broad phase, m².
    squares: BlockMax<2>,
    /// Travel bounds of each block.
    pub(crate) travel_bounds: Vec<BlockTravel>,
    /// Chunks of candidates by the result of the travel bounds, then the candidates to test, and
    /// the results of their tests.
    pub(crate) bound_checks: Vec<BoundCheck>,
    pub(crate) open: Vec<u32>,
    tests: Vec<CandidateTest>,
    /// Sets of moving blocks that may touch each other, the largest motion bound of each set, m,
    /// and the blocks of near pairs.
    pub(crate) block_sets: DisjointSets,
    pub(crate) set_motion_bounds: Vec<f64>,
    pub(crate) near_blocks: Vec<[u32; 2]>,
    /// True for blocks with an increased motion bound.
    pub(crate) raised: Vec<bool>,
}

/// Result of the test of a candidate, for its fields of the same names, m.
#[derive(Clone, Copy, Debug, Default)]
struct CandidateTest {
    far_until: f64,
    excluded_until: f64,
    near_until: f64,
}

/// Motion of a block, m.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct MotionBound {
    /// Motion bound: largest displacement of a node in the step.
    pub(crate) motion_bound: f64,
    /// Largest distance of a node from its position in the last broad phase.
    pub(super) moved: f64,
    /// Travel: sum over the steps since then of the largest displacement of a node.
    pub(super) travel: f64,
    /// Largest sum of `moved` and `motion_bound` before the next broad phase.
    pub(super) allowance: f64,
}

impl<const D: usize> CandidateSearch<D> {
    /// Finds the pairs `near` at the start of a coarse step, sorted. `may_meet`
    /// selects pairs of blocks.
    pub(crate) fn find_near(
        &mut self,
        blocks: &SearchContext<D>,
        at: Configuration<D>,
        speeds: StepSpeeds,
        may_meet: &impl Fn([u32; 2]) -> bool,
        near: &mut Vec<Pair>,
    ) {
        self.blocks
            .resize(blocks.fixed.len(), MotionBound::default());
        self.accumulate_travel(blocks, at);
        let of_blocks = speeds.bounds.iter().zip(blocks.fixed);
        for (bound, (speed, &fixed)) in self.blocks.iter_mut().zip(of_blocks) {
            bound.motion_bound = if fixed {
                0.0
            } else {
                SPEED_GAIN * speed * speeds.step + LEAST_MOTION_BOUND * blocks.tolerance
            };
        }
        let exceeds = |bound: &MotionBound| bound.moved + bound.motion_bound > bound.allowance;
        loop {
            if self.origin.is_empty() || self.blocks.iter().any(exceeds) {
                self.broad_phase(blocks, at, may_meet);
            }
            self.test_all(blocks, at);
            self.spread_motion_bounds(blocks, at);
            if !self.blocks.iter().any(exceeds) {
                break;
            }
        }
        self.found.par_sort_unstable();
        let found = self.found.par_iter().with_min_len(BOUND_CHECKS_PER_TASK);
        let pairs = found.map(|&number| self.candidates[number as usize].pair);
        pairs.collect_into_vec(near);
    }

    /// Returns true if nodes moved farther in the step before the last search than their motion
    /// bound, at positions where they may have passed through others.
    pub(crate) fn exceeded_bounds(&self) -> bool {
        self.exceeded_bounds
    }

    /// Returns the distance of the features of each near pair at its test, up to round-off, m.
    pub(crate) fn distances(&self) -> impl Iterator<Item = f64> + '_ {
        self.found.iter().map(|&number| {
            let candidate = &self.candidates[number as usize];
            let [a, b] = candidate
                .blocks
                .map(|block| self.blocks[block as usize].travel);
            candidate.far_until - (a + b)
        })
    }

    /// Returns true if a pair is a candidate and near.
    pub(crate) fn is_near(&self, pair: Pair) -> bool {
        let main = pair.main as usize;
        let Some(&[first, end]) = self.workspace.of_main.get(main..main + 2) else {
            return false;
        };
        (first as usize..end as usize)
            .any(|number| self.workspace.is_near[number] && self.candidates[number].pair == pair)
    }

    /// Updates the travels of the blocks, and `exceeded_bounds` if they exceed their bounds.
    fn accumulate_travel(&mut self, blocks: &SearchContext<D>, at: Configuration<D>) {
        self.measure(blocks, at);
        self.exceeded_bounds = self.may_have_missed_pairs(blocks, at);
        let is_fixed = |node: usize| blocks.fixed[blocks.block_of[node] as usize];
        let nodes = self.last.par_iter_mut().with_min_len(NODES_AT_ONCE);
        let moving = nodes.enumerate().filter(|(node, _)| !is_fixed(*node));
        moving.for_each(|(node, last)| *last = at.at(node as u32));
        for (bound, [travel, moved]) in self
            .blocks
            .iter_mut()
            .zip(self.workspace.squares.of_blocks())
        {
            bound.travel += travel.sqrt();
            bound.moved = moved.sqrt();
        }
    }

    /// Finds the largest displacements of a node of each block since the last search and since the
    /// last broad phase.
    fn measure(&mut self, blocks: &SearchContext<D>, at: Configuration<D>) {
        let block_of = &blocks.block_of[..self.last.len()];
        let displacement = |node: u32| {
            let n = node as usize;
            let now = at.at(node);
            let displacement = [&self.last[n], &self.origin[n]].map(|then| sub(&now, then));
            displacement.map(|displacement| dot(&displacement, &displacement))
        };
        self.workspace
            .squares
            .find(block_of, blocks.fixed.len(), displacement);
    }

    /// Returns true if blocks that moved farther than their motion bound since the last search may
    /// have passed through others. That is so if, with the true displacements as bounds, more pairs
    /// would have been near, and the nodes of such a pair moved as far as its distance.
    fn may_have_missed_pairs(&self, blocks: &SearchContext<D>, at: Configuration<D>) -> bool {
        let displacement = |block: usize| self.workspace.squares.of_blocks()[block][0].sqrt();
        let travel_of = |nodes: &[u32]| {
            let travels = nodes.iter();
            let travels = travels.map(|&node| norm(&sub(&at.at(node), &self.last[node as usize])));
            travels.fold(0.0, f64::max)
        };
        let fast = |block: &usize| displacement(*block) > self.blocks[*block].motion_bound;
        let fast: Vec<usize> = (0..self.blocks.len()).filter(fast).collect();
        if fast.is_empty() {
            return false;
        }
        let before = Configuration::at_rest(&self.last);
        let missed = |number: &u32| {
            let Candidate {
                pair, blocks: of, ..
            } = self.candidates[*number as usize];
            let [a, b] = of.map(|block| displacement(block as usize));
            let surface = blocks.surface;
            let own = travel_of(surface.main_nodes(pair.main))
                + travel_of(surface.target_nodes(pair.target));
            !self.workspace.is_near[*number as usize]
                && surface.distance_lower_bound(pair, before) <= own + blocks.tolerance
                && surface.cull(pair, before, blocks.range(a + b)) == CullingResult::Near
        };
        fast.into_iter().any(|block| {
            let bound = self.blocks[block];
            bound.moved + displacement(block) > bound.allowance
                || self.candidates_of(block).iter().any(missed)
        })
    }

    /// Returns true if all data fit these numbers of nodes and blocks, and the features that a
    /// surface `has`.
    pub(crate) fn is_of(&self, nodes: usize, blocks: usize, has: &impl Fn(Pair) -> bool) -> bool {
        let is_known = |candidate: &Candidate| {
            let mut of = candidate.blocks.iter();
            has(candidate.pair) && of.all(|&block| (block as usize) < blocks)
        };
        let lists = [self.origin.len(), self.last.len()];
        let found = self.found.iter();
        lists.iter().all(|&count| count == nodes || count == 0)
            && lists[0] == lists[1]
            && (self.blocks.len() == blocks || self.candidates.is_empty())
            && self.candidates.is_sorted_by_key(|candidate| candidate.pair)
            && self.candidates.iter().all(is_known)
            && found
                .clone()
                .all(|&number| (number as usize) < self.candidates.len())
    }

    /// Makes all anew that a checkpoint does not contain.
    pub(crate) fn rebuild_workspace(&mut self) {
        self.list_candidates();
        self.workspace.is_near = vec![false; self.candidates.len()];
        for &number in &self.found {
            self.workspace.is_near[number as usize] = true;
        }
    }

    fn test_all(&mut self, blocks: &SearchContext<D>, at: Configuration<D>) {
        self.update_travel_bounds(blocks.tolerance);
        self.compare_bounds();
        self.found.clear();
        let SearchWorkspace {
            bound_checks,
            open,
            is_near,
            ..
        } = &mut self.workspace;
        is_near.clear();
        is_near.resize(self.candidates.len(), false);
        open.clear();
        for bound_check in bound_checks {
            for number in &bound_check.still_near {
                is_near[*number as usize] = true;
                self.found.push(*number);
            }
            open.extend(&bound_check.open);
        }
        let cache = blocks.surface.geometry_cache(open.len(), None);
        self.test_open(blocks, at.with(cache.as_ref()));
    }

    /// Computes the travel bounds of each block, and selects the active candidates again if the
    /// list is not valid for them.
    pub(crate) fn update_travel_bounds(&mut self, tolerance: f64) {
        let SearchWorkspace {
            travel_bounds,
            active_candidates,
            ..
        } = &mut self.workspace;
        travel_bounds.clear();
        travel_bounds.extend(
            self.blocks
                .iter()
                .map(|bound| bound.travel_bounds(tolerance)),
        );
        if !active_candidates.is_valid_for(travel_bounds) {
            let motion_bounds = self.blocks.iter().map(|bound| bound.motion_bound);
            let largest_motion_bound = motion_bounds.fold(0.0, f64::max);
            active_candidates.select(&self.candidates, travel_bounds, largest_motion_bound);
        }
    }

    /// Compares the active candidates with the travel bounds, in parallel chunks.
    fn compare_bounds(&mut self) {
        let SearchWorkspace {
            bound_checks,
            travel_bounds,
            active_candidates,
            ..
        } = &mut self.workspace;
        let some = active_candidates.numbers.par_chunks(BOUND_CHECKS_PER_TASK);
        bound_checks.resize_with(some.len(), BoundCheck::default);
        some.zip(bound_checks).for_each(|(numbers, bound_check)| {
            bound_check.still_near.clear();
            bound_check.open.clear();
            for &number in numbers {
                let candidate = &self.candidates[number as usize];
                let [a, b] = candidate.blocks.map(|block| travel_bounds[block as usize]);
                if a.travel + b.travel <= candidate.near_until {
                    bound_check.still_near.push(number);
                } else if candidate.may_be_near(a, b) {
                    bound_check.open.push(number);
                }
            }
        });
    }

    /// Tests the open candidates, and records the near ones.
    pub(crate) fn test_open(&mut self, blocks: &SearchContext<D>, at: Configuration<D>) {
        let test = |&number: &u32| {
            let candidate = &self.candidates[number as usize];
            let [a, b] = candidate.blocks.map(|block| &self.blocks[block as usize]);
            let (motion, travel) = (a.motion_bound + b.motion_bound, a.travel + b.travel);
            let apart = blocks.surface.distance_lower_bound(candidate.pair, at);
            let nearness = if apart <= DISTANCE_CHECKED * (motion + blocks.tolerance) {
                let surface = blocks.surface;
                surface.cull(candidate.pair, at, blocks.range(motion))
            } else {
                CullingResult::Far
            };
            let excluded_until = match nearness {
                CullingResult::ExcludedUntil(length) => {
                    length + CULLING_RATE * travel - CULLING_ROUND_OFF * blocks.tolerance
                }
                CullingResult::Near | CullingResult::Far => 0.0,
            };
            let near_until = if nearness == CullingResult::Near {
                travel
                    + f64::max(
                        NEAR_MARGIN * blocks.tolerance,
                        NEAR_MARGIN_IN_MOTION * motion,
                    )
            } else {
                -1.0
            };
            CandidateTest {
                far_until: apart + travel,
                excluded_until,
                near_until,
            }
        };
        let SearchWorkspace {
            open,
            tests,
            is_near,
            ..
        } = &mut self.workspace;
        let numbers = open.par_iter().with_min_len(CANDIDATES_PER_TASK);
        numbers.map(test).collect_into_vec(tests);
        for (&number, test) in open.iter().zip(&*tests) {
            let candidate = &mut self.candidates[number as usize];
            candidate.far_until = test.far_until;
            candidate.excluded_until = test.excluded_until;
            candidate.near_until = test.near_until;
            if test.near_until >= 0.0 {
                is_near[number as usize] = true;
                self.found.push(number);
            }
        }
    }
}

impl Candidate {
    /// Returns true if the pair may be near for these travel bounds of its blocks.
    pub(crate) fn may_be_near(&self, a: BlockTravel, b: BlockTravel) -> bool {
        self.far_until <= a.distance + b.distance && self.excluded_until <= a.turning + b.turning
    }
}

/// Travel bounds of a block, so far and in the step, m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockTravel {
    /// Travel so far.
    pub(super) travel: f64,
    /// Travel plus the distance that a near feature may have: half of the tolerance counts for
    /// either block.
    pub(crate) distance: f64,
    /// [`CULLING_RATE`] times the travel, plus the motion bound; compared with
    /// [`excluded_until`](Candidate::excluded_until).
    pub(crate) turning: f64,
}

impl MotionBound {
    fn travel_bounds(&self, tolerance: f64) -> BlockTravel {
        BlockTravel {
            travel: self.travel,
            distance: self.travel + DISTANCE_KEPT * (self.motion_bound + 0.5 * tolerance),
            turning: CULLING_RATE * self.travel + self.motion_bound,
        }
    }
}

impl<const D: usize> SearchContext<'_, D> {
    /// Returns the range of a relative `motion`, m.
    fn range(&self, motion: f64) -> CullingRange {
        CullingRange {
            motion,
            tolerance: self.tolerance,
        }
    }

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
