//! The simulation as its users see it; the number of dimensions is hidden here.

pub(crate) mod build;
pub(crate) mod checkpoint;
pub(crate) mod edit;
pub(crate) mod energy_gain;
pub(crate) mod observe;
pub mod output;
pub(crate) mod overview;
pub(crate) mod penetration;
pub(crate) mod rest;
pub(crate) mod snapshot;
pub(crate) mod typed_simulation;
pub(crate) mod update_cost;
pub(crate) mod validity;
pub(crate) mod warnings;

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::math::profile::Stage;
use crate::math::restore::ResumeError;
use crate::mesh::Mesh;
use crate::model::state::Corrections;
use crate::model::{Model, ModelError};
use crate::refinement::dimension::{PLANE, SOLID};
use crate::scene::{ContactModel, Scene};
use crate::simulation::output::{BlockRow, ContactFrame, ContactRow, Frame, HistoryRow, ProbeRow};
pub use crate::simulation::overview::{BlockOverview, CollisionOverview, Overview};
use crate::simulation::snapshot::Snapshot;
use crate::simulation::typed_simulation::TypedSimulation;
use crate::simulation::validity::StepError;
use crate::step::Run;

/// A mesh of either dimension.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum AnyMesh {
    /// A mesh in 2-D.
    Plane(Mesh<2>),
    /// A mesh in 3-D.
    Solid(Mesh<3>),
}

/// A simulation, made from a scene and its mesh.
///
/// # Example
///
/// ```
/// # use cdem::{AnyMesh, Simulation, mesh::assemble, scene::from_value};
/// # let scene = from_value(serde_json::json!({
/// #     "version": 1, "dimension": 2, "time": { "end": 0.01 },
/// #     "material": [{ "name": "rock", "young_modulus": 1e9, "poisson_ratio": 0.2, "density": 2e3 }],
/// #     "block": [{
/// #         "name": "stone", "material": "rock", "element": "quad4", "velocity": [2.0, 0.0],
/// #         "shape": { "box": { "min": [0.0, 0.0], "max": [1.0, 1.0], "divisions": [2, 2] } }
/// #     }]
/// # })).unwrap();
/// # let start = || -> Result<Simulation, Box<dyn std::error::Error>> {
/// #     let mesh = assemble::<2>(&scene, &mut |_| unreachable!())?;
/// #     Ok(Simulation::new(&scene, AnyMesh::Plane(mesh))?)
/// # };
/// let mut simulation = start()?;
/// simulation.step()?;
/// assert_eq!(simulation.step_index(), 1);
/// // Rows of blocks.csv: mass in kg, velocity in m/s.
/// let stone = &simulation.blocks()[0];
/// assert!((stone.mass - 2000.0).abs() < 1e-9 && (stone.velocity[0] - 2.0).abs() < 1e-12);
/// // A checkpoint goes on with the same bits.
/// let mut resumed = start()?.resumed(&simulation.checkpoint())?;
/// simulation.step()?;
/// resumed.step()?;
/// assert_eq!(simulation.positions(), resumed.positions());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Simulation {
    pub(crate) scene: Scene,
    pub(crate) run: AnyRun,
}

pub(crate) enum AnyRun {
    Plane(Box<TypedSimulation<2>>),
    Solid(Box<TypedSimulation<3>>),
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
        let saved = each!(self, driven => postcard::to_stdvec(&driven.stored()));
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
        each!(mut self, driven => driven.report.validity.check_elements(&driven.run))
    }

    /// Returns the warnings of the run so far. Warnings known before the first step are in
    /// [`Overview::warnings`].
    pub fn warnings(&mut self) -> Vec<String> {
        let watch_energy = self.watches_energy();
        each!(mut self, driven => driven.warnings(watch_energy))
    }

    /// Returns the warnings of losses at first touches whose reason is new since the last call.
    /// They are in [`Self::warnings`], too.
    pub fn take_loss_warnings(&mut self) -> Vec<String> {
        each!(mut self, driven => driven.take_loss_warnings())
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
                driven.stop_when.as_ref().is_some_and(|stop_when| {
                    stop_when.is_met(&driven.run, driven.report.at_rest_since)
                })
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
        each!(self, driven => driven.report.exchange.maximum())
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
            let contacts = run.contacts.iter().flat_map(|contacts| contacts.contact_points());
            contacts.map(|contact| run.contact_row(&contact.history)).collect()
        })
    }

    /// Returns the number of element updates so far.
    #[must_use]
    pub fn element_updates(&self) -> u64 {
        each!(self, driven => driven.run.state.element_updates)
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
        each!(self, driven => driven.run.state.corrections)
    }

    /// Returns the figures of the model.
    #[must_use]
    pub fn overview(&self) -> Overview {
        each!(self, driven => driven.overview(&self.scene))
    }
}
