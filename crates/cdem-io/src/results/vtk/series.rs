//! A time series of frames: numbered files and the `.pvd` that lists them.

use std::fmt::Write as _;
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
    entries: String,
    count: usize,
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
            entries: String::new(),
            count: 0,
        };
        let frames = folder.join(name);
        std::fs::create_dir(&frames).map_err(|error| ResultsError::write(&frames, error))?;
        series.write_list()?;
        Ok(series)
    }

    /// Adds the frame that `write` puts at the path it is given.
    pub(in super::super) fn add(
        &mut self,
        time: f64,
        write: impl FnOnce(&Path) -> Result<(), ResultsError>,
    ) -> Result<(), ResultsError> {
        let Self { name, ending, .. } = *self;
        let file = format!("{name}/{:05}.{ending}", self.count);
        write(&self.folder.join(&file))?;
        writeln!(
            self.entries,
            "<DataSet timestep=\"{time:e}\" part=\"0\" file=\"{file}\"/>"
        )
        .expect("writing to a string cannot fail");
        self.count += 1;
        self.write_list()
    }

    fn write_list(&self) -> Result<(), ResultsError> {
        let path = self.folder.join(format!("{}.pvd", self.name));
        write_whole(&path, |out| {
            write!(
                out,
                "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\">\n\
                 <Collection>\n{}</Collection>\n</VTKFile>\n",
                self.entries
            )
        })
    }
}
