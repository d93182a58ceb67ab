//! The tables of a run, small enough for a page.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use crate::results::ResultsError;

/// Largest number of rows in a chart: about one per pixel.
const ROWS: usize = 2000;

/// Largest number of blocks whose motion is shown: those with the most kinetic energy.
const BLOCKS: usize = 8;

/// Largest number of contacts in the list: those with the largest forces.
const CONTACTS: usize = 50;

/// Number of time intervals in which new contacts are counted.
const BINS: usize = 100;

/// A table, column by column.
pub(super) type Columns = BTreeMap<String, Vec<f32>>;

/// Blocks of a run.
#[derive(Default, Serialize)]
pub(super) struct Blocks {
    time: Vec<f32>,
    blocks: Vec<BlockMotion>,
    /// Names and masses, kg, of all blocks with rows, in their order.
    #[serde(skip)]
    pub(super) all: Vec<(String, f64)>,
}

/// Speed, m/s, and force, N, of one block.
#[derive(Serialize)]
struct BlockMotion {
    name: String,
    speed: Vec<f32>,
    force: Vec<f32>,
}

/// Contacts of a run.
#[derive(Default, Serialize)]
pub(super) struct Contacts {
    count: usize,
    begun: Begun,
    largest: Vec<Contact>,
    /// Time of the first contact after t = 0, s.
    #[serde(skip)]
    pub(super) first: Option<f64>,
}

/// Numbers of contacts that began around given times, s.
#[derive(Default, Serialize)]
struct Begun {
    time: Vec<f32>,
    number: Vec<u32>,
}

#[derive(Serialize)]
struct Contact {
    main: String,
    target: String,
    #[serde(rename = "type")]
    kind: String,
    time_on: f64,
    time_off: Option<f64>,
    peak_normal_force: f64,
    normal_impulse: f64,
    slip: f64,
}

/// Reads a table of numbers.
///
/// # Errors
/// If the file is missing or is not a table.
pub(super) fn history(path: &Path) -> Result<Columns, ResultsError> {
    let mut columns = Columns::new();
    let (head, rows) = records(path)?;
    for row in rows {
        let row = row.map_err(|error| ResultsError::read(path, error.into()))?;
        for (name, value) in head.iter().zip(&row) {
            let column = columns.entry(name.to_owned()).or_default();
            column.push(value.parse().unwrap_or(f32::NAN));
        }
    }
    for column in columns.values_mut() {
        thin(column);
    }
    Ok(columns)
}

/// Reads the motion of the blocks.
///
/// # Errors
/// If the file is missing or is not a table.
pub(super) fn blocks(path: &Path) -> Result<Blocks, ResultsError> {
    let mut found = Blocks::default();
    let mut energy: BTreeMap<String, f64> = BTreeMap::new();
    each_block(path, |row| {
        let square = row.velocity.iter().map(|v| v * v).sum::<f64>();
        let most = energy.entry(row.name.to_owned()).or_insert_with(|| {
            found.all.push((row.name.to_owned(), row.mass));
            0.0
        });
        *most = most.max(row.mass * square);
    })?;
    let mut chosen: Vec<(String, f64)> = energy.into_iter().collect();
    chosen.retain(|(_, energy)| *energy > 0.0);
    chosen.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    chosen.truncate(BLOCKS);
    let motion = |(name, _)| BlockMotion {
        name,
        speed: Vec::new(),
        force: Vec::new(),
    };
    found.blocks = chosen.into_iter().map(motion).collect();
    each_block(path, |row| {
        let known = found.blocks.iter().position(|block| block.name == row.name);
        let Some(number) = known else { return };
        if number == 0 {
            found.time.push(row.time as f32);
        }
        let size = |vector: [f64; 3]| vector.iter().map(|x| x * x).sum::<f64>().sqrt() as f32;
        let block = &mut found.blocks[number];
        block.speed.push(size(row.velocity));
        block.force.push(size(row.force));
    })?;
    thin(&mut found.time);
    for block in &mut found.blocks {
        thin(&mut block.speed);
        thin(&mut block.force);
    }
    Ok(found)
}

/// The columns of `blocks.csv` that are used.
struct BlockRow<'a> {
    time: f64,
    name: &'a str,
    mass: f64,
    velocity: [f64; 3],
    force: [f64; 3],
}

fn each_block(path: &Path, mut look: impl FnMut(BlockRow)) -> Result<(), ResultsError> {
    let (_, rows) = records(path)?;
    for row in rows {
        let row = row.map_err(|error| ResultsError::read(path, error.into()))?;
        let number = |column: usize| row.get(column).and_then(|text| text.parse().ok());
        let number = |column: usize| number(column).unwrap_or(f64::NAN);
        look(BlockRow {
            time: number(0),
            name: row.get(1).unwrap_or_default(),
            mass: number(2),
            velocity: [6, 7, 8].map(number),
            force: [12, 13, 14].map(number),
        });
    }
    Ok(())
}

/// Reads the contacts of a run that ended at `end`, s.
///
/// # Errors
/// If the file is missing or is not a table.
pub(super) fn contacts(path: &Path, end: f64) -> Result<Contacts, ResultsError> {
    let mut found = Contacts::default();
    let width = if end > 0.0 { end / BINS as f64 } else { 1.0 };
    let mut number = vec![0; BINS];
    let (_, rows) = records(path)?;
    for row in rows {
        let row = row.map_err(|error| ResultsError::read(path, error.into()))?;
        let text = |column: usize| row.get(column).unwrap_or_default().to_owned();
        let real = |column: usize| text(column).parse::<f64>().ok();
        let contact = Contact {
            main: text(0),
            target: text(1),
            kind: text(2),
            time_on: real(3).unwrap_or_default(),
            time_off: real(4),
            peak_normal_force: real(8).unwrap_or_default(),
            normal_impulse: real(9).unwrap_or_default(),
            slip: real(11).unwrap_or_default(),
        };
        found.count += 1;
        let bin = (contact.time_on / width) as usize;
        number[bin.min(BINS - 1)] += 1;
        if contact.time_on > 0.0 {
            let first = found.first.get_or_insert(contact.time_on);
            *first = first.min(contact.time_on);
        }
        found.largest.push(contact);
        if found.largest.len() >= 2 * CONTACTS {
            keep_largest(&mut found.largest);
        }
    }
    keep_largest(&mut found.largest);
    found.begun = Begun {
        time: (0..BINS)
            .map(|bin| ((bin as f64 + 0.5) * width) as f32)
            .collect(),
        number,
    };
    Ok(found)
}

fn keep_largest(contacts: &mut Vec<Contact>) {
    contacts.sort_by(|a, b| b.peak_normal_force.total_cmp(&a.peak_normal_force));
    contacts.truncate(CONTACTS);
}

type Rows = csv::StringRecordsIntoIter<std::fs::File>;

/// Returns the names of the columns, and the rows.
fn records(path: &Path) -> Result<(csv::StringRecord, Rows), ResultsError> {
    let read = |error: csv::Error| ResultsError::read(path, error.into());
    let mut reader = csv::Reader::from_path(path).map_err(read)?;
    let head = reader.headers().map_err(read)?.clone();
    Ok((head, reader.into_records()))
}

/// Keeps about [`ROWS`] rows, evenly spaced, and the last one.
fn thin(column: &mut Vec<f32>) {
    let apart = column.len().div_ceil(ROWS).max(1);
    let last = column.len().saturating_sub(1);
    let mut row = 0;
    column.retain(|_| {
        let stays = row % apart == 0 || row == last;
        row += 1;
        stays
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_columns_keep_their_ends() {
        let mut column: Vec<f32> = (0..10_000_u16).map(f32::from).collect();
        thin(&mut column);
        assert_eq!(column.len(), ROWS + 1);
        assert_eq!([column[0], column[1], column[ROWS]], [0.0, 5.0, 9999.0]);
        let mut short = vec![1.0, 2.0];
        thin(&mut short);
        assert_eq!(short, [1.0, 2.0]);
    }
}
