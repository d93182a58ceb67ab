//! Assembly of nodal impulses from the impulses of element groups.

use std::cmp::Reverse;

use crate::element::{ElementSet, GroupNodes};
use crate::math::adjacency::Adjacency;
use crate::math::vector::add_scaled;

/// For each node, the element impulses that act on it. A share is the impulse of a group on a node.
#[derive(Clone, Debug, Default)]
pub(crate) struct Assembly {
    /// First share of each set, and the total number.
    sets: Vec<usize>,
    /// Shares of each node, the finest level first.
    shares: Adjacency<Share>,
}

/// A share of a node.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    /// Index among the shares of all sets.
    number: u32,
    /// Level of its group.
    level: u8,
}

/// A group that may be due, with the number of its first share.
struct GroupShares<'a> {
    level: u8,
    nodes: &'a [u32],
    first: u32,
}

impl<'a> GroupShares<'a> {
    /// Returns the nodes with their shares.
    fn of_nodes(&self) -> impl Iterator<Item = (u32, Share)> + Clone + use<'a> {
        let level = self.level;
        let shares = (self.first..).map(move |number| Share { number, level });
        self.nodes.iter().copied().zip(shares)
    }
}

impl Assembly {
    /// Builds the assembly for the present groups of the elements.
    pub(super) fn new<const D: usize>(sets: &[Box<dyn ElementSet<D>>], node_count: usize) -> Self {
        let (mut starts, mut count) = (vec![0], 0);
        let mut groups = Vec::new();
        for set in sets {
            for GroupNodes { level, nodes } in set.groups() {
                let first = count as u32;
                groups.extend(level.map(|level| GroupShares {
                    level,
                    nodes,
                    first,
                }));
                count += nodes.len();
            }
            starts.push(count);
        }
        groups.sort_by_key(|group| Reverse(group.level));
        Self {
            sets: starts,
            shares: Adjacency::of_pairs(groups.iter().flat_map(GroupShares::of_nodes), node_count),
        }
    }

    /// Returns the number of shares.
    pub(super) fn len(&self) -> usize {
        self.sets.last().copied().unwrap_or_default()
    }

    /// Returns the shares of a set.
    pub(super) fn of_set(&self, set: usize) -> std::ops::Range<usize> {
        self.sets[set]..self.sets[set + 1]
    }

    /// Sums, for consecutive nodes beginning with `first`, those `shares` that are of level
    /// `coarsest` or finer.
    pub(super) fn sums<const D: usize>(
        &self,
        first: usize,
        coarsest: u8,
        shares: &[[f64; D]],
        sums: &mut [[f64; D]],
    ) {
        for (sum, own) in sums.iter_mut().zip(self.shares.lists_from(first)) {
            *sum = [0.0; D];
            for share in own {
                if share.level < coarsest {
                    break;
                }
                add_scaled(sum, 1.0, &shares[share.number as usize]);
            }
        }
    }
}
