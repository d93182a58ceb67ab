//! Reads frames that [`write_frame`](super::write_frame) has written.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::Path;

use cdem::mesh::ElementKind;
use flate2::read::ZlibDecoder;
use roxmltree::{Document, Node};

use super::frame::kind_of_cell;
use super::xml::{APPENDED, BLOCK};

/// The whole model at one instant.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SavedFrame {
    /// Current positions of points, m.
    pub(crate) points: Vec<[f64; 3]>,
    pub(crate) kinds: Vec<ElementKind>,
    /// Points of all cells, one cell after the other, in the order of [`ElementKind`].
    pub(crate) connectivity: Vec<u32>,
    /// Fields by name: all components of the first item first.
    pub(crate) point_fields: BTreeMap<String, Vec<f64>>,
    pub(crate) cell_fields: BTreeMap<String, Vec<f64>>,
}

/// Reads a frame.
///
/// # Errors
/// A description of the fault.
pub(crate) fn read_frame(path: &Path) -> Result<SavedFrame, String> {
    let bytes = std::fs::read(path).map_err(|error| format!("cannot be read: {error}"))?;
    parse(&bytes)
}

fn parse(bytes: &[u8]) -> Result<SavedFrame, String> {
    let end = memchr::memmem::find(bytes, APPENDED.as_bytes()).ok_or("has no data")?;
    let head = std::str::from_utf8(&bytes[..end]).map_err(|_| "has a header that is no text")?;
    let head = format!("{head}</VTKFile>");
    let head = Document::parse(&head).map_err(|error| format!("has a wrong header: {error}"))?;
    let arrays = Arrays {
        data: &bytes[end + APPENDED.len()..],
    };
    let section = |name: &str| {
        let mut all = head.descendants();
        all.find(|node| node.has_tag_name(name))
            .ok_or_else(|| format!("has no {name}"))
    };
    let cells = arrays.of(section("Cells")?)?;
    let cell_array = |name: &str| {
        cells
            .get(name)
            .ok_or_else(|| format!("has no {name} of cells"))
    };
    let points = arrays.of(section("Points")?)?;
    let points = points.get("Points").ok_or("has no points")?;
    let mut frame = SavedFrame {
        points: points.as_chunks().0.to_vec(),
        point_fields: arrays.of(section("PointData")?)?,
        cell_fields: arrays.of(section("CellData")?)?,
        ..SavedFrame::default()
    };
    let mut nodes = cell_array("connectivity")?.iter();
    for &cell_type in cell_array("types")? {
        let kind = kind_of_cell(cell_type as u8).ok_or("has cells of another kind")?;
        let start = frame.connectivity.len();
        let own = nodes.by_ref().take(kind.node_count());
        frame.connectivity.extend(own.map(|&node| node as u32));
        frame.kinds.push(kind);
        if frame.connectivity.len() < start + kind.node_count() {
            return Err("has an incomplete cell".to_owned());
        }
        if kind == ElementKind::Wedge6 {
            // As in writing.
            frame.connectivity.swap(start + 1, start + 2);
            frame.connectivity.swap(start + 4, start + 5);
        }
    }
    let count = frame.points.len();
    let is_point = |&node: &u32| (node as usize) < count;
    let are_points = frame.connectivity.iter().all(is_point);
    are_points
        .then_some(frame)
        .ok_or("has cells with points that do not exist".to_owned())
}

/// Arrays after the head of a file.
struct Arrays<'a> {
    data: &'a [u8],
}

impl Arrays<'_> {
    /// Returns all arrays of a section, by name.
    fn of(&self, section: Node) -> Result<BTreeMap<String, Vec<f64>>, String> {
        let arrays = section
            .children()
            .filter(|node| node.has_tag_name("DataArray"));
        let named = arrays.map(|array| {
            let name = array
                .attribute("Name")
                .ok_or("has an array without a name")?;
            Ok((name.to_owned(), self.read(array)?))
        });
        named.collect()
    }

    fn read(&self, array: Node) -> Result<Vec<f64>, String> {
        let offset = array.attribute("offset").and_then(|text| text.parse().ok());
        let bytes = offset.and_then(|offset| self.unpack(offset));
        let bytes = bytes.ok_or("has an incomplete array")?;
        match array.attribute("type") {
            Some("Float64") => Ok(numbers(&bytes, f64::from_le_bytes)),
            Some("Int64") => Ok(numbers(&bytes, |b| i64::from_le_bytes(b) as f64)),
            Some("Int32") => Ok(numbers(&bytes, |b| f64::from(i32::from_le_bytes(b)))),
            Some("UInt8") => Ok(numbers(&bytes, |[b]| f64::from(b))),
            _ => Err("has an array of another type".to_owned()),
        }
    }

    /// Returns the bytes of a compressed array; `None` if it is incomplete.
    fn unpack(&self, offset: usize) -> Option<Vec<u8>> {
        let mut rest = self.data.get(offset..)?;
        let mut word = || {
            let (word, others) = rest.split_first_chunk()?;
            rest = others;
            usize::try_from(u64::from_le_bytes(*word)).ok()
        };
        let [count, size, _last] = [word()?, word()?, word()?];
        let sizes: Vec<usize> = (0..count).map_while(|_| word()).collect();
        if sizes.len() < count || size > BLOCK {
            return None;
        }
        let mut bytes = Vec::new();
        for size in sizes {
            let (block, others) = rest.split_at_checked(size)?;
            rest = others;
            let mut block = ZlibDecoder::new(block).take(BLOCK as u64);
            block.read_to_end(&mut bytes).ok()?;
        }
        Some(bytes)
    }
}

fn numbers<const N: usize>(bytes: &[u8], number: impl Fn([u8; N]) -> f64) -> Vec<f64> {
    bytes
        .as_chunks()
        .0
        .iter()
        .map(|&bytes| number(bytes))
        .collect()
}
