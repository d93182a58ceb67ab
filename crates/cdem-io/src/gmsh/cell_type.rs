//! Gmsh's numbers of element types.

use cdem::mesh::{CellKind, ElementKind, MeshError};

use super::scan::Scanner;

/// Returns the kind of cell with Gmsh's type number; `whose` names the element in messages.
///
/// # Errors
/// If the type is not supported; the message tells how to avoid it.
pub(super) fn cell_kind(
    number: i32,
    scanner: &Scanner,
    whose: impl Fn() -> String,
) -> Result<CellKind, MeshError> {
    let kind = match number {
        15 => CellKind::Point,
        1 => CellKind::Line,
        2 => CellKind::Element(ElementKind::Tri3),
        3 => CellKind::Element(ElementKind::Quad4),
        4 => CellKind::Element(ElementKind::Tet4),
        5 => CellKind::Element(ElementKind::Hex8),
        6 => CellKind::Element(ElementKind::Wedge6),
        _ => {
            let (name, help) = unsupported(number);
            let problem = format!("{} is a {name}, which is not supported", whose());
            return Err(scanner.fault(problem, help));
        }
    };
    Ok(kind)
}

/// Returns the name of an unsupported type, and advice.
fn unsupported(number: i32) -> (String, &'static str) {
    let first_order = "make a mesh of first order: Mesh.ElementOrder = 1, or SetOrder 1";
    let name = match number {
        7 => {
            let help =
                "pyramids join hexahedra to tetrahedra: use only hexahedra or only tetrahedra";
            return ("5-node pyramid".to_owned(), help);
        }
        8 => "second-order line",
        9 => "second-order triangle",
        10 | 16 => "second-order quadrilateral",
        11 => "second-order tetrahedron",
        12 | 17 => "second-order hexahedron",
        13 | 18 => "second-order prism",
        14 | 19 => "second-order pyramid",
        _ => {
            let help =
                "use triangles, quadrilaterals, tetrahedra, prisms or hexahedra of first order";
            return (format!("cell of Gmsh's type {number}"), help);
        }
    };
    (name.to_owned(), first_order)
}
