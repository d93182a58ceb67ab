//! A time series of frames: numbered files and the `.pvd` that lists them.

use std::path::{Component, Path, PathBuf};

use roxmltree::{Document, Node};

use super::super::error::ResultsError;
use super::super::file::write_whole;

/// Files `NAME/00000.ENDING`, … and their list `NAME.pvd`.
///
/// The list is replaced after each frame, so a killed run leaves a list of complete frames.
#[derive(Clone)]
pub(in super::super) struct Series {
    folder: PathBuf,
    name: &'static str,
    ending: &'static str,
    /// Times of the frames, s.
    times: Vec<f64>,
}

/// Reads times, s, and files of the frames from a list.
pub(in super::super) fn listed(list: &Path) -> Result<Vec<(f64, PathBuf)>, ResultsError> {
    let text = std::fs::read_to_string(list).map_err(|error| ResultsError::read(list, error))?;
    let refuse = |why: &str| ResultsError::Frame {
        path: list.to_owned(),
        why: why.to_owned(),
    };
    let document = Document::parse(&text).map_err(|_| refuse("is no list of frames"))?;
    let folder = list.parent().unwrap_or(Path::new(""));
    let entries = document.descendants();
    let entries = entries.filter(|node| node.has_tag_name("DataSet"));
    let entry = |node: Node| {
        let time = node.attribute("timestep")?.parse().ok()?;
        // Listed files must be in the folder of the list.
        let file = Path::new(node.attribute("file")?);
        let mut parts = file.components();
        let is_within = parts.all(|part| matches!(part, Component::Normal(_)));
        is_within.then(|| (time, folder.join(file)))
    };
    let entries: Option<Vec<_>> = entries.map(entry).collect();
    entries.ok_or_else(|| refuse("lists a file that is no frame of this run"))
}

impl Series {
    /// Creates an empty series in `folder`; its list exists from the start.
    pub(in super::super) fn create(
        folder: &Path,
        name: &'static str,
        ending: &'static str,
    ) -> Result<Self, ResultsError> {
        let series = Self {
            folder: folder.to_owned(),
            name,
            ending,
            times: Vec::new(),
        };
        let frames = folder.join(name);
        std::fs::create_dir(&frames).map_err(|error| ResultsError::write(&frames, error))?;
        series.write_list()?;
        Ok(series)
    }

    /// Continues a series after its frames at `times`, s.
    pub(in super::super) fn reopen(
        folder: &Path,
        name: &'static str,
        ending: &'static str,
        times: Vec<f64>,
    ) -> Result<Self, ResultsError> {
        let series = Self {
            folder: folder.to_owned(),
            name,
            ending,
            times,
        };
        series.write_list()?;
        Ok(series)
    }

    /// Returns the times of the frames, s.
    pub(in super::super) fn times(&self) -> &[f64] {
        &self.times
    }

    /// Returns the paths of the list and of the frames from number `from` on.
    pub(in super::super) fn files(&self, from: usize) -> impl Iterator<Item = PathBuf> {
        let frames = (from..self.times.len()).map(|number| self.frame(number));
        let list = std::iter::once(format!("{}.pvd", self.name));
        list.chain(frames).map(|file| self.folder.join(file))
    }

    /// Returns the path of a frame, relative to the folder.
    fn frame(&self, number: usize) -> String {
        format!("{}/{number:05}.{}", self.name, self.ending)
    }

    /// Adds a frame, to be written with [`Added::write`].
    pub(in super::super) fn add(&mut self, time: f64) -> Added {
        self.times.push(time);
        Added(self.clone())
    }

    fn write_list(&self) -> Result<(), ResultsError> {
        let path = self.folder.join(format!("{}.pvd", self.name));
        write_whole(&path, |out| {
            writeln!(out, "<?xml version=\"1.0\"?>")?;
            writeln!(out, "<VTKFile type=\"Collection\" version=\"1.0\">")?;
            writeln!(out, "<Collection>")?;
            for (number, time) in self.times.iter().enumerate() {
                let file = self.frame(number);
                let entry = format!("timestep=\"{time:e}\" part=\"0\" file=\"{file}\"");
                writeln!(out, "<DataSet {entry}/>")?;
            }
            writeln!(out, "</Collection>\n</VTKFile>")
        })
    }
}

/// A series whose last frame is still to be written.
pub(in super::super) struct Added(Series);

impl Added {
    /// Calls `write` with the path of the frame, then updates the list.
    pub(in super::super) fn write(
        self,
        write: impl FnOnce(&Path) -> Result<(), ResultsError>,
    ) -> Result<(), ResultsError> {
        let Self(series) = self;
        let number = series.times.len() - 1;
        write(&series.folder.join(series.frame(number)))?;
        series.write_list()
    }
}
