//! Who is due when: levels as lists of elements and nodes.

use super::levels::{Joined, Levels, Schedule};
use crate::contact::Contacts;
use crate::model::Model;

/// Who is due when, until the levels change.
#[derive(Clone, Debug, Default)]
pub(crate) struct Plan {
    pub(crate) levels: Levels,
    /// Elements of each set; nodes; both without those of fixed blocks.
    pub(super) elements: Vec<Schedule>,
    nodes: Schedule,
    /// Held nodes of blocks that are not fixed, by level.
    pub(super) held: Vec<u32>,
    pub(super) finest: u8,
}

/// One substep of the plan.
pub(crate) struct Substep<'a> {
    pub(super) plan: &'a Plan,
    /// The coarsest level that is due.
    coarsest: u8,
    /// Coarse step, s, its start, and the time of this substep's start, s.
    step: f64,
    pub(crate) step_start: f64,
    pub(crate) time: f64,
    held: Vec<u32>,
}

impl Substep<'_> {
    /// Nodes that are due.
    pub(crate) fn nodes(&self) -> &[u32] {
        self.plan.nodes.due(self.coarsest)
    }

    /// Elements of a set that are due.
    pub(crate) fn elements(&self, set: usize) -> &[u32] {
        self.plan.elements[set].due(self.coarsest)
    }

    /// Held nodes of moving blocks that are due.
    pub(crate) fn held(&self) -> &[u32] {
        &self.held
    }

    /// Whether a node is due.
    pub(crate) fn is_due(&self, node: u32) -> bool {
        self.plan.levels.node[node as usize] >= self.coarsest
    }

    /// Interval of a node, s.
    pub(crate) fn duration(&self, node: u32) -> f64 {
        self.step / f64::from(1_u32 << self.plan.levels.node[node as usize])
    }

    /// Interval of an element of the mesh, s.
    pub(crate) fn element_duration(&self, element: usize) -> f64 {
        self.step / f64::from(1_u32 << self.plan.levels.element[element])
    }
}

impl Plan {
    pub(super) fn new<const D: usize>(model: &Model<D>, levels: Levels) -> Self {
        let fixed = |node: u32| model.is_fixed(node);
        let elements = model.sets.iter().map(|set| {
            let of: Vec<u8> = set
                .mesh_elements()
                .iter()
                .map(|&e| levels.element[e as usize])
                .collect();
            Schedule::new(&of, |i| !fixed(set.nodes(i)[0]))
        });
        let elements: Vec<_> = elements.collect();
        let nodes = Schedule::new(&levels.node, |node| !fixed(node as u32));
        let finest = nodes
            .due(0)
            .first()
            .map_or(0, |&node| levels.node[node as usize]);
        Self {
            elements,
            nodes,
            held: model.held_nodes(),
            finest,
            levels,
        }
    }

    /// The `number`-th substep of a coarse step.
    pub(super) fn substep(&self, number: u32, step: f64, start: f64) -> Substep<'_> {
        let coarsest = match number {
            0 => 0,
            _ => self.finest - number.trailing_zeros().min(u32::from(self.finest)) as u8,
        };
        let mut substep = Substep {
            plan: self,
            coarsest,
            step,
            step_start: start,
            time: start + f64::from(number) * step / f64::from(1_u32 << self.finest),
            held: Vec::new(),
        };
        substep.held = self
            .held
            .iter()
            .copied()
            .filter(|&node| substep.is_due(node))
            .collect();
        substep
    }

    /// The whole model at the start of a coarse step.
    pub(crate) fn all(&self, step: f64, start: f64) -> Substep<'_> {
        self.substep(0, step, start)
    }

    /// Number of elements of each level.
    pub(crate) fn histogram(&self) -> Vec<u64> {
        let mut sum: Vec<u64> = vec![0];
        for set in &self.elements {
            let of = set.histogram();
            sum.resize(sum.len().max(of.len()), 0);
            for (total, count) in sum.iter_mut().zip(of) {
                *total += count;
            }
        }
        sum
    }
}

impl<const D: usize> Model<D> {
    /// Nodes that count as one in the levels: those of contacts, and those of
    /// blocks with a dense mass matrix.
    pub(super) fn joined_nodes(&self, contacts: Option<&Contacts<D>>) -> Joined {
        let mut joined = Joined::new(self.mesh.nodes.len());
        for block in 0..self.blocks.len() {
            let nodes = self.nodes(block);
            if self.inertia.is_dense(nodes.start) {
                for node in nodes.clone() {
                    joined.join(nodes.start as u32, node as u32);
                }
            }
        }
        if let Some(contacts) = contacts {
            contacts.joined_nodes(&mut joined);
        }
        joined.flatten();
        joined
    }

    /// Held nodes of blocks that are not fixed.
    pub(super) fn held_nodes(&self) -> Vec<u32> {
        let nodes = 0..self.mesh.nodes.len() as u32;
        let held = |node: &u32| self.inertia.held(*node as usize).contains(&true);
        nodes
            .filter(|node| !self.is_fixed(*node) && held(node))
            .collect()
    }
}
