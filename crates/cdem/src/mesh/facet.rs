//! Which facets lie on the boundary, and whether elements fit together there.

use std::borrow::Cow;

use rayon::prelude::*;

use crate::mesh::vector::distance;
use crate::mesh::{Element, Facet, Mesh};

/// Two or more elements that do not fit together at a facet; indices into the
/// elements looked at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum FacetFault {
    /// The same nodes.
    Duplicate(u32, u32),
    /// More than two, or two on the same side.
    Overlapping(Vec<u32>, Facet),
}

/// A facet with what identifies it from both sides.
#[derive(Clone, Copy)]
struct Side {
    /// Its nodes, sorted; unused room is `u32::MAX`.
    nodes: [u32; 4],
    /// Which way round the element goes through them.
    forward: bool,
    facet: Facet,
}

impl Side {
    /// Room for one.
    const NONE: Self = Self {
        nodes: [u32::MAX; 4],
        forward: false,
        facet: Facet {
            element: 0,
            local: 0,
        },
    };
}

/// Sorted nodes of a facet, as a key; unused room is `u32::MAX`.
pub(super) fn sorted(nodes: impl Iterator<Item = u32>) -> [u32; 4] {
    let mut key = [u32::MAX; 4];
    key.iter_mut()
        .zip(nodes)
        .for_each(|(slot, node)| *slot = node);
    // A network: millions of these are sorted.
    for (a, b) in [(0, 1), (2, 3), (0, 2), (1, 3), (1, 2)] {
        (key[a], key[b]) = (key[a].min(key[b]), key[a].max(key[b]));
    }
    key
}

/// Facets of all elements, in order of their nodes. Those of one lowest node are put together
/// first: each such heap is small, and sorted while it is at hand.
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

/// Goes through the facets of all elements.
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

/// Facets of `elements` that only one of them has, sorted.
fn free_facets(sides: &[Side]) -> Vec<Facet> {
    let alone = sides
        .chunk_by(|a, b| a.nodes == b.nodes)
        .filter(|chunk| chunk.len() == 1);
    let mut facets: Vec<_> = alone.map(|chunk| chunk[0].facet).collect();
    facets.sort_unstable();
    facets
}

/// Boundary facets of the elements of one block, whose indices count from 0.
///
/// # Errors
/// The first facet, by its nodes, at which elements lie over each other.
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
    /// Facets that belong to exactly one element of their block, sorted.
    #[must_use]
    pub fn boundary_facets(&self) -> Cow<'_, [Facet]> {
        match &self.boundary.0 {
            Some(known) => Cow::Borrowed(known),
            None => Cow::Owned(self.find_boundary_facets()),
        }
    }

    /// Works them out, for all that will ask: from here on the elements stay as they are.
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

    /// Nodes of a facet: in 2-D with the element to the left, in 3-D
    /// counter-clockwise seen from outside.
    pub fn facet_nodes(&self, facet: Facet) -> impl ExactSizeIterator<Item = u32> + Clone {
        let element = &self.elements[facet.element as usize];
        let corners = element.kind.facets()[facet.local as usize].iter();
        corners.map(|&corner| element.nodes[corner as usize])
    }

    /// Length of the shortest edge of the boundary, m; infinite without blocks.
    #[must_use]
    pub fn smallest_boundary_edge(&self) -> f64 {
        let facets = self.boundary_facets();
        let lengths = facets.iter().flat_map(|&facet| self.edge_lengths(facet));
        lengths.fold(f64::INFINITY, f64::min)
    }

    /// Length of the longest edge of some elements, m; 0 without any.
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
