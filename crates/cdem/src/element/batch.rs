//! Structure-of-arrays batches of elements for the SIMD kernels.

use crate::element::element_set::{ElementRecord, ElementRecordMut};
use crate::element::geometry::{self, ElementGeometry, IntegrationPoints, Lame, NodalValues};
use crate::element::prefetch::prefetch;
use crate::element::simd::{Lanes, SimdRow, Single, WIDTH};

/// Elements of one shape in batches of [`WIDTH`]. Unused lanes of the last batch have zero volume.
#[derive(Debug, Default)]
pub(super) struct Batches<const D: usize, const N: usize, const Q: usize> {
    /// Number of elements.
    count: usize,
    /// Geometry of each batch, Gauss point by Gauss point: the gradients of all nodes but the
    /// first, whose gradient is minus the sum of the others, and the volume.
    rest: Vec<SimdRow>,
    /// Records of the elements of each batch, number by number.
    records: Vec<SimdRow>,
    /// Nodes of the elements of each batch, by their indices in the group.
    nodes: Vec<[[u16; WIDTH]; N]>,
}

impl<const D: usize, const N: usize, const Q: usize> Batches<D, N, Q> {
    /// Number of numbers of a Gauss point, and of the geometry of an element.
    const POINT: usize = (N - 1) * D + 1;
    const REST: usize = Q * Self::POINT;

    /// Number of batches that the prefetch runs ahead. The numbers are prefetched one after the
    /// other while a batch is computed, since processors take few requests at a time. By then the
    /// data have arrived.
    const AHEAD: usize = if Q == 1 { 4 } else { 1 };

    /// Creates an empty list with capacity for `count` elements with records of `record` numbers.
    pub(super) fn with_capacity(count: usize, record: usize) -> Self {
        let batches = count.div_ceil(WIDTH);
        Self {
            count: 0,
            rest: Vec::with_capacity(batches * Self::REST),
            records: Vec::with_capacity(batches * record),
            nodes: Vec::with_capacity(batches),
        }
    }

    /// Returns the number of batches.
    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Returns the memory, bytes.
    pub(super) fn memory(&self) -> usize {
        size_of_val(&*self.rest) + size_of_val(&*self.records) + size_of_val(&*self.nodes)
    }

    /// Returns the bytes that a kick reads for an element with a record of `size` numbers, plus
    /// those that it writes to the record.
    pub(super) fn moved(size: usize) -> usize {
        (Self::REST + 2 * size) * size_of::<f64>() + N * size_of::<u16>()
    }

    /// Adds an element.
    pub(super) fn push(
        &mut self,
        nodes: [u16; N],
        element: &ElementGeometry<D, N, Q>,
        record: &[f64],
    ) {
        let lane = self.count % WIDTH;
        if lane == 0 {
            let batches = self.nodes.len() + 1;
            self.rest.resize(batches * Self::REST, SimdRow::default());
            self.records
                .resize(batches * record.len(), SimdRow::default());
            self.nodes.push([[0; WIDTH]; N]);
        }
        let batch = self.nodes.len() - 1;
        for a in 0..N {
            self.nodes[batch][a][lane] = nodes[a];
        }
        let points = self.rest[batch * Self::REST..].chunks_exact_mut(Self::POINT);
        for (q, point) in points.enumerate() {
            for (row, number) in point
                .iter_mut()
                .zip(element.gradients[q][1..].as_flattened())
            {
                row[lane] = *number;
            }
            point[Self::POINT - 1][lane] = element.volumes[q];
        }
        let rows = self.records[batch * record.len()..].iter_mut();
        for (row, number) in rows.zip(record) {
            row[lane] = *number;
        }
        self.count += 1;
    }

    /// Returns the nodes of an element, by their indices in the group.
    pub(super) fn nodes(&self, element: usize) -> [u16; N] {
        self.nodes[element / WIDTH].map(|all| all[element % WIDTH])
    }

    /// Returns the geometry of one element.
    pub(super) fn element(&self, element: usize, lame: Lame<f64>) -> ElementGeometry<D, N, Q> {
        let Batch { rest, .. } = self.batch(element / WIDTH, 0);
        let own = BatchLanes::<Single, D, N, Q>::new(Single, rest, element % WIDTH, lame);
        let points: [_; Q] = std::array::from_fn(|q| own.point(q));
        ElementGeometry {
            gradients: points.map(|(gradients, _)| gradients),
            volumes: points.map(|(_, volume)| volume),
            lame,
        }
    }

    /// Prefetches records of `size` numbers for a kernel that only reads them; [`BatchRecords`]
    /// does it when it writes. Records of several Gauss points are more than the processor takes at
    /// a time.
    #[inline(always)]
    pub(super) fn prefetch_records(&self, batch: usize, size: usize) {
        let batch = batch + Self::AHEAD;
        if Q == 1 && batch < self.len() {
            prefetch(&self.records[batch * size..][..size]);
        }
    }

    /// Returns the geometry, the nodes and the records of a batch; a record has `size` numbers.
    #[inline(always)]
    pub(super) fn batch(&self, batch: usize, size: usize) -> Batch<'_, N, &[SimdRow]> {
        Batch {
            rest: &self.rest[batch * Self::REST..],
            nodes: &self.nodes[batch],
            records: &self.records[batch * size..][..size],
        }
    }

    /// Returns the same with mutable records, and the records to prefetch.
    #[inline(always)]
    pub(super) fn batch_mut(
        &mut self,
        batch: usize,
        size: usize,
    ) -> (Batch<'_, N, &mut [SimdRow]>, &[SimdRow]) {
        let (records, next) = self.records[batch * size..].split_at_mut(size);
        let batch = Batch {
            rest: &self.rest[batch * Self::REST..],
            nodes: &self.nodes[batch],
            records,
        };
        let ahead = next.get((Self::AHEAD - 1) * size..);
        (batch, ahead.unwrap_or_default())
    }
}

/// The data of [`WIDTH`] elements.
pub(super) struct Batch<'a, const N: usize, R> {
    /// Geometry of this batch, followed by that of all later batches.
    pub(super) rest: &'a [SimdRow],
    pub(super) nodes: &'a [[u16; WIDTH]; N],
    pub(super) records: R,
}

/// Elements in SIMD lanes, from lane `first` of a batch on, with their moduli.
pub(super) struct BatchLanes<'a, L: Lanes, const D: usize, const N: usize, const Q: usize> {
    lanes: L,
    rest: &'a [SimdRow],
    /// Geometry to prefetch, if there is more.
    ahead: &'a [SimdRow],
    first: usize,
    lame: Lame<L::Number>,
}

impl<'a, L: Lanes, const D: usize, const N: usize, const Q: usize> BatchLanes<'a, L, D, N, Q> {
    /// Creates the lanes of the batch at the head of `rest`.
    #[inline(always)]
    pub(super) fn new(lanes: L, rest: &'a [SimdRow], first: usize, lame: Lame<f64>) -> Self {
        let size = Batches::<D, N, Q>::REST;
        Self {
            lanes,
            rest: &rest[..size],
            ahead: rest
                .get(Batches::<D, N, Q>::AHEAD * size..)
                .unwrap_or_default(),
            first,
            lame: Lame {
                lambda: lanes.splat(lame.lambda),
                mu: lanes.splat(lame.mu),
            },
        }
    }
}

impl<L: Lanes, const D: usize, const N: usize, const Q: usize> IntegrationPoints<D, N, Q, L::Number>
    for BatchLanes<'_, L, D, N, Q>
{
    #[inline(always)]
    fn lame(&self) -> Lame<L::Number> {
        self.lame
    }

    #[inline(always)]
    fn point(&self, q: usize) -> (NodalValues<D, N, L::Number>, L::Number) {
        let size = Batches::<D, N, Q>::POINT;
        if self.first == 0 && !self.ahead.is_empty() {
            prefetch(&self.ahead[q * size..][..size]);
        }
        let point = &self.rest[q * size..][..size];
        let mut gradients = [[self.lanes.splat(0.0); D]; N];
        for a in 1..N {
            for k in 0..D {
                gradients[a][k] = self.lanes.load(&point[(a - 1) * D + k], self.first);
            }
        }
        geometry::balance(&mut gradients);
        (gradients, self.lanes.load(&point[size - 1], self.first))
    }
}

/// Records of elements in SIMD lanes, from lane `first` on.
pub(super) struct BatchRecords<'a, L, R> {
    pub(super) lanes: L,
    pub(super) rows: R,
    /// Records to prefetch on write, if there are more.
    pub(super) ahead: &'a [SimdRow],
    pub(super) first: usize,
}

impl<L: Lanes, R: AsRef<[SimdRow]>> ElementRecord<L::Number> for BatchRecords<'_, L, R> {
    #[inline(always)]
    fn get(&self, place: usize) -> L::Number {
        self.lanes.load(&self.rows.as_ref()[place], self.first)
    }
}

impl<L: Lanes, R: AsRef<[SimdRow]> + AsMut<[SimdRow]>> ElementRecordMut<L::Number>
    for BatchRecords<'_, L, R>
{
    #[inline(always)]
    fn set(&mut self, place: usize, number: L::Number) {
        self.lanes
            .store(number, &mut self.rows.as_mut()[place], self.first);
        if self.first == 0 && !self.ahead.is_empty() {
            prefetch(std::slice::from_ref(&self.ahead[place]));
        }
    }
}
