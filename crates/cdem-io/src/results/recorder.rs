//! Writes the results of a run while it goes on.

use std::fs;
use std::path::{Path, PathBuf};

use cdem::Simulation;
use cdem::output::{BlockRow, ContactFrame, ContactRow, Frame, HistoryRow, ProbeRow};
use cdem::scene::{Geometry, Scene};

use super::background::Background;
use super::cadence::Clock;
use super::checkpoint::{self, Checkpoint, Checkpoints, Position, SoFar, Start, State};
use super::error::{ResultsError, Unprepared};
use super::file::write_whole;
use super::folder::{BLOCKS, CONTACTS, Folder, HISTORY, PROBES, SCENE, SUMMARY};
use super::rows;
use super::summary::{Status, Summary};
use super::table::{Row, Table};
use super::unfinished::LeftOff;
use super::vtk::{Series, write_contact_frame, write_frame};

/// What a recorder asks of a run; all of one instant.
///
/// Methods that take `&mut self` may start a new average or drain a list.
pub trait Observed {
    /// Simulated time, s.
    fn time(&self) -> f64;
    /// The row of `history.csv`.
    fn history(&mut self) -> HistoryRow;
    /// The rows of `blocks.csv` for the blocks asked for, forces averaged since the last call.
    fn block_rows(&mut self) -> Vec<BlockRow>;
    /// The rows of `probes.csv`.
    fn probe_rows(&mut self) -> Vec<ProbeRow>;
    /// The whole model: its time, s, and what makes a frame of it beside the steps.
    fn frame(&mut self) -> (f64, impl FnOnce() -> Frame + Send + 'static);
    /// The live contact points.
    fn contact_frame(&self) -> ContactFrame;
    /// Contacts that ended since the last call.
    fn ended_contacts(&mut self) -> Vec<ContactRow>;
    /// Contacts that last.
    fn live_contacts(&self) -> Vec<ContactRow>;
}

impl Observed for Simulation {
    fn time(&self) -> f64 {
        self.time()
    }

    fn history(&mut self) -> HistoryRow {
        self.history()
    }

    fn block_rows(&mut self) -> Vec<BlockRow> {
        self.block_rows()
    }

    fn probe_rows(&mut self) -> Vec<ProbeRow> {
        self.probe_rows()
    }

    fn frame(&mut self) -> (f64, impl FnOnce() -> Frame + Send + 'static) {
        let capture = self.capture();
        (capture.time(), move || capture.into_frame())
    }

    fn contact_frame(&self) -> ContactFrame {
        self.contact_frame()
    }

    fn ended_contacts(&mut self) -> Vec<ContactRow> {
        self.ended_contacts()
    }

    fn live_contacts(&self) -> Vec<ContactRow> {
        self.live_contacts()
    }
}

/// The writer of a results folder.
///
/// Rows and frames come from the first coarse step at or after their nominal
/// time, the start and the end included; observing never changes the run. A
/// killed run leaves whole rows and whole frames.
pub struct Recorder {
    folder: PathBuf,
    checkpoints: Checkpoints,
    /// Writes frames and checkpoints.
    background: Background,
    /// Frames that the last checkpoint counts on.
    frames_kept: usize,
    history: Output<Table>,
    blocks: Output<Table>,
    probes: Table,
    contacts: Table,
    frames: Output<[Series; 2]>,
}

/// Something that is written now and then.
struct Output<T> {
    clock: Clock,
    to: T,
}

impl Recorder {
    /// Makes the folder, removing the earlier run in it, with all files of
    /// a run that has not begun. Meshes of the scene are relative to
    /// `scene_folder`; in the `scene.toml` written they are relative to it.
    ///
    /// # Errors
    /// If the disk refuses: before anything is changed, or half-way.
    pub fn create(folder: &Folder, scene: &Scene, scene_folder: &Path) -> Result<Self, Unprepared> {
        let mut touched = false;
        Self::begin(folder, scene, scene_folder, &mut touched)
            .map_err(|error| Unprepared { error, touched })
    }

    fn begin(
        folder: &Folder,
        scene: &Scene,
        scene_folder: &Path,
        touched: &mut bool,
    ) -> Result<Self, ResultsError> {
        folder.prepare(touched)?;
        let path = folder.path();
        let table = |name: &str, header: &str| Table::create(&path.join(name), header);
        let clock = |cadence| Clock::new(cadence, scene.time.end);
        // The history is first: it marks the folder as a run's.
        let history = table(HISTORY, rows::HISTORY)?;
        *touched = true;
        history.lock();
        let text = crate::scene::write(&moved(scene, scene_folder, path));
        write_whole(&path.join(SCENE), |out| out.write_all(text.as_bytes()))?;
        Ok(Self {
            history: Output {
                clock: clock(scene.output.history),
                to: history,
            },
            blocks: Output {
                clock: clock(scene.output.blocks),
                to: table(BLOCKS, rows::BLOCKS)?,
            },
            probes: table(PROBES, rows::PROBES)?,
            contacts: table(CONTACTS, rows::CONTACTS)?,
            frames: Output {
                clock: clock(scene.output.frames),
                to: [
                    Series::create(path, "frames", "vtu")?,
                    Series::create(path, "contacts", "vtp")?,
                ],
            },
            checkpoints: Checkpoints::new(path),
            background: Background::default(),
            frames_kept: 0,
            folder: path.to_owned(),
        })
    }

    /// Goes on with the results of an unfinished run, from where its checkpoint was: what was
    /// written after that is dropped, and comes anew.
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn reopen(left_off: LeftOff) -> Result<Self, ResultsError> {
        let (path, state) = (left_off.folder, left_off.position);
        let log = path.join(checkpoint::FOLDER).join(checkpoint::LOG);
        let contacts = path.join(CONTACTS);
        if log.exists() {
            fs::rename(&log, &contacts).map_err(|error| ResultsError::write(&contacts, error))?;
        }
        let summary = path.join(SUMMARY);
        if summary.exists() {
            fs::remove_file(&summary).map_err(|error| ResultsError::write(&summary, error))?;
        }
        let [history, blocks, frames] = state.clocks;
        let table = |name: &str, length| Table::reopen(&path.join(name), length);
        let series = |name, ending| Series::reopen(&path, name, ending, state.frames.clone());
        let kept = state.frames.len();
        let recorder = Self {
            history: Output {
                clock: history,
                to: table(HISTORY, state.history)?,
            },
            blocks: Output {
                clock: blocks,
                to: table(BLOCKS, state.blocks)?,
            },
            probes: table(PROBES, state.probes)?,
            contacts: table(CONTACTS, state.contacts)?,
            frames: Output {
                clock: frames,
                to: [series("frames", "vtu")?, series("contacts", "vtp")?],
            },
            checkpoints: Checkpoints::new(&path),
            background: Background::default(),
            frames_kept: kept,
            folder: path,
        };
        recorder.history.to.lock();
        Ok(recorder)
    }

    /// Takes note that the loads of the scene are others now: in `scene.toml`, and with the
    /// next checkpoint.
    ///
    /// # Errors
    /// If the disk refuses, or `scene.toml` is not as it was written.
    pub fn change_loads(&mut self, scene: &Scene) -> Result<(), ResultsError> {
        self.checkpoints.drop_start();
        let path = self.folder.join(SCENE);
        let file = crate::scene::read(&path).map_err(|error| ResultsError::Scene {
            why: error.to_string(),
        })?;
        let changed = Scene {
            load: scene.load.clone(),
            ..file.scene
        };
        let text = crate::scene::write(&changed);
        write_whole(&path, |out| out.write_all(text.as_bytes()))
    }

    /// Whether there is a checkpoint to go on from.
    #[must_use]
    pub fn has_checkpoint(&self) -> bool {
        self.checkpoints.has_state()
    }

    /// Whether the last checkpoint has been written, so that the next would not wait.
    #[must_use]
    pub fn may_keep(&self) -> bool {
        self.checkpoints.is_ready()
    }

    /// Has a checkpoint written beside the steps that follow; to be called after
    /// [`Self::observe`].
    ///
    /// # Errors
    /// If the last one could not be written.
    pub fn keep(&mut self, simulation: &Simulation, so_far: SoFar) -> Result<(), ResultsError> {
        let start = self.checkpoints.wants_start().then(|| Start {
            scene: simulation.scene().clone(),
            mesh: simulation.mesh(),
        });
        let tables = [
            &self.history.to,
            &self.blocks.to,
            &self.probes,
            &self.contacts,
        ];
        let mut results: Vec<PathBuf> = tables.map(|table| table.path().to_owned()).into();
        for series in &self.frames.to {
            results.extend(series.files(self.frames_kept));
        }
        let frames = self.frames.to[0].times().to_vec();
        self.frames_kept = frames.len();
        let state = State {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            step: simulation.step_index(),
            time: simulation.time(),
            results: Position {
                history: self.history.to.extent(),
                blocks: self.blocks.to.extent(),
                probes: self.probes.extent(),
                contacts: self.contacts.extent(),
                frames,
                clocks: [
                    self.history.clock.clone(),
                    self.blocks.clock.clone(),
                    self.frames.clock.clone(),
                ],
            },
            so_far,
        };
        let write = self.checkpoints.begin(Checkpoint {
            start,
            state,
            run: simulation.checkpoint(),
            results,
        });
        let begun = self.background.begin(write);
        self.explained(begun)
    }

    /// Waits until all frames and checkpoints so far have been written.
    ///
    /// # Errors
    /// If one could not be.
    pub fn wait(&mut self) -> Result<(), ResultsError> {
        let written = self.background.wait();
        self.explained(written)
    }

    /// The folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Whether anything is due at `time`.
    #[must_use]
    pub fn is_due(&self, time: f64) -> bool {
        self.history.clock.is_due(time)
            || self.blocks.clock.is_due(time)
            || self.frames.clock.is_due(time)
    }

    /// Writes what is due, frames beside the steps that follow; to be called at the start and
    /// after each coarse step.
    ///
    /// # Errors
    /// If the disk refuses, or has refused an earlier frame.
    pub fn observe(&mut self, run: &mut impl Observed) -> Result<(), ResultsError> {
        let written = self.background.look().and_then(|()| self.write_due(run));
        self.explained(written)
    }

    fn write_due(&mut self, run: &mut impl Observed) -> Result<(), ResultsError> {
        let time = run.time();
        let due = [
            self.history.clock.due(time),
            self.blocks.clock.due(time),
            self.frames.clock.due(time),
        ];
        self.write(run, due)
    }

    /// Writes what is still missing at the end: last rows and frames, contacts
    /// that last, `contacts.csv` in order of time, `summary.json`. A run that
    /// has ended in no numbers keeps the last rows that hold numbers; its last
    /// frame shows where it has none.
    ///
    /// # Errors
    /// If the disk refuses; tables and frames before that are whole, and a summary tells of
    /// a run that was stopped.
    pub fn finish(
        mut self,
        run: &mut impl Observed,
        summary: &Summary,
    ) -> Result<(), ResultsError> {
        let time = run.time();
        self.require_folder()?;
        let is_finite = run.history().is_finite();
        let due = [
            self.history.clock.due_at_end(time) && is_finite,
            self.blocks.clock.due_at_end(time) && is_finite,
            self.frames.clock.due_at_end(time),
        ];
        let rows = self.write(run, due);
        let live = run.live_contacts();
        let contacts = self.contacts.append(live.iter().map(Row::from));
        let beside = self.background.wait();
        let log = self.checkpoints.log();
        let sorted = self
            .contacts
            .sort_by_number(rows::CONTACTS_TIME_ON, log.as_deref());
        let written = self.explained(rows.and(contacts).and(sorted).and(beside));
        let mut summary = summary.clone();
        if let (Err(error), Status::Done) = (&written, summary.status) {
            summary.status = Status::Stopped;
            summary.reason = error.to_string();
        }
        self.explained(written.and(summary.write(&self.folder.join(SUMMARY))))?;
        if summary.status == Status::Done {
            checkpoint::remove_all(&self.folder)?;
        }
        Ok(())
    }

    /// The folder is where it was: files in one that is not would be made anew, or grow unseen.
    fn require_folder(&self) -> Result<(), ResultsError> {
        match self.history.to.path().is_file() {
            true => Ok(()),
            false => Err(ResultsError::Gone {
                path: self.folder.clone(),
            }),
        }
    }

    /// Where the folder is gone that is the reason, whichever file was first to miss it.
    fn explained(&self, written: Result<(), ResultsError>) -> Result<(), ResultsError> {
        written.or_else(|error| self.require_folder().and(Err(error)))
    }

    fn write(
        &mut self,
        run: &mut impl Observed,
        [history, blocks, frames]: [bool; 3],
    ) -> Result<(), ResultsError> {
        if history || blocks || frames {
            self.require_folder()?;
        }
        let ended = run.ended_contacts();
        if !ended.is_empty() {
            self.contacts.append(ended.iter().map(Row::from))?;
        }
        if history {
            self.history.to.append([Row::from(&run.history())])?;
            self.probes.append(run.probe_rows().iter().map(Row::from))?;
        }
        if blocks {
            self.blocks
                .to
                .append(run.block_rows().iter().map(Row::from))?;
        }
        if frames {
            let [frames, contacts] = &mut self.frames.to;
            let (time, frame) = run.frame();
            let added = frames.add(time);
            self.background
                .begin(move || added.write(|path| write_frame(path, &frame())))?;
            let frame = run.contact_frame();
            let added = contacts.add(frame.time);
            self.background
                .begin(move || added.write(|path| write_contact_frame(path, &frame)))?;
        }
        Ok(())
    }
}

/// The scene with the paths of its meshes relative to another folder, so that
/// what is written there can be run again.
fn moved(scene: &Scene, from: &Path, to: &Path) -> Scene {
    let mut scene = scene.clone();
    for block in &mut scene.block {
        if let Geometry::Mesh { path, .. } = &mut block.geometry
            && let Ok(mesh) = from.join(&path).canonicalize()
            && let Ok(to) = to.canonicalize()
            && let Some(relative) = pathdiff::diff_paths(mesh, to)
        {
            *path = relative;
        }
    }
    scene
}
