//! A run of one dimension, with the data that only its reports need.

use crate::math::profile::Stage;
use crate::math::restore::ResumeError;
use crate::model::block_names::parts;
use crate::refinement::Adaptivity;
use crate::scene::{self, Scene, StopWhen};
use crate::simulation::checkpoint::{ReportState, SimulationState};
use crate::simulation::observe::{FollowedNode, SynchronisedInstant};
use crate::simulation::output::{BlockRow, HistoryRow};
use crate::simulation::penetration;
use crate::simulation::validity::{StepError, ValidityGuard};
use crate::step::Run;
use std::borrow::Cow;
use std::sync::Arc;

/// Coarse steps between two checks of the elements and of the energy ledger.
const CHECK_INTERVAL: u64 = 64;

/// A run, with the data that only its reports need.
pub(crate) struct TypedSimulation<const D: usize> {
    pub(crate) run: Run<D>,
    pub(crate) report: ReportState,
    pub(crate) probes: Vec<FollowedNode>,
    /// The synchronised state of the current step, once it has been requested.
    pub(crate) instant: Option<Arc<SynchronisedInstant<D>>>,
    /// The stopping criterion of the scene, if it has one.
    pub(crate) stop_when: Option<StopWhen>,
    /// True for the blocks that have rows in `blocks.csv`.
    pub(crate) has_rows: Vec<bool>,
}

impl<const D: usize> TypedSimulation<D> {
    pub(crate) fn new(mut run: Run<D>, scene: &Scene) -> Self {
        let mesh = run.base_mesh();
        let probe = |probe: &scene::Probe| {
            let point: [f64; D] = std::array::from_fn(|c| probe.point[c]);
            let blocks = parts(scene, mesh, &probe.block);
            FollowedNode::new(&probe.name, mesh, blocks, &point)
        };
        let probes = scene.probe.iter().filter_map(probe).collect();
        let mut listed = vec![scene.output.block_list.is_none(); mesh.blocks.len()];
        for name in scene.output.block_list.iter().flatten() {
            parts(scene, mesh, name).for_each(|block| listed[block] = true);
        }
        let instant = run.instant();
        Self {
            report: ReportState::new(&run, scene, &instant),
            run,
            probes,
            instant: Some(instant),
            stop_when: scene.time.stop_when.clone(),
            has_rows: listed,
        }
    }

    pub(crate) fn set_initial_velocities(
        &mut self,
        scene: &Scene,
        field: &dyn Fn([f64; 3]) -> [f64; 3],
    ) {
        self.run.set_velocities(field);
        self.instant = None;
        let instant = self.instant();
        self.report = ReportState::new(&self.run, scene, &instant);
    }

    /// Returns the state, which a checkpoint stores.
    pub(crate) fn stored(&self) -> SimulationState<'_, D> {
        SimulationState {
            run: self.run.stored(),
            report: Cow::Borrowed(&self.report),
        }
    }

    /// Continues from a stored state.
    ///
    /// # Errors
    /// If it is of another scene or mesh.
    pub(crate) fn restore(&mut self, stored: SimulationState<D>) -> Result<(), ResumeError> {
        self.run.restore(stored.run)?;
        self.report = stored.report.into_owned();
        self.instant = None;
        self.report.validity.is_of(self.run.model.blocks.len())
    }

    /// Returns the synchronised state at the current time, made once a step.
    pub(crate) fn instant(&mut self) -> Arc<SynchronisedInstant<D>> {
        let number = self.run.state.number;
        match &self.instant {
            Some(instant) if instant.number == number => Arc::clone(instant),
            _ => {
                let instant = self.run.instant();
                self.instant = Some(Arc::clone(&instant));
                instant
            }
        }
    }

    pub(crate) fn history(&mut self) -> HistoryRow {
        let instant = self.instant();
        self.run.history(&instant, self.report.start_energy)
    }

    pub(crate) fn block_rows(&mut self) -> Vec<BlockRow> {
        let instant = self.instant();
        let time = self.run.time();
        let since = time - self.report.last_block_rows;
        self.report.last_block_rows = time;
        let listed = &self.has_rows;
        self.run.block_rows(&instant, since, |block| listed[block])
    }

    pub(crate) fn step(&mut self, watch_energy: bool) -> Result<(), StepError> {
        self.instant = None;
        self.run.step();
        let checked = self.check(watch_energy);
        self.run.watch.lap(Stage::Checks);
        checked
    }

    /// Checks that the run is still valid after the step.
    pub(crate) fn check(&mut self, watch_energy: bool) -> Result<(), StepError> {
        if let Some(stop_when) = &self.stop_when {
            let since = &mut self.report.at_rest_since;
            *since = stop_when.at_rest_since(&self.run, *since);
        }
        let ledger = &self.run.state.ledger;
        self.report
            .exchange
            .count(ledger.external_work, ledger.gravity_work);
        self.report.gain.track(&self.run);
        self.report.validity.check_motion(&self.run)?;
        self.report.validity.check_overlap(&mut self.run)?;
        let number = self.run.state.number;
        if !number.is_multiple_of(CHECK_INTERVAL) && number != self.run.model.step_count {
            return Ok(());
        }
        self.report.validity.check_elements(&self.run)?;
        let row = self.history();
        self.report
            .exchange
            .count(row.external_work, row.gravity_work);
        ValidityGuard::check_energy(&row, &self.report.exchange, watch_energy)
    }

    /// Returns the warnings of losses at first touches whose reason is new since the last call.
    pub(crate) fn take_loss_warnings(&mut self) -> Vec<String> {
        let adaptivity = self.run.adaptivity.as_mut();
        adaptivity
            .map(Adaptivity::take_new_warnings)
            .unwrap_or_default()
    }

    pub(crate) fn warnings(&mut self, watch_energy: bool) -> Vec<String> {
        let mut warnings = self.report.validity.warnings(&self.run);
        let contacts = self.run.contacts.as_ref();
        warnings.extend(
            contacts
                .into_iter()
                .flat_map(|contacts| contacts.energies().warnings()),
        );
        warnings.extend(penetration::warnings(&self.run));
        let second = self.run.adaptivity.as_ref();
        warnings.extend(second.map(Adaptivity::warnings).unwrap_or_default());
        let row = self.history();
        warnings.extend(ValidityGuard::ledger_warning(
            &row,
            &self.report.exchange,
            watch_energy,
        ));
        if watch_energy {
            let is_refined = self.run.adaptivity.is_some();
            let gain = &self.report.gain;
            warnings.extend(gain.warning(&self.report.exchange, is_refined));
        }
        warnings
    }
}
