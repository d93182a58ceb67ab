//! Collects nodes, cells and groups into a raw mesh.

use std::collections::{BTreeMap, BTreeSet};

use cdem::mesh::{CellKind, MeshError, RawGroup, RawMesh};

use super::scan::{DAMAGED, Scanner};

/// A raw mesh under construction.
pub(super) struct Collector {
    mesh: RawMesh,
    nodes: NodeNumbers,
    groups: BTreeMap<(usize, i32), u32>,
    /// Groups that have a name.
    named: BTreeSet<usize>,
    sets: BTreeMap<Vec<u32>, u32>,
    /// Sets of one group, for files that give each element one group.
    single: BTreeMap<(usize, i32), u32>,
}

impl Collector {
    pub(super) fn new(origin: &str) -> Self {
        Self {
            mesh: RawMesh::new(origin),
            nodes: NodeNumbers::Unknown,
            groups: BTreeMap::new(),
            named: BTreeSet::new(),
            sets: BTreeMap::from([(Vec::new(), 0)]),
            single: BTreeMap::new(),
        }
    }

    /// True if nodes have been read.
    pub(super) fn has_nodes(&self) -> bool {
        !matches!(self.nodes, NodeNumbers::Unknown)
    }

    /// Sets the nodes: numbers and coordinates, equally many.
    pub(super) fn set_nodes(
        &mut self,
        scanner: &Scanner,
        tags: Vec<u64>,
        points: Vec<[f64; 3]>,
    ) -> Result<(), MeshError> {
        if tags.len() >= u32::MAX as usize {
            let problem = format!(
                "{} nodes are more than 32-bit numbers can count",
                tags.len()
            );
            return Err(scanner.fault(problem, "use a coarser mesh"));
        }
        self.nodes = NodeNumbers::new(&tags).map_err(|tag| {
            let of_tag = tags.iter().zip(1_u32..).filter(|(other, _)| **other == tag);
            let places: Vec<_> = of_tag.take(2).map(|(_, place)| place.to_string()).collect();
            let problem = format!(
                "two nodes have the number {tag}: nodes {} of the section",
                places.join(" and ")
            );
            scanner.section_fault(problem, "renumber the nodes: Gmsh, RenumberMeshNodes")
        })?;
        self.mesh.point_tags = tags;
        self.mesh.points = points;
        Ok(())
    }

    /// Names a physical group; with an empty name the group keeps its number as name.
    ///
    /// # Errors
    /// If it already has another name.
    pub(super) fn name_group(
        &mut self,
        scanner: &Scanner,
        dimension: usize,
        tag: i32,
        name: &str,
    ) -> Result<(), MeshError> {
        let group = self.group(dimension, tag) as usize;
        if !self.named.insert(group) && self.mesh.groups[group].name != name {
            let problem = format!(
                "group {tag} of dimension {dimension} has two names, \"{}\" and \"{name}\"",
                self.mesh.groups[group].name
            );
            return Err(scanner.fault(problem, "leave one of them out"));
        }
        if !name.is_empty() {
            name.clone_into(&mut self.mesh.groups[group].name);
        }
        Ok(())
    }

    fn group(&mut self, dimension: usize, tag: i32) -> u32 {
        let groups = &mut self.mesh.groups;
        *self.groups.entry((dimension, tag)).or_insert_with(|| {
            groups.push(RawGroup {
                dimension,
                tag,
                name: tag.to_string(),
            });
            groups.len() as u32 - 1
        })
    }

    /// Returns the set of the physical groups with these numbers. A negative number means the same
    /// group with reversed cells.
    pub(super) fn group_set(&mut self, dimension: usize, tags: &[i32]) -> u32 {
        let tags = tags.iter().filter_map(|tag| tag.checked_abs());
        let groups = tags.map(|tag| self.group(dimension, tag)).collect();
        self.set_of(groups)
    }

    /// Returns the set of one physical group; 0 means no group.
    pub(super) fn single_set(&mut self, dimension: usize, tag: i32) -> u32 {
        if tag == 0 {
            return 0;
        }
        if let Some(&known) = self.single.get(&(dimension, tag)) {
            return known;
        }
        let set = self.group_set(dimension, &[tag]);
        self.single.insert((dimension, tag), set);
        set
    }

    fn set_of(&mut self, mut groups: Vec<u32>) -> u32 {
        groups.sort_unstable();
        groups.dedup();
        let sets = &mut self.mesh.group_sets;
        *self.sets.entry(groups).or_insert_with_key(|groups| {
            sets.push(groups.clone());
            sets.len() as u32 - 1
        })
    }

    /// Reserves memory for cells; the caller has checked their number.
    pub(super) fn reserve(&mut self, kind: CellKind, count: usize) {
        let cells = self.mesh.cells_mut(kind);
        cells.nodes.reserve(count * kind.node_count());
        cells.tags.reserve(count);
        cells.sets.reserve(count);
    }

    /// Reads the nodes of one cell with `next`, and adds the cell.
    pub(super) fn read_cell<'a>(
        &mut self,
        kind: CellKind,
        tag: u64,
        set: u32,
        scanner: &mut Scanner<'a>,
        next: impl Fn(&mut Scanner<'a>) -> Result<u64, MeshError>,
    ) -> Result<(), MeshError> {
        let cells = self.mesh.cells_mut(kind);
        for _ in 0..kind.node_count() {
            let node = next(scanner)?;
            let Some(index) = self.nodes.index(node) else {
                let problem = format!("element {tag} has the node {node}, which does not exist");
                let help = match node {
                    0 => "node numbers start at 1, not at 0: renumber the nodes",
                    _ => DAMAGED,
                };
                return Err(scanner.fault(problem, help));
            };
            cells.nodes.push(index);
        }
        cells.tags.push(tag);
        cells.sets.push(set);
        Ok(())
    }

    /// Merges cells that a file lists once for each of their groups.
    pub(super) fn merge_repeated_cells(&mut self) {
        for kind in 0..self.mesh.cells.len() {
            let cells = &self.mesh.cells[kind];
            let count = cells.kind.node_count();
            if cells.sets.windows(2).all(|pair| pair[0] == pair[1]) {
                continue;
            }
            let sorted = |nodes: &[u32]| {
                let mut key = [u32::MAX; 8];
                key[..count].copy_from_slice(nodes);
                key.sort_unstable();
                key
            };
            let mut keyed: Vec<_> = cells
                .nodes
                .chunks_exact(count)
                .map(sorted)
                .zip(0..)
                .collect();
            keyed.sort_unstable();
            let same = keyed.chunk_by(|(a, _), (b, _)| a == b);
            let repeated: Vec<Vec<usize>> = same
                .filter(|chunk| chunk.len() > 1)
                .map(|chunk| chunk.iter().map(|&(_, index)| index).collect())
                .collect();
            let mut gone = vec![false; cells.tags.len()];
            for indices in repeated {
                self.merge(kind, &indices, &mut gone);
            }
            self.remove(kind, &gone);
        }
    }

    /// Gives the first of some cells on the same nodes the groups of the others. A cell that adds
    /// no new group is a true duplicate; it stays, and is refused where the mesh is used.
    fn merge(&mut self, kind: usize, indices: &[usize], gone: &mut [bool]) {
        let set = |mesh: &RawMesh, index: usize| {
            mesh.group_sets[mesh.cells[kind].sets[index] as usize].clone()
        };
        let mut groups = set(&self.mesh, indices[0]);
        for &index in &indices[1..] {
            let more = set(&self.mesh, index);
            if !more.is_empty() && more.iter().all(|group| !groups.contains(group)) {
                groups.extend(more);
                gone[index] = true;
            }
        }
        self.mesh.cells[kind].sets[indices[0]] = self.set_of(groups);
    }

    fn remove(&mut self, kind: usize, gone: &[bool]) {
        let cells = &mut self.mesh.cells[kind];
        let count = cells.kind.node_count();
        let kept = || gone.iter().map(|gone| !gone);
        let mut per_cell = kept();
        cells.tags.retain(|_| per_cell.next().unwrap_or(true));
        let mut per_cell = kept();
        cells.sets.retain(|_| per_cell.next().unwrap_or(true));
        let mut per_node = kept().flat_map(|kept| std::iter::repeat_n(kept, count));
        cells.nodes.retain(|_| per_node.next().unwrap_or(true));
    }

    /// Refuses a number that two elements of one dimension share. Elements listed once for each
    /// group have been merged before.
    pub(super) fn check_numbers(&self, scanner: &Scanner) -> Result<(), MeshError> {
        for dimension in 0..=3 {
            let alike = self.mesh.cells.iter();
            let alike = alike.filter(|cells| cells.kind.dimension() == dimension);
            let mut tags: Vec<u64> = alike.flat_map(|cells| cells.tags.clone()).collect();
            tags.sort_unstable();
            if let Some(pair) = tags.windows(2).find(|pair| pair[0] == pair[1]) {
                let help = "remove one of them if it is a copy, or renumber the elements: Gmsh, \
                            RenumberMeshElements";
                let problem = format!("two elements have the number {}", pair[0]);
                return Err(scanner.section_fault(problem, help));
            }
        }
        Ok(())
    }

    pub(super) fn finish(self) -> RawMesh {
        self.mesh
    }
}

/// Map from the file's node numbers to indices.
enum NodeNumbers {
    Unknown,
    /// Index by number; `u32::MAX` if there is no such node.
    Dense(Vec<u32>),
    /// Sorted numbers with their indices, for numbers that are far apart.
    Sparse(Vec<(u64, u32)>),
}

impl NodeNumbers {
    /// Builds the map.
    ///
    /// # Errors
    /// The first number that occurs twice.
    fn new(tags: &[u64]) -> Result<Self, u64> {
        let largest = tags.iter().copied().max().unwrap_or(0);
        if largest < 8 * tags.len() as u64 + 1024 {
            let mut dense = vec![u32::MAX; largest as usize + 1];
            for (index, &tag) in (0..).zip(tags) {
                let slot = &mut dense[tag as usize];
                if *slot != u32::MAX {
                    return Err(tag);
                }
                *slot = index;
            }
            return Ok(Self::Dense(dense));
        }
        let mut sparse: Vec<_> = tags.iter().copied().zip(0..).collect();
        sparse.sort_unstable();
        match sparse.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            Some(pair) => Err(pair[0].0),
            None => Ok(Self::Sparse(sparse)),
        }
    }

    fn index(&self, tag: u64) -> Option<u32> {
        match self {
            Self::Unknown => None,
            Self::Dense(dense) => {
                let slot = dense.get(usize::try_from(tag).ok()?)?;
                (*slot != u32::MAX).then_some(*slot)
            }
            Self::Sparse(sparse) => {
                let found = sparse
                    .binary_search_by_key(&tag, |&(other, _)| other)
                    .ok()?;
                Some(sparse[found].1)
            }
        }
    }
}
