//! Rollback log of an island's drift: the changes are undone, so that other islands see the
//! nodes as they were, and are applied again later.

use std::collections::BTreeSet;

use crate::math::vector::{add_scaled, dot, sub};
use crate::model::kinematics::{NodalMotion, NodeState};

/// Nodes that an island moves, with their states before and after.
#[derive(Debug)]
pub(crate) struct Rollback<const D: usize> {
    /// Nodes of the island, sorted, then others; the number of the former, and the set of the
    /// latter.
    nodes: Vec<u32>,
    own: usize,
    beyond: BTreeSet<u32>,
    before: Vec<NodeState<D>>,
    after: Vec<NodeState<D>>,
}

impl<const D: usize> Rollback<D> {
    /// Starts the log of an island with these nodes.
    pub(super) fn new(nodes: &[u32], motion: &NodalMotion<D>) -> Self {
        Self {
            nodes: nodes.to_vec(),
            own: nodes.len(),
            beyond: BTreeSet::new(),
            before: nodes.iter().map(|&node| motion.state(node)).collect(),
            after: Vec::new(),
        }
    }

    /// Adds nodes that are not in the log yet. These must not have moved.
    pub(crate) fn track(&mut self, nodes: &[u32], motion: &NodalMotion<D>) {
        for &node in nodes {
            let is_own = self.nodes[..self.own].binary_search(&node).is_ok();
            if !is_own && self.beyond.insert(node) {
                self.nodes.push(node);
                self.before.push(motion.state(node));
            }
        }
    }

    /// Sets the nodes back to their states before.
    pub(super) fn undo(&mut self, motion: &mut NodalMotion<D>) {
        self.after.clear();
        let after = self.nodes.iter().map(|&node| motion.state(node));
        self.after.extend(after);
        for (&node, before) in self.nodes.iter().zip(&self.before) {
            motion.set_state(node, *before);
        }
    }

    /// Applies the changes again. Where another island has changed a node, adds the change to
    /// its present state. Returns the energy of the product of both velocity changes, J, which
    /// neither island has booked. `mass` is that of all nodes, kg.
    pub(super) fn redo(&self, motion: &mut NodalMotion<D>, mass: &[f64]) -> f64 {
        let mut energy = 0.0;
        let changes = self.before.iter().zip(&self.after);
        for (&node, (before, after)) in self.nodes.iter().zip(changes) {
            let mut state = motion.state(node);
            let [.., velocity] = &state;
            let changes = [sub(velocity, &before[2]), sub(&after[2], &before[2])];
            energy += mass[node as usize] * dot(&changes[0], &changes[1]);
            for ((now, before), after) in state.iter_mut().zip(before).zip(after) {
                change(now, [before, after]);
            }
            motion.set_state(node, state);
        }
        energy
    }
}

/// Sets a value to `after` if it is still `before`; otherwise adds the change.
pub(super) fn change<const D: usize>(now: &mut [f64; D], [before, after]: [&[f64; D]; 2]) {
    if now == before {
        *now = *after;
    } else {
        add_scaled(now, 1.0, &sub(after, before));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Node 2 is outside both islands, which both move it from its state before. It must get
    /// both changes, in either order, and the returned energy must be that of all.
    #[test]
    fn islands_that_move_the_same_node_move_it_together() {
        let (rest, mass) = ([[0.0; 2]; 4], [1.0, 2.0, 3.0, 4.0]);
        let start = |k: u32| [0.125, 0.25, 0.5].map(|x| [x, x + f64::from(k)]);
        let states = || (0..4).map(start).collect::<Vec<_>>();
        // The displacement stays; its compensation and the velocity change.
        let moved = |node: u32, times: f64| {
            let [displacement, carry, velocity] = start(node);
            let change = |vector: [f64; 2], by: f64| vector.map(|x| x + times * by);
            [displacement, change(carry, 0.0625), change(velocity, 0.75)]
        };
        let all = |motion: &NodalMotion<2>| (0..4).map(|k| motion.state(k)).collect::<Vec<_>>();
        let mut fields: [Vec<[f64; 2]>; 3] =
            [0, 1, 2].map(|which| states().iter().map(|state| state[which]).collect());
        let [displacement, carry, velocity] = &mut fields;
        let mut motion = NodalMotion {
            rest: &rest,
            displacement,
            compensation: carry,
            velocity,
        };
        let mut trails: Vec<Rollback<2>> = Vec::new();
        for own in [0, 3] {
            let mut rollback = Rollback::new(&[own], &motion);
            rollback.track(&[own, 2], &motion);
            rollback.track(&[2], &motion);
            for node in [own, 2] {
                motion.set_state(node, moved(node, 1.0));
            }
            rollback.undo(&mut motion);
            assert_eq!(all(&motion), states());
            trails.push(rollback);
        }
        let expected: Vec<_> = (0..4)
            .zip([1.0, 0.0, 2.0, 1.0])
            .map(|(k, n)| moved(k, n))
            .collect();
        for _ in 0..2 {
            let told: f64 = trails
                .iter()
                .map(|rollback| rollback.redo(&mut motion, &mass))
                .sum();
            assert_eq!(told, mass[2] * 2.0 * 0.75 * 0.75);
            assert_eq!(all(&motion), expected);
            states()
                .iter()
                .zip(0..)
                .for_each(|(state, node)| motion.set_state(node, *state));
            trails.reverse();
        }
    }
}
