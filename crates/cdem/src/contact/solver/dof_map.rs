//! Map from the nodes that contacts of an island move to the velocities in the solver's SIMD
//! blocks.

use std::ops::Range;

use crate::contact::solver::contact_rows::nodes_of;
use crate::contact::solver::inverse_mass_columns::InverseMassColumns;
use crate::contact::solver::simd_block::SimdBlock;
use crate::contact::surface::ContactJacobian;
use crate::model::inverse_mass::{InverseMass, KickMobility};

/// Position of a node's components among the numbers of all SIMD blocks: the first, and the
/// stride to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct DofSlot {
    pub(super) first: u32,
    pub(super) stride: u32,
}

/// Nodes that impulses may move, and all nodes that mass matrices couple to them. Prescribed
/// ones among these do not move.
#[derive(Clone, Debug, Default)]
pub(super) struct DofMap {
    /// All of them, sorted.
    nodes: Vec<u32>,
    /// Nodes with a slot, whose velocities change at each visit, sorted; and their slots.
    slot_nodes: Vec<u32>,
    slots: Vec<DofSlot>,
    /// The other nodes, sorted: those of blocks that move by columns and that no contact
    /// touches. They need no velocity before the impulses are known.
    others: Vec<u32>,
    groups: Vec<CoupledNodes>,
    /// The number of SIMD blocks.
    simd_blocks: usize,
}

/// Nodes that one mass matrix couples.
#[derive(Clone, Debug)]
pub(super) struct CoupledNodes {
    nodes: Range<u32>,
    /// Their ranges among the nodes with a slot, the other nodes, and the SIMD blocks.
    pub(super) slots: Range<usize>,
    pub(super) others: Range<usize>,
    pub(super) simd_blocks: Range<u32>,
}

impl DofSlot {
    /// Returns the slots of `nodes` nodes that one mass matrix couples, in SIMD blocks from
    /// `simd_block` on; and the number of these SIMD blocks.
    fn of<const D: usize, P: SimdBlock>(
        nodes: usize,
        simd_block: usize,
    ) -> (impl Iterator<Item = Self>, usize) {
        let (simd_blocks, stride) = if nodes == 1 && !P::BY_COLUMNS {
            (1, 1)
        } else {
            (D * nodes.div_ceil(P::WIDTH), P::WIDTH)
        };
        let slots = (0..nodes).map(move |k| Self {
            first: (P::WIDTH * (simd_block + D * (k / P::WIDTH)) + k % P::WIDTH) as u32,
            stride: stride as u32,
        });
        (slots, simd_blocks)
    }

    /// Returns the position of a component.
    #[inline(always)]
    pub(super) fn number(self, component: usize) -> usize {
        self.first as usize + component * self.stride as usize
    }
}

impl DofMap {
    /// Assigns slots for the nodes that contacts move, given sorted. Fills the `columns` of
    /// blocks that move by columns.
    pub(super) fn slot<const D: usize, P: SimdBlock>(
        &mut self,
        moved: &[u32],
        inertia: &InverseMass<D>,
        columns: &mut InverseMassColumns<D, P>,
    ) {
        self.nodes.clear();
        self.slot_nodes.clear();
        self.slots.clear();
        self.others.clear();
        self.groups.clear();
        self.simd_blocks = 0;
        columns.clear();
        let mut moved = moved;
        while let Some(&node) = moved.first() {
            let coupled = inertia.coupled(node as usize);
            let coupled = coupled.start as u32..coupled.end as u32;
            let (own, rest) = moved.split_at(moved.partition_point(|node| *node < coupled.end));
            let starts = (self.slot_nodes.len(), self.others.len());
            self.nodes.extend(coupled.clone());
            if P::BY_COLUMNS {
                let is_other = |node: &u32| own.binary_search(node).is_err();
                self.slot_nodes.extend(own);
                self.others.extend(coupled.clone().filter(is_other));
                columns.add(inertia, own, &self.others[starts.1..]);
            } else {
                self.slot_nodes.extend(coupled.clone());
            }
            let count = self.slot_nodes.len() - starts.0;
            let (slots, simd_blocks) = DofSlot::of::<D, P>(count, self.simd_blocks);
            self.slots.extend(slots);
            self.groups.push(CoupledNodes {
                nodes: coupled,
                slots: starts.0..self.slot_nodes.len(),
                others: starts.1..self.others.len(),
                simd_blocks: self.simd_blocks as u32..(self.simd_blocks + simd_blocks) as u32,
            });
            self.simd_blocks += simd_blocks;
            moved = rest;
        }
    }

    /// Returns all nodes, sorted.
    pub(super) fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Returns the nodes with a slot, sorted.
    pub(super) fn slots(&self) -> impl ExactSizeIterator<Item = (u32, DofSlot)> + '_ {
        self.slot_nodes
            .iter()
            .copied()
            .zip(self.slots.iter().copied())
    }

    /// Returns the nodes without a slot, sorted.
    pub(super) fn others(&self) -> &[u32] {
        &self.others
    }

    pub(super) fn groups(&self) -> &[CoupledNodes] {
        &self.groups
    }

    /// Returns the number of SIMD blocks.
    pub(super) fn simd_blocks(&self) -> usize {
        self.simd_blocks
    }

    /// Returns the index of a node among those with a slot, its slot, and the SIMD blocks of
    /// all nodes that a mass matrix couples to it.
    pub(super) fn find(&self, node: u32) -> (usize, DofSlot, Range<u32>) {
        let place = self.slot_nodes.partition_point(|&other| other < node);
        (place, self.slots[place], self.simd_blocks_around(node))
    }

    fn simd_blocks_around(&self, node: u32) -> Range<u32> {
        let group = self.groups.partition_point(|group| group.nodes.end <= node);
        self.groups[group].simd_blocks.clone()
    }

    /// Appends the SIMD blocks that a contact moves to `all`.
    pub(super) fn add_simd_blocks<const D: usize>(
        &self,
        jacobian: &ContactJacobian<D>,
        mobility: KickMobility<D>,
        all: &mut Vec<u32>,
    ) {
        let start = all.len();
        for (_, node, _) in nodes_of(jacobian, mobility).filter(|(.., held)| !held) {
            let simd_blocks = self.simd_blocks_around(node);
            if !all[start..].contains(&simd_blocks.start) {
                all.extend(simd_blocks);
            }
        }
    }
}
