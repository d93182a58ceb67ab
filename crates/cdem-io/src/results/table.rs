//! CSV files that grow by complete rows.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, BufRead as _, BufReader, Read as _, Write as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::error::ResultsError;
use super::file::write_whole;

/// One row under construction.
#[derive(Debug, Default)]
pub(super) struct Row(csv::StringRecord);

impl Row {
    pub(super) fn text(mut self, text: &str) -> Self {
        self.0.push_field(text);
        self
    }

    pub(super) fn whole(self, number: u64) -> Self {
        self.text(&number.to_string())
    }

    /// Adds a number with 17 significant digits, which reads back with the same bits.
    pub(super) fn real(self, number: f64) -> Self {
        self.text(&format!("{number:.16e}"))
    }

    pub(super) fn reals(self, numbers: &[f64]) -> Self {
        numbers.iter().fold(self, |row, &number| row.real(number))
    }
}

/// A CSV file. Each batch of rows goes to the system in one write as soon as it is complete, so a
/// killed run leaves complete rows.
#[derive(Debug)]
pub(super) struct Table {
    path: PathBuf,
    file: File,
    extent: Extent,
}

/// Length of a file and checksum of its content.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Extent {
    /// Length, bytes.
    length: u64,
    /// CRC-32 of these bytes.
    sum: u32,
}

impl Extent {
    /// Returns the extent with these bytes appended.
    fn with(self, bytes: &[u8]) -> Self {
        let mut sum = crc32fast::Hasher::new_with_initial_len(self.sum, self.length);
        sum.update(bytes);
        Self {
            length: self.length + bytes.len() as u64,
            sum: sum.finalize(),
        }
    }

    /// Checks that a file in a folder has at least this length and the same content, or returns the
    /// fault.
    pub(super) fn fits(self, folder: &Path, name: &Path) -> Result<(), String> {
        let path = &folder.join(name);
        let is = fs::metadata(path).map_or(0, |file| file.len());
        if is < self.length {
            let (length, name) = (self.length, name.display());
            return Err(format!("needs {length} bytes of {name}, which has {is}"));
        }
        let unreadable = |error: io::Error| format!("needs {}: {error}", name.display());
        let file = File::open(path).map_err(unreadable)?;
        let mut file = BufReader::with_capacity(READ_AT_ONCE, file.take(self.length));
        let mut found = Self::default();
        loop {
            let bytes = file.fill_buf().map_err(unreadable)?;
            if bytes.is_empty() {
                break;
            }
            let count = bytes.len();
            found = found.with(bytes);
            file.consume(count);
        }
        if found == self {
            Ok(())
        } else {
            let name = name.display();
            Err(format!("does not fit {name}, which has changed since"))
        }
    }
}

/// Number of bytes that are read at once.
const READ_AT_ONCE: usize = 1 << 16;

impl Table {
    /// Creates the file with its header.
    pub(super) fn create(path: &Path, header: &str) -> Result<Self, ResultsError> {
        let mut open = OpenOptions::new();
        let file = open.append(true).create_new(true).open(path);
        let mut table = Self {
            path: path.to_owned(),
            file: file.map_err(|error| ResultsError::write(path, error))?,
            extent: Extent::default(),
        };
        table.write(format!("{header}\n").as_bytes())?;
        Ok(table)
    }

    /// Opens a file to continue it after some extent; the rest is dropped.
    pub(super) fn reopen(path: &Path, extent: Extent) -> Result<Self, ResultsError> {
        let open = || {
            let file = OpenOptions::new().append(true).open(path)?;
            file.set_len(extent.length)?;
            Ok(file)
        };
        Ok(Self {
            path: path.to_owned(),
            file: open().map_err(|error| ResultsError::write(path, error))?,
            extent,
        })
    }

    /// Returns the path of the file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the extent of the file.
    pub(super) fn extent(&self) -> Extent {
        self.extent
    }

    /// Locks the file against other processes until it is closed, if the system can.
    pub(super) fn lock(&self) {
        is_free(&self.file);
    }

    /// Appends rows.
    pub(super) fn append(
        &mut self,
        rows: impl IntoIterator<Item = Row>,
    ) -> Result<(), ResultsError> {
        let mut batch = csv::Writer::from_writer(Vec::new());
        for row in rows {
            batch
                .write_record(&row.0)
                .expect("rows of one table have as many fields");
        }
        let bytes = batch.into_inner().expect("writing into memory cannot fail");
        self.write(&bytes)
    }

    /// Sorts the rows by a numeric column, in ascending order; equal ones stay in the order in
    /// which they were written. Holds the whole table in memory. The unsorted table is moved to the
    /// path of a `log`, if one is given.
    pub(super) fn sort_by_number(
        &self,
        column: usize,
        log: Option<&Path>,
    ) -> Result<(), ResultsError> {
        if let Some(log) = log {
            fs::rename(&self.path, log).map_err(|error| ResultsError::write(log, error))?;
        }
        let unsorted = log.unwrap_or(&self.path);
        let read = |error: csv::Error| ResultsError::read(unsorted, error.into());
        let mut reader = csv::Reader::from_path(unsorted).map_err(read)?;
        let header = reader.headers().map_err(read)?.clone();
        let mut rows = Vec::new();
        for row in reader.records() {
            let row = row.map_err(read)?;
            let number: f64 = row[column]
                .parse()
                .expect("the column was written as numbers");
            rows.push((number, row));
        }
        rows.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        write_whole(&self.path, |out| {
            let mut writer = csv::Writer::from_writer(out);
            writer.write_record(&header)?;
            for (_, row) in &rows {
                writer.write_record(row)?;
            }
            writer.flush()
        })
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), ResultsError> {
        if let Err(error) = self.file.write_all(bytes) {
            // A partial row is useless; if it cannot be removed, that is not a second error.
            let _ = self.file.set_len(self.extent.length);
            return Err(ResultsError::write(&self.path, error));
        }
        self.extent = self.extent.with(bytes);
        Ok(())
    }
}

/// True if no other process has locked the file; this locks it, if the system can.
pub(super) fn is_free(file: &File) -> bool {
    !matches!(file.try_lock(), Err(TryLockError::WouldBlock))
}
