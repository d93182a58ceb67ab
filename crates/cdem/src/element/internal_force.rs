//! The kick of many elements: chunk by chunk on all threads, and within a chunk in SIMD lanes.

use std::marker::PhantomData;

use pulp::{Arch, Simd, WithSimd};

use crate::element::batch::{Batch, BatchLanes, BatchRecords};
use crate::element::chunk::{Chunk, LevelGroup};
use crate::element::element_set::Formulation;
use crate::element::gather_scatter::{GatheredFields, LaneNodes};
use crate::element::geometry::Moduli;
use crate::element::simd::{Lanes, Register, SimdRow, WIDTH};
use crate::element::{Due, Interval};
use crate::math::parallel::NODES_AT_ONCE;

/// Impulses of the element groups on their nodes, N·s, group by group: elastic, and viscous. The
/// viscous ones are left out if nothing is damped.
pub(crate) type GroupImpulses<'a, const D: usize> = [&'a mut [[f64; D]]; 2];

/// Splits both arrays after `count` entries.
fn split<const D: usize>(
    group_impulses: GroupImpulses<'_, D>,
    count: usize,
) -> [GroupImpulses<'_, D>; 2] {
    let [elastic, viscous] = group_impulses.map(|impulses| {
        let count = count.min(impulses.len());
        impulses.split_at_mut(count)
    });
    [[elastic.0, viscous.0], [elastic.1, viscous.1]]
}

/// Number of Gauss points times dimensions whose forces are not worth another thread: 100 to 200
/// microseconds of work. To wake a thread takes some tens of microseconds, and it then finds
/// nothing in its caches.
pub(super) const SERIAL_WORK: usize = 32_768;

/// Calls `work` for each chunk with its part of the impulses. Uses one thread if at most
/// [`SERIAL_WORK`] Gauss points times dimensions are due and their nodes number at most
/// [`NODES_AT_ONCE`]. With more nodes the nodal work is parallel too and keeps the other threads
/// awake.
pub(super) fn each_chunk<const D: usize, const N: usize, const Q: usize>(
    chunks: &mut [Chunk<D, N, Q>],
    mut group_impulses: GroupImpulses<D>,
    coarsest: u8,
    work: &(impl Fn(&mut Chunk<D, N, Q>, GroupImpulses<D>) + Sync),
) {
    let due = chunks.iter().flat_map(|chunk| chunk.due(coarsest));
    let (elements, nodes) = due.fold((0, 0), |(elements, nodes), group| {
        (elements + group.members.len(), nodes + group.nodes.len())
    });
    if chunks.len() == 1 || elements * Q * D <= SERIAL_WORK && nodes <= NODES_AT_ONCE {
        for chunk in chunks {
            let [own, others] = split(group_impulses, chunk.node_count());
            work(chunk, own);
            group_impulses = others;
        }
        return;
    }
    let (left, right) = chunks.split_at_mut(chunks.len() / 2);
    let count = left.iter().map(Chunk::node_count).sum();
    let [of_left, of_right] = split(group_impulses, count);
    rayon::join(
        || each_chunk(left, of_left, coarsest, work),
        || each_chunk(right, of_right, coarsest, work),
    );
}

/// A group that is due, and the moduli of its elements.
struct DueGroup<'a, const D: usize, const N: usize, const Q: usize> {
    group: &'a mut LevelGroup<D, N, Q>,
    moduli: &'a Moduli,
}

/// A kick of elements of one formulation.
pub(super) struct InternalForceKick<'a, const D: usize, F> {
    due: &'a Due<'a>,
    /// Displacements, m, and velocities, m/s, of all nodes.
    displacement: &'a [[f64; D]],
    velocity: &'a [[f64; D]],
    /// Index in the mesh of each element of the set.
    mesh_elements: &'a [u32],
    formulation: PhantomData<F>,
}

impl<'a, const D: usize, F> InternalForceKick<'a, D, F> {
    pub(super) fn new(
        due: &'a Due<'a>,
        [displacement, velocity]: [&'a [[f64; D]]; 2],
        mesh_elements: &'a [u32],
    ) -> Self {
        Self {
            due,
            displacement,
            velocity,
            mesh_elements,
            formulation: PhantomData,
        }
    }

    /// Kicks the due groups of a chunk.
    pub(super) fn chunk<const N: usize, const Q: usize>(
        &self,
        chunk: &mut Chunk<D, N, Q>,
        group_impulses: GroupImpulses<D>,
    ) where
        F: Formulation<D, N, Q>,
    {
        GatheredFields::with(|fields| {
            Arch::new().dispatch(Task {
                kick: self,
                chunk,
                group_impulses,
                fields,
            });
        });
    }

    /// Returns the interval of each element of a batch, s.
    #[inline(always)]
    fn intervals<const N: usize, const Q: usize>(
        &self,
        group: &LevelGroup<D, N, Q>,
        batch: usize,
    ) -> SimdRow {
        match self.due.interval {
            Interval::OfLevel(all) => {
                SimdRow::splat(group.level.map_or(0.0, |level| all[level as usize]))
            }
            Interval::OfElement(all) => {
                let mut intervals = SimdRow::default();
                let members = &group.members[batch * WIDTH..];
                for (interval, &member) in intervals.iter_mut().zip(members) {
                    *interval = all[self.mesh_elements[member as usize] as usize];
                }
                intervals
            }
        }
    }

    /// Kicks a group and writes the impulses on its nodes.
    #[inline(always)]
    fn group<L: Lanes, const N: usize, const Q: usize>(
        &self,
        lanes: L,
        DueGroup { group, moduli }: DueGroup<D, N, Q>,
        fields: &mut GatheredFields,
        [elastic, viscous]: GroupImpulses<D>,
    ) where
        F: Formulation<D, N, Q>,
    {
        fields.displacement.read(&group.nodes, self.displacement);
        fields.elastic.clear(group.nodes.len());
        let is_damped = moduli.damping > 0.0;
        if is_damped {
            fields.velocity.read(&group.nodes, self.velocity);
            fields.viscous.clear(group.nodes.len());
        }
        // Records that a report discards. A test at each number would break up the kernel.
        let mut discarded = Vec::new();
        for batch in 0..group.batches.len() {
            let intervals = self.intervals(group, batch);
            let (found, ahead) = group.batches.batch_mut(batch, F::RECORD);
            let Batch {
                rest,
                nodes,
                records,
            } = found;
            let rows = if self.due.updates_records {
                records
            } else {
                discarded.clear();
                discarded.extend_from_slice(records);
                &mut discarded[..F::RECORD]
            };
            for first in (0..WIDTH).step_by(L::COUNT) {
                let element = BatchLanes::new(lanes, rest, first, moduli.lame);
                let at = LaneNodes {
                    lanes,
                    nodes,
                    first,
                };
                let u = fields.displacement.relative(at);
                let mut records = BatchRecords {
                    lanes,
                    rows: &mut *rows,
                    ahead,
                    first,
                };
                let force = F::respond(&element, &u, &mut records);
                let duration = lanes.load(&intervals, first);
                fields.elastic.add(at, &force, duration);
                if is_damped {
                    let velocity = fields.velocity.relative(at);
                    let rate = F::force_rate(&element, &u, &velocity);
                    let duration = lanes.splat(moduli.damping) * duration;
                    fields.viscous.add(at, &rate, duration);
                }
            }
        }
        fields.elastic.write(elastic);
        if is_damped {
            fields.viscous.write(viscous);
        } else {
            viscous.fill([0.0; D]);
        }
    }
}

/// The kick of a chunk, compiled for the SIMD instructions of the machine.
struct Task<'a, 'b, const D: usize, const N: usize, const Q: usize, F> {
    kick: &'a InternalForceKick<'a, D, F>,
    chunk: &'b mut Chunk<D, N, Q>,
    group_impulses: GroupImpulses<'b, D>,
    fields: &'b mut GatheredFields,
}

impl<const D: usize, const N: usize, const Q: usize, F> WithSimd for Task<'_, '_, D, N, Q, F>
where
    F: Formulation<D, N, Q>,
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (lanes, moduli) = (Register(simd), self.chunk.moduli);
        let mut group_impulses = self.group_impulses;
        for group in self.chunk.groups_mut() {
            let [own, others] = split(group_impulses, group.nodes.len());
            if group.is_due(self.kick.due.coarsest) {
                let due = DueGroup {
                    group,
                    moduli: &moduli,
                };
                self.kick.group(lanes, due, self.fields, own);
            }
            group_impulses = others;
        }
    }
}
