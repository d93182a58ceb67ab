//! Frames of the whole model (`.vtu`) and of the contact points (`.vtp`).

use std::path::Path;

use cdem::mesh::ElementKind;
use cdem::output::{ContactFrame, FieldValues, Frame, FrameField};

use super::super::error::ResultsError;
use super::xml::{Values, XmlFile};

/// Names of vector components.
const XYZ: [&str; 3] = ["x", "y", "z"];

/// Writes a frame as an unstructured grid (`.vtu`), completely or not at all.
///
/// # Errors
/// If writing fails.
pub fn write_frame(path: &Path, frame: &Frame) -> Result<(), ResultsError> {
    let mut file = XmlFile::new("UnstructuredGrid");
    file.time(frame.time);
    file.open(
        "Piece",
        &[
            ("NumberOfPoints", frame.points.len()),
            ("NumberOfCells", frame.kinds.len()),
        ],
    );
    write_points(&mut file, &frame.points);
    write_cells(&mut file, frame);
    file.open("PointData", &[]);
    write_fields(&mut file, &frame.point_fields);
    file.close();
    file.open("CellData", &[]);
    write_fields(&mut file, &frame.cell_fields);
    file.save(path)
}

/// Writes the contact points as vertices.
pub(in super::super) fn write_contact_frame(
    path: &Path,
    frame: &ContactFrame,
) -> Result<(), ResultsError> {
    let count = frame.points.len();
    let mut file = XmlFile::new("PolyData");
    file.time(frame.time);
    file.open(
        "Piece",
        &[
            ("NumberOfPoints", count),
            ("NumberOfVerts", count),
            ("NumberOfLines", 0),
            ("NumberOfStrips", 0),
            ("NumberOfPolys", 0),
        ],
    );
    write_points(&mut file, &frame.points);
    let numbers: Vec<i64> = (0..).take(count).collect();
    let ends: Vec<i64> = (1..).take(count).collect();
    file.open("Verts", &[]);
    file.array("connectivity", 0, &Values::Index(&numbers));
    file.array("offsets", 0, &Values::Index(&ends));
    file.close();
    file.open("PointData", &[]);
    for (name, vectors) in [("normal", &frame.normals), ("force", &frame.forces)] {
        file.named_array(name, &XYZ, &Values::Real(vectors.as_flattened()));
    }
    file.array("slip", 0, &Values::Real(&frame.slips));
    file.array("area", 0, &Values::Real(&frame.areas));
    file.save(path)
}

fn write_points(file: &mut XmlFile, points: &[[f64; 3]]) {
    file.open("Points", &[]);
    file.array("Points", 3, &Values::Real(points.as_flattened()));
    file.close();
}

fn write_cells(file: &mut XmlFile, frame: &Frame) {
    let mut connectivity = Vec::with_capacity(frame.connectivity.len());
    let mut offsets = Vec::with_capacity(frame.kinds.len());
    let mut points = frame.connectivity.iter().map(|&point| i64::from(point));
    let mut end = 0;
    for &kind in &frame.kinds {
        let start = connectivity.len();
        connectivity.extend(points.by_ref().take(kind.node_count()));
        if kind == ElementKind::Wedge6 {
            // In VTK the triangle 0 1 2 must face outward, in Gmsh inward.
            connectivity.swap(start + 1, start + 2);
            connectivity.swap(start + 4, start + 5);
        }
        end += kind.node_count() as i64;
        offsets.push(end);
    }
    debug_assert_eq!(connectivity.len(), frame.connectivity.len());
    let types: Vec<u8> = frame.kinds.iter().map(|&kind| cell_type(kind)).collect();
    file.open("Cells", &[]);
    file.array("connectivity", 0, &Values::Index(&connectivity));
    file.array("offsets", 0, &Values::Index(&offsets));
    file.array("types", 0, &Values::Byte(&types));
    file.close();
}

fn write_fields(file: &mut XmlFile, fields: &[FrameField]) {
    for field in fields {
        let values = match &field.values {
            FieldValues::Real(values) => Values::Real(values),
            FieldValues::Whole(values) => Values::Whole(values),
        };
        file.named_array(field.name, field.components, &values);
    }
}

/// Returns the kind of cells with this VTK number.
pub(super) fn kind_of_cell(number: u8) -> Option<ElementKind> {
    let kinds = [
        ElementKind::Tri3,
        ElementKind::Quad4,
        ElementKind::Tet4,
        ElementKind::Hex8,
        ElementKind::Wedge6,
    ];
    kinds.into_iter().find(|&kind| cell_type(kind) == number)
}

/// Returns VTK's number of a cell type.
const fn cell_type(kind: ElementKind) -> u8 {
    match kind {
        ElementKind::Tri3 => 5,
        ElementKind::Quad4 => 9,
        ElementKind::Tet4 => 10,
        ElementKind::Hex8 => 12,
        ElementKind::Wedge6 => 13,
    }
}
