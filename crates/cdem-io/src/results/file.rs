//! Writes files completely or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::error::ResultsError;

/// Ending of unfinished files.
pub(super) const UNFINISHED: &str = "unfinished";

/// Writes a file under another name and renames it to `path` when complete.
pub(super) fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), ResultsError> {
    replace(path, write, |_| Ok(()))
}

fn replace(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    sync: impl FnOnce(&File) -> io::Result<()>,
) -> Result<(), ResultsError> {
    let unfinished = unfinished(path);
    let attempt = || {
        let mut out = BufWriter::new(File::create(&unfinished)?);
        write(&mut out)?;
        let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
        sync(&file)?;
        fs::rename(&unfinished, path)
    };
    attempt().map_err(|error| {
        // The unfinished file is useless; if it cannot be removed, that is not a second error.
        let _ = fs::remove_file(&unfinished);
        ResultsError::write(path, error)
    })
}

/// Does as [`write_whole`] and syncs to disk. After a loss of power there is the old file or the
/// new one.
pub(super) fn write_lasting(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), ResultsError> {
    replace(path, write, |file| file.sync_all())?;
    let folder = path.parent().unwrap_or(Path::new("."));
    // Only some systems can open folders as files.
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
    Ok(())
}

fn unfinished(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(UNFINISHED);
    name.into()
}
