//! A raw mesh, indexed so that blocks can be cut out of it.

use std::collections::BTreeMap;

use crate::mesh::assemble::{SourceCell, check_plane};
use crate::mesh::error::nearest;
use crate::mesh::facet::sorted;
use crate::mesh::{BlockFault, CellKind, Element, MeshError, PresentCells, RawMesh};

/// A raw mesh with its cells and groups sorted for look-up.
pub(super) struct MeshSource {
    pub(super) raw: RawMesh,
    /// Cells of full dimension by group set, in the order of the file.
    cells: Vec<Vec<SourceCell>>,
    /// Sorted nodes and group set of every facet that is in a group, sorted.
    facets: Vec<([u32; 4], u32)>,
    /// Points with their groups of lower dimension than facets, sorted.
    points: Vec<(u32, u32)>,
    /// Edges of curves in 3-D, lower point first, and their groups, sorted.
    edges: Vec<([u32; 2], u32)>,
    /// True for points of a facet in a group: a quick rejection.
    on_facet: Vec<bool>,
}

impl MeshSource {
    /// Indexes a mesh for blocks of `dimension`.
    ///
    /// # Errors
    /// If the mesh is inconsistent.
    pub(super) fn new(raw: RawMesh, dimension: usize) -> Result<Self, MeshError> {
        raw.check()?;
        let mut source = Self {
            cells: vec![Vec::new(); raw.group_sets.len()],
            facets: Vec::new(),
            points: Vec::new(),
            edges: Vec::new(),
            on_facet: vec![false; raw.points.len()],
            raw: RawMesh::default(),
        };
        for cells in &raw.cells {
            let nodes = cells.nodes.chunks_exact(cells.kind.node_count());
            for ((nodes, &tag), &set) in nodes.zip(&cells.tags).zip(&cells.sets) {
                match (cells.kind, cells.kind.dimension()) {
                    (CellKind::Element(kind), d) if d == dimension => {
                        let element = Element::new(kind, nodes);
                        source.cells[set as usize].push(SourceCell { element, tag, set });
                    }
                    _ if set == 0 => {}
                    (_, d) if d + 1 == dimension => {
                        source.facets.push((sorted(nodes.iter().copied()), set));
                        nodes
                            .iter()
                            .for_each(|&n| source.on_facet[n as usize] = true);
                    }
                    (_, d) if d + 1 < dimension => {
                        let groups = &raw.group_sets[set as usize];
                        let of_node = |&n| groups.iter().map(move |&group| (n, group));
                        source.points.extend(nodes.iter().flat_map(of_node));
                        if let &[a, b] = nodes {
                            let edge = [a.min(b), a.max(b)];
                            source
                                .edges
                                .extend(groups.iter().map(|&group| (edge, group)));
                        }
                    }
                    _ => {}
                }
            }
        }
        source.facets.sort_unstable();
        source.facets.dedup();
        source.points.sort_unstable();
        source.points.dedup();
        source.edges.sort_unstable();
        source.edges.dedup();
        source.raw = raw;
        Ok(source)
    }

    /// Returns the cells of a physical group, or all cells.
    ///
    /// # Errors
    /// If there is no such group, or if it is empty.
    pub(super) fn select(
        &self,
        group: Option<&str>,
        dimension: usize,
    ) -> Result<Vec<SourceCell>, BlockFault> {
        let wanted = group
            .map(|name| self.groups_named(name, dimension))
            .transpose()?;
        let chosen = |set: &[u32]| match &wanted {
            None => true,
            Some(wanted) => set.iter().any(|group| wanted.contains(group)),
        };
        let sets = self.cells.iter().zip(&self.raw.group_sets);
        let lists = sets
            .filter(|(_, set)| chosen(set))
            .map(|(cells, _)| cells.as_slice());
        let mut cells = lists.collect::<Vec<_>>().concat();
        if !cells.is_empty() {
            cells.sort_by_key(|cell| cell.tag);
            return Ok(cells);
        }
        let what = match group {
            None => "the mesh".to_owned(),
            Some(name) => format!("physical group \"{name}\""),
        };
        Err(BlockFault::Empty {
            what,
            dimension,
            present: self.present(dimension),
        })
    }

    /// Returns the elements of the file, for a block that finds none of this dimension.
    fn present(&self, dimension: usize) -> PresentCells {
        let count: usize = self.cells.iter().map(Vec::len).sum();
        if count > 0 {
            // The first set is that of no group.
            let without = self.cells[0].len() == count;
            return if without {
                PresentCells::WithoutGroups(count)
            } else {
                PresentCells::InOtherGroups(count)
            };
        }
        let dimensions = self.raw.cells.iter().map(|cells| cells.kind.dimension());
        match dimensions.max() {
            None => PresentCells::Nothing,
            Some(0 | 1) => PresentCells::PointsOrLines,
            Some(2) if check_plane(&self.raw.points, |_| 0).is_err() => {
                PresentCells::SurfaceInSpace
            }
            Some(other) if other == dimension => PresentCells::Nothing,
            Some(other) => PresentCells::OfDimension(other),
        }
    }

    /// Returns the indices of the groups of cells called `name`.
    fn groups_named(&self, name: &str, dimension: usize) -> Result<Vec<u32>, BlockFault> {
        let all = || (0_u32..).zip(&self.raw.groups);
        let named = all().filter(|(_, group)| group.name == name);
        let (fitting, other): (Vec<_>, Vec<_>) =
            named.partition(|(_, group)| group.dimension == dimension);
        match (fitting.as_slice(), other.first()) {
            ([], Some((_, other))) => Err(BlockFault::GroupDimension {
                group: name.to_owned(),
                found: extent_name(other.dimension),
                expected: extent_name(dimension),
            }),
            ([], None) => {
                let of_cells = all().filter(|(_, group)| group.dimension == dimension);
                let mut known: Vec<_> = of_cells.map(|(_, group)| group.name.clone()).collect();
                known.sort_unstable();
                known.dedup();
                Err(BlockFault::UnknownGroup {
                    group: name.to_owned(),
                    cells: extent_name(dimension),
                    nearest: nearest(name, known.iter().map(String::as_str)),
                    known,
                })
            }
            _ => Ok(fitting.into_iter().map(|(index, _)| index).collect()),
        }
    }

    /// Returns the groups of the facet on these points.
    pub(super) fn facet_groups<'a>(
        &'a self,
        nodes: impl Iterator<Item = u32> + Clone,
    ) -> impl Iterator<Item = u32> + 'a {
        let listed = nodes.clone().all(|node| self.on_facet[node as usize]);
        let key = sorted(nodes);
        let start = match listed {
            true => self.facets.partition_point(|(other, _)| *other < key),
            false => self.facets.len(),
        };
        let same = self.facets[start..]
            .iter()
            .take_while(move |(other, _)| *other == key);
        same.flat_map(|&(_, set)| self.raw.group_sets[set as usize].iter().copied())
    }

    /// Returns the groups of points, and in 3-D of curves, that contain a point.
    pub(super) fn point_groups(&self, point: u32) -> impl Iterator<Item = u32> {
        let start = self.points.partition_point(|&(other, _)| other < point);
        let same = self.points[start..]
            .iter()
            .take_while(move |(other, _)| *other == point);
        same.map(|&(_, group)| group)
    }

    /// True if groups of curves in 3-D have edges.
    pub(super) fn has_curves(&self) -> bool {
        !self.edges.is_empty()
    }

    /// Returns the edges of curves in 3-D from a point to one with a higher number, as (other
    /// point, group).
    pub(super) fn curves_from(&self, point: u32) -> impl Iterator<Item = (u32, u32)> {
        let start = self.edges.partition_point(|&([a, _], _)| a < point);
        let same = self.edges[start..]
            .iter()
            .take_while(move |&&([a, _], _)| a == point);
        same.map(|&([_, b], group)| (b, group))
    }

    /// Returns the file's numbers of points that no element uses.
    pub(super) fn unused_points(&self) -> Vec<u64> {
        let mut unused = vec![true; self.raw.points.len()];
        for cell in self.cells.iter().flatten() {
            cell.element
                .nodes()
                .iter()
                .for_each(|&n| unused[n as usize] = false);
        }
        let tags = self.raw.point_tags.iter().zip(unused);
        tags.filter(|&(_, unused)| unused)
            .map(|(&tag, _)| tag)
            .collect()
    }

    /// Returns the raw groups by name and dimension; those with equal name and dimension form one
    /// group.
    pub(super) fn group_names(&self) -> BTreeMap<(&str, usize), Vec<u32>> {
        let mut names: BTreeMap<_, Vec<u32>> = BTreeMap::new();
        for (index, group) in (0..).zip(&self.raw.groups) {
            names
                .entry((group.name.as_str(), group.dimension))
                .or_default()
                .push(index);
        }
        names
    }
}

/// Returns the word for the parts of a physical group of this dimension.
pub(super) fn extent_name(dimension: usize) -> &'static str {
    match dimension {
        0 => "points",
        1 => "curves",
        2 => "surfaces",
        _ => "volumes",
    }
}
