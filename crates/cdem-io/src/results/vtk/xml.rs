//! VTK's XML container: small header, arrays appended as raw zlib blocks.
//!
//! Own writer, because the arrays are compressed in parallel and written
//! without the third that base64 adds. Source: VTK File Formats, "XML File
//! Formats", section on appended data and compression.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use flate2::{Compression, write::ZlibEncoder};
use rayon::prelude::*;

use super::super::error::ResultsError;
use super::super::file::write_whole;

/// Uncompressed bytes of a compression block: large enough to compress well,
/// small enough to keep all threads busy.
const BLOCK: usize = 1 << 17;

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

/// A file under construction.
pub(super) struct XmlFile {
    dataset: &'static str,
    header: String,
    appended: Vec<u8>,
    open: Vec<&'static str>,
}

impl XmlFile {
    /// Starts a file of a data set type, e.g. `UnstructuredGrid`.
    pub(super) fn new(dataset: &'static str) -> Self {
        let mut file = Self {
            dataset,
            header: String::new(),
            appended: Vec::new(),
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
        self.named_array(name, components, &[], values);
    }

    /// The time of a frame, where VTK's readers look for it.
    pub(super) fn time(&mut self, time: f64) {
        self.open("FieldData", &[]);
        self.data_array("TimeValue", 0, &[], Some(1), &Values::Real(&[time]));
        self.close();
    }

    /// Adds an array whose components have names.
    pub(super) fn named_array(
        &mut self,
        name: &str,
        components: usize,
        component_names: &[&str],
        values: &Values<'_>,
    ) {
        self.data_array(name, components, component_names, None, values);
    }

    fn data_array(
        &mut self,
        name: &str,
        components: usize,
        component_names: &[&str],
        tuples: Option<usize>,
        values: &Values<'_>,
    ) {
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
        compress(&values.to_bytes(), &mut self.appended);
    }

    fn attribute(&mut self, name: &str, value: impl std::fmt::Display) {
        write!(self.header, " {name}=\"{value}\"").expect("writing to a string cannot fail");
    }

    /// Writes the file, whole or not at all.
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
                 compressor=\"vtkZLibDataCompressor\">\n{header}\
                 <AppendedData encoding=\"raw\">\n_"
            )?;
            out.write_all(&appended)?;
            out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
        })
    }
}

/// Appends `bytes` as VTK's compressed array: number of blocks, block size,
/// size of the last block if it is not full, compressed sizes, blocks.
fn compress(bytes: &[u8], out: &mut Vec<u8>) {
    let blocks: Vec<Vec<u8>> = bytes.par_chunks(BLOCK).map(compress_block).collect();
    let mut header = vec![blocks.len(), BLOCK, bytes.len() % BLOCK];
    header.extend(blocks.iter().map(Vec::len));
    for word in header {
        out.extend_from_slice(&(word as u64).to_le_bytes());
    }
    for block in blocks {
        out.extend_from_slice(&block);
    }
}

fn compress_block(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    encoder
        .write_all(bytes)
        .and_then(|()| encoder.finish())
        .expect("compression into memory cannot fail")
}
