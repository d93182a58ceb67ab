//! The broad phase of a search, and the lists that follow from its candidates.

use rayon::prelude::*;

use crate::contact::detection::candidates::{
    Candidate, CandidateSearch, MotionBound, SearchContext,
};
use crate::contact::detection::clusters::{Cluster, Clusters};
use crate::contact::detection::grid;
use crate::contact::surface::aabb::Aabb;
use crate::contact::surface::{Configuration, Pair, Surface};
use crate::contact::tolerances::{
    BROAD_PHASE_STEPS, BROAD_PHASE_STEPS_AT_REST, CANDIDATES_PER_TASK, CLUSTERS_PER_TASK,
    DISTANCE_KEPT,
};

/// Boxes around the features of a cluster, grown, in the order of [`Cluster::features`].
type ClusterBoxes<const D: usize> = Vec<[Vec<Aabb<D>>; 2]>;

impl<const D: usize> CandidateSearch<D> {
    /// Finds all candidates anew, and sets the allowances for which they serve.
    pub(super) fn broad_phase(
        &mut self,
        blocks: &SearchContext<D>,
        at: Configuration<D>,
        may_meet: &impl Fn([u32; 2]) -> bool,
    ) {
        let moving = blocks.fixed.iter().filter(|&&fixed| !fixed).count().max(1);
        let motion_bounds = self.blocks.iter().map(|bound| bound.motion_bound);
        let mean = motion_bounds.sum::<f64>() / moving as f64;
        let least = (BROAD_PHASE_STEPS * mean).max(BROAD_PHASE_STEPS_AT_REST * blocks.tolerance);
        for (bound, &fixed) in self.blocks.iter_mut().zip(blocks.fixed) {
            *bound = MotionBound {
                motion_bound: bound.motion_bound,
                allowance: if fixed {
                    0.0
                } else {
                    least.max(BROAD_PHASE_STEPS * bound.motion_bound)
                },
                ..MotionBound::default()
            };
        }
        self.origin.clear();
        let nodes = 0..blocks.block_of.len() as u32;
        self.origin.extend(nodes.map(|node| at.at(node)));
        self.last.clone_from(&self.origin);
        let allowance = |block: u32| self.blocks[block as usize].allowance;
        let margin = |block| DISTANCE_KEPT * (allowance(block) + 0.5 * blocks.tolerance);
        let clusters = blocks.clusters;
        let cache = blocks.surface.geometry_cache(clusters.features(), None);
        let at = at.with(cache.as_ref());
        let pairs = clusters.overlapping(blocks.surface, at, &margin, may_meet);
        let pairs = pairs.into_par_iter().with_min_len(CANDIDATES_PER_TASK);
        let candidates = pairs.map(|pair| Candidate {
            pair,
            blocks: blocks.of(pair),
            far_until: blocks.surface.distance_lower_bound(pair, at),
            excluded_until: 0.0,
            near_until: -1.0,
        });
        let within = |candidate: &Candidate| {
            let [a, b] = candidate.blocks.map(margin);
            candidate.far_until <= a + b
        };
        self.candidates = candidates.filter(within).collect();
        self.list_candidates();
    }

    /// Lists the candidates by main feature and by block.
    pub(super) fn list_candidates(&mut self) {
        self.workspace.active_candidates.forget();
        let mains = self.candidates.last().map_or(0, |last| last.pair.main + 1);
        let main = |candidate: &Candidate| candidate.pair.main as usize;
        self.workspace.of_main = starts(self.candidates.iter().map(main), mains as usize);
        let blocks = |candidate: &Candidate| candidate.blocks.map(|block| block as usize);
        let all = self.candidates.iter().flat_map(blocks);
        self.workspace.block_start = starts(all, self.blocks.len());
        let mut next = self.workspace.block_start.clone();
        self.workspace.of_block.clear();
        self.workspace.of_block.resize(2 * self.candidates.len(), 0);
        for (number, candidate) in (0..).zip(&self.candidates) {
            for block in blocks(candidate) {
                self.workspace.of_block[next[block] as usize] = number;
                next[block] += 1;
            }
        }
    }

    /// Returns the numbers of the candidates of a block.
    pub(super) fn candidates_of(&self, block: usize) -> &[u32] {
        &self.workspace.of_block[self.workspace.block_start[block] as usize
            ..self.workspace.block_start[block + 1] as usize]
    }
}

impl Clusters {
    /// Returns the canonical feature pairs of blocks that `may_meet` whose boxes overlap, sorted.
    /// Each box is grown by the `margin` of its block, m.
    pub(in crate::contact) fn overlapping<const D: usize>(
        &self,
        surface: &dyn Surface<D>,
        at: Configuration<D>,
        margin: &(impl Fn(u32) -> f64 + Sync),
        may_meet: &impl Fn([u32; 2]) -> bool,
    ) -> Vec<Pair> {
        let around = |cluster: &Cluster| {
            let nodes = cluster.nodes.iter().map(|&node| at.at(node));
            Aabb::around(nodes, margin(cluster.block))
        };
        let extents: Vec<Aabb<D>> = self.clusters.iter().map(around).collect();
        let wanted = |one: u32, other: u32| {
            one < other
                && may_meet([one, other].map(|cluster| self.clusters[cluster as usize].block))
        };
        let meeting = grid::overlapping(&extents, &extents, wanted);
        let mut meets = vec![false; self.clusters.len()];
        for (one, other) in &meeting {
            (meets[*one as usize], meets[*other as usize]) = (true, true);
        }
        let clusters = (&self.clusters, meets)
            .into_par_iter()
            .with_min_len(CLUSTERS_PER_TASK);
        let boxes = clusters.map(|(cluster, meets)| {
            let boxes = || cluster.boxes(surface, at, margin(cluster.block));
            meets.then(boxes).unwrap_or_default()
        });
        let boxes: Vec<ClusterBoxes<D>> = boxes.collect();
        let meeting = meeting.into_par_iter().with_min_len(CLUSTERS_PER_TASK);
        let pairs = meeting.flat_map_iter(|(one, other)| {
            let both = [one, other].map(|cluster| cluster as usize);
            let orders = [both, [both[1], both[0]]].into_iter();
            orders.flat_map(|sides| self.pairs(sides, &boxes, &extents))
        });
        let mut pairs: Vec<Pair> = pairs.filter(|&pair| surface.is_canonical(pair)).collect();
        pairs.par_sort_unstable();
        pairs
    }

    /// Returns the mains of a cluster and targets of another whose boxes overlap.
    fn pairs<const D: usize>(
        &self,
        [main, target]: [usize; 2],
        boxes: &[ClusterBoxes<D>],
        extents: &[Aabb<D>],
    ) -> Vec<Pair> {
        let mut pairs = Vec::new();
        for family in 0..self.families {
            let within = |cluster: usize, side: usize, other: usize| {
                let numbers = self.clusters[cluster].features[family][side].iter();
                let both = numbers.copied().zip(&boxes[cluster][family][side]);
                both.filter(move |(_, aabb)| aabb.overlaps(&extents[other]))
            };
            let targets: Vec<_> = within(target, 1, main).collect();
            for (main, aabb) in within(main, 0, target) {
                let close = targets.iter().filter(|(_, other)| aabb.overlaps(other));
                pairs.extend(close.map(|&(target, _)| Pair { main, target }));
            }
        }
        pairs
    }
}

impl Cluster {
    /// Returns the boxes around the features, grown by `margin`, m.
    fn boxes<const D: usize>(
        &self,
        surface: &dyn Surface<D>,
        at: Configuration<D>,
        margin: f64,
    ) -> ClusterBoxes<D> {
        let of_family = |[mains, targets]: &[Vec<u32>; 2]| {
            let main_box = |&main: &u32| surface.main_box(main, at, margin);
            let target_box = |&target: &u32| surface.target_box(target, at, margin);
            [
                mains.iter().map(main_box).collect(),
                targets.iter().map(target_box).collect(),
            ]
        };
        self.features.iter().map(of_family).collect()
    }
}

/// Returns the index of the first item of each of `count` owners in a list sorted by owner, and the
/// end of the list.
fn starts(owners: impl Iterator<Item = usize>, count: usize) -> Vec<u32> {
    let mut start = vec![0; count + 1];
    for owner in owners {
        start[owner + 1] += 1;
    }
    for owner in 0..count {
        start[owner + 1] += start[owner];
    }
    start
}
