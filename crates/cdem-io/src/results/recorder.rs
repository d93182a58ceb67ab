//! Writes the results of a run while it steps.

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

/// Data that a recorder reads from a run, all of one instant.
///
/// Methods that take `&mut self` may start a new average or empty a list.
pub trait Observed {
    /// Returns the simulated time, s.
    fn time(&self) -> f64;
    /// Returns the row of `history.csv`.
    fn history(&mut self) -> HistoryRow;
    /// Returns the rows of `blocks.csv` for the selected blocks, with forces averaged since the
    /// last call.
    fn block_rows(&mut self) -> Vec<BlockRow>;
    /// Returns the rows of `probes.csv`.
    fn probe_rows(&mut self) -> Vec<ProbeRow>;
    /// Returns the time, s, and a function that makes the frame on another thread.
    fn frame(&mut self) -> (f64, impl FnOnce() -> Frame + Send + 'static);
    /// Returns the current contact points.
    fn contact_frame(&self) -> ContactFrame;
    /// Returns the contacts that ended since the last call.
    fn ended_contacts(&mut self) -> Vec<ContactRow>;
    /// Returns the contacts that are still closed.
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
/// Rows and frames are written at the first coarse step at or after their nominal time, start and
/// end included. Observing never changes the run. A killed run leaves complete rows and complete
/// frames.
pub struct Recorder {
    folder: PathBuf,
    checkpoints: Checkpoints,
    /// Writes frames and checkpoints.
    background: Background,
    /// Number of frames that the last checkpoint refers to.
    frames_kept: usize,
    history: Output<Table>,
    blocks: Output<Table>,
    probes: Table,
    contacts: Table,
    frames: Output<[Series; 2]>,
}

/// An output with its clock.
struct Output<T> {
    clock: Clock,
    to: T,
}

impl Recorder {
    /// Creates the folder, after removal of an earlier run in it, with all files of a run that has
    /// not begun. Mesh paths of the scene are relative to `scene_folder`; in the `scene.toml`
    /// written they are relative to the results folder.
    ///
    /// # Errors
    /// If writing fails, before anything is changed or later.
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
        // The history comes first: it marks the folder as that of a run.
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

    /// Continues the results of an unfinished run from its checkpoint. Results written after the
    /// checkpoint are dropped and written again.
    ///
    /// # Errors
    /// If writing fails.
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

    /// Records changed loads of the scene: in `scene.toml`, and with the next checkpoint.
    ///
    /// # Errors
    /// If writing fails, or if `scene.toml` has been changed and cannot be read.
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

    /// True if there is a checkpoint to continue from.
    #[must_use]
    pub fn has_checkpoint(&self) -> bool {
        self.checkpoints.has_state()
    }

    /// True if the last checkpoint has been written, so that the next one would not wait.
    #[must_use]
    pub fn may_keep(&self) -> bool {
        self.checkpoints.is_ready()
    }

    /// Queues a checkpoint, written while the run steps; to be called after [`Self::observe`].
    ///
    /// # Errors
    /// If an earlier frame or checkpoint could not be written.
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

    /// Waits until all queued frames and checkpoints are written.
    ///
    /// # Errors
    /// If one could not be written.
    pub fn wait(&mut self) -> Result<(), ResultsError> {
        let written = self.background.wait();
        self.explained(written)
    }

    /// Returns the path of the results folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// True if anything is due at `time`.
    #[must_use]
    pub fn is_due(&self, time: f64) -> bool {
        self.history.clock.is_due(time)
            || self.blocks.clock.is_due(time)
            || self.frames.clock.is_due(time)
    }

    /// Writes what is due, frames while the run steps on; to be called at the start and after each
    /// coarse step.
    ///
    /// # Errors
    /// If writing fails, or if writing an earlier frame has failed.
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

    /// Writes the rest at the end: last rows and frames, contacts that are still closed,
    /// `contacts.csv` in order of time, `summary.json`. If the last state is not finite, the tables
    /// keep their last finite rows; the last frame shows where values are not finite.
    ///
    /// # Errors
    /// If writing fails. Tables and frames before that are complete, and the summary reports a run
    /// that was stopped.
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

    /// Checks that the folder still exists. In a removed folder files would be created anew, or
    /// grow unseen.
    fn require_folder(&self) -> Result<(), ResultsError> {
        match self.history.to.path().is_file() {
            true => Ok(()),
            false => Err(ResultsError::Gone {
                path: self.folder.clone(),
            }),
        }
    }

    /// Returns the missing folder as the reason if it is gone, whichever file failed first.
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

/// Returns the scene with mesh paths relative to another folder, so that a scene written there can
/// be run again.
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
