//! Contact in a checkpoint.

use crate::contact::Contacts;
use crate::contact::detection::candidates::CandidateSearch;
use crate::contact::energy::ContactEnergies;
use crate::contact::state::{ContactState, ContactWorkspace};
use crate::contact::surface::{Configuration, Pair};
use crate::math::restore::ResumeError;

impl<const D: usize> Contacts<D> {
    /// Returns the state, which a checkpoint stores.
    pub(crate) fn state(&self) -> &ContactState<D> {
        &self.state
    }

    /// Takes a stored state; the workspace is to be rebuilt then. The surface must be that of the
    /// time of storing.
    ///
    /// # Errors
    /// If the state belongs to other blocks.
    pub(crate) fn restore(&mut self, state: ContactState<D>) -> Result<(), ResumeError> {
        let data = &self.model_data;
        let families = data.surface.families();
        state.check(data.block_of.len(), data.fixed.len(), |pair: Pair| {
            let mut families = families.iter();
            families
                .any(|[main, target]| main.contains(&pair.main) && target.contains(&pair.target))
        })?;
        let watch = self.state.energies.watch;
        self.state = state;
        self.state.energies = ContactEnergies {
            watch,
            ..self.state.energies
        };
        Ok(())
    }

    /// Makes the workspace anew from the state, between two steps.
    pub(crate) fn rebuild_workspace(&mut self, at: Configuration<D>) {
        let nodes = self.model_data.block_of.len();
        let positions = (0..nodes as u32).map(|node| at.at(node)).collect();
        self.workspace = ContactWorkspace {
            search: CandidateSearch::restored(positions, &self.state.motion_bounds),
            ..ContactWorkspace::new(nodes, &self.state.islands)
        };
        for island in &mut self.state.islands {
            island.drop_workspace();
        }
        self.set_separation_bounds();
    }
}
