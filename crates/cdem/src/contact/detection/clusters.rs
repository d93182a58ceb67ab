//! Clusters: neighbouring boundary features of a block.
//!
//! The broad phase finds clusters whose boxes overlap, and only then looks at their features. A
//! block of one element is one cluster, so the cost of a crowd is that of its blocks. A mountain
//! has many, so the cost of a pebble on it is that of the surface below the pebble.

use std::ops::Range;

use rayon::prelude::*;

use crate::contact::detection::grid;
use crate::contact::surface::aabb::Aabb;
use crate::contact::surface::{Configuration, Pair, Surface};
use crate::contact::tolerances::{CLUSTERS_PER_TASK, MOST_FEATURES_OF_CLUSTER};

/// The clusters of all blocks.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clusters {
    clusters: Vec<Cluster>,
    /// Number of feature families.
    families: usize,
}

/// Main and target features of one block.
#[derive(Clone, Debug)]
struct Cluster {
    block: u32,
    /// Their nodes.
    nodes: Vec<u32>,
    /// By family: mains, targets.
    features: Vec<[Vec<u32>; 2]>,
}

/// A feature to be put into a cluster.
struct ClusteredFeature<const D: usize> {
    block: u32,
    /// Mean of its nodes at rest, m.
    middle: [f64; D],
    family: usize,
    /// 0 for a main, 1 for a target.
    side: usize,
    number: u32,
}

/// Boxes around the features of a cluster, grown, in the order of [`Cluster::features`].
type ClusterBoxes<const D: usize> = Vec<[Vec<Aabb<D>>; 2]>;

impl Clusters {
    /// Returns the clusters of a surface whose nodes belong to `block_of` and lie at `rest`, m.
    pub(crate) fn new<const D: usize>(
        surface: &dyn Surface<D>,
        block_of: &[u32],
        rest: &[[f64; D]],
    ) -> Self {
        let families = surface.families();
        let mut features: Vec<ClusteredFeature<D>> = Vec::new();
        for (family, sides) in families.iter().enumerate() {
            for (side, numbers) in sides.iter().enumerate() {
                for number in Range::clone(numbers) {
                    let nodes = nodes_of(surface, side, number);
                    let share = 1.0 / nodes.len() as f64;
                    let coordinate = |c: usize| -> f64 {
                        let of_nodes = nodes.iter().map(|&node| rest[node as usize][c]);
                        share * of_nodes.sum::<f64>()
                    };
                    features.push(ClusteredFeature {
                        block: block_of[nodes[0] as usize],
                        middle: std::array::from_fn(coordinate),
                        family,
                        side,
                        number,
                    });
                }
            }
        }
        features.sort_by_key(|feature| feature.block);
        let mut clusters = Self {
            clusters: Vec::new(),
            families: families.len(),
        };
        for of_block in features.chunk_by_mut(|one, other| one.block == other.block) {
            clusters.divide(surface, of_block);
        }
        clusters
    }

    /// Splits the features of a block in halves across their longest extent, until they are few.
    fn divide<const D: usize>(
        &mut self,
        surface: &dyn Surface<D>,
        features: &mut [ClusteredFeature<D>],
    ) {
        if features.len() <= MOST_FEATURES_OF_CLUSTER {
            self.clusters.push(self.patch(surface, features));
            return;
        }
        let extent = Aabb::around(features.iter().map(|feature| feature.middle), 0.0);
        let length = |c: &usize| extent.max[*c] - extent.min[*c];
        let longest = (0..D).max_by(|a, b| length(a).total_cmp(&length(b)));
        let c = longest.unwrap_or(0);
        let half = features.len() / 2;
        features.select_nth_unstable_by(half, |one, other| {
            let rank = |f: &ClusteredFeature<D>| (f.family, f.side, f.number);
            let by_place = one.middle[c].total_cmp(&other.middle[c]);
            by_place.then_with(|| rank(one).cmp(&rank(other)))
        });
        let (low, high) = features.split_at_mut(half);
        self.divide(surface, low);
        self.divide(surface, high);
    }

    fn patch<const D: usize>(
        &self,
        surface: &dyn Surface<D>,
        features: &[ClusteredFeature<D>],
    ) -> Cluster {
        let mut patch = Cluster {
            block: features[0].block,
            nodes: Vec::new(),
            features: vec![Default::default(); self.families],
        };
        for feature in features {
            patch.features[feature.family][feature.side].push(feature.number);
            let nodes = nodes_of(surface, feature.side, feature.number);
            patch.nodes.extend(nodes);
        }
        patch.nodes.sort_unstable();
        patch.nodes.dedup();
        for numbers in patch.features.iter_mut().flatten() {
            numbers.sort_unstable();
        }
        patch
    }

    /// Returns the number of features, mains and targets.
    pub(super) fn features(&self) -> usize {
        let sides = self.clusters.iter().flat_map(|patch| &patch.features);
        sides.flatten().map(Vec::len).sum()
    }

    /// Returns the canonical feature pairs of blocks that `may_meet` whose boxes overlap, sorted.
    /// Each box is grown by the `margin` of its block, m.
    pub(in crate::contact) fn overlapping<const D: usize>(
        &self,
        surface: &dyn Surface<D>,
        at: Configuration<D>,
        margin: &(impl Fn(u32) -> f64 + Sync),
        may_meet: &impl Fn([u32; 2]) -> bool,
    ) -> Vec<Pair> {
        let around = |patch: &Cluster| {
            let nodes = patch.nodes.iter().map(|&node| at.at(node));
            Aabb::around(nodes, margin(patch.block))
        };
        let extents: Vec<Aabb<D>> = self.clusters.iter().map(around).collect();
        let wanted = |one: u32, other: u32| {
            one < other && may_meet([one, other].map(|patch| self.clusters[patch as usize].block))
        };
        let meeting = grid::overlapping(&extents, &extents, wanted);
        let mut meets = vec![false; self.clusters.len()];
        for (one, other) in &meeting {
            (meets[*one as usize], meets[*other as usize]) = (true, true);
        }
        let clusters = (&self.clusters, meets)
            .into_par_iter()
            .with_min_len(CLUSTERS_PER_TASK);
        let boxes = clusters.map(|(patch, meets)| {
            let boxes = || patch.boxes(surface, at, margin(patch.block));
            meets.then(boxes).unwrap_or_default()
        });
        let boxes: Vec<ClusterBoxes<D>> = boxes.collect();
        let meeting = meeting.into_par_iter().with_min_len(CLUSTERS_PER_TASK);
        let pairs = meeting.flat_map_iter(|(one, other)| {
            let both = [one, other].map(|patch| patch as usize);
            let ways = [both, [both[1], both[0]]].into_iter();
            ways.flat_map(|sides| self.pairs(sides, &boxes, &extents))
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
            let within = |patch: usize, side: usize, other: usize| {
                let numbers = self.clusters[patch].features[family][side].iter();
                let both = numbers.copied().zip(&boxes[patch][family][side]);
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

fn nodes_of<const D: usize>(surface: &dyn Surface<D>, side: usize, number: u32) -> &[u32] {
    if side == 0 {
        surface.main_nodes(number)
    } else {
        surface.target_nodes(number)
    }
}
