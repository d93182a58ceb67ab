//! A run for those who drive it: the dimension is hidden here.

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
use crate::refinement::{Adaptivity, FORESEEN_SPEED};
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
    /// In the plane.
    Plane(Mesh<2>),
    /// In space.
    Solid(Mesh<3>),
}

/// Coarse steps between two looks at elements and ledger.
const CHECK_INTERVAL: u64 = 64;

/// What `check` and the closing summary tell of a model.
#[derive(Clone, Debug, Default)]
pub struct Overview {
    /// One a block.
    pub blocks: Vec<BlockOverview>,
    /// Nodes and elements of all blocks.
    pub nodes: usize,
    /// Elements of all blocks.
    pub elements: usize,
    /// Smallest and largest stable step of an element, s.
    pub stable_step: [f64; 2],
    /// The coarsest step, s.
    pub step: f64,
    /// Steps of the run.
    pub step_count: u64,
    /// Elements of each level, coarsest first; fixed blocks left out.
    pub levels: Vec<u64>,
    /// Element updates in a coarse step.
    pub updates_per_step: u64,
    /// Memory of model and state, bytes, about.
    pub memory_bytes: u64,
    /// Contacts that are closed now.
    pub contacts: usize,
    /// What is not wrong, but should be looked at before a run: where in the
    /// scene, and what.
    pub warnings: Vec<Problem>,
}

/// A block in an [`Overview`].
#[derive(Clone, Debug)]
pub struct BlockOverview {
    /// Name.
    pub name: String,
    /// Name of its material.
    pub material: String,
    /// Elements.
    pub elements: usize,
    /// Nodes.
    pub nodes: usize,
    /// Mass, kg.
    pub mass: f64,
    /// Mass matrix in use.
    pub mass_kind: MassKind,
    /// Largest relative error of its moments of inertia.
    pub inertia_error: f64,
    /// Immovable.
    pub fixed: bool,
}

/// What becomes on two scales of the heaviest block that moves where its corner hits its
/// like.
#[derive(Clone, Debug)]
pub struct CollisionOverview {
    /// Its name.
    pub block: String,
    /// How fast, m/s.
    pub speed: f64,
    /// Its elements then; `None` where it cannot be refined.
    pub elements: Option<usize>,
    /// Updates of these in a coarse step, and of those it has now.
    pub updates_per_step: [u64; 2],
}

/// A run: made from a scene and its mesh, stepped, and asked for samples.
pub struct Simulation {
    pub(crate) scene: Scene,
    pub(crate) run: AnyRun,
}

pub(crate) enum AnyRun {
    Plane(Box<TypedSimulation<2>>),
    Solid(Box<TypedSimulation<3>>),
}

/// A run and what only its reports need.
pub(crate) struct TypedSimulation<const D: usize> {
    pub(crate) run: Run<D>,
    /// Kinetic plus strain energy at t = 0, J.
    start_energy: f64,
    exchange: ExchangedEnergy,
    pub(crate) last_block_rows: f64,
    probes: Vec<FollowedNode>,
    pub(crate) instant: Option<Arc<SynchronisedInstant<D>>>,
    validity: ValidityGuard,
    /// Where the scene says when to stop.
    rest: Option<Rest>,
    /// Blocks that rows are wanted of.
    listed: Vec<bool>,
}

/// The same of either dimension.
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
    /// A run of `scene` at t = 0.
    ///
    /// # Errors
    /// When scene and mesh do not fit together; see [`ModelError`].
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

    /// The scene with every default filled in.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// What a collision will cost, on two scales: work for some seconds where blocks have
    /// millions of elements.
    #[must_use]
    pub fn foresee_collision(&self) -> Option<CollisionOverview> {
        each!(self, driven => driven.foresee_collision())
    }

    /// All that the run has come to, for [`Self::resumed`]. Asking changes nothing.
    ///
    /// # Panics
    /// Never: what is written to memory cannot fail.
    #[must_use]
    pub fn checkpoint(&self) -> Vec<u8> {
        let saved = each!(self, driven => postcard::to_stdvec(&driven.saved()));
        saved.expect("memory takes all that has a form")
    }

    /// A run at its start as it was when a checkpoint of the same scene and mesh was made: it
    /// goes on with the same bits, on any number of threads.
    ///
    /// # Errors
    /// When the checkpoint is of another run or version.
    pub fn resumed(mut self, checkpoint: &[u8]) -> Result<Self, ResumeError> {
        each!(mut self, driven => {
            let saved = postcard::from_bytes(checkpoint).map_err(ResumeError::Unreadable)?;
            driven.restore(saved)?;
        });
        Ok(self)
    }

    /// The mesh before refinement.
    #[must_use]
    pub fn mesh(&self) -> AnyMesh {
        match &self.run {
            AnyRun::Plane(driven) => AnyMesh::Plane(driven.run.base_mesh().clone()),
            AnyRun::Solid(driven) => AnyMesh::Solid(driven.run.base_mesh().clone()),
        }
    }

    /// Gives all nodes that are free to move the velocity that `field` has at
    /// their place, m and m/s, instead of what the scene says: a vibration, a
    /// wave. For a run that has not made its first step; what the ledger
    /// counts begins here.
    pub fn set_initial_velocities(&mut self, field: &dyn Fn([f64; 3]) -> [f64; 3]) {
        each!(mut self, driven => driven.set_initial_velocities(&self.scene, field));
    }

    /// One coarse step.
    ///
    /// # Errors
    /// When the run has become unphysical; the state stays as it is, to be
    /// looked at.
    pub fn step(&mut self) -> Result<(), StepError> {
        let watch_energy = self.watches_energy();
        each!(mut self, driven => driven.step(watch_energy))
    }

    /// Counts from now on how long each stage of a step takes: [`Self::stage_times`].
    pub fn time_stages(&mut self) {
        each!(mut self, driven => {
            driven.run.watch.start();
            driven.run.contacts.iter_mut().for_each(|contacts| contacts.time_stages());
        });
    }

    /// Wall-clock time of each stage of the steps since [`Self::time_stages`].
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

    /// Looks whether an element has turned inside out, which [`Self::step`]
    /// does now and then only: for whoever is about to report the state.
    ///
    /// # Errors
    /// When there is one.
    pub fn check_elements(&mut self) -> Result<(), StepError> {
        each!(mut self, driven => driven.validity.check_elements(&driven.run))
    }

    /// What the user should know of the run so far; what is known before its
    /// first step stands in [`Overview::warnings`].
    pub fn warnings(&mut self) -> Vec<String> {
        let watch_energy = self.watches_energy();
        each!(mut self, driven => driven.warnings(watch_energy))
    }

    /// Penalty springs are a yardstick: what they do to energy is shown.
    fn watches_energy(&self) -> bool {
        self.scene.contact.model != ContactModel::Penalty
    }

    /// Whether the end is reached, or what `stop_when` asks for: the kinetic
    /// energy of the half steps has stayed below its threshold for its time.
    #[must_use]
    pub fn finished(&self) -> bool {
        self.step_index() >= self.step_count()
            || each!(self, driven => {
                driven.rest.as_ref().is_some_and(|rest| rest.reached(&driven.run))
            })
    }

    /// Coarse steps made.
    #[must_use]
    pub fn step_index(&self) -> u64 {
        each!(self, driven => driven.run.state.number)
    }

    /// Coarse steps of the whole run.
    #[must_use]
    pub fn step_count(&self) -> u64 {
        each!(self, driven => driven.run.model.step_count)
    }

    /// Time, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        each!(self, driven => driven.run.told_time())
    }

    /// Energies and momenta now.
    pub fn history(&mut self) -> HistoryRow {
        each!(mut self, driven => driven.history())
    }

    /// The most energy that has been in the blocks, or has gone through gravity,
    /// loads and boundary conditions, so far, J; 0 where that is round-off. What the
    /// residual of the ledger is to be held against.
    #[must_use]
    pub fn energy_exchanged(&self) -> f64 {
        each!(self, driven => driven.exchange.most())
    }

    /// Blocks now; contact forces are means since the last call.
    pub fn block_rows(&mut self) -> Vec<BlockRow> {
        each!(mut self, driven => driven.block_rows())
    }

    /// Probes now.
    pub fn probe_rows(&mut self) -> Vec<ProbeRow> {
        each!(mut self, driven => {
            let instant = driven.instant();
            driven.run.probe_rows(&instant, &driven.probes)
        })
    }

    /// The whole model now, with the fields that the scene asks for.
    pub fn frame(&mut self) -> Frame {
        self.capture().into_frame()
    }

    /// What [`Self::frame`] is made of, for another thread to make it.
    pub fn capture(&mut self) -> Snapshot {
        let fields = self.scene.output.fields.clone();
        each!(mut self, driven => {
            let instant = driven.instant();
            driven.run.capture(&instant, &fields)
        })
    }

    /// Live contact points now.
    #[must_use]
    pub fn contact_frame(&self) -> ContactFrame {
        each!(self, driven => driven.run.contact_frame())
    }

    /// Contacts that have ended since the last call.
    pub fn ended_contacts(&mut self) -> Vec<ContactRow> {
        each!(mut self, driven => {
            let run = &mut driven.run;
            let ended = run.contacts.as_mut().map(|contacts| contacts.take_ended());
            ended.unwrap_or_default().iter().map(|record| run.contact_row(record)).collect()
        })
    }

    /// Contacts that last.
    #[must_use]
    pub fn live_contacts(&self) -> Vec<ContactRow> {
        each!(self, driven => {
            let run = &driven.run;
            let live = run.contacts.iter().flat_map(|contacts| contacts.contact_points());
            live.map(|live| run.contact_row(&live.history)).collect()
        })
    }

    /// Element updates so far.
    #[must_use]
    pub fn element_updates(&self) -> u64 {
        each!(self, driven => driven.run.element_updates)
    }

    /// Contacts that have begun so far.
    #[must_use]
    pub fn contacts_begun(&self) -> u64 {
        each!(self, driven => driven.run.contacts.as_ref().map_or(0, |c| c.contacts_begun()))
    }

    /// Deepest penetration at the start of a kick so far, and now, m.
    #[must_use]
    pub fn max_penetration(&self) -> f64 {
        each!(self, driven => driven.run.max_penetration())
    }

    /// Corrections of positions so far; none in most runs.
    #[must_use]
    pub fn corrections(&self) -> Corrections {
        each!(self, driven => driven.run.corrections)
    }

    /// The model in figures.
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
            listed,
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

    /// The synchronised state now, made once a step.
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
        let listed = &self.listed;
        self.run.block_rows(&instant, since, |block| listed[block])
    }

    fn step(&mut self, watch_energy: bool) -> Result<(), StepError> {
        self.instant = None;
        self.run.step();
        let checked = self.check(watch_energy);
        self.run.watch.lap(Stage::Checks);
        checked
    }

    /// Whether the step has left the run sound.
    fn check(&mut self, watch_energy: bool) -> Result<(), StepError> {
        if let Some(rest) = &mut self.rest {
            rest.look(&self.run);
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
            speed: FORESEEN_SPEED,
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

/// Mesh, levels and schedules of an element, bytes.
const BYTES_PER_ELEMENT: usize = 64;

/// Arrays of a node, bytes a dimension: positions, motion, impulses.
const BYTES_PER_NODE: usize = 120;
