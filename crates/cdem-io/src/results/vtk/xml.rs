//! VTK's XML container: small header, arrays appended as raw zlib blocks.
//!
//! An own writer, because the arrays are compressed in parallel and written without the third that
//! base64 adds. Source: VTK File Formats, "XML File Formats", section on appended data and
//! compression.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use flate2::{Compression, write::ZlibEncoder};
use rayon::prelude::*;

use super::super::error::ResultsError;
use super::super::file::write_whole;

/// Uncompressed bytes of a compression block: large enough to compress well, small enough to occupy
/// all threads.
pub(super) const BLOCK: usize = 1 << 17;

/// Text between header and arrays.
pub(super) const APPENDED: &str = "<AppendedData encoding=\"raw\">\n_";

/// Values of an array, borrowed.
pub(super) enum Values<'a> {
    Real(&'a [f64]),
    Whole(&'a [i32]),
    Index(&'a [i64]),
    Byte(&'a [u8]),
}

impl Values<'_> {
    fn type_name(&self) -> &'static str {
        match self {
            Self::Real(_) => "Float64",
            Self::Whole(_) => "Int32",
            Self::Index(_) => "Int64",
            Self::Byte(_) => "UInt8",
        }
    }

    fn len(&self) -> usize {
        match self {
            Self::Real(values) => values.len(),
            Self::Whole(values) => values.len(),
            Self::Index(values) => values.len(),
            Self::Byte(values) => values.len(),
        }
    }

    fn to_bytes(&self) -> Vec<u8> {
        match self {
            Self::Real(values) => values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            Self::Whole(values) => values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            Self::Index(values) => values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            Self::Byte(values) => values.to_vec(),
        }
    }
}

/// Compression levels, in the order in which they are tried.
const LEVELS: [u32; 3] = [1, 0, 9];

/// An array with its attributes.
struct DataArray<'a> {
    name: &'a str,
    /// Number of components; 0 for a plain scalar.
    components: usize,
    component_names: &'a [&'a str],
    /// Number of tuples, where VTK's readers ask for it.
    tuples: Option<usize>,
    values: &'a Values<'a>,
}

/// A file under construction.
pub(super) struct XmlFile {
    dataset: &'static str,
    header: String,
    appended: Vec<u8>,
    /// Offsets at which meshio puts each array, and the next, as it reads the file: uncompressed,
    /// in base64. It then looks for arrays by their offset and finds the wrong one if one of these
    /// equals the offset of a later array (meshio 5.3.5, `_parse_raw_binary`).
    unpacked: Vec<usize>,
    open: Vec<&'static str>,
}

impl XmlFile {
    /// Starts a file of a data set type, e.g. `UnstructuredGrid`.
    pub(super) fn new(dataset: &'static str) -> Self {
        let mut file = Self {
            dataset,
            header: String::new(),
            appended: Vec::new(),
            unpacked: vec![0],
            open: Vec::new(),
        };
        file.open(dataset, &[]);
        file
    }

    /// Opens an element with whole-number attributes.
    pub(super) fn open(&mut self, element: &'static str, attributes: &[(&str, usize)]) {
        self.header.push('<');
        self.header.push_str(element);
        for (name, value) in attributes {
            self.attribute(name, value);
        }
        self.header.push_str(">\n");
        self.open.push(element);
    }

    /// Closes the element opened last.
    pub(super) fn close(&mut self) {
        if let Some(element) = self.open.pop() {
            self.header.push_str("</");
            self.header.push_str(element);
            self.header.push_str(">\n");
        }
    }

    /// Adds an array; `components` 0 means a plain scalar.
    pub(super) fn array(&mut self, name: &str, components: usize, values: &Values<'_>) {
        self.data_array(&DataArray {
            name,
            components,
            component_names: &[],
            tuples: None,
            values,
        });
    }

    /// Writes the time of a frame at the place where VTK's readers expect it.
    pub(super) fn time(&mut self, time: f64) {
        self.open("FieldData", &[]);
        self.data_array(&DataArray {
            name: "TimeValue",
            components: 0,
            component_names: &[],
            tuples: Some(1),
            values: &Values::Real(&[time]),
        });
        self.close();
    }

    /// Adds an array whose components have names; without names, a plain scalar.
    pub(super) fn named_array(
        &mut self,
        name: &str,
        component_names: &[&str],
        values: &Values<'_>,
    ) {
        self.data_array(&DataArray {
            name,
            components: component_names.len(),
            component_names,
            tuples: None,
            values,
        });
    }

    fn data_array(&mut self, array: &DataArray<'_>) {
        let DataArray {
            name,
            components,
            component_names,
            tuples,
            values,
        } = *array;
        debug_assert!(
            values.len().is_multiple_of(components.max(1)),
            "array {name} must hold whole tuples"
        );
        self.header.push_str("<DataArray");
        self.attribute("type", values.type_name());
        self.attribute("Name", name);
        if components > 0 {
            self.attribute("NumberOfComponents", components);
        }
        for (i, component) in component_names.iter().enumerate() {
            self.attribute(&format!("ComponentName{i}"), component);
        }
        if let Some(tuples) = tuples {
            self.attribute("NumberOfTuples", tuples);
        }
        self.attribute("format", "appended");
        self.attribute("offset", self.appended.len());
        self.header.push_str("/>\n");
        self.append(&values.to_bytes());
    }

    /// Appends an array, compressed so that the offset of the next one is not one at which meshio
    /// has put another.
    fn append(&mut self, bytes: &[u8]) {
        let (start, place) = (self.appended.len(), self.unpacked[self.unpacked.len() - 1]);
        for level in LEVELS {
            self.appended.truncate(start);
            compress(bytes, level, &mut self.appended);
            if !self.unpacked.contains(&self.appended.len()) {
                break;
            }
        }
        let with_size = size_of::<u64>() + bytes.len();
        self.unpacked.push(place + 4 * with_size.div_ceil(3));
    }

    fn attribute(&mut self, name: &str, value: impl std::fmt::Display) {
        write!(self.header, " {name}=\"{value}\"").expect("writing to a string cannot fail");
    }

    /// Writes the file, completely or not at all.
    pub(super) fn save(mut self, path: &Path) -> Result<(), ResultsError> {
        while !self.open.is_empty() {
            self.close();
        }
        let Self {
            dataset,
            header,
            appended,
            ..
        } = self;
        write_whole(path, |out| {
            write!(
                out,
                "<?xml version=\"1.0\"?>\n<VTKFile type=\"{dataset}\" version=\"1.0\" \
                 byte_order=\"LittleEndian\" header_type=\"UInt64\" \
                 compressor=\"vtkZLibDataCompressor\">\n{header}{APPENDED}"
            )?;
            out.write_all(&appended)?;
            out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
        })
    }
}

/// Appends `bytes` as VTK's compressed array: number of blocks, block size,
/// size of the last block if it is not full, compressed sizes, blocks.
fn compress(bytes: &[u8], level: u32, out: &mut Vec<u8>) {
    let block = |bytes| compress_block(bytes, level);
    let blocks: Vec<Vec<u8>> = bytes.par_chunks(BLOCK).map(block).collect();
    let mut header = vec![blocks.len(), BLOCK, bytes.len() % BLOCK];
    header.extend(blocks.iter().map(Vec::len));
    for word in header {
        out.extend_from_slice(&(word as u64).to_le_bytes());
    }
    for block in blocks {
        out.extend_from_slice(&block);
    }
}

fn compress_block(bytes: &[u8], level: u32) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(level));
    encoder
        .write_all(bytes)
        .and_then(|()| encoder.finish())
        .expect("compression into memory cannot fail")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Creates a file with one array for each length, of whole numbers from 0 to `count` − 1.
    fn file(count: i32, lengths: &[usize]) -> XmlFile {
        let mut file = XmlFile::new("UnstructuredGrid");
        for &length in lengths {
            let values: Vec<i32> = (0..length as i32).map(|i| i * i % count).collect();
            file.array("numbers", 0, &Values::Whole(&values));
        }
        file
    }

    #[test]
    fn no_offset_is_one_at_which_meshio_puts_an_earlier_array() {
        // Number of offsets that the first level of compression alone would put where meshio has an
        // array.
        let mut met = 0;
        for count in 1..40 {
            for length in 1..60 {
                let lengths = [length, 3 * length, 1, length, 12, 7 * length];
                let file = file(count, &lengths);
                let offset = |line: &str| -> Option<usize> {
                    let (_, rest) = line.split_once("offset=\"")?;
                    rest.split('"').next()?.parse().ok()
                };
                let offsets: Vec<usize> = file.header.lines().filter_map(offset).collect();
                assert_eq!(offsets.len(), lengths.len());
                for (i, at) in offsets.iter().enumerate().skip(1) {
                    assert!(!file.unpacked[..i].contains(at), "{lengths:?} of {count}");
                }
                let mut fast = Vec::new();
                for &length in &lengths {
                    let numbers = (0..length as i32).flat_map(|i| (i * i % count).to_le_bytes());
                    compress(&numbers.collect::<Vec<u8>>(), LEVELS[0], &mut fast);
                    met += usize::from(file.unpacked.contains(&fast.len()));
                }
            }
        }
        assert!(met > 0, "no file that meshio would misread was tried");
    }
}
