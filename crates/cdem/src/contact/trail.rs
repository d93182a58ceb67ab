//! What the drift of one island has changed: undone, for other islands to see its nodes as they
//! were, and done again.

use crate::model::motion::{Motion, State};
use crate::vector::{add_scaled, sub};

/// Nodes that an island moves, and how they were before and after.
#[derive(Debug)]
pub(crate) struct Trail<const D: usize> {
    /// Those of the island, sorted, then those beyond.
    nodes: Vec<u32>,
    own: usize,
    before: Vec<State<D>>,
    after: Vec<State<D>>,
}

impl<const D: usize> Trail<D> {
    /// Of an island of these nodes.
    pub(super) fn new(nodes: &[u32], motion: &Motion<D>) -> Self {
        Self {
            nodes: nodes.to_vec(),
            own: nodes.len(),
            before: nodes.iter().map(|&node| motion.state(node)).collect(),
            after: Vec::new(),
        }
    }

    /// Goes on to nodes, which have not been moved yet.
    pub(crate) fn reach(&mut self, nodes: impl Iterator<Item = u32>, motion: &Motion<D>) {
        for node in nodes {
            let (own, beyond) = self.nodes.split_at(self.own);
            if own.binary_search(&node).is_err() && !beyond.contains(&node) {
                self.nodes.push(node);
                self.before.push(motion.state(node));
            }
        }
    }

    /// Takes the nodes back to where they were.
    pub(super) fn undo(&mut self, motion: &mut Motion<D>) {
        self.after.clear();
        let after = self.nodes.iter().map(|&node| motion.state(node));
        self.after.extend(after);
        for (&node, before) in self.nodes.iter().zip(&self.before) {
            motion.set_state(node, *before);
        }
    }

    /// Moves the nodes once more; by what they have changed by where another island has moved
    /// them.
    pub(super) fn redo(&self, motion: &mut Motion<D>) {
        let changes = self.before.iter().zip(&self.after);
        for (&node, (before, after)) in self.nodes.iter().zip(changes) {
            let mut state = motion.state(node);
            for ((now, before), after) in state.iter_mut().zip(before).zip(after) {
                if now == before {
                    *now = *after;
                } else {
                    add_scaled(now, 1.0, &sub(after, before));
                }
            }
            motion.set_state(node, state);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::motion::Copied;

    /// Node 2 lies beyond both islands: it goes where both send it, whoever comes first.
    #[test]
    fn islands_that_move_the_same_node_move_it_together() {
        let rest = [[0.0; 2]; 4];
        let at = |k: u32| [0.125, 0.25, 0.5].map(|x| [x, x + f64::from(k)]);
        let states = || (0..4).map(at).collect::<Vec<_>>();
        let mut copied = Copied::of(&states());
        let mut motion = copied.motion(&rest);
        let mut trails: Vec<Trail<2>> = [[0, 1], [3, 3]]
            .iter()
            .map(|own| {
                let mut trail = Trail::new(&own[..1], &motion);
                trail.reach([own[1], 2, 2].into_iter(), &motion);
                for &node in &trail.nodes {
                    let state = motion.state(node);
                    motion.set_state(node, state.map(|vector| vector.map(|x| x + 0.75)));
                }
                trail.undo(&mut motion);
                trail
            })
            .collect();
        let mut found = Vec::new();
        for _ in 0..2 {
            let mut copied = Copied::of(&states());
            let mut motion = copied.motion(&rest);
            let all = |motion: &Motion<2>| (0..4).map(|k| motion.state(k)).collect::<Vec<_>>();
            assert_eq!(all(&motion), states());
            trails.iter().for_each(|trail| trail.redo(&mut motion));
            found.push(all(&motion));
            trails.reverse();
        }
        let moved =
            |k: u32| at(k).map(|vector| vector.map(|x| x + if k == 2 { 1.5 } else { 0.75 }));
        assert!(
            found
                .iter()
                .all(|found| found.iter().copied().eq((0..4).map(moved)))
        );
    }
}
