//! The kick schedule: elements and nodes grouped by time level.

use std::ops::Range;

use crate::contact::Contacts;
use crate::contact::timing::NodeDrifts;
use crate::element::{Due, Interval};
use crate::math::disjoint_sets::DisjointSets;
use crate::model::time_levels::{Levels, MAX_LEVEL};
use crate::model::{Model, State};
use crate::step::assembly::Assembly;
use crate::step::kick::KickPurpose;
use crate::step::node_ranges::{NodeRanges, each_range};
use crate::step::steady_forces::LevelBorder;

/// The kick schedule that holds until the levels change.
#[derive(Clone, Debug, Default)]
pub(crate) struct KickSchedule {
    pub(crate) levels: Levels,
    /// Number of elements of each level. Like the nodes, without those of fixed blocks.
    elements: Vec<u64>,
    nodes: NodeRanges,
    pub(super) assembly: Assembly,
    /// Nodes at which elements of coarser levels act, in the order of [`State::steady_forces`].
    pub(super) borders: Vec<LevelBorder>,
    /// True if the interval before the last kick of each element and node is that of its level.
    pub(super) is_settled: bool,
    /// True if `is_settled` was already true before the last step: the stored node intervals are
    /// right, too.
    pub(super) is_steady: bool,
    /// Prescribed nodes of blocks that are not fixed.
    pub(super) prescribed_nodes: Vec<u32>,
    pub(super) finest: u8,
}

/// One substep of the schedule.
pub(crate) struct Substep<'a> {
    pub(super) schedule: &'a KickSchedule,
    /// The coarsest level that is due.
    pub(super) coarsest: u8,
    /// Interval of each level, s.
    durations: [f64; MAX_LEVEL as usize + 1],
    /// Purpose of its kick.
    pub(super) purpose: KickPurpose,
    /// Start of the coarse step, and start of this substep, s.
    pub(crate) step_start: f64,
    pub(crate) time: f64,
}

impl Substep<'_> {
    /// Returns the nodes that are due, as ranges of consecutive nodes.
    pub(super) fn ranges(&self) -> &[Range<u32>] {
        self.schedule.nodes.due(self.coarsest)
    }

    /// Applies `work` to each range of due nodes and its part of the nodal arrays, on all threads.
    pub(super) fn each_range<T: Send, const N: usize>(
        &self,
        arrays: [&mut [T]; N],
        work: &(impl Fn(usize, [&mut [T]; N]) + Sync),
    ) {
        each_range(self.ranges(), 0, arrays, work);
    }

    /// Applies `work` to each due node and its entries of the arrays.
    pub(super) fn each_node<T: Send, const N: usize>(
        &self,
        arrays: [&mut [T]; N],
        work: &(impl Fn(usize, [&mut T; N]) + Sync),
    ) {
        self.each_range(arrays, &|first, mut slices| {
            for k in 0..slices[0].len() {
                work(first + k, slices.each_mut().map(|own| &mut own[k]));
            }
        });
    }

    /// Returns the number of elements that are due.
    pub(crate) fn element_count(&self) -> u64 {
        self.schedule.elements[self.coarsest as usize..]
            .iter()
            .sum()
    }

    /// Returns the elements that are due, over the given element intervals, s, or else over those
    /// of their levels.
    pub(super) fn due<'b>(&'b self, of_element: Option<&'b [f64]>) -> Due<'b> {
        Due {
            coarsest: self.coarsest,
            interval: of_element.map_or(Interval::OfLevel(&self.durations), Interval::OfElement),
            updates_records: self.purpose == KickPurpose::Advance,
        }
    }

    /// Returns the prescribed nodes of moving blocks that are due.
    pub(crate) fn prescribed(&self) -> impl Iterator<Item = u32> + '_ {
        let nodes = self.schedule.prescribed_nodes.iter().copied();
        nodes.filter(|&node| self.is_due(node))
    }

    /// Returns true if a node is due.
    pub(crate) fn is_due(&self, node: u32) -> bool {
        self.schedule.levels.node[node as usize] >= self.coarsest
    }

    /// Returns the drifts of the nodes that are due.
    pub(super) fn drifts(&self) -> NodeDrifts<'_> {
        NodeDrifts::OfLevels {
            levels: &self.schedule.levels.node,
            coarsest: self.coarsest,
            durations: &self.durations,
        }
    }

    /// Returns the interval of a node, s.
    pub(crate) fn duration(&self, node: u32) -> f64 {
        self.durations[self.schedule.levels.node[node as usize] as usize]
    }

    /// Returns the interval of a level, s.
    pub(super) fn duration_of(&self, level: u8) -> f64 {
        self.durations[level as usize]
    }

    /// Returns the interval of an element of the mesh, s.
    pub(crate) fn element_duration(&self, element: usize) -> f64 {
        self.durations[self.schedule.levels.element[element] as usize]
    }
}

impl KickSchedule {
    /// Sorts the elements and nodes of the model by their levels.
    pub(super) fn new<const D: usize>(
        model: &mut Model<D>,
        state: &State<D>,
        levels: Levels,
    ) -> Self {
        let (blocks, block_of) = (&model.blocks, &model.block_of);
        let fixed = |node: u32| blocks[block_of[node as usize] as usize].fixed;
        let elements = &model.mesh.elements;
        let due = |e: u32| !fixed(elements[e as usize].nodes()[0]);
        let level = |e: u32| due(e).then(|| levels.element[e as usize]);
        let of_elements: Vec<_> = (0..elements.len() as u32).map(level).collect();
        for set in &mut model.sets {
            set.arrange(&of_elements);
        }
        let mut count = vec![0; MAX_LEVEL as usize + 1];
        let mut is_settled = true;
        for e in (0..elements.len() as u32).filter(|&e| due(e)) {
            let level = levels.element[e as usize];
            count[level as usize] += 1;
            is_settled &= state.element_interval[e as usize] == duration(model.step, level);
        }
        let is_active = |node: usize| !fixed(node as u32);
        let begins = |node: usize| model.inertia.coupled(node).start == node;
        let nodes = NodeRanges::new(&levels.node, is_active, begins);
        is_settled &= nodes.due(0).iter().cloned().flatten().all(|node| {
            let level = levels.node[node as usize];
            state.node_interval[node as usize] == duration(model.step, level)
        });
        let assembly = Assembly::new(&model.sets, model.mesh.nodes.len());
        Self {
            elements: count,
            borders: assembly.level_borders(&levels),
            assembly,
            is_settled,
            is_steady: false,
            prescribed_nodes: model.prescribed_nodes(),
            finest: nodes.finest(),
            nodes,
            levels,
        }
    }

    /// Returns true if no schedule has been built yet.
    pub(super) fn is_empty(&self) -> bool {
        self.elements.is_empty()
    }

    /// Returns the substep `number` of a coarse step.
    pub(super) fn substep(&self, number: u32, step: f64, start: f64) -> Substep<'_> {
        let coarsest = match number {
            0 => 0,
            _ => self.finest - number.trailing_zeros().min(u32::from(self.finest)) as u8,
        };
        Substep {
            schedule: self,
            coarsest,
            purpose: KickPurpose::Advance,
            durations: std::array::from_fn(|level| duration(step, level as u8)),
            step_start: start,
            time: start + f64::from(number) * step / f64::from(1_u32 << self.finest),
        }
    }

    /// Returns the substep of a report at the start of a coarse step: all nodes are due.
    pub(crate) fn report(&self, step: f64, start: f64) -> Substep<'_> {
        Substep {
            purpose: KickPurpose::Report,
            ..self.substep(0, step, start)
        }
    }

    /// Returns the number of elements of each level, up to the finest in use.
    pub(crate) fn histogram(&self) -> Vec<u64> {
        let used = self.elements.iter().rposition(|&count| count > 0);
        self.elements[..used.map_or(1, |last| last + 1)].to_vec()
    }
}

/// Returns the interval of a level, s.
pub(super) fn duration(step: f64, level: u8) -> f64 {
    step / f64::from(1_u32 << level)
}

impl<const D: usize> Model<D> {
    /// Returns the sets of nodes that count as one in the levels: those of contacts, and those of
    /// blocks with a consistent mass matrix.
    pub(super) fn joined_nodes(&self, contacts: Option<&Contacts<D>>) -> DisjointSets {
        let mut joined = DisjointSets::new(self.mesh.nodes.len());
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

    /// Returns the prescribed nodes of blocks that are not fixed.
    pub(super) fn prescribed_nodes(&self) -> Vec<u32> {
        let nodes = 0..self.mesh.nodes.len() as u32;
        let is_prescribed = |node: &u32| self.inertia.prescribed(*node as usize).contains(&true);
        nodes
            .filter(|node| !self.is_fixed(*node) && is_prescribed(node))
            .collect()
    }
}
