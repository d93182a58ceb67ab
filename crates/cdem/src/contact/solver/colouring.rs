//! Graph colouring of points that share nodes, for parallel passes: points of one colour, in
//! different tasks, share no node.
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

use crate::contact::solver::simd_block::{SimdBlock, SimdBlocks};
use crate::contact::tolerances::{
    COLOUR_TASKS_WORTH_A_THREAD, CONTACTS_ABREAST, CONTACTS_PER_COLOUR_TASK,
};

/// The number of colours that one round assigns: bits of a word.
const PALETTE: u32 = u64::BITS;

/// Lists of the nodes of points, one after the other.
#[derive(Clone, Debug, Default)]
pub(super) struct NodesOf {
    nodes: Vec<u32>,
    /// Start of the list of each point, and the end of the last.
    starts: Vec<usize>,
}

impl NodesOf {
    /// Removes all points.
    pub(super) fn clear(&mut self) {
        self.nodes.clear();
        self.starts.clear();
    }

    /// Adds a point. `add` appends its nodes to the list.
    pub(super) fn push(&mut self, add: impl FnOnce(&mut Vec<u32>)) {
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        add(&mut self.nodes);
        self.starts.push(self.nodes.len());
    }

    /// Returns the number of points.
    fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Returns the nodes of a point.
    #[inline]
    pub(super) fn of(&self, point: usize) -> &[u32] {
        &self.nodes[self.starts[point]..self.starts[point + 1]]
    }
}

/// Points in the order in which passes visit them, colour by colour. The position of a point is
/// its index in that order.
#[derive(Clone, Debug, Default)]
pub(super) struct Colouring {
    /// The point at each position, and its nodes.
    order: Vec<u32>,
    nodes: NodesOf,
    /// Ranges of positions that one thread visits one after the other; and their least length,
    /// except at the end of a colour.
    tasks: Vec<Range<usize>>,
    task: usize,
    /// Tasks of each colour, which share no nodes.
    colours: Vec<Range<usize>>,
    /// The number of nodes.
    node_count: usize,
    /// Positions that passes visit, in order; and the start of each task among them.
    active: Vec<u32>,
    begins: Vec<usize>,
}

impl Colouring {
    /// Arranges points anew, by the nodes that each changes, of `node_count`.
    ///
    /// Points with the same first and last node form a group, such as the contacts of two
    /// blocks with consistent mass: this takes fewer colours, and their nodes stay in the
    /// cache. Each group gets the first colour that none of its nodes has. If there are too few
    /// points for two threads, they keep their order, in which neighbours in space follow each
    /// other: sweeps converge a little faster that way.
    ///
    /// # Panics
    /// If a node is not below `node_count`.
    pub(super) fn arrange(&mut self, node_count: usize, nodes_of: &NodesOf) {
        self.arrange_in_tasks(node_count, nodes_of, CONTACTS_PER_COLOUR_TASK);
    }

    fn arrange_in_tasks(&mut self, node_count: usize, nodes_of: &NodesOf, task: usize) {
        (self.node_count, self.task) = (node_count, task);
        self.order.clear();
        self.nodes.clear();
        self.tasks.clear();
        self.colours.clear();
        if nodes_of.len() <= 2 * task {
            self.push(std::iter::once(0..nodes_of.len() as u32), nodes_of);
        } else {
            self.colour(nodes_of);
        }
        self.activate_all();
    }

    /// Adds points colour by colour.
    fn colour(&mut self, nodes_of: &NodesOf) {
        let ends = |point: u32| {
            let nodes = nodes_of.of(point as usize).iter();
            (nodes.clone().min(), nodes.max())
        };
        let mut sorted: Vec<u32> = (0..nodes_of.len() as u32).collect();
        sorted.sort_by_cached_key(|&point| (ends(point), point));
        let mut pending: Vec<&[u32]> = sorted.chunk_by(|&a, &b| ends(a) == ends(b)).collect();
        let mut used = vec![0_u64; self.node_count];
        while !pending.is_empty() {
            used.fill(0);
            let mut palette = vec![Vec::new(); PALETTE as usize];
            pending.retain(|group| {
                let nodes = || group.iter().flat_map(|&point| nodes_of.of(point as usize));
                let taken = nodes().fold(0, |taken, &node| taken | used[node as usize]);
                let colour = taken.trailing_ones();
                if colour < PALETTE {
                    palette[colour as usize].push(*group);
                    nodes().for_each(|&node| used[node as usize] |= 1 << colour);
                }
                colour == PALETTE
            });
            for groups in palette.iter().filter(|groups| !groups.is_empty()) {
                self.push(groups.chunks(CONTACTS_ABREAST).map(abreast), nodes_of);
            }
        }
    }

    /// Makes all positions active.
    pub(super) fn activate_all(&mut self) {
        self.active.clear();
        self.active.extend(0..self.order.len() as u32);
        self.begins.clear();
        self.begins.extend(self.tasks.iter().map(|task| task.start));
        self.begins.push(self.order.len());
    }

    /// Keeps only those active positions for which `stay` is true, given the position and its
    /// nodes.
    pub(super) fn deactivate(&mut self, mut stay: impl FnMut(usize, &[u32]) -> bool) {
        let (mut kept, mut next) = (0, 0);
        for task in 1..self.begins.len() {
            for number in next..self.begins[task] {
                let place = self.active[number];
                self.active[kept] = place;
                let place = place as usize;
                kept += usize::from(stay(place, self.nodes(place)));
            }
            next = std::mem::replace(&mut self.begins[task], kept);
        }
        self.active.truncate(kept);
    }

    /// Returns the active positions, in order.
    pub(super) fn active(&self) -> &[u32] {
        &self.active
    }

    /// Adds a colour from parts that share no nodes, and splits it into tasks.
    fn push(&mut self, parts: impl Iterator<Item = impl Iterator<Item = u32>>, nodes_of: &NodesOf) {
        let (first, mut start) = (self.tasks.len(), self.order.len());
        for points in parts {
            for point in points {
                let nodes = nodes_of.of(point as usize);
                assert!(nodes.iter().all(|&node| (node as usize) < self.node_count));
                self.order.push(point);
                self.nodes.push(|all| all.extend_from_slice(nodes));
            }
            if self.order.len() - start >= self.task {
                self.tasks.push(start..self.order.len());
                start = self.order.len();
            }
        }
        if start < self.order.len() {
            self.tasks.push(start..self.order.len());
        }
        self.colours.push(first..self.tasks.len());
    }

    /// Returns the point at each position.
    pub(super) fn order(&self) -> &[u32] {
        &self.order
    }

    /// Returns the number of nodes.
    pub(super) fn node_count(&self) -> usize {
        self.node_count
    }

    /// Returns the nodes of the point at a position.
    pub(super) fn nodes(&self, place: usize) -> &[u32] {
        self.nodes.of(place)
    }

    /// Visits each active position, with its value in `own` and the `values` of its nodes,
    /// colour by colour, the tasks of a colour in parallel. Returns the
    /// [combined](Visit::together) results. The points fix the order of combination.
    pub(super) fn pass<T: Send, V: Send, F: Visit<T, V, N>, const N: usize>(
        &self,
        own: &mut [T],
        values: &mut [V],
        visit: &F,
    ) -> [f64; N] {
        assert_eq!(own.len(), self.order.len());
        assert_eq!(values.len(), self.node_count);
        let (own, values) = (SharedSlice::new(own), SharedSlice::new(values));
        let run = |awake: Range<usize>| {
            // SAFETY: tasks of a colour share neither positions nor nodes, and no two colours
            // are visited at the same time. All indices are in range: `push` has asserted it
            // for the nodes, and the lengths are asserted above.
            let task =
                unsafe { ColourTask::new(self, &self.active[awake], (&own, &values), visit) };
            Arch::new().dispatch(task)
        };
        let mut all = [0.0; N];
        for tasks in &self.colours {
            let awake = self.begins[tasks.start]..self.begins[tasks.end];
            if awake.is_empty() {
                continue;
            }
            let is_small = awake.len() <= COLOUR_TASKS_WORTH_A_THREAD * self.task;
            if is_small || tasks.len() == 1 {
                all = F::together(all, run(awake));
                continue;
            }
            let task = |task: usize| run(self.begins[task]..self.begins[task + 1]);
            all = F::together(all, halves(tasks.clone(), &task, &F::together));
        }
        all
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

/// Returns the first point of each group, then the second of each, and so on.
fn abreast<'a>(groups: &'a [&'a [u32]]) -> impl Iterator<Item = u32> + 'a {
    let longest = groups.iter().map(|group| group.len()).max().unwrap_or(0);
    (0..longest).flat_map(|k| groups.iter().filter_map(move |group| group.get(k).copied()))
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

/// Active positions that are visited one after the other, with the widest instructions of the
/// machine.
struct ColourTask<'a, T, V, F, const N: usize> {
    colours: &'a Colouring,
    places: &'a [u32],
    own: &'a SharedSlice<'a, T>,
    values: &'a SharedSlice<'a, V>,
    visit: &'a F,
}

impl<'a, T, V, F, const N: usize> ColourTask<'a, T, V, F, N> {
    /// # Safety
    ///
    /// The positions and their nodes are in range, and nothing else uses their values during
    /// the lifetime of the result.
    unsafe fn new(
        colours: &'a Colouring,
        places: &'a [u32],
        (own, values): (&'a SharedSlice<'a, T>, &'a SharedSlice<'a, V>),
        visit: &'a F,
    ) -> Self {
        Self {
            colours,
            places,
            own,
            values,
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
        for &place in self.places {
            let place = place as usize;
            let nodes = self.colours.nodes(place);
            // SAFETY: the caller of `new` guarantees it.
            let (own, values) =
                unsafe { (self.own.get_mut(place), NodeValues::new(self.values, nodes)) };
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
        (number, lane): (usize, usize),
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
        // side. The reads end before `pack` or `change` lends a value.
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
    use proptest::prelude::*;

    /// Generates lists of nodes of points.
    fn lists() -> impl Strategy<Value = Vec<Vec<u32>>> {
        prop::collection::vec(prop::collection::vec(0..50_u32, 0..6), 0..300)
    }

    fn colours(lists: &[Vec<u32>], task: usize) -> Colouring {
        let mut nodes_of = NodesOf::default();
        for list in lists {
            nodes_of.push(|all| all.extend(list));
        }
        let mut colours = Colouring::default();
        // An earlier arrangement must not matter.
        colours.arrange_in_tasks(100, &nodes_of, task + 1);
        colours.arrange_in_tasks(100, &nodes_of, task);
        colours
    }

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
        #[test]
        fn tasks_of_a_colour_share_no_node(lists in lists(), task in 1..20_usize) {
            let colours = colours(&lists, task);
            let mut order = colours.order().to_vec();
            order.sort_unstable();
            prop_assert!(order.iter().copied().eq(0..lists.len() as u32));
            let places = colours.tasks.iter().cloned().flatten();
            prop_assert!(places.eq(0..lists.len()));
            let tasks = colours.colours.iter().cloned().flatten();
            prop_assert!(tasks.eq(0..colours.tasks.len()));
            for tasks in &colours.colours {
                let mut owner = [None; 100];
                for task in tasks.clone() {
                    for place in colours.tasks[task].clone() {
                        prop_assert_eq!(colours.nodes(place), &lists[colours.order[place] as usize]);
                        for &node in colours.nodes(place) {
                            let owner = owner[node as usize].get_or_insert(task);
                            prop_assert_eq!(*owner, task);
                        }
                    }
                }
            }
        }

        /// Compares with a plain loop over the active positions. Sums depend on the order.
        #[test]
        fn a_pass_gives_the_same_bits_on_any_number_of_threads(
            lists in lists(),
            sleep in prop::collection::vec(1..9_usize, 0..4),
        ) {
            let mut colours = colours(&lists, 2);
            let mut awake: Vec<usize> = (0..lists.len()).collect();
            for of in sleep {
                colours.deactivate(|place, _| place % of > 0);
                awake.retain(|place| place % of > 0);
            }
            prop_assert!(colours.active().iter().map(|&place| place as usize).eq(awake.clone()));
            let start = || {
                let own: Vec<f64> = (0..lists.len()).map(|i| (i as f64).sin()).collect();
                (own, vec![1.0; 100])
            };
            let (mut own, mut values) = start();
            let (mut sum, mut size) = (0.0, 0.0);
            for place in awake {
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
                let [of_all] = pool
                    .expect("a pool")
                    .install(|| colours.pass(&mut found, &mut changed, &Mix));
                prop_assert!((&found, &changed) == (&own, &values));
                prop_assert_eq!(*told.get_or_insert(of_all), of_all);
                // Round-off of this many additions.
                prop_assert!((of_all - sum).abs() <= lists.len() as f64 * f64::EPSILON * size);
            }
        }
    }

    #[test]
    fn more_points_of_a_node_than_a_palette_has_colours() {
        let lists: Vec<_> = (1..71).map(|i| vec![0, i]).collect();
        let colours = colours(&lists, 1);
        assert_eq!(colours.order.len(), 70);
        assert_eq!(colours.colours.len(), 70);
    }
}
