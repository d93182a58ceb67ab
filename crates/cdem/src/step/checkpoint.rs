//! A run in a checkpoint.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::contact::state::ContactState;
use crate::math::restore::{ResumeError, require};
use crate::math::serde_pod;
use crate::model::{Model, State};
use crate::refinement::state::AdaptivityState;
use crate::step::Run;
use crate::step::schedule::KickSchedule;
use crate::step::workspace::Workspace;

/// The states from which a run continues: of the bodies, of contact and of adaptivity.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct RunState<'a, const D: usize> {
    bodies: Cow<'a, State<D>>,
    /// Records of the elements, one element after the other. The element sets hold them in the
    /// order of their kernels, which may differ from machine to machine.
    #[serde(with = "serde_pod")]
    element_records: Vec<f64>,
    contacts: Option<Cow<'a, ContactState<D>>>,
    adaptivity: Option<Cow<'a, AdaptivityState<D>>>,
}

impl<const D: usize> Run<D> {
    /// Returns the state between two steps, which a checkpoint stores.
    pub(crate) fn stored(&self) -> RunState<'_, D> {
        let contacts = self.contacts.as_ref();
        let adaptivity = self.adaptivity.as_ref();
        RunState {
            bodies: Cow::Borrowed(&self.state),
            element_records: self.model.element_records(),
            contacts: contacts.map(|contacts| Cow::Borrowed(contacts.state())),
            adaptivity: adaptivity.map(|adaptivity| Cow::Borrowed(adaptivity.state())),
        }
    }

    /// Continues from a stored state; `self` is at t = 0 of the same scene and mesh.
    ///
    /// # Errors
    /// If the stored state is of another scene or mesh.
    pub(crate) fn restore(&mut self, stored: RunState<D>) -> Result<(), ResumeError> {
        let is_contact = stored.contacts.is_some() == self.contacts.is_some();
        let is_refined = stored.adaptivity.is_some() == self.adaptivity.is_some();
        require(is_contact && is_refined, "its contact model")?;
        let bodies = stored.bodies.into_owned();
        require(
            bodies.number <= self.model.step_count,
            "its number of steps",
        )?;
        if let Some(adaptivity) = stored.adaptivity {
            self.restore_adaptivity(adaptivity.into_owned(), bodies.number)?;
        }
        let mesh = &self.model.mesh;
        require(
            bodies.is_of(mesh.nodes.len(), mesh.elements.len(), mesh.blocks.len()),
            "its nodes and elements",
        )?;
        self.model.set_element_records(&stored.element_records)?;
        self.state = bodies;
        self.model.set_prescribed_nodes(self.time());
        if let (Some(contacts), Some(state)) = (&mut self.contacts, stored.contacts) {
            contacts.restore(state.into_owned())?;
        }
        self.rebuild_workspace();
        let borders = self.workspace.schedule.borders.len();
        require(self.state.steady_forces.len() == borders, "its time levels")
    }

    /// Builds the refined mesh of a stored state.
    fn restore_adaptivity(
        &mut self,
        state: AdaptivityState<D>,
        number: u64,
    ) -> Result<(), ResumeError> {
        let Some(adaptivity) = &mut self.adaptivity else {
            return Ok(());
        };
        adaptivity.restore(state)?;
        if adaptivity.refined_blocks().iter().any(Option::is_some) {
            self.model
                .remesh(adaptivity, number as f64 * self.model.step);
            let mesh = &self.model.mesh;
            if let Some(contacts) = &mut self.contacts {
                let surface = adaptivity.base_model.surface(mesh, contacts.resolution());
                contacts.exchange_surface(mesh, surface);
            }
        }
        Ok(())
    }

    /// Makes all workspace anew from model and state, between two steps.
    pub(crate) fn rebuild_workspace(&mut self) {
        if let Some(contacts) = &mut self.contacts {
            contacts.rebuild_workspace(self.model.positions(&self.state).into());
        }
        self.workspace = Workspace::new(&self.model, &self.state, self.contacts.is_some());
        let levels = self.levels();
        self.workspace.schedule = KickSchedule::new(&mut self.model, &self.state, levels);
    }
}

impl<const D: usize> Model<D> {
    /// Returns the histories of the elements, set by set.
    fn element_records(&self) -> Vec<f64> {
        let of_set = self.sets.iter();
        let records = of_set.flat_map(|set| (0..set.len()).flat_map(|i| set.record(i)));
        records.collect()
    }

    fn set_element_records(&mut self, histories: &[f64]) -> Result<(), ResumeError> {
        let mut rest = histories;
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
