//! Boundary facets, and the check that elements fit together at facets.

use std::borrow::Cow;

use rayon::prelude::*;

use crate::mesh::vector::distance;
use crate::mesh::{Element, Facet, Mesh};

/// Two or more elements that do not fit together at a facet, as indices into the elements checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum FacetFault {
    /// Two elements with the same nodes.
    Duplicate(u32, u32),
    /// More than two elements, or two on the same side.
    Overlapping(Vec<u32>, Facet),
}

/// A facet with a key that identifies it from both sides.
#[derive(Clone, Copy)]
struct Side {
    /// Its nodes, sorted; unused entries are `u32::MAX`.
    nodes: [u32; 4],
    /// Direction in which the element goes through the nodes.
    forward: bool,
    facet: Facet,
}

impl Side {
    /// Unused entry.
    const NONE: Self = Self {
        nodes: [u32::MAX; 4],
        forward: false,
        facet: Facet {
            element: 0,
            local: 0,
        },
    };
}

/// Returns the sorted nodes of a facet, as a key; unused entries are `u32::MAX`.
pub(super) fn sorted(nodes: impl Iterator<Item = u32>) -> [u32; 4] {
    let mut key = [u32::MAX; 4];
    key.iter_mut()
        .zip(nodes)
        .for_each(|(slot, node)| *slot = node);
    // A sorting network, because millions of these are sorted.
    for (a, b) in [(0, 1), (2, 3), (0, 2), (1, 3), (1, 2)] {
        (key[a], key[b]) = (key[a].min(key[b]), key[a].max(key[b]));
    }
    key
}

/// Returns the facets of all elements, in order of their nodes. Facets with the same lowest node
/// are first put into one bucket; each bucket is small and is sorted on its own.
fn sides(elements: &[Element]) -> Vec<Side> {
    let mut ends: Vec<usize> = Vec::new();
    visit_sides(elements, |side| {
        let lowest = side.nodes[0] as usize;
        if ends.len() <= lowest {
            ends.resize(lowest + 1, 0);
        }
        ends[lowest] += 1;
    });
    let mut count = 0;
    for end in &mut ends {
        (*end, count) = (count, count + *end);
    }
    let mut sides = vec![Side::NONE; count];
    visit_sides(elements, |side| {
        let place = &mut ends[side.nodes[0] as usize];
        sides[*place] = side;
        *place += 1;
    });
    let of_lowest = sides.par_chunk_by_mut(|a, b| a.nodes[0] == b.nodes[0]);
    of_lowest.for_each(|heap| heap.sort_unstable_by_key(|side| (side.nodes, side.facet)));
    sides
}

/// Visits the facets of all elements.
fn visit_sides(elements: &[Element], mut visit: impl FnMut(Side)) {
    for (element, number) in elements.iter().zip(0..) {
        for (corners, local) in element.kind.facets().iter().zip(0..) {
            let at = |i: usize| element.nodes[corners[i] as usize];
            let count = corners.len();
            let nodes = sorted((0..count).map(at));
            let lowest = (0..count).find(|&i| at(i) == nodes[0]).unwrap_or(0);
            let forward = match count {
                2 => lowest == 0,
                _ => at((lowest + 1) % count) < at((lowest + count - 1) % count),
            };
            visit(Side {
                nodes,
                forward,
                facet: Facet {
                    element: number,
                    local,
                },
            });
        }
    }
}

/// Returns the facets that belong to one element only, sorted.
fn free_facets(sides: &[Side]) -> Vec<Facet> {
    let alone = sides
        .chunk_by(|a, b| a.nodes == b.nodes)
        .filter(|chunk| chunk.len() == 1);
    let mut facets: Vec<_> = alone.map(|chunk| chunk[0].facet).collect();
    facets.sort_unstable();
    facets
}

/// Returns the boundary facets of the elements of one block, whose indices count from 0.
///
/// # Errors
/// The first facet, in the order of nodes, at which elements overlap.
pub(super) fn checked_boundary(elements: &[Element]) -> Result<Vec<Facet>, FacetFault> {
    let sides = sides(elements);
    for chunk in sides.chunk_by(|a, b| a.nodes == b.nodes) {
        let [first, second, ..] = chunk else { continue };
        for pair in chunk.windows(2) {
            let [a, b] = [pair[0].facet.element, pair[1].facet.element];
            if same_nodes(&elements[a as usize], &elements[b as usize]) {
                return Err(FacetFault::Duplicate(a, b));
            }
        }
        if chunk.len() > 2 || first.forward == second.forward {
            let all = chunk.iter().map(|side| side.facet.element).collect();
            return Err(FacetFault::Overlapping(all, first.facet));
        }
    }
    Ok(free_facets(&sides))
}

fn same_nodes(a: &Element, b: &Element) -> bool {
    let sorted = |element: &Element| {
        let mut nodes = element.nodes;
        nodes.sort_unstable();
        nodes
    };
    sorted(a) == sorted(b)
}

impl<const D: usize> Mesh<D> {
    /// Returns the facets that belong to exactly one element of their block, sorted.
    #[must_use]
    pub fn boundary_facets(&self) -> Cow<'_, [Facet]> {
        match &self.boundary.0 {
            Some(known) => Cow::Borrowed(known),
            None => Cow::Owned(self.find_boundary_facets()),
        }
    }

    /// Caches the boundary facets. The elements must not change after this.
    pub(crate) fn keep_boundary_facets(&mut self) {
        self.boundary.0 = Some(self.find_boundary_facets());
    }

    fn find_boundary_facets(&self) -> Vec<Facet> {
        let mut all = Vec::new();
        for block in &self.blocks {
            let first = block.elements.start;
            let elements = &self.elements[first as usize..block.elements.end as usize];
            let facets = free_facets(&sides(elements));
            all.extend(facets.iter().map(|f| Facet {
                element: f.element + first,
                ..*f
            }));
        }
        all
    }

    /// Returns the nodes of a facet: in 2-D with the element to the left, in 3-D counter-clockwise
    /// seen from outside.
    pub fn facet_nodes(&self, facet: Facet) -> impl ExactSizeIterator<Item = u32> + Clone {
        let element = &self.elements[facet.element as usize];
        let corners = element.kind.facets()[facet.local as usize].iter();
        corners.map(|&corner| element.nodes[corner as usize])
    }

    /// Returns the length of the shortest edge of the boundary, m; infinite without blocks.
    #[must_use]
    pub fn smallest_boundary_edge(&self) -> f64 {
        let facets = self.boundary_facets();
        let lengths = facets.iter().flat_map(|&facet| self.edge_lengths(facet));
        lengths.fold(f64::INFINITY, f64::min)
    }

    /// Returns the length of the longest edge of some elements, m; 0 without elements.
    pub(crate) fn largest_edge(&self, elements: std::ops::Range<u32>) -> f64 {
        let facets = elements.flat_map(|element| {
            let count = self.elements[element as usize].kind.facets().len();
            (0..count as u8).map(move |local| Facet { element, local })
        });
        let lengths = facets.flat_map(|facet| self.edge_lengths(facet));
        lengths.fold(0.0, f64::max)
    }

    fn edge_lengths(&self, facet: Facet) -> impl Iterator<Item = f64> {
        let nodes = self.facet_nodes(facet);
        let next = nodes.clone().cycle().skip(1);
        let length = |(a, b): (u32, u32)| distance(self.nodes[a as usize], self.nodes[b as usize]);
        nodes.zip(next).map(length)
    }
}
