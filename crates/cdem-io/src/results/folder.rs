//! Checks that a run may write to a folder.

use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use super::checkpoint;
use super::error::ResultsError;
use super::file::UNFINISHED;
use super::table::is_free;

/// Names of single files.
pub(crate) const SCENE: &str = "scene.toml";
pub(crate) const HISTORY: &str = "history.csv";
pub(crate) const BLOCKS: &str = "blocks.csv";
pub(crate) const PROBES: &str = "probes.csv";
pub(crate) const CONTACTS: &str = "contacts.csv";
pub(crate) const SUMMARY: &str = "summary.json";
pub(crate) const REPORT: &str = "report.html";

/// All single files of a run.
const FILES: [&str; 9] = [
    SUMMARY,
    REPORT,
    SCENE,
    BLOCKS,
    CONTACTS,
    PROBES,
    "frames.pvd",
    "contacts.pvd",
    MARK,
];

/// Folders of numbered files, and the ending of these files.
const SERIES: [(&str, &str); 3] = [
    ("frames", "vtu"),
    ("contacts", "vtp"),
    (checkpoint::FOLDER, checkpoint::ENDING),
];

/// File that marks the folder of a run. It is written first and removed last, so that a folder half
/// written or half removed is still recognised …
const MARK: &str = HISTORY;

/// … by its first bytes, whatever columns a later version adds.
const MARK_START: &[u8] = b"step,time,kinetic_energy,";

/// A folder that is free for a run: absent, empty, or with an earlier run to replace.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    earlier: Vec<PathBuf>,
}

impl Folder {
    /// Returns the default results folder of a scene: its path without ending, with `-results`.
    #[must_use]
    pub fn beside(scene: &Path) -> PathBuf {
        let mut name = scene.file_stem().unwrap_or_default().to_owned();
        name.push("-results");
        scene.with_file_name(name)
    }

    /// Checks that the run of `scene` may write to `path`; changes nothing.
    ///
    /// # Errors
    /// If `path` is a file, has anything but an earlier run, has the scene, or has an earlier run
    /// and `force` is false.
    pub fn claim(path: &Path, scene: &Path, force: bool) -> Result<Self, ResultsError> {
        let owned = || path.to_owned();
        let mut earlier = Vec::new();
        match fs::metadata(path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            Err(error) => return Err(ResultsError::read(path, error)),
            Ok(found) if !found.is_dir() => {
                return Err(ResultsError::NotFolder { path: owned() });
            }
            Ok(_) => {
                earlier = entries_of_run(path)?;
                let history = fs::File::open(path.join(MARK));
                if history.is_ok_and(|file| !is_free(&file)) {
                    return Err(ResultsError::Busy { path: owned() });
                }
                if !earlier.is_empty() && !force {
                    return Err(ResultsError::EarlierRun {
                        path: owned(),
                        has_checkpoints: checkpoint::are_in(path),
                    });
                }
                if !earlier.is_empty() && is_in(scene, path) {
                    return Err(ResultsError::HoldsScene { path: owned() });
                }
            }
        }
        Ok(Self {
            path: owned(),
            earlier,
        })
    }

    /// Returns the path.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Removes the earlier run and creates the folder. Sets `touched` as soon as anything has
    /// changed.
    pub(super) fn prepare(&self, touched: &mut bool) -> Result<(), ResultsError> {
        for entry in &self.earlier {
            let entry = self.path.join(entry);
            let removed = if entry.is_dir() {
                fs::remove_dir(&entry)
            } else {
                fs::remove_file(&entry)
            };
            removed.map_err(|error| ResultsError::write(&entry, error))?;
            *touched = true;
        }
        let new = !self.path.exists();
        fs::create_dir_all(&self.path).map_err(|error| ResultsError::write(&self.path, error))?;
        *touched |= new;
        Ok(())
    }
}

/// Returns the entries of an earlier run in the order of their removal.
fn entries_of_run(folder: &Path) -> Result<Vec<PathBuf>, ResultsError> {
    let mut entries = Vec::new();
    let foreign = |entry: PathBuf| {
        let path = folder.to_owned();
        Err(ResultsError::Foreign { path, entry })
    };
    for (name, kind) in list(folder)? {
        let series = SERIES.iter().find(|(series, _)| *series == name);
        match series {
            Some((_, ending)) if kind.is_dir() => {
                for (frame, kind) in list(&folder.join(&name))? {
                    let frame_path = Path::new(&name).join(&frame);
                    let is_known = is_numbered(&frame, ending)
                        || name == checkpoint::FOLDER && checkpoint::has(finished_name(&frame));
                    if !kind.is_file() || !is_known {
                        return foreign(frame_path);
                    }
                    entries.push(frame_path);
                }
                entries.push(name.into());
            }
            None if kind.is_file() && FILES.contains(&finished_name(&name)) => {
                entries.push(name.into());
            }
            _ => return foreign(name.into()),
        }
    }
    if let Some(first) = entries.first()
        && !has_mark(folder)
    {
        return foreign(first.clone());
    }
    entries.sort_by_key(|entry| entry.as_os_str() == MARK);
    Ok(entries)
}

/// Returns the names in a folder, sorted, with their types (links are not followed).
fn list(folder: &Path) -> Result<Vec<(String, fs::FileType)>, ResultsError> {
    let read = || {
        fs::read_dir(folder)?
            .map(|entry| {
                let entry = entry?;
                let name = entry.file_name().to_string_lossy().into_owned();
                Ok((name, entry.file_type()?))
            })
            .collect::<std::io::Result<Vec<_>>>()
    };
    let mut names = read().map_err(|error| ResultsError::read(folder, error))?;
    names.sort_by(|(a, _), (b, _)| a.cmp(b));
    Ok(names)
}

fn finished_name(name: &str) -> &str {
    name.strip_suffix(UNFINISHED)
        .and_then(|rest| rest.strip_suffix('.'))
        .unwrap_or(name)
}

fn is_numbered(name: &str, ending: &str) -> bool {
    finished_name(name)
        .strip_suffix(ending)
        .and_then(|rest| rest.strip_suffix('.'))
        .is_some_and(|number| number.len() >= 5 && number.bytes().all(|b| b.is_ascii_digit()))
}

/// True if the folder is that of a run.
pub(super) fn has_mark(folder: &Path) -> bool {
    let mut start = [0; MARK_START.len()];
    fs::File::open(folder.join(MARK))
        .and_then(|mut file| file.read_exact(&mut start))
        .is_ok_and(|()| start == MARK_START)
}

fn is_in(file: &Path, folder: &Path) -> bool {
    match (fs::canonicalize(file), fs::canonicalize(folder)) {
        (Ok(file), Ok(folder)) => file.starts_with(folder),
        _ => false,
    }
}
