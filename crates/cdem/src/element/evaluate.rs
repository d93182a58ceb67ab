//! Evaluation of a quantity of all elements, in SIMD lanes.

use std::marker::PhantomData;

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::element::batch::{Batch, BatchLanes, BatchRecords};
use crate::element::chunk::{Chunk, MAX_CHUNK};
use crate::element::element_set::{ElementRecord, Formulation};
use crate::element::gather_scatter::{GatheredFields, LaneNodes};
use crate::element::geometry::{self, IntegrationPoints, Moduli, NodalValues};
use crate::element::internal_force::SERIAL_WORK;
use crate::element::simd::{Lanes, Real, Register, SimdRow, WIDTH};
use crate::element::tensor;
use crate::element::total_lagrangian::green_lagrange;

/// Bytes of values per thread that are collected before `receive` gets them. They fit the cache of
/// a core.
const AT_ONCE: usize = 2 << 20;

/// A quantity of an element with a displacement and a record.
///
/// `A` is the number of numbers in a value.
pub(super) trait Evaluation<const D: usize, const N: usize, const Q: usize, const A: usize>:
    Sync
{
    /// Number of numbers in a record.
    const RECORD: usize;

    /// Usual number of elements of a chunk whose values are wanted.
    const EXPECTED_VALUES: usize = MAX_CHUNK;

    fn value<T: Real>(
        element: &impl IntegrationPoints<D, N, Q, T>,
        moduli: &Moduli,
        displacement: &NodalValues<D, N, T>,
        record: &impl ElementRecord<T>,
    ) -> [T; A];
}

/// Strain energy, J.
pub(super) struct StrainEnergy<F>(PhantomData<F>);

impl<const D: usize, const N: usize, const Q: usize, F> Evaluation<D, N, Q, 1> for StrainEnergy<F>
where
    F: Formulation<D, N, Q>,
{
    const RECORD: usize = F::RECORD;

    #[inline(always)]
    fn value<T: Real>(
        element: &impl IntegrationPoints<D, N, Q, T>,
        _: &Moduli,
        displacement: &NodalValues<D, N, T>,
        record: &impl ElementRecord<T>,
    ) -> [T; 1] {
        [F::strain_energy(element, displacement, record)]
    }
}

/// Cauchy stress, averaged over the current volume, Pa: xx yy zz xy yz zx.
pub(super) struct CauchyStress<F>(PhantomData<F>);

impl<const D: usize, const N: usize, const Q: usize, F> Evaluation<D, N, Q, 6> for CauchyStress<F>
where
    F: Formulation<D, N, Q>,
{
    const RECORD: usize = F::RECORD;

    #[inline(always)]
    fn value<T: Real>(
        element: &impl IntegrationPoints<D, N, Q, T>,
        moduli: &Moduli,
        displacement: &NodalValues<D, N, T>,
        record: &impl ElementRecord<T>,
    ) -> [T; 6] {
        F::stress(element, moduli, displacement, record).average()
    }
}

/// Measure of distortion: the sums over the Gauss points of E:E, where E is Green's strain, and of
/// (det F − 1)².
pub(super) struct Distortion;

impl<const D: usize, const N: usize, const Q: usize> Evaluation<D, N, Q, 2> for Distortion {
    const RECORD: usize = 0;

    const EXPECTED_VALUES: usize = 0;

    #[inline(always)]
    fn value<T: Real>(
        element: &impl IntegrationPoints<D, N, Q, T>,
        _: &Moduli,
        displacement: &NodalValues<D, N, T>,
        _: &impl ElementRecord<T>,
    ) -> [T; 2] {
        let one = displacement[0][0].constant(1.0);
        let (mut strains, mut changes) = (one.constant(0.0), one.constant(0.0));
        for q in 0..Q {
            let (gradients, _) = element.point(q);
            let h = geometry::gradient(&gradients, displacement);
            let strain = green_lagrange(&h);
            let change = tensor::determinant(&tensor::with_unit(&h)) - one;
            strains += tensor::contraction(&strain, &strain);
            changes += change * change;
        }
        [strains, changes]
    }
}

/// Evaluates all elements of a set. `receive` gets the set indices and the values of the elements
/// whose value `is_wanted`, chunk by chunk.
pub(super) fn evaluate_all<W, const D: usize, const N: usize, const Q: usize, const A: usize>(
    chunks: &[Chunk<D, N, Q>],
    displacement: &[[f64; D]],
    is_wanted: impl Fn(&[f64; A]) -> bool + Sync,
    mut receive: impl FnMut(u32, [f64; A]),
) where
    W: Evaluation<D, N, Q, A>,
{
    let evaluate_chunk = |(chunk, values): (&Chunk<D, N, Q>, &mut Vec<(u32, [f64; A])>)| {
        values.clear();
        values.reserve(W::EXPECTED_VALUES);
        GatheredFields::with(|fields| {
            Arch::new().dispatch(EvaluationTask {
                chunk,
                displacement,
                fields,
                is_wanted: &is_wanted,
                values,
                evaluation: PhantomData::<W>,
            });
        });
    };
    let groups = chunks.iter().flat_map(|chunk| chunk.groups());
    let elements: usize = groups.map(|group| group.members.len()).sum();
    // Either all threads or one, as in the kick.
    let least = if elements * Q * D <= SERIAL_WORK {
        chunks.len()
    } else {
        1
    };
    let in_cache = AT_ONCE / (MAX_CHUNK * size_of::<(u32, [f64; A])>());
    let at_once = in_cache * rayon::current_num_threads();
    let mut values = vec![Vec::new(); at_once.min(chunks.len())];
    for some in chunks.chunks(at_once) {
        let some = some.par_iter().zip(&mut values);
        some.with_min_len(least.max(1)).for_each(evaluate_chunk);
        for (member, value) in values.iter_mut().flat_map(|values| values.drain(..)) {
            receive(member, value);
        }
    }
}

/// The evaluation of a chunk, compiled for the SIMD instructions of the machine.
struct EvaluationTask<'a, const D: usize, const N: usize, const Q: usize, const A: usize, W, I> {
    chunk: &'a Chunk<D, N, Q>,
    displacement: &'a [[f64; D]],
    fields: &'a mut GatheredFields,
    is_wanted: &'a I,
    values: &'a mut Vec<(u32, [f64; A])>,
    evaluation: PhantomData<W>,
}

impl<W, I, const D: usize, const N: usize, const Q: usize, const A: usize> WithSimd
    for EvaluationTask<'_, D, N, Q, A, W, I>
where
    W: Evaluation<D, N, Q, A>,
    I: Fn(&[f64; A]) -> bool,
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (lanes, moduli) = (Register(simd), &self.chunk.moduli);
        for group in self.chunk.groups() {
            let field = &mut self.fields.displacement;
            field.read(&group.nodes, self.displacement);
            for (batch, members) in group.members.chunks(WIDTH).enumerate() {
                group.batches.prefetch_records(batch, W::RECORD);
                let Batch {
                    rest,
                    nodes,
                    records,
                } = group.batches.batch(batch, W::RECORD);
                let mut rows = [SimdRow::default(); A];
                for first in (0..WIDTH).step_by(S::F64_LANES) {
                    let element = BatchLanes::new(lanes, rest, first, moduli.lame);
                    let u = field.relative(LaneNodes {
                        lanes,
                        nodes,
                        first,
                    });
                    let records = BatchRecords {
                        lanes,
                        rows: records,
                        ahead: &[],
                        first,
                    };
                    let value = W::value(&element, moduli, &u, &records);
                    for (number, row) in value.into_iter().zip(&mut rows) {
                        lanes.store(number, row, first);
                    }
                }
                for (lane, &member) in members.iter().enumerate() {
                    let value = rows.map(|row| row[lane]);
                    if (self.is_wanted)(&value) {
                        self.values.push((member, value));
                    }
                }
            }
        }
    }
}
