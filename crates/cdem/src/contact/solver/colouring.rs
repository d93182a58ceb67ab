//! Graph colouring of points that share nodes, for [parallel
//! passes](crate::contact::solver::coloured_pass): points of one colour, in different tasks,
//! share no node.

use std::ops::Range;

use crate::contact::tolerances::{CONTACTS_ABREAST, CONTACTS_PER_COLOUR_TASK};

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
    pub(super) tasks: Vec<Range<usize>>,
    pub(super) task: usize,
    /// Tasks of each colour, which share no nodes.
    pub(super) colours: Vec<Range<usize>>,
    /// The number of nodes.
    node_count: usize,
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
}

/// Returns the first point of each group, then the second of each, and so on.
fn abreast<'a>(groups: &'a [&'a [u32]]) -> impl Iterator<Item = u32> + 'a {
    let longest = groups.iter().map(|group| group.len()).max().unwrap_or(0);
    (0..longest).flat_map(|k| groups.iter().filter_map(move |group| group.get(k).copied()))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Generates lists of nodes of points.
    pub(in crate::contact::solver) fn lists() -> impl Strategy<Value = Vec<Vec<u32>>> {
        prop::collection::vec(prop::collection::vec(0..50_u32, 0..6), 0..300)
    }

    pub(in crate::contact::solver) fn colours(lists: &[Vec<u32>], task: usize) -> Colouring {
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
    }

    #[test]
    fn more_points_of_a_node_than_a_palette_has_colours() {
        let lists: Vec<_> = (1..71).map(|i| vec![0, i]).collect();
        let colours = colours(&lists, 1);
        assert_eq!(colours.order.len(), 70);
        assert_eq!(colours.colours.len(), 70);
    }
}
