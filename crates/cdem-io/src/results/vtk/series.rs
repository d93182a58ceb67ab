//! A time series of frames: numbered files and the `.pvd` that lists them.

use std::path::{Path, PathBuf};

use super::super::error::ResultsError;
use super::super::file::write_whole;

/// Files `NAME/00000.ENDING`, … and their list `NAME.pvd`.
///
/// The list is replaced after each frame, so a killed run leaves a list of
/// whole frames.
pub(in super::super) struct Series {
    folder: PathBuf,
    name: &'static str,
    ending: &'static str,
    /// Of each frame, s.
    times: Vec<f64>,
}

impl Series {
    /// An empty series in `folder`; its list exists from the start.
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

    /// A series that goes on after its frames of these times, s.
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

    /// Times of the frames, s.
    pub(in super::super) fn times(&self) -> &[f64] {
        &self.times
    }

    /// The list, and the frames from one on.
    pub(in super::super) fn files(&self, from: usize) -> impl Iterator<Item = PathBuf> {
        let frames = (from..self.times.len()).map(|number| self.frame(number));
        let list = std::iter::once(format!("{}.pvd", self.name));
        list.chain(frames).map(|file| self.folder.join(file))
    }

    /// Where a frame is.
    fn frame(&self, number: usize) -> String {
        format!("{}/{number:05}.{}", self.name, self.ending)
    }

    /// Adds the frame that `write` puts at the path it is given.
    pub(in super::super) fn add(
        &mut self,
        time: f64,
        write: impl FnOnce(&Path) -> Result<(), ResultsError>,
    ) -> Result<(), ResultsError> {
        write(&self.folder.join(self.frame(self.times.len())))?;
        self.times.push(time);
        self.write_list()
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
