//! CSV files that grow by whole rows.

use std::fs::{File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};

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

    /// A number with 17 significant digits: the same bits when read back.
    pub(super) fn real(self, number: f64) -> Self {
        self.text(&format!("{number:.16e}"))
    }

    pub(super) fn reals(self, numbers: &[f64]) -> Self {
        numbers.iter().fold(self, |row, &number| row.real(number))
    }
}

/// A CSV file. Each batch of rows goes to the system in one write as soon as
/// it is complete, so a killed run leaves whole rows.
#[derive(Debug)]
pub(super) struct Table {
    path: PathBuf,
    file: File,
}

impl Table {
    /// Creates the file with its header.
    pub(super) fn create(path: &Path, header: &str) -> Result<Self, ResultsError> {
        let mut open = OpenOptions::new();
        let file = open.append(true).create_new(true).open(path);
        let mut table = Self {
            path: path.to_owned(),
            file: file.map_err(|error| ResultsError::write(path, error))?,
        };
        table.write(format!("{header}\n").as_bytes())?;
        Ok(table)
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

    /// Puts the rows in ascending order of a numeric column; equal ones stay in
    /// the order in which they were written. Holds the whole table in memory.
    pub(super) fn sort_by_number(self, column: usize) -> Result<(), ResultsError> {
        let read = |error: csv::Error| ResultsError::read(&self.path, error.into());
        let mut reader = csv::Reader::from_path(&self.path).map_err(read)?;
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
        self.file
            .write_all(bytes)
            .map_err(|error| ResultsError::write(&self.path, error))
    }
}
