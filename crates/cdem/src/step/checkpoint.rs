//! A run in a checkpoint.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::contact::checkpoint::SavedContacts;
use crate::math::adjacency::Adjacency;
use crate::math::restore::{ResumeError, require};
use crate::math::serde_pod;
use crate::mesh::Element;
use crate::model::ledger::Ledger;
use crate::model::{Model, State};
use crate::refinement::checkpoint::SavedScale;
use crate::step::kick::KickImpulses;
use crate::step::schedule::KickSchedule;
use crate::step::{Corrections, Run};

/// The restart state of a run: the fields of [`Run`], and the histories of its elements.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct SavedRun<'a, const D: usize> {
    state: Cow<'a, State<D>>,
    /// History variables of the elements, one element after the other.
    #[serde(with = "serde_pod")]
    records: Vec<f64>,
    contacts: Option<SavedContacts<'a, D>>,
    adaptivity: Option<SavedScale<'a, D>>,
    ledger: Ledger,
    block_impulse: Cow<'a, [[f64; 3]]>,
    #[serde(with = "serde_pod")]
    node_impulse: Vec<[f64; D]>,
    touched_nodes: Cow<'a, [u32]>,
    element_updates: u64,
    corrections: Corrections,
    /// Of the last kick: velocities before it, m/s, and the interval of each node, s.
    #[serde(with = "serde_pod")]
    before: Vec<[f64; D]>,
    #[serde(with = "serde_pod")]
    interval: Vec<f64>,
    active_boundaries: Cow<'a, [bool]>,
}

impl<const D: usize> Run<D> {
    /// Returns the state that a checkpoint between two steps stores.
    pub(crate) fn saved(&self) -> SavedRun<'_, D> {
        SavedRun {
            state: Cow::Borrowed(&self.state),
            records: self.model.records(),
            contacts: self.contacts.as_ref().map(|contacts| contacts.saved()),
            adaptivity: self.adaptivity.as_ref().map(|second| second.saved()),
            ledger: self.ledger,
            block_impulse: Cow::Borrowed(&self.block_impulse),
            node_impulse: self.node_impulse.clone(),
            touched_nodes: Cow::Borrowed(&self.touched_nodes),
            element_updates: self.element_updates,
            corrections: self.corrections,
            before: self.impulses.before.clone(),
            interval: self.impulses.interval.clone(),
            active_boundaries: Cow::Borrowed(&self.active_boundaries),
        }
    }

    /// Continues from a saved state; `self` is at t = 0 of the same scene and mesh.
    ///
    /// # Errors
    /// If the saved state is of another scene or mesh.
    pub(crate) fn restore(&mut self, saved: SavedRun<D>) -> Result<(), ResumeError> {
        let is_contact = saved.contacts.is_some() == self.contacts.is_some();
        let is_refined = saved.adaptivity.is_some() == self.adaptivity.is_some();
        require(is_contact && is_refined, "its contact model")?;
        require(
            saved.state.number <= self.model.step_count,
            "its number of steps",
        )?;
        let time = saved.state.number as f64 * self.model.step;
        if let (Some(second), Some(saved)) = (&mut self.adaptivity, saved.adaptivity) {
            second.restore(saved)?;
            if second.refined_blocks().iter().any(Option::is_some) {
                self.model.remesh(second, time);
                let mesh = &self.model.mesh;
                if let Some(contacts) = &mut self.contacts {
                    let surface = second.base_model.surface(mesh, contacts.tolerance());
                    contacts.exchange_surface(mesh, surface);
                }
                let elements = mesh.elements.iter().map(Element::nodes);
                self.adjacency = Adjacency::new(elements, mesh.nodes.len());
            }
        }
        self.model.set_prescribed_nodes(time);
        let nodes = self.model.mesh.nodes.len();
        let is_node = |&node: &u32| (node as usize) < nodes;
        let fits = saved.state.is_of(nodes, self.model.mesh.elements.len())
            && saved.block_impulse.len() == self.model.blocks.len()
            && saved.node_impulse.len() == nodes
            && saved.touched_nodes.iter().all(is_node)
            && saved.before.len() == nodes
            && saved.interval.len() == nodes
            && saved.active_boundaries.len() == self.model.boundaries.len();
        require(fits, "its nodes and elements")?;
        self.model.set_records(&saved.records)?;
        self.state = saved.state.into_owned();
        if let (Some(contacts), Some(saved)) = (&mut self.contacts, saved.contacts) {
            contacts.restore(saved)?;
        }
        let levels = self.levels();
        self.schedule = KickSchedule::new(&mut self.model, &self.state, levels);
        self.ledger = saved.ledger;
        self.block_impulse = saved.block_impulse.into_owned();
        self.node_impulse = saved.node_impulse;
        self.touched_nodes = saved.touched_nodes.into_owned();
        self.element_updates = saved.element_updates;
        self.corrections = saved.corrections;
        self.impulses = KickImpulses::new(nodes);
        self.impulses.before = saved.before;
        self.impulses.interval = saved.interval;
        self.active_boundaries = saved.active_boundaries.into_owned();
        Ok(())
    }
}

impl<const D: usize> State<D> {
    /// Returns true if the state is of this number of nodes and elements.
    fn is_of(&self, nodes: usize, elements: usize) -> bool {
        let lists = [
            self.displacement.len(),
            self.compensation.len(),
            self.velocity.len(),
            self.contact_force.len(),
            self.node_interval.len(),
        ];
        lists.iter().all(|&length| length == nodes) && self.element_interval.len() == elements
    }
}

impl<const D: usize> Model<D> {
    /// Returns the history variables of the elements, set by set.
    fn records(&self) -> Vec<f64> {
        let of_set = self.sets.iter();
        let records = of_set.flat_map(|set| (0..set.len()).flat_map(|i| set.record(i)));
        records.collect()
    }

    fn set_records(&mut self, records: &[f64]) -> Result<(), ResumeError> {
        let mut rest = records;
        for set in &mut self.sets {
            let length = set.record_length();
            for i in 0..set.len() {
                let Some((own, others)) = rest.split_at_checked(length) else {
                    return require(false, "its elements");
                };
                set.set_record(i, own);
                rest = others;
            }
        }
        require(rest.is_empty(), "its elements")
    }
}
