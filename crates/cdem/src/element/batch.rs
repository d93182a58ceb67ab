//! Elements as the kernels read them: number by number, so many side by side.

use super::geometry::{self, Element, Lame};
use super::lanes::{Lanes, Row, WIDTH};

/// Elements of one shape, [`WIDTH`] to a batch; what the last one lacks has no volume.
#[derive(Debug, Default)]
pub(super) struct Batches<const D: usize, const N: usize, const Q: usize> {
    /// Number of elements.
    count: usize,
    /// Of each batch, Gauss point by Gauss point: the gradients of all nodes but the first,
    /// whose gradient is minus the sum of the others, and the volume.
    rest: Vec<Row>,
    /// Of each batch: the elements' records, number by number.
    records: Vec<Row>,
    /// Of each batch: the elements' nodes, by their numbers in the group.
    nodes: Vec<[[u16; WIDTH]; N]>,
}

impl<const D: usize, const N: usize, const Q: usize> Batches<D, N, Q> {
    /// Numbers of a Gauss point, and of an element at rest.
    const POINT: usize = (N - 1) * D + 1;
    const REST: usize = Q * Self::POINT;

    /// None yet of `count` elements with records of `record` numbers.
    pub(super) fn with_capacity(count: usize, record: usize) -> Self {
        let batches = count.div_ceil(WIDTH);
        Self {
            count: 0,
            rest: Vec::with_capacity(batches * Self::REST),
            records: Vec::with_capacity(batches * record),
            nodes: Vec::with_capacity(batches),
        }
    }

    /// Number of batches.
    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Bytes.
    pub(super) fn memory(&self) -> usize {
        size_of_val(&*self.rest) + size_of_val(&*self.records) + size_of_val(&*self.nodes)
    }

    /// Adds an element.
    pub(super) fn push(&mut self, nodes: [u16; N], element: &Element<D, N, Q>, record: &[f64]) {
        let lane = self.count % WIDTH;
        if lane == 0 {
            let batches = self.nodes.len() + 1;
            self.rest.resize(batches * Self::REST, Row::default());
            self.records.resize(batches * record.len(), Row::default());
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

    /// Nodes of an element, by their numbers in the group.
    pub(super) fn nodes(&self, element: usize) -> [u16; N] {
        self.nodes[element / WIDTH].map(|all| all[element % WIDTH])
    }

    /// Nodes of a batch.
    #[inline(always)]
    pub(super) fn nodes_of_batch(&self, batch: usize) -> &[[u16; WIDTH]; N] {
        &self.nodes[batch]
    }

    /// Elements side by side from `first` on in a batch, of some moduli.
    #[inline(always)]
    pub(super) fn gather<L: Lanes>(
        &self,
        lanes: L,
        (batch, first): (usize, usize),
        lame: Lame<f64>,
    ) -> Element<D, N, Q, L::Number> {
        let rest = &self.rest[batch * Self::REST..][..Self::REST];
        let zero = lanes.splat(0.0);
        let mut element = Element {
            gradients: [[[zero; D]; N]; Q],
            volumes: [zero; Q],
            lame: Lame {
                lambda: lanes.splat(lame.lambda),
                mu: lanes.splat(lame.mu),
            },
        };
        for q in 0..Q {
            let point = &rest[q * Self::POINT..][..Self::POINT];
            for a in 1..N {
                for k in 0..D {
                    let row = &point[(a - 1) * D + k];
                    element.gradients[q][a][k] = lanes.load(row, first);
                }
            }
            geometry::balance(&mut element.gradients[q]);
            element.volumes[q] = lanes.load(&point[Self::POINT - 1], first);
        }
        element
    }

    /// Records of a batch, of `size` numbers.
    #[inline(always)]
    pub(super) fn records(&self, batch: usize, size: usize) -> &[Row] {
        &self.records[batch * size..][..size]
    }

    /// Records of a batch, of `size` numbers.
    #[inline(always)]
    pub(super) fn records_mut(&mut self, batch: usize, size: usize) -> &mut [Row] {
        &mut self.records[batch * size..][..size]
    }
}
