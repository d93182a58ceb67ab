//! From the shares of groups of elements to what their nodes get.

use rayon::prelude::*;

use crate::element::ElementSet;
use crate::model::AT_ONCE;

/// Which shares belong to each node.
#[derive(Clone, Debug, Default)]
pub(crate) struct Assembly {
    /// Where the shares of each set begin, and where all end.
    sets: Vec<usize>,
    /// Where the entries of each node begin, and where all end.
    start: Vec<u32>,
    /// Finest first.
    entries: Vec<Entry>,
}

/// A share of a node.
#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    /// Its number among the shares of all sets.
    share: u32,
    /// Level of its group.
    level: u8,
}

impl Assembly {
    /// Of the groups that the elements are in now.
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

    /// Number of shares.
    pub(super) fn len(&self) -> usize {
        self.sets.last().copied().unwrap_or_default()
    }

    /// Shares of a set.
    pub(super) fn of_set(&self, set: usize) -> std::ops::Range<usize> {
        self.sets[set]..self.sets[set + 1]
    }

    /// Sums of the shares of some nodes that are of level `coarsest` or finer.
    pub(super) fn sums<const D: usize>(
        &self,
        nodes: &[u32],
        coarsest: u8,
        shares: &[[f64; D]],
        sums: &mut Vec<[f64; D]>,
    ) {
        let sum = |&node: &u32| self.sum(node, coarsest, shares);
        let nodes = nodes.par_iter().with_min_len(AT_ONCE);
        nodes.map(sum).collect_into_vec(sums);
    }

    /// The same of all nodes.
    pub(super) fn sum_all<const D: usize>(
        &self,
        coarsest: u8,
        shares: &[[f64; D]],
        sums: &mut [[f64; D]],
    ) {
        let sums = sums.par_iter_mut().with_min_len(AT_ONCE).enumerate();
        sums.for_each(|(node, sum)| *sum = self.sum(node as u32, coarsest, shares));
    }

    /// Where they are all that acts: the same of all nodes, which takes their velocities from
    /// `before` to after a kick of lumped masses, in one pass over memory.
    pub(super) fn kick_all<const D: usize>(
        &self,
        (coarsest, shares): (u8, &[[f64; D]]),
        inverse_mass: &[[f64; D]],
        [sums, before, velocity]: [&mut [[f64; D]]; 3],
    ) {
        let sums = sums.par_iter_mut().with_min_len(AT_ONCE).enumerate();
        let nodes = sums.zip(before).zip(velocity).zip(inverse_mass);
        nodes.for_each(|((((node, sum), before), velocity), inverse)| {
            *sum = self.sum(node as u32, coarsest, shares);
            *before = *velocity;
            for c in 0..D {
                velocity[c] += inverse[c] * sum[c];
            }
        });
    }

    #[inline]
    fn sum<const D: usize>(&self, node: u32, coarsest: u8, shares: &[[f64; D]]) -> [f64; D] {
        let node = node as usize;
        let own = self.start[node] as usize..self.start[node + 1] as usize;
        let mut sum = [0.0; D];
        for entry in &self.entries[own] {
            if entry.level < coarsest {
                break;
            }
            let share = &shares[entry.share as usize];
            for c in 0..D {
                sum[c] += share[c];
            }
        }
        sum
    }
}
