//! Fields at the nodes of a group of elements, copied to memory that fits the nearest caches.

use std::cell::RefCell;

use bytemuck::{Pod, Zeroable};

use crate::element::MAX_NODES;
use crate::element::chunk::MAX_CHUNK;
use crate::element::geometry::NodalValues;
use crate::element::simd::{Lanes, SimdRow, WIDTH};

thread_local! {
    static GATHERED_FIELDS: RefCell<GatheredFields> = RefCell::default();
}

/// Fields at the nodes of a group.
#[derive(Default)]
pub(super) struct GatheredFields {
    pub(super) displacement: GatheredField,
    pub(super) velocity: GatheredField,
    pub(super) elastic: GatheredField,
    pub(super) viscous: GatheredField,
}

impl GatheredFields {
    /// Calls `work` with the fields of this thread. Their content is arbitrary.
    pub(super) fn with(work: impl FnOnce(&mut Self)) {
        GATHERED_FIELDS.with_borrow_mut(work);
    }
}

/// Number of node indices that a batch can store, so that no access needs a bounds check. A group
/// has fewer nodes.
const NODES: usize = 1 << 16;
const _: () = assert!(MAX_CHUNK * MAX_NODES <= NODES);

/// A vector aligned for one load. Missing components are 0.
#[derive(Clone, Copy, Default, Pod, Zeroable)]
#[repr(C, align(32))]
struct AlignedVector([f64; 4]);

/// Vectors at the nodes of a group, with room for any group. The room for one more vector allows
/// the first to be aligned.
pub(super) struct GatheredField(Vec<f64>);

impl Default for GatheredField {
    fn default() -> Self {
        // The system usually gives zeroed pages without touching them, so threads of short runs do
        // not wait for them.
        Self(vec![
            0.0;
            (NODES + 1) * size_of::<AlignedVector>()
                / size_of::<f64>()
        ])
    }
}

impl GatheredField {
    /// Returns the vectors from the first aligned address on.
    #[inline(always)]
    fn all(&self) -> &[AlignedVector; NODES] {
        let (_, all, _) = bytemuck::pod_align_to(&self.0);
        all.first_chunk().expect("room for one more")
    }

    /// Returns the same, mutable.
    #[inline(always)]
    fn all_mut(&mut self) -> &mut [AlignedVector; NODES] {
        let (_, all, _) = bytemuck::pod_align_to_mut(&mut self.0);
        all.first_chunk_mut().expect("room for one more")
    }

    /// Reads the values at some nodes of the mesh.
    #[inline(always)]
    pub(super) fn read<const D: usize>(&mut self, nodes: &[u32], all: &[[f64; D]]) {
        for (own, &node) in self.all_mut().iter_mut().zip(nodes) {
            own.0[..D].copy_from_slice(&all[node as usize]);
        }
    }

    /// Zeroes the first `count` vectors.
    #[inline(always)]
    pub(super) fn clear(&mut self, count: usize) {
        self.all_mut()[..count].fill(AlignedVector::default());
    }

    /// Writes the first vectors to `to`.
    #[inline(always)]
    pub(super) fn write<const D: usize>(&self, to: &mut [[f64; D]]) {
        for (to, own) in to.iter_mut().zip(self.all()) {
            to.copy_from_slice(&own.0[..D]);
        }
    }

    /// Returns the vectors at the nodes of elements in SIMD lanes, minus those at their first
    /// nodes.
    #[inline(always)]
    pub(super) fn relative<L: Lanes, const D: usize, const N: usize>(
        &self,
        at: LaneNodes<'_, L, N>,
    ) -> NodalValues<D, N, L::Number> {
        let all = self.all();
        let mut relative = [[at.lanes.splat(0.0); D]; N];
        let origin: [L::Number; D] = at.gather(all, 0);
        for a in 1..N {
            let own: [L::Number; D] = at.gather(all, a);
            for k in 0..D {
                relative[a][k] = own[k] - origin[k];
            }
        }
        relative
    }

    /// Adds forces times durations, s, element by element.
    #[inline(always)]
    pub(super) fn add<L: Lanes, const D: usize, const N: usize>(
        &mut self,
        at: LaneNodes<'_, L, N>,
        force: &NodalValues<D, N, L::Number>,
        duration: L::Number,
    ) {
        let LaneNodes {
            lanes,
            nodes,
            first,
        } = at;
        let all = self.all_mut();
        let mut rows = [[SimdRow::default(); D]; N];
        for a in 0..N {
            for k in 0..D {
                lanes.store(duration * force[a][k], &mut rows[a][k], 0);
            }
        }
        for lane in 0..L::COUNT {
            for a in 0..N {
                let mut impulse = [0.0; 4];
                for k in 0..D {
                    impulse[k] = rows[a][k][lane];
                }
                let own = &mut all[nodes[a][first + lane] as usize];
                for k in 0..4 {
                    own.0[k] += impulse[k];
                }
            }
        }
    }
}

/// The nodes of the elements in SIMD lanes, from lane `first` of a batch on.
#[derive(Clone, Copy)]
pub(super) struct LaneNodes<'a, L, const N: usize> {
    pub(super) lanes: L,
    /// Nodes of the batch, by their indices in the group.
    pub(super) nodes: &'a [[u16; WIDTH]; N],
    pub(super) first: usize,
}

impl<L: Lanes, const N: usize> LaneNodes<'_, L, N> {
    /// Returns the vectors at node `a` of each element.
    #[inline(always)]
    fn gather<const D: usize>(&self, all: &[AlignedVector; NODES], a: usize) -> [L::Number; D] {
        let nodes = &self.nodes[a];
        let mut rows = [SimdRow::default(); D];
        for lane in 0..L::COUNT {
            let own = &all[nodes[self.first + lane] as usize];
            for k in 0..D {
                rows[k][lane] = own.0[k];
            }
        }
        rows.map(|row| self.lanes.load(&row, 0))
    }
}
