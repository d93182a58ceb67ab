//! Assembly of nodal impulses from the impulses of element groups.

use crate::element::ElementSet;
use crate::math::vector::add_scaled;

/// For each node, the element impulses that act on it. A share is the impulse of a group on a node.
#[derive(Clone, Debug, Default)]
pub(crate) struct Assembly {
    /// First share of each set, and the total number.
    sets: Vec<usize>,
    /// First entry of each node, and the total number.
    start: Vec<u32>,
    /// Of each node, the finest level first.
    entries: Vec<Entry>,
}

/// A share of a node.
#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    /// Index among the shares of all sets.
    share: u32,
    /// Level of its group.
    level: u8,
}

impl Assembly {
    /// Builds the assembly for the present groups of the elements.
    pub(super) fn new<const D: usize>(sets: &[Box<dyn ElementSet<D>>], node_count: usize) -> Self {
        let mut assembly = Self {
            sets: vec![0],
            start: vec![0; node_count + 1],
            entries: Vec::new(),
        };
        let (mut count, mut levels) = (0, [false; u8::MAX as usize + 1]);
        for set in sets {
            set.each_group(&mut |level, nodes| {
                count += nodes.len();
                if let Some(level) = level {
                    levels[level as usize] = true;
                    for &node in nodes {
                        assembly.start[node as usize + 1] += 1;
                    }
                }
            });
            assembly.sets.push(count);
        }
        for node in 0..node_count {
            assembly.start[node + 1] += assembly.start[node];
        }
        let mut next = assembly.start.clone();
        assembly.entries = vec![Entry::default(); next[node_count] as usize];
        for level in (0..=u8::MAX).rev().filter(|&level| levels[level as usize]) {
            let mut share = 0;
            for set in sets {
                set.each_group(&mut |of_group, nodes| {
                    for &node in nodes.iter().filter(|_| of_group == Some(level)) {
                        let place = &mut next[node as usize];
                        assembly.entries[*place as usize] = Entry { share, level };
                        *place += 1;
                        share += 1;
                    }
                    if of_group != Some(level) {
                        share += nodes.len() as u32;
                    }
                });
            }
        }
        assembly
    }

    /// Returns the number of shares.
    pub(super) fn len(&self) -> usize {
        self.sets.last().copied().unwrap_or_default()
    }

    /// Returns the shares of a set.
    pub(super) fn of_set(&self, set: usize) -> std::ops::Range<usize> {
        self.sets[set]..self.sets[set + 1]
    }

    /// Sums the shares of consecutive nodes, beginning with `first`, that are of level `coarsest`
    /// or finer.
    pub(super) fn sums<const D: usize>(
        &self,
        first: usize,
        (coarsest, shares): (u8, &[[f64; D]]),
        sums: &mut [[f64; D]],
    ) {
        let starts = self.start[first..].iter().zip(&self.start[first + 1..]);
        for (sum, (&start, &end)) in sums.iter_mut().zip(starts) {
            *sum = [0.0; D];
            for entry in &self.entries[start as usize..end as usize] {
                if entry.level < coarsest {
                    break;
                }
                add_scaled(sum, 1.0, &shares[entry.share as usize]);
            }
        }
    }
}
