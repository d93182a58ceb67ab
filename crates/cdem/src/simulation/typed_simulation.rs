//! A run of one dimension, with the data that only its reports need.

use crate::math::profile::Stage;
use crate::math::restore::ResumeError;
use crate::model::block_names::parts;
use crate::refinement::Adaptivity;
use crate::scene::{self, Scene};
use crate::simulation::checkpoint::SavedSimulation;
use crate::simulation::observe::{FollowedNode, SynchronisedInstant};
use crate::simulation::output::{BlockRow, HistoryRow};
use crate::simulation::rest::Rest;
use crate::simulation::validity::{ExchangedEnergy, StepError, ValidityGuard};
use crate::step::Run;
use std::borrow::Cow;
use std::sync::Arc;

/// Coarse steps between two checks of the elements and of the energy ledger.
const CHECK_INTERVAL: u64 = 64;

/// A run, with the data that only its reports need.
pub(crate) struct TypedSimulation<const D: usize> {
    pub(crate) run: Run<D>,
    /// Kinetic plus strain energy at t = 0, J.
    pub(crate) start_energy: f64,
    pub(crate) exchange: ExchangedEnergy,
    pub(crate) last_block_rows: f64,
    pub(crate) probes: Vec<FollowedNode>,
    pub(crate) instant: Option<Arc<SynchronisedInstant<D>>>,
    pub(crate) validity: ValidityGuard,
    /// The stopping criterion of the scene, if it has one.
    pub(crate) rest: Option<Rest>,
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
        let start_energy = run.energy(&instant);
        Self {
            validity: ValidityGuard::new(&run, scene),
            exchange: ExchangedEnergy::new(&run, scene, start_energy),
            rest: rest_of(&run, scene),
            run,
            start_energy,
            last_block_rows: 0.0,
            probes,
            instant: Some(instant),
            has_rows: listed,
        }
    }

    pub(crate) fn set_initial_velocities(
        &mut self,
        scene: &Scene,
        field: &dyn Fn([f64; 3]) -> [f64; 3],
    ) {
        self.run.set_velocities(field);
        self.validity = ValidityGuard::new(&self.run, scene);
        self.rest = rest_of(&self.run, scene);
        self.instant = None;
        let instant = self.instant();
        self.start_energy = self.run.energy(&instant);
        self.exchange = ExchangedEnergy::new(&self.run, scene, self.start_energy);
    }

    pub(crate) fn saved(&self) -> SavedSimulation<'_, D> {
        SavedSimulation {
            run: self.run.saved(),
            start_energy: self.start_energy,
            exchange: self.exchange,
            last_block_rows: self.last_block_rows,
            health: Cow::Borrowed(&self.validity),
            at_rest_since: self.rest.as_ref().and_then(Rest::since),
        }
    }

    pub(crate) fn restore(&mut self, saved: SavedSimulation<D>) -> Result<(), ResumeError> {
        self.run.restore(saved.run)?;
        self.start_energy = saved.start_energy;
        self.exchange = saved.exchange;
        self.last_block_rows = saved.last_block_rows;
        self.validity = saved.health.into_owned();
        if let Some(rest) = &mut self.rest {
            rest.restore(saved.at_rest_since);
        }
        self.instant = None;
        self.validity.is_of(self.run.model.blocks.len())
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
        self.run.history(&instant, self.start_energy)
    }

    pub(crate) fn block_rows(&mut self) -> Vec<BlockRow> {
        let instant = self.instant();
        let time = self.run.time();
        let since = time - self.last_block_rows;
        self.last_block_rows = time;
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
        if let Some(rest) = &mut self.rest {
            rest.update(&self.run);
        }
        let ledger = &self.run.ledger;
        self.exchange
            .count(ledger.external_work, ledger.gravity_work);
        self.validity.check_motion(&self.run)?;
        self.validity.check_overlap(&mut self.run)?;
        let number = self.run.state.number;
        if !number.is_multiple_of(CHECK_INTERVAL) && number != self.run.model.step_count {
            return Ok(());
        }
        self.validity.check_elements(&self.run)?;
        let row = self.history();
        self.exchange.count(row.external_work, row.gravity_work);
        ValidityGuard::check_energy(&row, &self.exchange, watch_energy)
    }

    pub(crate) fn warnings(&mut self, watch_energy: bool) -> Vec<String> {
        let mut warnings = self.validity.warnings.clone();
        let contacts = self.run.contacts.as_ref();
        warnings.extend(
            contacts
                .into_iter()
                .flat_map(|contacts| contacts.energies().warnings()),
        );
        warnings.extend(self.run.corrections.warning());
        let second = self.run.adaptivity.as_ref();
        warnings.extend(second.map(Adaptivity::warnings).unwrap_or_default());
        let row = self.history();
        warnings.extend(ValidityGuard::ledger_warning(
            &row,
            &self.exchange,
            watch_energy,
        ));
        warnings
    }
}

fn rest_of<const D: usize>(run: &Run<D>, scene: &Scene) -> Option<Rest> {
    let stop_when = scene.time.stop_when.as_ref();
    stop_when.map(|stop_when| Rest::new(run, stop_when))
}
