//! The simulation as its users see it; the number of dimensions is hidden here.

pub(crate) mod build;
pub(crate) mod checkpoint;
pub(crate) mod edit;
pub(crate) mod observe;
pub mod output;
pub(crate) mod rest;
pub(crate) mod snapshot;
pub(crate) mod update_cost;
pub(crate) mod validity;
pub(crate) mod warnings;

use std::borrow::Cow;
use std::sync::Arc;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::element::mass::MassKind;
use crate::math::profile::Stage;
use crate::math::restore::ResumeError;
use crate::mesh::Mesh;
use crate::model::block_names::parts;
use crate::model::{Model, ModelError};
use crate::refinement::dimension::{PLANE, SOLID};
use crate::refinement::{ASSUMED_SPEED, Adaptivity};
use crate::scene::{self, ContactModel, Problem, Scene};
use crate::simulation::checkpoint::SavedSimulation;
use crate::simulation::observe::{FollowedNode, SynchronisedInstant};
use crate::simulation::output::{BlockRow, ContactFrame, ContactRow, Frame, HistoryRow, ProbeRow};
use crate::simulation::rest::Rest;
use crate::simulation::snapshot::Snapshot;
use crate::simulation::validity::{ExchangedEnergy, StepError, ValidityGuard};
use crate::step::{Corrections, Run};

/// A mesh of either dimension.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum AnyMesh {
    /// A mesh in 2-D.
    Plane(Mesh<2>),
    /// A mesh in 3-D.
    Solid(Mesh<3>),
}

/// Coarse steps between two checks of the elements and of the energy ledger.
const CHECK_INTERVAL: u64 = 64;

/// Figures of a model, for `check` and for the closing summary.
#[derive(Clone, Debug, Default)]
pub struct Overview {
    /// The blocks, in the order of the mesh.
    pub blocks: Vec<BlockOverview>,
    /// Number of nodes of all blocks.
    pub nodes: usize,
    /// Number of elements of all blocks.
    pub elements: usize,
    /// Smallest and largest stable step of an element, s.
    pub stable_step: [f64; 2],
    /// The coarse step, s.
    pub step: f64,
    /// Number of coarse steps of the run.
    pub step_count: u64,
    /// Number of elements of each time level, coarsest first, without fixed blocks.
    pub levels: Vec<u64>,
    /// Number of element updates in a coarse step.
    pub updates_per_step: u64,
    /// Approximate memory of model and state, bytes.
    pub memory_bytes: u64,
    /// Number of contact points that are closed now.
    pub contacts: usize,
    /// Warnings that a user should read before a run, each with its place in the scene.
    pub warnings: Vec<Problem>,
}

/// A block in an [`Overview`].
#[derive(Clone, Debug)]
pub struct BlockOverview {
    /// Name.
    pub name: String,
    /// Name of its material.
    pub material: String,
    /// Number of elements.
    pub elements: usize,
    /// Number of nodes.
    pub nodes: usize,
    /// Mass, kg.
    pub mass: f64,
    /// Mass matrix in use.
    pub mass_kind: MassKind,
    /// Largest relative error of its moments of inertia.
    pub inertia_error: f64,
    /// True if the block cannot move.
    pub fixed: bool,
}

/// Predicted cost of a collision with adaptivity: the heaviest block that moves hits a block like
/// itself with a corner.
#[derive(Clone, Debug)]
pub struct CollisionOverview {
    /// Name of the block.
    pub block: String,
    /// Impact speed, m/s.
    pub speed: f64,
    /// Number of elements of the refined block; `None` if the block cannot be refined.
    pub elements: Option<usize>,
    /// Element updates of the block in a coarse step: refined, and now.
    pub updates_per_step: [u64; 2],
}

/// A simulation, made from a scene and its mesh.
pub struct Simulation {
    pub(crate) scene: Scene,
    pub(crate) run: AnyRun,
}

pub(crate) enum AnyRun {
    Plane(Box<TypedSimulation<2>>),
    Solid(Box<TypedSimulation<3>>),
}

/// A run, with the data that only its reports need.
pub(crate) struct TypedSimulation<const D: usize> {
    pub(crate) run: Run<D>,
    /// Kinetic plus strain energy at t = 0, J.
    start_energy: f64,
    exchange: ExchangedEnergy,
    pub(crate) last_block_rows: f64,
    probes: Vec<FollowedNode>,
    pub(crate) instant: Option<Arc<SynchronisedInstant<D>>>,
    validity: ValidityGuard,
    /// The stopping criterion of the scene, if it has one.
    rest: Option<Rest>,
    /// True for the blocks that have rows in `blocks.csv`.
    has_rows: Vec<bool>,
}

/// Evaluates an expression for the simulation of either dimension.
macro_rules! each {
    ($simulation:expr, $driven:ident => $body:expr) => {
        match &$simulation.run {
            $crate::simulation::AnyRun::Plane($driven) => $body,
            $crate::simulation::AnyRun::Solid($driven) => $body,
        }
    };
    (mut $simulation:expr, $driven:ident => $body:expr) => {
        match &mut $simulation.run {
            $crate::simulation::AnyRun::Plane($driven) => $body,
            $crate::simulation::AnyRun::Solid($driven) => $body,
        }
    };
}

pub(crate) use each;

impl Simulation {
    /// Creates the simulation of `scene` at t = 0.
    ///
    /// # Errors
    /// If scene and mesh do not fit together; see [`ModelError`].
    pub fn new(scene: &Scene, mesh: AnyMesh) -> Result<Self, ModelError> {
        let mut scene = scene.clone();
        let run = match mesh {
            AnyMesh::Plane(mesh) => {
                let built = Model::build(&mut scene, mesh, PLANE)?;
                AnyRun::Plane(Box::new(TypedSimulation::new(Run::new(built), &scene)))
            }
            AnyMesh::Solid(mesh) => {
                let built = Model::build(&mut scene, mesh, SOLID)?;
                AnyRun::Solid(Box::new(TypedSimulation::new(Run::new(built), &scene)))
            }
        };
        Ok(Self { scene, run })
    }

    /// Returns the scene with every default filled in.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Predicts the cost of a collision; `None` without adaptivity. Takes some seconds if blocks
    /// have millions of elements.
    #[must_use]
    pub fn foresee_collision(&self) -> Option<CollisionOverview> {
        each!(self, driven => driven.foresee_collision())
    }

    /// Returns the state of the run, for [`Self::resumed`]. Changes nothing.
    ///
    /// # Panics
    /// Never: serialising into memory cannot fail.
    #[must_use]
    pub fn checkpoint(&self) -> Vec<u8> {
        let saved = each!(self, driven => postcard::to_stdvec(&driven.saved()));
        saved.expect("memory takes all that has a form")
    }

    /// Restores a checkpoint of the same scene and mesh in a simulation at its start. The run then
    /// continues bit for bit, on any number of threads.
    ///
    /// # Errors
    /// If the checkpoint is of another run or version.
    pub fn resumed(mut self, checkpoint: &[u8]) -> Result<Self, ResumeError> {
        each!(mut self, driven => {
            let saved = postcard::from_bytes(checkpoint).map_err(ResumeError::Unreadable)?;
            driven.restore(saved)?;
        });
        Ok(self)
    }

    /// Returns the mesh before refinement.
    #[must_use]
    pub fn mesh(&self) -> AnyMesh {
        match &self.run {
            AnyRun::Plane(driven) => AnyMesh::Plane(driven.run.base_mesh().clone()),
            AnyRun::Solid(driven) => AnyMesh::Solid(driven.run.base_mesh().clone()),
        }
    }

    /// Gives all free nodes the velocity that `field` has at their position (m, m/s), in place of
    /// the initial velocity of the scene: a vibration or a wave, say. Only for a run that has not
    /// made its first step; the energy ledger starts here.
    pub fn set_initial_velocities(&mut self, field: &dyn Fn([f64; 3]) -> [f64; 3]) {
        each!(mut self, driven => driven.set_initial_velocities(&self.scene, field));
    }

    /// Advances the run by one coarse step.
    ///
    /// # Errors
    /// If the run has become unphysical. The state is kept, so that it can be inspected.
    pub fn step(&mut self) -> Result<(), StepError> {
        let watch_energy = self.watches_energy();
        each!(mut self, driven => driven.step(watch_energy))
    }

    /// Starts to measure the duration of each stage of a step, for [`Self::stage_times`].
    pub fn time_stages(&mut self) {
        each!(mut self, driven => {
            driven.run.watch.start();
            driven.run.contacts.iter_mut().for_each(|contacts| contacts.time_stages());
        });
    }

    /// Returns the wall-clock time of each stage, summed over the steps since
    /// [`Self::time_stages`].
    #[must_use]
    pub fn stage_times(&self) -> [(Stage, Duration); Stage::ALL.len()] {
        each!(self, driven => {
            let run = &driven.run;
            let contacts = run.contacts.as_ref();
            Stage::ALL.map(|stage| {
                let of_contacts = contacts.map(|contacts| contacts.energies().watch.spent(stage));
                (stage, run.watch.spent(stage) + of_contacts.unwrap_or_default())
            })
        })
    }

    /// Checks that no element is inverted. [`Self::step`] checks this only at intervals; call this
    /// before the state is reported.
    ///
    /// # Errors
    /// If an element is inverted.
    pub fn check_elements(&mut self) -> Result<(), StepError> {
        each!(mut self, driven => driven.validity.check_elements(&driven.run))
    }

    /// Returns the warnings of the run so far. Warnings known before the first step are in
    /// [`Overview::warnings`].
    pub fn warnings(&mut self) -> Vec<String> {
        let watch_energy = self.watches_energy();
        each!(mut self, driven => driven.warnings(watch_energy))
    }

    /// True if an energy residual stops the run. The penalty model is a reference for comparison:
    /// its energy error is reported but does not stop the run.
    fn watches_energy(&self) -> bool {
        self.scene.contact.model != ContactModel::Penalty
    }

    /// True if the end time is reached, or if `stop_when` is met: the kinetic energy of the half
    /// steps has stayed below its threshold for its duration.
    #[must_use]
    pub fn finished(&self) -> bool {
        self.step_index() >= self.step_count()
            || each!(self, driven => {
                driven.rest.as_ref().is_some_and(|rest| rest.reached(&driven.run))
            })
    }

    /// Returns the number of coarse steps made.
    #[must_use]
    pub fn step_index(&self) -> u64 {
        each!(self, driven => driven.run.state.number)
    }

    /// Returns the number of coarse steps of the whole run.
    #[must_use]
    pub fn step_count(&self) -> u64 {
        each!(self, driven => driven.run.model.step_count)
    }

    /// Returns the current time, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        each!(self, driven => driven.run.report_time())
    }

    /// Returns energies and momenta at the current time.
    pub fn history(&mut self) -> HistoryRow {
        each!(mut self, driven => driven.history())
    }

    /// Returns the reference of the energy residual, J: the largest energy so far that was in the
    /// blocks or has gone through gravity, loads and boundary conditions; 0 if it is round-off.
    #[must_use]
    pub fn energy_exchanged(&self) -> f64 {
        each!(self, driven => driven.exchange.maximum())
    }

    /// Returns the current rows of the blocks; contact forces are means since the last call.
    pub fn block_rows(&mut self) -> Vec<BlockRow> {
        each!(mut self, driven => driven.block_rows())
    }

    /// Returns the current rows of the probes.
    pub fn probe_rows(&mut self) -> Vec<ProbeRow> {
        each!(mut self, driven => {
            let instant = driven.instant();
            driven.run.probe_rows(&instant, &driven.probes)
        })
    }

    /// Returns the current frame of the whole model, with the fields that the scene asks for.
    pub fn frame(&mut self) -> Frame {
        self.capture().into_frame()
    }

    /// Copies the data of [`Self::frame`], so that another thread can make the frame.
    pub fn capture(&mut self) -> Snapshot {
        let fields = self.scene.output.fields.clone();
        each!(mut self, driven => {
            let instant = driven.instant();
            driven.run.capture(&instant, &fields)
        })
    }

    /// Returns the current contact points.
    #[must_use]
    pub fn contact_frame(&self) -> ContactFrame {
        each!(self, driven => driven.run.contact_frame())
    }

    /// Returns the contacts that have ended since the last call.
    pub fn ended_contacts(&mut self) -> Vec<ContactRow> {
        each!(mut self, driven => {
            let run = &mut driven.run;
            let ended = run.contacts.as_mut().map(|contacts| contacts.take_ended());
            ended.unwrap_or_default().iter().map(|record| run.contact_row(record)).collect()
        })
    }

    /// Returns the contacts that are still closed.
    #[must_use]
    pub fn live_contacts(&self) -> Vec<ContactRow> {
        each!(self, driven => {
            let run = &driven.run;
            let live = run.contacts.iter().flat_map(|contacts| contacts.contact_points());
            live.map(|live| run.contact_row(&live.history)).collect()
        })
    }

    /// Returns the number of element updates so far.
    #[must_use]
    pub fn element_updates(&self) -> u64 {
        each!(self, driven => driven.run.element_updates)
    }

    /// Returns the number of contacts that have begun so far.
    #[must_use]
    pub fn contacts_begun(&self) -> u64 {
        each!(self, driven => driven.run.contacts.as_ref().map_or(0, |c| c.contacts_begun()))
    }

    /// Returns the deepest penetration, m: at the start of any kick so far, or now.
    #[must_use]
    pub fn max_penetration(&self) -> f64 {
        each!(self, driven => driven.run.max_penetration())
    }

    /// Returns the position corrections so far; most runs have none.
    #[must_use]
    pub fn corrections(&self) -> Corrections {
        each!(self, driven => driven.run.corrections)
    }

    /// Returns the figures of the model.
    #[must_use]
    pub fn overview(&self) -> Overview {
        each!(self, driven => driven.overview(&self.scene))
    }
}

impl<const D: usize> TypedSimulation<D> {
    fn new(mut run: Run<D>, scene: &Scene) -> Self {
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

    fn set_initial_velocities(&mut self, scene: &Scene, field: &dyn Fn([f64; 3]) -> [f64; 3]) {
        self.run.set_velocities(field);
        self.validity = ValidityGuard::new(&self.run, scene);
        self.rest = rest_of(&self.run, scene);
        self.instant = None;
        let instant = self.instant();
        self.start_energy = self.run.energy(&instant);
        self.exchange = ExchangedEnergy::new(&self.run, scene, self.start_energy);
    }

    fn saved(&self) -> SavedSimulation<'_, D> {
        SavedSimulation {
            run: self.run.saved(),
            start_energy: self.start_energy,
            exchange: self.exchange,
            last_block_rows: self.last_block_rows,
            health: Cow::Borrowed(&self.validity),
            at_rest_since: self.rest.as_ref().and_then(Rest::since),
        }
    }

    fn restore(&mut self, saved: SavedSimulation<D>) -> Result<(), ResumeError> {
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

    fn block_rows(&mut self) -> Vec<BlockRow> {
        let instant = self.instant();
        let time = self.run.time();
        let since = time - self.last_block_rows;
        self.last_block_rows = time;
        let listed = &self.has_rows;
        self.run.block_rows(&instant, since, |block| listed[block])
    }

    fn step(&mut self, watch_energy: bool) -> Result<(), StepError> {
        self.instant = None;
        self.run.step();
        let checked = self.check(watch_energy);
        self.run.watch.lap(Stage::Checks);
        checked
    }

    /// Checks that the run is still valid after the step.
    fn check(&mut self, watch_energy: bool) -> Result<(), StepError> {
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

    fn warnings(&mut self, watch_energy: bool) -> Vec<String> {
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

    fn foresee_collision(&self) -> Option<CollisionOverview> {
        let foreseen = self.run.adaptivity.as_ref()?.foresee()?;
        Some(CollisionOverview {
            block: self.run.model.mesh.blocks[foreseen.block].name.clone(),
            speed: ASSUMED_SPEED,
            elements: foreseen.elements,
            updates_per_step: foreseen.updates,
        })
    }

    fn overview(&self, scene: &Scene) -> Overview {
        let model = &self.run.model;
        let levels = self.run.schedule.histogram();
        let updates = levels
            .iter()
            .enumerate()
            .map(|(level, count)| count << level)
            .sum();
        let block = |(number, block): (usize, &crate::mesh::Block)| BlockOverview {
            name: block.name.clone(),
            material: scene.block[block.source].material.clone(),
            elements: model.elements(number).len(),
            nodes: model.nodes(number).len(),
            mass: model
                .nodes(number)
                .map(|node| model.inertia.mass()[node])
                .sum(),
            mass_kind: model.blocks[number].mass_kind,
            inertia_error: model.blocks[number].inertia_error,
            fixed: model.blocks[number].fixed,
        };
        let in_sets: usize = model.sets.iter().map(|set| set.memory()).sum();
        Overview {
            blocks: model.mesh.blocks.iter().enumerate().map(block).collect(),
            nodes: model.mesh.nodes.len(),
            elements: model.mesh.elements.len(),
            stable_step: [model.limits[1], model.limits[0]],
            step: model.step,
            step_count: model.step_count,
            levels,
            updates_per_step: updates,
            memory_bytes: (in_sets
                + model.inertia.dense_memory()
                + model.mesh.elements.len() * BYTES_PER_ELEMENT
                + model.mesh.nodes.len() * BYTES_PER_NODE * D) as u64,
            contacts: self
                .run
                .contacts
                .iter()
                .flat_map(|contacts| contacts.contact_points())
                .count(),
            warnings: model.warnings.clone(),
        }
    }
}

fn rest_of<const D: usize>(run: &Run<D>, scene: &Scene) -> Option<Rest> {
    let stop_when = scene.time.stop_when.as_ref();
    stop_when.map(|stop_when| Rest::new(run, stop_when))
}

/// Memory of mesh, levels and schedules for each element, bytes.
const BYTES_PER_ELEMENT: usize = 64;

/// Memory of the arrays for each node and dimension, bytes: positions, motion, impulses.
const BYTES_PER_NODE: usize = 120;
