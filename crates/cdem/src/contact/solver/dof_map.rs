//! Which nodes the contacts of an island move, and where its solver keeps their velocities.

use std::ops::Range;

use crate::contact::solver::contact_rows::nodes_of;
use crate::contact::solver::inverse_mass_columns::InverseMassColumns;
use crate::contact::solver::simd_block::SimdBlock;
use crate::contact::surface::ContactJacobian;
use crate::model::inverse_mass::{InverseMass, KickMobility};

/// Where the components of a node are among the numbers of all packs.
#[derive(Clone, Copy, Debug)]
pub(super) struct DofSlot {
    pub(super) first: u32,
    pub(super) stride: u32,
}

/// Nodes that impulses may move, with all that mass matrices couple to them: held ones among these
/// get nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct DofMap {
    /// All, sorted.
    nodes: Vec<u32>,
    /// Those whose velocities each visit changes, sorted, and where their numbers are.
    seated: Vec<u32>,
    seats: Vec<DofSlot>,
    /// The others, of blocks that contacts move by columns, sorted: they need no velocity before
    /// the impulses are known.
    others: Vec<u32>,
    groups: Vec<CoupledNodes>,
    /// How many packs there are.
    packs: usize,
}

/// Nodes that one mass matrix couples.
#[derive(Clone, Debug)]
pub(super) struct CoupledNodes {
    nodes: Range<u32>,
    /// Their parts of the nodes with seats and of the others, and their packs.
    pub(super) seats: Range<usize>,
    pub(super) others: Range<usize>,
    pub(super) packs: Range<u32>,
}

impl DofSlot {
    /// The seats of so many nodes that one mass matrix couples, in packs from the one with this
    /// number on; and how many packs they take.
    fn of<const D: usize, P: SimdBlock>(
        nodes: usize,
        pack: usize,
    ) -> (impl Iterator<Item = Self>, usize) {
        let (packs, stride) = if nodes == 1 && !P::BY_COLUMNS {
            (1, 1)
        } else {
            (D * nodes.div_ceil(P::WIDTH), P::WIDTH)
        };
        let seats = (0..nodes).map(move |k| Self {
            first: (P::WIDTH * (pack + D * (k / P::WIDTH)) + k % P::WIDTH) as u32,
            stride: stride as u32,
        });
        (seats, packs)
    }

    /// Where a component is.
    #[inline(always)]
    pub(super) fn number(self, component: usize) -> usize {
        self.first as usize + component * self.stride as usize
    }
}

impl DofMap {
    /// Seats the nodes that contacts move, which are sorted; takes the `columns` of those that
    /// are moved by them.
    pub(super) fn seat<const D: usize, P: SimdBlock>(
        &mut self,
        moved: &[u32],
        inertia: &InverseMass<D>,
        columns: &mut InverseMassColumns<D, P>,
    ) {
        self.nodes.clear();
        self.seated.clear();
        self.seats.clear();
        self.others.clear();
        self.groups.clear();
        self.packs = 0;
        columns.clear();
        let mut moved = moved;
        while let Some(&node) = moved.first() {
            let coupled = inertia.coupled(node as usize);
            let coupled = coupled.start as u32..coupled.end as u32;
            let (own, rest) = moved.split_at(moved.partition_point(|node| *node < coupled.end));
            let starts = (self.seated.len(), self.others.len());
            self.nodes.extend(coupled.clone());
            if P::BY_COLUMNS {
                let is_other = |node: &u32| own.binary_search(node).is_err();
                self.seated.extend(own);
                self.others.extend(coupled.clone().filter(is_other));
                columns.add(inertia, own, &self.others[starts.1..]);
            } else {
                self.seated.extend(coupled.clone());
            }
            let count = self.seated.len() - starts.0;
            let (seats, packs) = DofSlot::of::<D, P>(count, self.packs);
            self.seats.extend(seats);
            self.groups.push(CoupledNodes {
                nodes: coupled,
                seats: starts.0..self.seated.len(),
                others: starts.1..self.others.len(),
                packs: self.packs as u32..(self.packs + packs) as u32,
            });
            self.packs += packs;
            moved = rest;
        }
    }

    /// All nodes, sorted.
    pub(super) fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Those with a seat, sorted.
    pub(super) fn seated(&self) -> impl ExactSizeIterator<Item = (u32, DofSlot)> + '_ {
        self.seated.iter().copied().zip(self.seats.iter().copied())
    }

    /// Those without, sorted.
    pub(super) fn others(&self) -> &[u32] {
        &self.others
    }

    pub(super) fn groups(&self) -> &[CoupledNodes] {
        &self.groups
    }

    /// How many packs there are.
    pub(super) fn packs(&self) -> usize {
        self.packs
    }

    /// The place of a node among those with a seat, that seat, and the packs of what a mass matrix
    /// couples to it.
    pub(super) fn find(&self, node: u32) -> (usize, DofSlot, Range<u32>) {
        let place = self.seated.partition_point(|&other| other < node);
        (place, self.seats[place], self.packs_around(node))
    }

    fn packs_around(&self, node: u32) -> Range<u32> {
        let group = self.groups.partition_point(|group| group.nodes.end <= node);
        self.groups[group].packs.clone()
    }

    /// Adds the packs that a contact moves to those of `all`.
    pub(super) fn add_packs<const D: usize>(
        &self,
        jacobian: &ContactJacobian<D>,
        mobility: KickMobility<D>,
        all: &mut Vec<u32>,
    ) {
        let start = all.len();
        for (_, node, _) in nodes_of(jacobian, mobility).filter(|(.., held)| !held) {
            let packs = self.packs_around(node);
            if !all[start..].contains(&packs.start) {
                all.extend(packs);
            }
        }
    }
}
