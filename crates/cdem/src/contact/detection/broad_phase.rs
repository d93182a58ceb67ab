//! The broad phase of a search, and the lists that follow from its candidates.

use rayon::prelude::*;

use crate::contact::detection::candidates::{
    BlockMotion, Candidate, CandidateSearch, SearchContext,
};
use crate::contact::detection::clusters::{Cluster, Clusters};
use crate::contact::detection::grid;
use crate::contact::surface::aabb::Aabb;
use crate::contact::surface::{Configuration, Pair, Surface};
use crate::contact::tolerances::{
    BOUND_SLACK, BROAD_PHASE_STEPS, BROAD_PHASE_STEPS_AT_REST, CANDIDATES_PER_TASK,
    CLUSTERS_PER_TASK,
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
        let motion_bounds = self.blocks.iter().map(|block| block.motion_bound);
        let mean = motion_bounds.sum::<f64>() / moving as f64;
        let least = (BROAD_PHASE_STEPS * mean).max(BROAD_PHASE_STEPS_AT_REST * blocks.resolution);
        for (block, &fixed) in self.blocks.iter_mut().zip(blocks.fixed) {
            *block = BlockMotion {
                motion_bound: block.motion_bound,
                travel: 0.0,
                allowance: if fixed {
                    0.0
                } else {
                    least.max(BROAD_PHASE_STEPS * block.motion_bound)
                },
            };
        }
        let allowance = |block: u32| self.blocks[block as usize].allowance;
        let resolution = (1.0 + BOUND_SLACK) * blocks.resolution;
        let margin = |block| allowance(block) + 0.5 * resolution;
        let clusters = blocks.clusters;
        let cache = blocks.surface.geometry_cache(clusters.features(), None);
        let at = at.with(cache.as_ref());
        let pairs = clusters.overlapping(blocks.surface, at, &margin, may_meet);
        let pairs = pairs.into_par_iter().with_min_len(CANDIDATES_PER_TASK);
        let candidates = pairs.filter_map(|pair| {
            let (of, distance) = (blocks.of(pair), blocks.surface.distance(pair, at));
            let [a, b] = of.map(margin);
            (distance <= a + b).then(|| Candidate::new(pair, of, distance))
        });
        self.candidates = candidates.collect();
        self.active_candidates.forget();
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
