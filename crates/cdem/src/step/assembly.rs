//! Assembly of nodal impulses from the impulses of element groups.

use std::cmp::Reverse;

use crate::element::{ElementSet, GroupNodes};
use crate::math::adjacency::Adjacency;
use crate::math::vector::add_scaled;

/// For each node, the group impulses that act on it: impulses of element groups on a node.
#[derive(Clone, Debug, Default)]
pub(crate) struct Assembly {
    /// First group impulse of each set, and the total number.
    sets: Vec<usize>,
    /// Group impulses of each node, the finest level first.
    group_impulses: Adjacency<GroupImpulse>,
}

/// A group impulse on a node.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct GroupImpulse {
    /// Index among the group impulses of all sets.
    pub(super) number: u32,
    /// Level of its group.
    pub(super) level: u8,
}

/// A group that may be due, with the number of its first group impulse.
struct GroupRange<'a> {
    level: u8,
    nodes: &'a [u32],
    first: u32,
}

impl<'a> GroupRange<'a> {
    /// Returns the nodes with their group impulses.
    fn of_nodes(&self) -> impl Iterator<Item = (u32, GroupImpulse)> + Clone + use<'a> {
        let level = self.level;
        let group_impulses = (self.first..).map(move |number| GroupImpulse { number, level });
        self.nodes.iter().copied().zip(group_impulses)
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
                groups.extend(level.map(|level| GroupRange {
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
            group_impulses: Adjacency::of_pairs(
                groups.iter().flat_map(GroupRange::of_nodes),
                node_count,
            ),
        }
    }

    /// Returns the group impulses of each node, the finest level first.
    pub(super) fn of_nodes(&self) -> impl Iterator<Item = &[GroupImpulse]> {
        self.group_impulses.lists_from(0)
    }

    /// Returns the number of group impulses.
    pub(super) fn len(&self) -> usize {
        self.sets.last().copied().unwrap_or_default()
    }

    /// Returns the range of the group impulses of a set.
    pub(super) fn of_set(&self, set: usize) -> std::ops::Range<usize> {
        self.sets[set]..self.sets[set + 1]
    }

    /// Sums, for consecutive nodes beginning with `first`, those `group_impulses` that are of level
    /// `coarsest` or finer.
    pub(super) fn sums<const D: usize>(
        &self,
        first: usize,
        coarsest: u8,
        group_impulses: &[[f64; D]],
        sums: &mut [[f64; D]],
    ) {
        for (sum, own) in sums.iter_mut().zip(self.group_impulses.lists_from(first)) {
            *sum = [0.0; D];
            for group_impulse in own {
                if group_impulse.level < coarsest {
                    break;
                }
                add_scaled(sum, 1.0, &group_impulses[group_impulse.number as usize]);
            }
        }
    }
}
