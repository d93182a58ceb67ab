//! Clusters: neighbouring boundary features of a block.
//!
//! The broad phase finds clusters whose boxes overlap, and only then looks at their features. A
//! block of one element is one cluster, so the cost of a crowd is that of its blocks. A mountain
//! has many, so the cost of a pebble on it is that of the surface below the pebble.

use std::ops::Range;

use crate::contact::surface::Surface;
use crate::contact::surface::aabb::Aabb;
use crate::contact::tolerances::MOST_FEATURES_OF_CLUSTER;

/// The clusters of all blocks.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clusters {
    pub(super) clusters: Vec<Cluster>,
    /// Number of feature families.
    pub(super) families: usize,
}

/// Main and target features of one block.
#[derive(Clone, Debug)]
pub(super) struct Cluster {
    pub(super) block: u32,
    /// Their nodes.
    pub(super) nodes: Vec<u32>,
    /// By family: mains, targets.
    pub(super) features: Vec<[Vec<u32>; 2]>,
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
            self.clusters.push(self.cluster_of(surface, features));
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

    fn cluster_of<const D: usize>(
        &self,
        surface: &dyn Surface<D>,
        features: &[ClusteredFeature<D>],
    ) -> Cluster {
        let mut cluster = Cluster {
            block: features[0].block,
            nodes: Vec::new(),
            features: vec![Default::default(); self.families],
        };
        for feature in features {
            cluster.features[feature.family][feature.side].push(feature.number);
            let nodes = nodes_of(surface, feature.side, feature.number);
            cluster.nodes.extend(nodes);
        }
        cluster.nodes.sort_unstable();
        cluster.nodes.dedup();
        for numbers in cluster.features.iter_mut().flatten() {
            numbers.sort_unstable();
        }
        cluster
    }

    /// Returns the number of features, mains and targets.
    pub(super) fn features(&self) -> usize {
        let sides = self.clusters.iter().flat_map(|cluster| &cluster.features);
        sides.flatten().map(Vec::len).sum()
    }
}

fn nodes_of<const D: usize>(surface: &dyn Surface<D>, side: usize, number: u32) -> &[u32] {
    if side == 0 {
        surface.main_nodes(number)
    } else {
        surface.target_nodes(number)
    }
}
