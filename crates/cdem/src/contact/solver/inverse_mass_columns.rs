//! Columns of M⁻¹: velocities that an impulse on one node of a large block makes at its other
//! nodes.
//!
//! The responses of all contacts with such a block would not fit in the caches. The columns of
//! a node are stored once, for all of its contacts. They contain the nodes that contacts touch,
//! and the others, which get their velocities when the impulses are known.

use std::ops::Range;

use pulp::Simd;

use crate::contact::solver::contact_rows::JacobianTerm;
use crate::contact::solver::simd_block::{BlockFactors, SimdBlock, SimdBlocks};
use crate::model::inverse_mass::InverseMass;

/// Columns of the nodes that contacts touch, in the order of addition.
#[derive(Clone, Debug, Default)]
pub(super) struct InverseMassColumns<const D: usize, P> {
    /// Velocities at the touched nodes of the block for unit impulses, 1/kg, in SIMD blocks of
    /// one component.
    simd_blocks: Vec<P>,
    /// Velocities at its other nodes for unit impulses, 1/kg.
    beyond: Vec<f64>,
    /// Start of the column of each component of each node.
    starts: Vec<[BlockStart; D]>,
}

#[derive(Clone, Copy, Debug, Default)]
struct BlockStart {
    simd_blocks: u32,
    beyond: u32,
}

impl<const D: usize, P: SimdBlock> InverseMassColumns<D, P> {
    pub(super) fn clear(&mut self) {
        self.simd_blocks.clear();
        self.beyond.clear();
        self.starts.clear();
    }

    /// Adds the columns of the nodes of a block that contacts touch. `others` are its other
    /// nodes.
    pub(super) fn add(&mut self, inertia: &InverseMass<D>, touched: &[u32], others: &[u32]) {
        let mut entries = Vec::with_capacity(touched.len());
        for &node in touched {
            let node = node as usize;
            let first = inertia.coupled(node).start;
            let mut starts = [BlockStart::default(); D];
            for c in 0..D {
                let alike = inertia.first_equal_column(node, c);
                if alike < c {
                    starts[c] = starts[alike];
                    continue;
                }
                starts[c] = BlockStart {
                    simd_blocks: self.simd_blocks.len() as u32,
                    beyond: self.beyond.len() as u32,
                };
                let column = inertia.column(node, c);
                let entry = |other: u32| column[other as usize - first];
                entries.clear();
                entries.extend(touched.iter().map(|&other| entry(other)));
                self.simd_blocks.extend(entries.chunks(P::WIDTH).map(P::of));
                self.beyond.extend(others.iter().map(|&other| entry(other)));
            }
            self.starts.push(starts);
        }
    }

    /// Adds to the velocities of the other nodes of a block, m/s, the response to impulses on
    /// its touched nodes. `touched` is their range among all touched nodes.
    pub(super) fn move_others(
        &self,
        touched: Range<usize>,
        impulses: &[[f64; D]],
        others: &mut [[f64; D]],
    ) {
        for (starts, impulse) in self.starts[touched.clone()].iter().zip(&impulses[touched]) {
            for c in 0..D {
                let column = &self.beyond[starts[c].beyond as usize..];
                for (velocity, entry) in others.iter_mut().zip(column) {
                    velocity[c] += entry * impulse[c];
                }
            }
        }
    }
}

/// A node of a contact whose block moves by columns.
#[derive(Clone, Debug)]
pub(super) struct ColumnTerm<const D: usize> {
    /// Index among all nodes that contacts touch.
    pub(super) node: u32,
    /// First SIMD block of its block among those of the contact, and their number per
    /// component.
    slot: u32,
    count: u32,
    /// Start of the column of each component.
    columns: [u32; D],
    /// Fraction of an impulse that damping leaves.
    pub(super) damping_factor: f64,
}

impl<const D: usize> ColumnTerm<D> {
    /// Creates the term of a node whose block has these SIMD blocks of the contact.
    pub(super) fn new<P: SimdBlock>(
        columns: &InverseMassColumns<D, P>,
        node: usize,
        simd_blocks: Range<usize>,
    ) -> Self {
        Self {
            node: node as u32,
            slot: simd_blocks.start as u32,
            count: (simd_blocks.len() / D) as u32,
            columns: columns.starts[node].map(|start| start.simd_blocks),
            damping_factor: 1.0,
        }
    }

    /// True if another node of the contact belongs to the same block.
    pub(super) fn moves(&self, other: &Self) -> bool {
        self.slot == other.slot
    }

    /// Returns the damped impulse on the node for an impulse of the contact, N·s.
    #[inline(always)]
    pub(super) fn on_node(&self, term: &JacobianTerm<D>, impulse: &[f64; D]) -> [f64; D] {
        let mut own = [0.0; D];
        for c in 0..D {
            for r in 0..D {
                own[c] += impulse[r] * term.columns[c][r];
            }
            own[c] *= self.damping_factor;
        }
        own
    }

    /// Adds the velocities that an impulse on the node makes, m/s.
    #[inline(always)]
    pub(super) fn push<S: Simd, P: SimdBlock>(
        &self,
        simd: S,
        columns: &InverseMassColumns<D, P>,
        on_node: &[f64; D],
        velocity: &mut impl SimdBlocks<P>,
    ) {
        for c in 0..D {
            let factor = BlockFactors::new(simd, &[on_node[c]]);
            let column = &columns.simd_blocks[self.columns[c] as usize..][..self.count as usize];
            for (k, entries) in column.iter().enumerate() {
                let own = velocity.simd_block(self.slot as usize + D * k + c);
                own.add_scaled(simd, &factor, std::array::from_ref(entries));
            }
        }
    }

    /// Returns the velocity that an impulse on the node makes at a node of the same block, m/s:
    /// the part of each component of the impulse.
    #[inline(always)]
    pub(super) fn velocity_at<P: SimdBlock>(
        &self,
        columns: &InverseMassColumns<D, P>,
        on_node: &[f64; D],
        other: &JacobianTerm<D>,
    ) -> [f64; D] {
        let simd_block = (other.slot - self.slot) as usize / D;
        let mut velocity = [0.0; D];
        for c in 0..D {
            let entries = &columns.simd_blocks[self.columns[c] as usize + simd_block];
            velocity[c] = entries.numbers()[other.lane as usize] * on_node[c];
        }
        velocity
    }
}
