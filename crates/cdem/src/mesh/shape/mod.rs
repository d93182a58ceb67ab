//! Shapes that need no mesh file: boxes and polygons.

pub(crate) mod grid;
pub(crate) mod polygon;

use crate::mesh::{BlockFault, CellKind, ElementKind, RawGroup, RawMesh};
use crate::scene::Geometry;

/// Meshes a shape of a scene, a box or a polygon, in `D` dimensions.
///
/// Groups are called `block.xmin` … for boxes and `block.edge1` … for polygons.
///
/// # Errors
/// [`BlockFault::Shape`] with the key at fault.
pub(super) fn mesh_shape<const D: usize>(
    block: &str,
    geometry: &Geometry,
) -> Result<RawMesh, BlockFault> {
    let (mesh, element) = match geometry {
        Geometry::Box {
            min,
            max,
            divisions,
            element,
        } => {
            require_dimension(*element, D)?;
            (grid::mesh_box::<D>(min, max, divisions, *element), *element)
        }
        Geometry::Polygon {
            corners,
            size,
            element,
        } => {
            require_dimension(*element, D)?;
            (polygon::mesh_polygon(corners, *size, *element), *element)
        }
        Geometry::Mesh { .. } => return Err(fault("mesh", "is a file, not a shape".into())),
    };
    let mut mesh = mesh?;
    mesh.origin = format!("shape of {} elements", element.name());
    for group in &mut mesh.groups {
        group.name = format!("{block}.{}", group.name);
    }
    Ok(mesh)
}

fn require_dimension(element: ElementKind, dimension: usize) -> Result<(), BlockFault> {
    let fits = match dimension {
        2 => "tri3 or quad4",
        _ => "tet4, wedge6 or hex8",
    };
    if element.dimension() == dimension {
        return Ok(());
    }
    let name = element.name();
    Err(fault(
        "element",
        format!("{name} does not fit into {dimension} dimensions; use {fits}"),
    ))
}

fn fault(key: &'static str, problem: String) -> BlockFault {
    BlockFault::Shape { key, problem }
}

/// Returns an empty shape with one group of facets for each side.
fn with_sides(names: impl Iterator<Item = String>, dimension: usize) -> RawMesh {
    let mut mesh = RawMesh::new("shape");
    for (index, name) in names.enumerate() {
        let tag = index as i32 + 1;
        mesh.groups.push(RawGroup {
            dimension: dimension - 1,
            tag,
            name,
        });
        mesh.group_sets.push(vec![index as u32]);
    }
    mesh
}

/// Adds a cell; `side` is the index of the side that the cell is a facet of.
fn push(mesh: &mut RawMesh, kind: CellKind, nodes: &[u32], side: Option<usize>) {
    let cells = mesh.cells_mut(kind);
    cells.tags.push(cells.tags.len() as u64 + 1);
    cells.nodes.extend_from_slice(nodes);
    cells.sets.push(side.map_or(0, |side| side as u32 + 1));
}

/// Returns the kind of boundary cell with this number of nodes.
fn facet_kind(nodes: usize) -> CellKind {
    match nodes {
        2 => CellKind::Line,
        3 => CellKind::Element(ElementKind::Tri3),
        _ => CellKind::Element(ElementKind::Quad4),
    }
}
