//! Passes over the points of a [colouring](Colouring), on many threads.
//!
//! Colours depend on the points alone, and tasks of one colour do not see each other. So a pass
//! gives the same bits on any number of threads (design, section 5).

#![allow(
    unsafe_code,
    reason = "threads write to one slice, each to places of its own"
)]

use std::marker::PhantomData;
use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use crate::contact::solver::colouring::Colouring;
use crate::contact::solver::simd_block::{SimdBlock, SimdBlocks};
use crate::contact::tolerances::COLOUR_TASKS_WORTH_A_THREAD;

impl Colouring {
    /// Visits each position, with its value in `own` and the `values` of its nodes, colour by
    /// colour, the tasks of a colour in parallel. Returns the [combined](Visit::together)
    /// results. The points fix the order of combination.
    pub(super) fn pass<T: Send, V: Send, F: Visit<T, V, N>, const N: usize>(
        &self,
        order: PassOrder,
        own: &mut [T],
        values: &mut [V],
        visit: &F,
    ) -> [f64; N] {
        assert_eq!(own.len(), self.order().len());
        assert_eq!(values.len(), self.node_count());
        let shared = SharedValues {
            own: SharedSlice::new(own),
            values: SharedSlice::new(values),
        };
        let run = |places: Range<usize>| {
            // SAFETY: tasks of a colour share neither positions nor nodes, and no two colours
            // are visited at the same time. All indices are in range: `push` has asserted it
            // for the nodes, and the lengths are asserted above.
            let task = unsafe { ColourTask::new(self, places, &shared, visit) };
            Arch::new().dispatch(ColourTask { order, ..task })
        };
        let mut all = [0.0; N];
        for number in 0..self.colours.len() {
            let tasks = &self.colours[order.index(number, self.colours.len())];
            if tasks.is_empty() {
                continue;
            }
            let places = self.tasks[tasks.start].start..self.tasks[tasks.end - 1].end;
            let is_small = places.len() <= COLOUR_TASKS_WORTH_A_THREAD * self.task;
            if is_small || tasks.len() == 1 {
                all = F::together(all, run(places));
                continue;
            }
            let task = |task: usize| run(self.tasks[task].clone());
            all = F::together(all, halves(tasks.clone(), &task, &F::together));
        }
        all
    }
}

/// Order of the positions in a pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum PassOrder {
    Forwards,
    Backwards,
}

impl PassOrder {
    /// Returns the index that comes at a place of the order, of `count`.
    #[inline(always)]
    fn index(self, place: usize, count: usize) -> usize {
        match self {
            Self::Forwards => place,
            Self::Backwards => count - 1 - place,
        }
    }
}

/// Runs one or more tasks on all threads, in halves. The order in which results are combined
/// does not depend on which task ends first.
fn halves<R: Send>(
    tasks: Range<usize>,
    run: &(impl Fn(usize) -> R + Sync),
    together: &(impl Fn(R, R) -> R + Sync),
) -> R {
    if tasks.len() == 1 {
        return run(tasks.start);
    }
    let middle = tasks.start + tasks.len() / 2;
    let (one, other) = rayon::join(
        || halves(tasks.start..middle, run, together),
        || halves(middle..tasks.end, run, together),
    );
    together(one, other)
}

/// Work at a position. It is compiled into each [`ColourTask`] for that task's instruction set:
/// `#[inline(always)]`, which no closure can be.
pub(super) trait Visit<T, V, const N: usize>: Sync {
    fn visit<S: Simd>(&self, simd: S, place: usize, own: &mut T, values: NodeValues<V>)
    -> [f64; N];

    /// Combines the results of two visits, or of any number: the larger value of each; NaN
    /// stays.
    #[inline(always)]
    fn together(one: [f64; N], other: [f64; N]) -> [f64; N] {
        std::array::from_fn(|i| larger(one[i], other[i]))
    }
}

/// Values that a pass changes: those of the points, by position, and those of the nodes.
struct SharedValues<'a, T, V> {
    own: SharedSlice<'a, T>,
    values: SharedSlice<'a, V>,
}

/// Positions that are visited one after the other, with the widest instructions of the machine.
struct ColourTask<'a, T, V, F, const N: usize> {
    colours: &'a Colouring,
    places: Range<usize>,
    order: PassOrder,
    shared: &'a SharedValues<'a, T, V>,
    visit: &'a F,
}

impl<'a, T, V, F, const N: usize> ColourTask<'a, T, V, F, N> {
    /// # Safety
    ///
    /// The positions and their nodes are in range, and nothing else uses their values during
    /// the lifetime of the result.
    unsafe fn new(
        colours: &'a Colouring,
        places: Range<usize>,
        shared: &'a SharedValues<'a, T, V>,
        visit: &'a F,
    ) -> Self {
        Self {
            colours,
            places,
            order: PassOrder::Forwards,
            shared,
            visit,
        }
    }
}

impl<T, V, F, const N: usize> WithSimd for ColourTask<'_, T, V, F, N>
where
    F: Visit<T, V, N>,
{
    type Output = [f64; N];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [f64; N] {
        let mut all = [0.0; N];
        for number in 0..self.places.len() {
            let place = self.places.start + self.order.index(number, self.places.len());
            let nodes = self.colours.nodes(place);
            // SAFETY: the caller of `new` guarantees it.
            let (own, values) = unsafe {
                (
                    self.shared.own.get_mut(place),
                    NodeValues::new(&self.shared.values, nodes),
                )
            };
            all = F::together(all, self.visit.visit(simd, place, own, values));
        }
        all
    }
}

/// Returns the larger number; NaN stays.
#[inline(always)]
pub(super) fn larger(one: f64, other: f64) -> f64 {
    if one >= other || one.is_nan() {
        one
    } else {
        other
    }
}

/// Values of a point's nodes.
pub(super) struct NodeValues<'a, V> {
    values: SharedSlice<'a, V>,
    nodes: &'a [u32],
}

impl<'a, V> NodeValues<'a, V> {
    /// # Safety
    ///
    /// The nodes are in range, and nothing else uses their values during the lifetime of the
    /// result.
    unsafe fn new(values: &SharedSlice<'a, V>, nodes: &'a [u32]) -> Self {
        Self {
            values: SharedSlice { ..*values },
            nodes,
        }
    }

    /// Changes the value of each node in turn, with its entry of `of_each`.
    #[inline(always)]
    pub(super) fn change<T>(&mut self, of_each: &[T], mut change: impl FnMut(&mut V, &T)) {
        for (&node, own) in self.nodes.iter().zip(of_each) {
            // SAFETY: the caller of `new` guarantees it; all of `self` is borrowed, and one
            // value at a time.
            change(unsafe { self.values.get_mut(node as usize) }, own);
        }
    }
}

impl<V: SimdBlock> SimdBlocks<V> for NodeValues<'_, V> {
    #[inline(always)]
    fn simd_block(&mut self, number: usize) -> &mut V {
        // SAFETY: the caller of `new` guarantees it; all of `self` is borrowed.
        unsafe { self.values.get_mut(self.nodes[number] as usize) }
    }

    #[inline(always)]
    fn change<T>(&mut self, of_each: &[T], change: impl FnMut(&mut V, &T)) {
        NodeValues::change(self, of_each, change);
    }
}

impl<V: SimdBlock> NodeValues<'_, V> {
    /// Returns `N` numbers of the point's nodes. The first is at `lane` of the node with index
    /// `number`; each other one is `stride` further, where the numbers of the next nodes
    /// follow.
    #[inline(always)]
    pub(super) fn numbers<const N: usize>(
        &self,
        number: usize,
        lane: usize,
        stride: usize,
    ) -> [f64; N] {
        const { assert!(size_of::<V>() == V::WIDTH * size_of::<f64>()) };
        const { assert!(align_of::<V>() >= align_of::<f64>()) };
        let node = self.nodes[number];
        let mut are_beside = true;
        for n in 0..N {
            let beyond = (lane + n * stride) / V::WIDTH;
            are_beside &= self.nodes[number + beyond] == node + beyond as u32;
        }
        assert!(are_beside);
        // SAFETY: the caller of `new` guarantees the values of these nodes, which lie side by
        // side. The reads end before `simd_block` or `change` lends a value.
        std::array::from_fn(|n| unsafe {
            let first = self.values.first.add(node as usize).cast::<f64>();
            *first.add(lane + n * stride)
        })
    }
}

/// A slice that several threads change.
struct SharedSlice<'a, T> {
    first: *mut T,
    slice: PhantomData<&'a mut [T]>,
}

// SAFETY: it gives out what a mutable slice would, each position to one thread at a time, as
// `get_mut` requires.
unsafe impl<T: Send> Sync for SharedSlice<'_, T> {}

impl<'a, T> SharedSlice<'a, T> {
    fn new(slice: &'a mut [T]) -> Self {
        Self {
            first: slice.as_mut_ptr(),
            slice: PhantomData,
        }
    }

    /// # Safety
    ///
    /// `place` is within the slice, and nothing else uses that element during the lifetime of
    /// the result.
    #[inline]
    #[allow(clippy::mut_from_ref, reason = "as of a cell")]
    unsafe fn get_mut(&self, place: usize) -> &mut T {
        // SAFETY: the caller guarantees it.
        unsafe { &mut *self.first.add(place) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::solver::colouring::tests::{colours, lists};
    use proptest::prelude::*;

    struct Mix;

    impl Visit<f64, f64, 1> for Mix {
        fn visit<S: Simd>(
            &self,
            _: S,
            _: usize,
            own: &mut f64,
            mut values: NodeValues<f64>,
        ) -> [f64; 1] {
            values.change(values.nodes, |value, _| *own += *value / 3.0);
            values.change(values.nodes, |value, _| *value += own.cos());
            [*own]
        }

        fn together(one: [f64; 1], other: [f64; 1]) -> [f64; 1] {
            [one[0] + other[0]]
        }
    }

    proptest! {
        /// Compares with a plain loop over the positions, there and back. Sums depend on the order.
        #[test]
        fn a_pass_gives_the_same_bits_on_any_number_of_threads(lists in lists()) {
            let colours = colours(&lists, 2);
            let start = || {
                let own: Vec<f64> = (0..lists.len()).map(|i| (i as f64).sin()).collect();
                (own, vec![1.0; 100])
            };
            let (mut own, mut values) = start();
            let (mut sum, mut size) = (0.0, 0.0);
            for place in (0..lists.len()).chain((0..lists.len()).rev()) {
                let own = &mut own[place];
                let nodes = || colours.nodes(place).iter().map(|&node| node as usize);
                nodes().for_each(|node| *own += values[node] / 3.0);
                nodes().for_each(|node| values[node] += own.cos());
                sum += *own;
                size += own.abs();
            }
            let mut told = None;
            for threads in [1, 2, 3] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                let (mut found, mut changed) = start();
                let pool = pool.expect("a pool");
                let of_both = [PassOrder::Forwards, PassOrder::Backwards].map(|order| {
                    let [of_all] = pool.install(|| colours.pass(order, &mut found, &mut changed, &Mix));
                    of_all
                });
                let of_all = of_both[0] + of_both[1];
                prop_assert!((&found, &changed) == (&own, &values));
                prop_assert_eq!(*told.get_or_insert(of_all), of_all);
                // Round-off of this many additions.
                prop_assert!((of_all - sum).abs() <= 2.0 * lists.len() as f64 * f64::EPSILON * size);
            }
        }
    }
}
