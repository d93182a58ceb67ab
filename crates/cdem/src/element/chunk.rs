//! Chunks of elements near each other, and the groups in them that are kicked together.

use std::cmp::Reverse;

use crate::element::batch::Batches;
use crate::element::geometry::{ElementGeometry, Moduli};
use crate::element::simd::WIDTH;

/// Largest number of elements in a chunk. The forces on the nodes of that many elements fit the
/// nearest caches, and a mesh of some ten thousand elements gives work for all threads.
pub(super) const MAX_CHUNK: usize = 2048;

/// Returns the number of elements in each chunk for `count` elements. The number of chunks is a
/// power of two, so that halves of them are equal work. A thread that waits for another falls
/// asleep and must be woken for the next pass.
pub(super) fn chunk_size(count: usize) -> usize {
    let chunks = count.div_ceil(MAX_CHUNK).next_power_of_two();
    count.max(1).div_ceil(chunks).next_multiple_of(WIDTH)
}

/// Elements of one material near each other, sorted by level.
pub(super) struct Chunk<const D: usize, const N: usize, const Q: usize> {
    pub(super) moduli: Moduli,
    /// Finest level first; elements that are never due last.
    groups: Vec<LevelGroup<D, N, Q>>,
    /// Sum over all groups of their numbers of nodes.
    node_count: usize,
}

/// Elements of one level.
pub(super) struct LevelGroup<const D: usize, const N: usize, const Q: usize> {
    /// `None`: never due.
    pub(super) level: Option<u8>,
    /// Their indices in the set, ascending.
    pub(super) members: Vec<u32>,
    /// Their nodes in the mesh, ascending.
    pub(super) nodes: Vec<u32>,
    pub(super) batches: Batches<D, N, Q>,
}

/// Position of an element of a set: [`MAX_CHUNK`] times the index of its chunk, plus its index in
/// the chunk, counted over the groups one after the other.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ElementSlot(u32);

impl ElementSlot {
    /// Creates the position at index `within` in the chunk with index `chunk`.
    pub(super) fn new(chunk: usize, within: usize) -> Self {
        Self((chunk * MAX_CHUNK + within) as u32)
    }

    /// Returns the index of the chunk.
    pub(super) fn chunk(self) -> usize {
        self.0 as usize / MAX_CHUNK
    }

    /// Returns the index in the chunk.
    pub(super) fn within(self) -> usize {
        self.0 as usize % MAX_CHUNK
    }
}

/// An element with all its data.
pub(super) struct Member<const D: usize, const N: usize, const Q: usize> {
    pub(super) number: u32,
    pub(super) nodes: [u32; N],
    pub(super) element: ElementGeometry<D, N, Q>,
    pub(super) record: Vec<f64>,
}

impl<const D: usize, const N: usize, const Q: usize> Chunk<D, N, Q> {
    /// Creates a chunk of elements that are all at level 0.
    pub(super) fn new(moduli: Moduli, members: &[Member<D, N, Q>]) -> Self {
        let group = LevelGroup::new(Some(0), members);
        Self {
            moduli,
            node_count: group.nodes.len(),
            groups: vec![group],
        }
    }

    /// Returns the groups, finest level first.
    pub(super) fn groups(&self) -> &[LevelGroup<D, N, Q>] {
        &self.groups
    }

    /// Returns the index of the group of the element with index `within` in this chunk, and its
    /// index in the group.
    pub(super) fn group_of(&self, within: usize) -> (usize, usize) {
        let (mut group, mut index) = (0, within);
        while index >= self.groups[group].members.len() {
            index -= self.groups[group].members.len();
            group += 1;
        }
        (group, index)
    }

    pub(super) fn groups_mut(&mut self) -> &mut [LevelGroup<D, N, Q>] {
        &mut self.groups
    }

    /// Returns the number of nodes of all groups. A node of several groups counts several times.
    pub(super) fn node_count(&self) -> usize {
        self.node_count
    }

    /// Returns the groups of level `coarsest` or finer.
    pub(super) fn due(&self, coarsest: u8) -> impl Iterator<Item = &LevelGroup<D, N, Q>> {
        let groups = self.groups.iter();
        groups.filter(move |group| group.is_due(coarsest))
    }

    /// Returns the memory, bytes.
    pub(super) fn memory(&self) -> usize {
        let groups = self.groups.iter();
        groups
            .map(|group| {
                group.batches.memory() + size_of_val(&*group.members) + size_of_val(&*group.nodes)
            })
            .sum()
    }

    /// Sorts the elements by level. Returns true if a level has changed.
    pub(super) fn arrange(&mut self, record: usize, level: impl Fn(u32) -> Option<u8>) -> bool {
        let stays = |group: &LevelGroup<D, N, Q>| {
            let mut members = group.members.iter();
            members.all(|&number| level(number) == group.level)
        };
        if self.groups.iter().all(stays) {
            return false;
        }
        let groups = self.groups.iter();
        let mut members: Vec<_> = groups
            .flat_map(|group| group.taken_apart(&self.moduli, record))
            .collect();
        members.sort_by_cached_key(|member| (Reverse(level(member.number)), member.number));
        let same = members.chunk_by(|a, b| level(a.number) == level(b.number));
        self.groups = same
            .map(|members| LevelGroup::new(level(members[0].number), members))
            .collect();
        self.node_count = self.groups.iter().map(|group| group.nodes.len()).sum();
        true
    }
}

impl<const D: usize, const N: usize, const Q: usize> LevelGroup<D, N, Q> {
    fn new(level: Option<u8>, members: &[Member<D, N, Q>]) -> Self {
        let mut nodes: Vec<u32> = members.iter().flat_map(|member| member.nodes).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes.shrink_to_fit();
        let record = members.first().map_or(0, |member| member.record.len());
        let mut batches = Batches::with_capacity(members.len(), record);
        for member in members {
            let own = member.nodes.map(|node| {
                let place = nodes.binary_search(&node);
                place.expect("a node of the group") as u16
            });
            batches.push(own, &member.element, &member.record);
        }
        Self {
            level,
            members: members.iter().map(|member| member.number).collect(),
            nodes,
            batches,
        }
    }

    /// True if the elements are due when the levels from `coarsest` on are.
    pub(super) fn is_due(&self, coarsest: u8) -> bool {
        self.level.is_some_and(|level| level >= coarsest)
    }

    /// Returns the geometry of one element.
    pub(super) fn element(&self, index: usize, moduli: &Moduli) -> ElementGeometry<D, N, Q> {
        self.batches.element(index, moduli.lame)
    }

    /// Returns the nodes of an element in the mesh.
    pub(super) fn nodes_of(&self, index: usize) -> [u32; N] {
        let own = self.batches.nodes(index);
        own.map(|node| self.nodes[node as usize])
    }

    /// Reads the record of an element.
    pub(super) fn record(&self, index: usize, record: &mut [f64]) {
        let rows = self.batches.batch(index / WIDTH, record.len()).records;
        for (number, row) in record.iter_mut().zip(rows) {
            *number = row[index % WIDTH];
        }
    }

    /// Writes the record of an element.
    pub(super) fn set_record(&mut self, index: usize, record: &[f64]) {
        let (batch, _) = self.batches.batch_mut(index / WIDTH, record.len());
        for (number, row) in record.iter().zip(batch.records) {
            row[index % WIDTH] = *number;
        }
    }

    fn taken_apart(&self, moduli: &Moduli, record: usize) -> impl Iterator<Item = Member<D, N, Q>> {
        let members = self.members.iter().enumerate();
        members.map(move |(index, &number)| {
            let mut own = vec![0.0; record];
            self.record(index, &mut own);
            Member {
                number,
                nodes: self.nodes_of(index),
                element: self.element(index, moduli),
                record: own,
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_of_the_chunks_are_as_much_work() {
        for count in (1..20_000).chain([99_999, 1_000_000]) {
            let size = chunk_size(count);
            let chunks = count.div_ceil(size);
            assert!(size <= MAX_CHUNK && size.is_multiple_of(WIDTH));
            let left = chunks / 2 * size;
            let differ = left.abs_diff(count - left);
            // Unfilled batches cause the difference; with more than 16 chunks it is one chunk at
            // most.
            let allowed = if chunks > 16 { size } else { chunks * WIDTH };
            assert!(chunks == 1 || differ <= allowed, "{differ} of {count}");
        }
        assert!(chunk_size(0) > 0);
    }
}
