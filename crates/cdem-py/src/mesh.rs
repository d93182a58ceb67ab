//! Meshes from arrays.

use std::collections::BTreeMap;

use cdem::mesh::{CellKind, ElementKind, RawGroup, RawMesh};
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;

use crate::errors::Fault;

/// Points, cells and named groups of cells.
#[pyclass(frozen, module = "cdem._engine")]
pub(crate) struct Mesh(pub(crate) RawMesh);

/// Shape of some cells, and their points, flat.
type Cells<'py> = (String, PyReadonlyArray1<'py, i64>);

/// A named group: its name, the dimension of its cells, and their numbers by entry of the cells.
type Group = (String, usize, Vec<(usize, Vec<usize>)>);

#[pymethods]
impl Mesh {
    /// Creates a mesh; `name` is its name in messages.
    #[new]
    fn new(
        name: &str,
        points: PyReadonlyArray1<'_, f64>,
        cells: Vec<Cells<'_>>,
        groups: Vec<Group>,
    ) -> PyResult<Self> {
        let wrong = |problem: String| Fault::Mesh(format!("{name}: {problem}"));
        let mut mesh = RawMesh::new(name);
        let (places, rest) = points.as_slice()?.as_chunks();
        if !rest.is_empty() {
            return Err(wrong("points must be rows of three coordinates".to_owned()).into());
        }
        mesh.points = places.to_vec();
        mesh.point_tags = (0..mesh.points.len() as u64).collect();
        let is_lost = |point: &[f64; 3]| point.iter().any(|x| !x.is_finite());
        if let Some(lost) = mesh.points.iter().position(is_lost) {
            return Err(wrong(format!("the coordinates of point {lost} are not finite")).into());
        }
        let kinds: Vec<CellKind> = cells
            .iter()
            .map(|(kind, _)| {
                kind_of(kind)
                    .ok_or_else(|| wrong(format!("cells of shape \"{kind}\" are not supported")))
            })
            .collect::<Result<_, _>>()?;
        let mut memberships = Vec::new();
        for ((_, nodes), kind) in cells.iter().zip(&kinds) {
            if nodes.len()? % kind.node_count() != 0 {
                let each = kind.node_count();
                return Err(wrong(format!("cells must be rows of {each} points")).into());
            }
            memberships.push(vec![Vec::new(); nodes.len()? / kind.node_count()]);
        }
        join(&mut mesh, groups, &mut memberships).map_err(wrong)?;
        let mut sets = Sets::default();
        for (((_, nodes), kind), members) in cells.iter().zip(&kinds).zip(memberships) {
            let first = mesh
                .cells
                .iter()
                .map(|cells| cells.tags.len())
                .sum::<usize>();
            let into = mesh.cells_mut(*kind);
            for &node in nodes.as_slice()? {
                let point = u32::try_from(node);
                into.nodes.push(point.map_err(|_| {
                    wrong(format!(
                        "a cell has point {node}, but points are counted from 0"
                    ))
                })?);
            }
            into.tags
                .extend((first..first + members.len()).map(|tag| tag as u64));
            into.sets
                .extend(members.into_iter().map(|groups| sets.number(groups)));
        }
        mesh.group_sets.extend(sets.all);
        mesh.check()
            .map_err(|error| Fault::Mesh(error.to_string()))?;
        Ok(Self(mesh))
    }
}

/// Adds the groups to the mesh and records them for their cells.
fn join(
    mesh: &mut RawMesh,
    groups: Vec<Group>,
    memberships: &mut [Vec<Vec<u32>>],
) -> Result<(), String> {
    for (number, (name, dimension, parts)) in (0..).zip(groups) {
        for (entry, members) in parts {
            for member in members {
                let cell = memberships
                    .get_mut(entry)
                    .and_then(|cells| cells.get_mut(member));
                let cell = cell.ok_or_else(|| {
                    format!("group \"{name}\" has cell {member}, which does not exist")
                })?;
                if cell.last() != Some(&number) {
                    cell.push(number);
                }
            }
        }
        mesh.groups.push(RawGroup {
            dimension,
            tag: number as i32 + 1,
            name,
        });
    }
    Ok(())
}

/// Distinct sets of groups; number 0 is the empty set.
#[derive(Default)]
struct Sets {
    all: Vec<Vec<u32>>,
    numbers: BTreeMap<Vec<u32>, u32>,
}

impl Sets {
    fn number(&mut self, groups: Vec<u32>) -> u32 {
        if groups.is_empty() {
            return 0;
        }
        let next = self.all.len() as u32 + 1;
        *self.numbers.entry(groups.clone()).or_insert_with(|| {
            self.all.push(groups);
            next
        })
    }
}

fn kind_of(name: &str) -> Option<CellKind> {
    match name {
        "vertex" => Some(CellKind::Point),
        "line" => Some(CellKind::Line),
        element => {
            let kind = serde_json::from_value(element.into());
            kind.ok().map(CellKind::Element)
        }
    }
}

/// Returns the name of an element shape in scenes.
pub(crate) fn name_of(kind: ElementKind) -> &'static str {
    match kind {
        ElementKind::Tri3 => "tri3",
        ElementKind::Quad4 => "quad4",
        ElementKind::Tet4 => "tet4",
        ElementKind::Wedge6 => "wedge6",
        ElementKind::Hex8 => "hex8",
    }
}
