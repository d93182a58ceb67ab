//! A run without an engine: its output depends on its step alone.

use std::path::{Path, PathBuf};

use cdem::mesh::ElementKind;
use cdem::output::{
    BlockRow, ContactFrame, ContactKind, ContactRow, FieldValues, Frame, FrameField, HistoryRow,
    ProbeRow,
};
use cdem::scene::{
    Cadence, Contact, ContactModel, Output, Plane, Scene, Schedule, Strength, Time, ZoneExtent,
};
use cdem_io::results::{Folder, Observed, Recorder, Status, Summary};

pub(crate) const STEPS: u64 = 10;
pub(crate) const STEP: f64 = 0.1;

/// A run at one of its steps.
#[derive(Default)]
pub(crate) struct Fake {
    pub(crate) step: u64,
}

/// Returns a number without a short decimal form, so that lost digits show.
pub(crate) fn awkward(i: usize) -> f64 {
    (i as f64 + 0.1).sin() * 10_f64.powi(i as i32 % 40 - 20)
}

fn contact(main: &str, time_on: f64, time_off: Option<f64>) -> ContactRow {
    ContactRow {
        main: main.to_owned(),
        target: "the, \"other\"".to_owned(),
        kind: ContactKind::VertexEdge,
        time_on,
        time_off,
        position: [awkward(1), awkward(2), 0.0],
        peak_normal_force: 1.0,
        normal_impulse: 2.0,
        shear_impulse: 3.0,
        slip: 4.0,
        level: 5,
    }
}

impl Observed for Fake {
    fn time(&self) -> f64 {
        self.step as f64 * STEP
    }

    fn history(&mut self) -> HistoryRow {
        HistoryRow {
            step: self.step,
            time: self.time(),
            kinetic_energy: awkward(self.step as usize),
            elements: 5,
            ..HistoryRow::default()
        }
    }

    fn block_rows(&mut self) -> Vec<BlockRow> {
        let row = |block: &str| BlockRow {
            time: self.time(),
            block: block.to_owned(),
            ..BlockRow::default()
        };
        vec![row("i"), row("j")]
    }

    fn probe_rows(&mut self) -> Vec<ProbeRow> {
        vec![ProbeRow {
            time: self.time(),
            probe: "tip".to_owned(),
            ..ProbeRow::default()
        }]
    }

    fn frame(&mut self) -> (f64, impl FnOnce() -> Frame + Send + 'static) {
        let time = self.time();
        (time, move || frame(time))
    }

    fn contact_frame(&self) -> ContactFrame {
        contact_frame(self.time(), self.step as usize)
    }

    fn ended_contacts(&mut self) -> Vec<ContactRow> {
        match self.step {
            3 => vec![contact("late", 0.2, Some(0.3))],
            5 => vec![contact("early", 0.1, Some(0.5))],
            _ => vec![],
        }
    }

    fn live_contacts(&self) -> Vec<ContactRow> {
        vec![contact("resting", 0.1, None)]
    }
}

/// Builds a frame with one cell of each kind and every type of field.
pub(crate) fn frame(time: f64) -> Frame {
    use ElementKind::{Hex8, Quad4, Tet4, Tri3, Wedge6};
    let kinds = vec![Tri3, Quad4, Tet4, Wedge6, Hex8];
    let nodes: usize = kinds.iter().map(|kind| kind.node_count()).sum();
    let reals = |count: usize| FieldValues::Real((0..count).map(awkward).collect());
    Frame {
        time,
        points: (0..nodes)
            .map(|i| [awkward(3 * i), awkward(3 * i + 1), awkward(3 * i + 2)])
            .collect(),
        connectivity: (0..nodes as u32).collect(),
        point_fields: vec![FrameField {
            name: "displacement",
            components: &["x", "y", "z"],
            values: reals(3 * nodes),
        }],
        cell_fields: vec![
            FrameField {
                name: "stress",
                components: &["xx", "yy", "zz", "xy", "yz", "zx"],
                values: reals(6 * kinds.len()),
            },
            FrameField {
                name: "von_mises",
                components: &[],
                values: reals(kinds.len()),
            },
            FrameField {
                name: "level",
                components: &[],
                values: FieldValues::Whole((-2..).take(kinds.len()).collect()),
            },
        ],
        kinds,
    }
}

/// Builds a frame of `count` contact points.
pub(crate) fn contact_frame(time: f64, count: usize) -> ContactFrame {
    let vectors = |offset: usize| {
        (0..count)
            .map(|i| [awkward(i + offset), awkward(i + offset + 1), 0.0])
            .collect::<Vec<_>>()
    };
    ContactFrame {
        time,
        points: vectors(0),
        normals: vectors(1),
        forces: vectors(2),
        slips: (0..count).map(awkward).collect(),
        areas: (0..count).map(|i| awkward(i + 7)).collect(),
    }
}

/// Builds a scene in which only time and output matter.
pub(crate) fn scene(history: Cadence, frames: Cadence) -> Scene {
    Scene {
        version: 1,
        title: String::new(),
        dimension: 3,
        plane: Plane::Strain,
        thickness: 1.0,
        gravity: Schedule::Constant(vec![0.0; 3]),
        time: Time {
            end: STEPS as f64 * STEP,
            step: Some(STEP),
            safety: 0.8,
            stop_when: None,
        },
        material: vec![],
        block: vec![],
        boundary: vec![],
        load: vec![],
        contact: Contact {
            model: ContactModel::UnifiedNode,
            tolerance: None,
            strength: Strength::default(),
            energy_loss: 0.01,
            max_level: 5,
            zone: ZoneExtent::Graded,
            normal_stiffness: None,
            shear_stiffness: None,
            pair: vec![],
        },
        output: Output {
            frames,
            history,
            blocks: history,
            block_list: None,
            fields: vec![],
            checkpoint: 0.0,
        },
        probe: vec![],
        warnings: vec![],
    }
}

/// A folder for the files of one test.
pub(crate) struct Place(tempfile::TempDir);

impl Place {
    pub(crate) fn new() -> Self {
        let place = Self(tempfile::tempdir().expect("a temporary folder"));
        std::fs::write(place.scene(), "the scene").expect("a writable folder");
        place
    }

    pub(crate) fn scene(&self) -> PathBuf {
        self.0.path().join("scene.toml")
    }

    pub(crate) fn results(&self) -> PathBuf {
        self.0.path().join("results")
    }

    pub(crate) fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.results().join(name)).expect(name)
    }

    pub(crate) fn recorder(&self, scene: &Scene, force: bool) -> Recorder {
        let folder = Folder::claim(&self.results(), &self.scene(), force).expect("free");
        Recorder::create(&folder, scene, self.0.path()).expect("created")
    }

    /// Does a whole fake run.
    pub(crate) fn run(&self, scene: &Scene, force: bool) {
        let mut recorder = self.recorder(scene, force);
        let mut run = Fake::default();
        recorder.observe(&mut run).expect("written");
        while run.step < STEPS {
            run.step += 1;
            recorder.observe(&mut run).expect("written");
        }
        recorder.finish(&mut run, &summary()).expect("written");
    }
}

pub(crate) fn summary() -> Summary {
    Summary {
        status: Status::Stopped,
        reason: "because".to_owned(),
        version: "0".to_owned(),
        steps: STEPS,
        time: 1.0,
        step: STEP,
        levels: vec![1, 4],
        wall_seconds: 2.0,
        setup_seconds: 0.5,
        element_updates: 50,
        updates_per_second: 25.0,
        threads: 1,
        contacts_begun: 3,
        max_penetration: f64::NAN,
        energy_residual: 0.0,
        warnings: Vec::new(),
        peak_memory_bytes: None,
    }
}

/// Returns the names in a folder, sorted.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    names
}
