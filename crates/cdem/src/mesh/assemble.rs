//! Assembles the blocks of a scene into one mesh.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::mesh::coincident::coincident_nodes;
use crate::mesh::conformity::unjoined;
use crate::mesh::error::FARTHEST;
use crate::mesh::facet::{FacetFault, checked_boundary};
use crate::mesh::member::Members;
use crate::mesh::notes::BlockNotes;
use crate::mesh::order::hilbert_order;
use crate::mesh::placement::Placement;
use crate::mesh::quality::{JacobianSign, orientation, reversed};
use crate::mesh::shape::mesh_shape;
use crate::mesh::source::MeshSource;
use crate::mesh::split::parts;
use crate::mesh::vector::{bounds, centre, distance};
use crate::mesh::{BlockFault, Element, Mesh, MeshBlock, MeshError, RawMesh};
use crate::scene::{self, Geometry, Scene, Split};

/// An element with its number and groups in the file.
#[derive(Clone, Copy, Debug)]
pub(super) struct SourceCell {
    pub(super) element: Element,
    /// The file's number of the element.
    pub(super) tag: u64,
    /// Its group set.
    pub(super) set: u32,
}

/// Number of elements for one thread at a time.
const ELEMENTS_AT_ONCE: usize = 1024;

/// Blocks up to this number of elements keep the order of the file: reordering gains nothing.
const TINY: usize = 64;

/// Largest spacing of floating-point numbers, over the extent of an element: a tenth of the
/// tolerance within which blocks touch by default.
const BLURRED: f64 = 1e-5;

/// Largest number of nodes, and of elements: `u32::MAX` stands for none.
const LIMIT: u32 = u32::MAX - 1;

/// Builds, places and checks the mesh of all blocks of a scene.
///
/// `load` reads a mesh file, once for each path. Elements numbered in reverse are corrected; larger
/// blocks are renumbered along a Hilbert curve. The result depends only on the scene and the files.
///
/// # Errors
/// The error of `load`, or the first error in a block's mesh.
pub fn assemble<const D: usize>(
    scene: &Scene,
    load: &mut dyn FnMut(&Path) -> Result<RawMesh, MeshError>,
) -> Result<Mesh<D>, MeshError> {
    let mut mesh = Mesh::default();
    let mut sources = Sources::default();
    let mut members = Members::default();
    let mut notes = BlockNotes::default();
    let names: BTreeSet<&str> = scene
        .block
        .iter()
        .map(|block| block.name.as_str())
        .collect();
    for (index, block) in scene.block.iter().enumerate() {
        let number = sources.find::<D>(block, load, &mut mesh.notes)?;
        let source = &sources.list[number];
        let wrong = |fault: BlockFault| fault.of(&block.name, &source.raw.origin);
        let mut body = PlacedMesh::<D>::new(block, source).map_err(wrong)?;
        if body.turned > 0 {
            notes.turned(&block.name, [body.turned, body.cells.len()]);
        }
        let ranges = parts(block.split, &mut body.cells, body.nodes.len());
        let mut numbering = Numbering::new(body.nodes.len());
        for (part, range) in ranges.into_iter().enumerate() {
            let name = part_name(block, part, &names).map_err(wrong)?;
            let part = body.part(range, &mut numbering).map_err(wrong)?;
            members.add(number, source, &part, &mesh);
            notes.coincident(&name, &part.coincident);
            notes.unjoined(&name, &part.unjoined);
            push(&mut mesh, part, name, index).map_err(wrong)?;
        }
    }
    mesh.groups = members.finish(&sources.list);
    mesh.notes.extend(notes.finish(D));
    mesh.nodes.shrink_to_fit();
    mesh.elements.shrink_to_fit();
    Ok(mesh)
}

fn part_name(
    block: &scene::Block,
    part: usize,
    taken: &BTreeSet<&str>,
) -> Result<String, BlockFault> {
    if block.split == Split::None {
        return Ok(block.name.clone());
    }
    let name = format!("{}.{}", block.name, part + 1);
    if taken.contains(name.as_str()) {
        return Err(BlockFault::NameTaken { name });
    }
    Ok(name)
}

/// Adds a part to the mesh as a block.
fn push<const D: usize>(
    mesh: &mut Mesh<D>,
    part: BlockPart<D>,
    name: String,
    source: usize,
) -> Result<(), BlockFault> {
    let [first_node, first_element] = [mesh.nodes.len(), mesh.elements.len()];
    let ends = [
        first_node + part.nodes.len(),
        first_element + part.elements.len(),
    ];
    if ends.iter().any(|&end| end > LIMIT as usize) {
        return Err(BlockFault::TooLarge { limit: LIMIT });
    }
    for mut element in part.elements {
        for node in &mut element.nodes[..element.kind.node_count()] {
            *node += first_node as u32;
        }
        mesh.elements.push(element);
    }
    mesh.nodes.extend(part.nodes);
    mesh.blocks.push(MeshBlock {
        name,
        source,
        nodes: first_node as u32..ends[0] as u32,
        elements: first_element as u32..ends[1] as u32,
    });
    Ok(())
}

/// Meshes of files, each read once, and of shapes.
#[derive(Default)]
struct Sources {
    list: Vec<MeshSource>,
    by_path: BTreeMap<PathBuf, usize>,
}

impl Sources {
    /// Returns the index of the mesh of a block.
    fn find<const D: usize>(
        &mut self,
        block: &scene::Block,
        load: &mut dyn FnMut(&Path) -> Result<RawMesh, MeshError>,
        notes: &mut Vec<String>,
    ) -> Result<usize, MeshError> {
        let raw = match &block.geometry {
            Geometry::Mesh { path, .. } => match self.by_path.get(path) {
                Some(&known) => return Ok(known),
                None => {
                    self.by_path.insert(path.clone(), self.list.len());
                    load(path)?
                }
            },
            shape => mesh_shape::<D>(&block.name, shape).map_err(|f| f.of(&block.name, "shape"))?,
        };
        let source = MeshSource::new(raw, D)?;
        let unused = source.unused_points();
        if let Some(first) = unused.first() {
            let (mesh, count) = (&source.raw.origin, unused.len());
            notes.push(format!(
                "{mesh}: number of nodes that are left out because no {D}-D element has them: \
                 {count}; the first is node {first}"
            ));
        }
        self.list.push(source);
        Ok(self.list.len() - 1)
    }
}

/// A block's mesh after placement, before it is split.
struct PlacedMesh<const D: usize> {
    /// Rest positions, m.
    nodes: Vec<[f64; D]>,
    /// Index of each node in the points of the source.
    points: Vec<u32>,
    /// Elements on `nodes`.
    cells: Vec<SourceCell>,
    /// Number of elements that were numbered in reverse.
    turned: usize,
}

impl<const D: usize> PlacedMesh<D> {
    fn new(block: &scene::Block, source: &MeshSource) -> Result<Self, BlockFault> {
        let group = match &block.geometry {
            Geometry::Mesh { group, .. } => group.as_deref(),
            Geometry::Box { .. } | Geometry::Polygon { .. } => None,
        };
        let mut cells = source.select(group, D)?;
        let points = Numbering::new(source.raw.points.len()).ascending(&mut cells);
        let tag = |node: usize| source.raw.point_tags[points[node] as usize];
        let place_of = |&point: &u32| source.raw.points[point as usize];
        if D == 2 {
            let raw: Vec<_> = points.iter().map(place_of).collect();
            check_plane(&raw, tag)?;
        }
        let placement = Placement::new(block);
        let place = |point: &u32| placement.apply::<D>(place_of(point));
        let nodes: Vec<_> = points.iter().map(place).collect();
        for (node, at) in nodes.iter().enumerate() {
            if !at.iter().all(|x| x.abs() <= FARTHEST) {
                return Err(BlockFault::NotFinite {
                    node: tag(node),
                    at: at.to_vec(),
                });
            }
        }
        let check = |cells: &mut [SourceCell]| -> Result<usize, BlockFault> {
            cells.iter_mut().try_fold(0, |turned, cell| {
                refuse_repeated(cell, &nodes, &tag)?;
                let places = corners(&cell.element, &nodes);
                refuse_blurred(cell, &places)?;
                Ok(turned + usize::from(orient(cell, &places)?))
            })
        };
        // The first fault is reported, whichever thread finds one first.
        let checked: Vec<_> = cells.par_chunks_mut(ELEMENTS_AT_ONCE).map(check).collect();
        let turned = checked.into_iter().sum::<Result<usize, BlockFault>>()?;
        Ok(Self {
            nodes,
            points,
            cells,
            turned,
        })
    }

    /// Returns a part of the mesh with its own numbers, checked.
    fn part(
        &mut self,
        cells: std::ops::Range<usize>,
        numbering: &mut Numbering,
    ) -> Result<BlockPart<D>, BlockFault> {
        let cells = &mut self.cells[cells];
        let at = |cell: &SourceCell| centre(corners(&cell.element, &self.nodes).into_iter());
        let used = if cells.len() > TINY {
            let centres: Vec<_> = cells
                .par_iter()
                .with_min_len(ELEMENTS_AT_ONCE)
                .map(at)
                .collect();
            let order = hilbert_order(&centres);
            let sorted: Vec<_> = order.into_iter().map(|i| cells[i as usize]).collect();
            cells.copy_from_slice(&sorted);
            numbering.by_first_use(cells)
        } else {
            numbering.ascending(cells)
        };
        let nodes: Vec<_> = used.iter().map(|&n| self.nodes[n as usize]).collect();
        let elements: Vec<_> = cells.iter().map(|cell| cell.element).collect();
        let boundary = checked_boundary(&elements).map_err(|f| misfit(f, cells, &nodes))?;
        Ok(BlockPart {
            coincident: coincident_nodes(&nodes, &elements, &boundary),
            unjoined: unjoined(&nodes, &elements, &boundary),
            points: used.iter().map(|&n| self.points[n as usize]).collect(),
            sets: cells.iter().map(|cell| cell.set).collect(),
            nodes,
            elements,
            boundary,
        })
    }
}

/// A part that becomes a block; its numbers count from 0.
pub(super) struct BlockPart<const D: usize> {
    pub(super) nodes: Vec<[f64; D]>,
    /// Index of each node in the points of the source.
    pub(super) points: Vec<u32>,
    pub(super) elements: Vec<Element>,
    /// Group set of each element.
    pub(super) sets: Vec<u32>,
    pub(super) boundary: Vec<crate::mesh::Facet>,
    /// Places where two nodes of the boundary coincide.
    coincident: Vec<[f64; D]>,
    /// Places where elements touch without being joined.
    unjoined: Vec<[f64; D]>,
}

fn corners<const D: usize>(element: &Element, nodes: &[[f64; D]]) -> Vec<[f64; D]> {
    element.nodes().iter().map(|&n| nodes[n as usize]).collect()
}

/// Refuses an element that uses a node twice.
fn refuse_repeated<const D: usize>(
    cell: &SourceCell,
    nodes: &[[f64; D]],
    tag: &impl Fn(usize) -> u64,
) -> Result<(), BlockFault> {
    let own = cell.element.nodes();
    let repeated = (1..own.len()).find(|&i| own[..i].contains(&own[i]));
    repeated.map_or(Ok(()), |i| {
        Err(BlockFault::Repeated {
            kind: cell.element.kind.name(),
            element: cell.tag,
            node: tag(own[i] as usize),
            at: centre(corners(&cell.element, nodes).into_iter()).to_vec(),
        })
    })
}

/// Refuses an element whose size is not well above the spacing of floating-point numbers at its
/// position.
fn refuse_blurred<const D: usize>(
    cell: &SourceCell,
    places: &[[f64; D]],
) -> Result<(), BlockFault> {
    let (low, high) = bounds(places.iter().copied());
    let farthest = places
        .iter()
        .flatten()
        .fold(0.0_f64, |far, x| far.max(x.abs()));
    let (size, spacing) = (distance(low, high), f64::EPSILON * farthest);
    // If all nodes are at one place, the orientation check reports it.
    if spacing <= BLURRED * size || size == 0.0 {
        return Ok(());
    }
    Err(BlockFault::Blurred {
        kind: cell.element.kind.name(),
        element: cell.tag,
        at: centre(places.iter().copied()).to_vec(),
        size,
        spacing,
    })
}

/// Renumbers the cell's nodes so that its Jacobian is positive; returns true if this was necessary.
fn orient<const D: usize>(cell: &mut SourceCell, places: &[[f64; D]]) -> Result<bool, BlockFault> {
    let kind = cell.element.kind;
    let at = || centre(places.iter().copied()).to_vec();
    let (kind_name, element) = (kind.name(), cell.tag);
    match orientation(kind, places) {
        JacobianSign::Positive => Ok(false),
        JacobianSign::Reversed => {
            cell.element = reversed(cell.element);
            Ok(true)
        }
        JacobianSign::Collapsed => Err(BlockFault::Collapsed {
            kind: kind_name,
            element,
            at: at(),
        }),
        JacobianSign::Flat => Err(BlockFault::Flat {
            kind: kind_name,
            element,
            at: at(),
            dimension: D,
        }),
        JacobianSign::Folded { negative, points } => Err(BlockFault::Folded {
            kind: kind_name,
            element,
            at: at(),
            negative,
            points,
        }),
    }
}

/// Checks that all z are equal up to rounding, in 2-D.
pub(super) fn check_plane(
    points: &[[f64; 3]],
    tag: impl Fn(usize) -> u64,
) -> Result<(), BlockFault> {
    let plane = points.first().map_or(0.0, |point| point[2]);
    let size = points
        .iter()
        .flatten()
        .fold(0.0_f64, |size, x| size.max(x.abs()));
    // Coordinates in text files have 16 digits; those of meshers that rotate have somewhat fewer.
    let rounding = 1e-9 * size;
    let out = points
        .iter()
        .position(|point| (point[2] - plane).abs() > rounding);
    match out {
        None => Ok(()),
        Some(index) => Err(BlockFault::NotPlanar {
            node: tag(index),
            z: points[index][2],
            plane,
        }),
    }
}

/// Returns the error for elements of the file that do not fit together.
fn misfit<const D: usize>(
    fault: FacetFault,
    cells: &[SourceCell],
    nodes: &[[f64; D]],
) -> BlockFault {
    let tag = |index: u32| cells[index as usize].tag;
    match fault {
        FacetFault::Duplicate(a, b) => {
            let places = corners(&cells[a as usize].element, nodes);
            let (first, second) = (tag(a).min(tag(b)), tag(a).max(tag(b)));
            BlockFault::Duplicate {
                first,
                second,
                at: centre(places.into_iter()).to_vec(),
            }
        }
        FacetFault::Overlapping(elements, facet) => {
            let element = &cells[facet.element as usize].element;
            let local = element.kind.facets()[facet.local as usize].iter();
            let places = local.map(|&c| nodes[element.nodes[c as usize] as usize]);
            let mut elements: Vec<_> = elements.into_iter().map(tag).collect();
            elements.sort_unstable();
            BlockFault::Overlapping {
                elements,
                at: centre(places).to_vec(),
            }
        }
    }
}

/// New node numbers for some cells, counting from 0.
struct Numbering {
    /// New number by old number; `u32::MAX` between calls.
    new: Vec<u32>,
}

impl Numbering {
    fn new(node_count: usize) -> Self {
        Self {
            new: vec![u32::MAX; node_count],
        }
    }

    /// Numbers nodes in order of first use by the cells; returns the old numbers.
    fn by_first_use(&mut self, cells: &mut [SourceCell]) -> Vec<u32> {
        let old = self.used(cells);
        self.renumber(cells, old)
    }

    /// Numbers nodes in their old order; returns the old numbers.
    fn ascending(&mut self, cells: &mut [SourceCell]) -> Vec<u32> {
        let mut old = self.used(cells);
        old.sort_unstable();
        self.renumber(cells, old)
    }

    fn used(&mut self, cells: &[SourceCell]) -> Vec<u32> {
        let mut old = Vec::new();
        for &node in cells.iter().flat_map(|cell| cell.element.nodes()) {
            if self.new[node as usize] == u32::MAX {
                self.new[node as usize] = 0;
                old.push(node);
            }
        }
        old
    }

    fn renumber(&mut self, cells: &mut [SourceCell], old: Vec<u32>) -> Vec<u32> {
        (0..)
            .zip(&old)
            .for_each(|(new, &node)| self.new[node as usize] = new);
        for cell in cells {
            let kind = cell.element.kind;
            for node in &mut cell.element.nodes[..kind.node_count()] {
                *node = self.new[*node as usize];
            }
        }
        old.iter()
            .for_each(|&node| self.new[node as usize] = u32::MAX);
        old
    }
}
