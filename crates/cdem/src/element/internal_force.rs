//! The kick of many elements: part by part on all threads, and in a part as many side by
//! side as the machine's registers hold.

use std::marker::PhantomData;

use pulp::{Arch, Simd, WithSimd};

use crate::element::batch::{Batch, BatchLanes, BatchRecords};
use crate::element::chunk::{Chunk, LevelGroup};
use crate::element::element_set::Formulation;
use crate::element::gather_scatter::GatheredFields;
use crate::element::geometry::Moduli;
use crate::element::simd::{Lanes, Register, SimdRow, WIDTH};
use crate::element::{Due, Interval};
use crate::math::parallel::NODES_AT_ONCE;

/// What groups of elements give their nodes, N·s, group by group: elastic impulses, and
/// viscous ones, which are left out where nothing is damped.
pub(crate) type GroupImpulses<'a, const D: usize> = [&'a mut [[f64; D]]; 2];

/// The first `count` of each, and the others.
fn split<const D: usize>(shares: GroupImpulses<'_, D>, count: usize) -> [GroupImpulses<'_, D>; 2] {
    let [elastic, viscous] = shares.map(|share| {
        let count = count.min(share.len());
        share.split_at_mut(count)
    });
    [[elastic.0, viscous.0], [elastic.1, viscous.1]]
}

/// Gauss points, times dimensions, whose forces are not worth another thread: 100 to 200
/// microseconds of work, where it takes some tens of them to wake one, which then finds nothing in
/// its caches.
pub(super) const FEW: usize = 32_768;

/// Works on all parts and what is theirs of the shares: one after the other where only a [`FEW`]
/// Gauss points of `coarsest` level or finer are in them, and so few nodes that nothing else that
/// is done to these is shared out either, which would keep another thread awake.
pub(super) fn each_part<const D: usize, const N: usize, const Q: usize>(
    parts: &mut [Chunk<D, N, Q>],
    mut shares: GroupImpulses<D>,
    coarsest: u8,
    work: &(impl Fn(&mut Chunk<D, N, Q>, GroupImpulses<D>) + Sync),
) {
    let due = parts.iter().flat_map(|part| part.due(coarsest));
    let (elements, nodes) = due.fold((0, 0), |(elements, nodes), group| {
        (elements + group.members.len(), nodes + group.nodes.len())
    });
    if parts.len() == 1 || elements * Q * D <= FEW && nodes <= NODES_AT_ONCE {
        for part in parts {
            let [own, others] = split(shares, part.node_count());
            work(part, own);
            shares = others;
        }
        return;
    }
    let (left, right) = parts.split_at_mut(parts.len() / 2);
    let count = left.iter().map(Chunk::node_count).sum();
    let [of_left, of_right] = split(shares, count);
    rayon::join(
        || each_part(left, of_left, coarsest, work),
        || each_part(right, of_right, coarsest, work),
    );
}

/// A kick of elements of one formulation.
pub(super) struct InternalForceKick<'a, const D: usize, F> {
    due: &'a Due<'a>,
    /// Of all nodes, m and m/s.
    displacement: &'a [[f64; D]],
    velocity: &'a [[f64; D]],
    /// Number in the mesh of each element of the set.
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

    /// Kicks the groups of a part that are due.
    pub(super) fn part<const N: usize, const Q: usize>(
        &self,
        part: &mut Chunk<D, N, Q>,
        shares: GroupImpulses<D>,
    ) where
        F: Formulation<D, N, Q>,
    {
        GatheredFields::with(|nearby| {
            Arch::new().dispatch(Task {
                kick: self,
                part,
                shares,
                nearby,
            });
        });
    }

    /// Interval of each element of a batch, s.
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

    /// Kicks a group: what its elements give goes to its shares.
    #[inline(always)]
    fn group<L: Lanes, const N: usize, const Q: usize>(
        &self,
        lanes: L,
        (group, moduli): (&mut LevelGroup<D, N, Q>, &Moduli),
        nearby: &mut GatheredFields,
        [elastic, viscous]: GroupImpulses<D>,
    ) where
        F: Formulation<D, N, Q>,
    {
        nearby.displacement.read(&group.nodes, self.displacement);
        nearby.elastic.clear(group.nodes.len());
        let is_damped = moduli.damping > 0.0;
        if is_damped {
            nearby.velocity.read(&group.nodes, self.velocity);
            nearby.viscous.clear(group.nodes.len());
        }
        // What a kick that only looks would keep: to ask of each number whether it is kept would
        // cut the kernel to pieces.
        let mut discarded = Vec::new();
        for batch in 0..group.batches.len() {
            let intervals = self.intervals(group, batch);
            let (found, ahead) = group.batches.batch_mut(batch, F::RECORD);
            let Batch {
                rest,
                nodes,
                records,
            } = found;
            let rows = if self.due.is_kept {
                records
            } else {
                discarded.clear();
                discarded.extend_from_slice(records);
                &mut discarded[..F::RECORD]
            };
            for first in (0..WIDTH).step_by(L::COUNT) {
                let element = BatchLanes::new(lanes, (rest, first), moduli.lame);
                let u = nearby.displacement.relative(lanes, nodes, first);
                let mut records = BatchRecords {
                    lanes,
                    rows: &mut *rows,
                    ahead,
                    first,
                };
                let force = F::respond(&element, &u, &mut records);
                let duration = lanes.load(&intervals, first);
                nearby.elastic.add(lanes, nodes, first, (&force, duration));
                if is_damped {
                    let velocity = nearby.velocity.relative(lanes, nodes, first);
                    let rate = F::force_rate(&element, &u, &velocity);
                    let duration = lanes.splat(moduli.damping) * duration;
                    nearby.viscous.add(lanes, nodes, first, (&rate, duration));
                }
            }
        }
        nearby.elastic.write(elastic);
        if is_damped {
            nearby.viscous.write(viscous);
        } else {
            viscous.fill([0.0; D]);
        }
    }
}

/// A kick of a part for whatever instructions the machine has.
struct Task<'a, 'b, const D: usize, const N: usize, const Q: usize, F> {
    kick: &'a InternalForceKick<'a, D, F>,
    part: &'b mut Chunk<D, N, Q>,
    shares: GroupImpulses<'b, D>,
    nearby: &'b mut GatheredFields,
}

impl<const D: usize, const N: usize, const Q: usize, F> WithSimd for Task<'_, '_, D, N, Q, F>
where
    F: Formulation<D, N, Q>,
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (lanes, moduli) = (Register(simd), self.part.moduli);
        let mut shares = self.shares;
        for group in self.part.groups_mut() {
            let [own, others] = split(shares, group.nodes.len());
            if group.is_due(self.kick.due.coarsest) {
                self.kick.group(lanes, (group, &moduli), self.nearby, own);
            }
            shares = others;
        }
    }
}
