//! Nodes that lie at one place but are not joined: cracks, or a mistake.

use crate::math::vector::dot;
use crate::mesh::vector::{bounds, distance};
use crate::mesh::{Element, Facet};

/// Distance, over the extent of the block, below which two nodes lie at one place: the usual
/// tolerance of meshers.
pub(super) const SAME: f64 = 1e-8;

/// Returns the places where two boundary nodes coincide, in a fixed order.
///
/// Only boundary nodes can coincide: an element beside an unjoined node has a free facet there.
pub(super) fn coincident_nodes<const D: usize>(
    nodes: &[[f64; D]],
    elements: &[Element],
    boundary: &[Facet],
) -> Vec<[f64; D]> {
    if elements.len() < 2 {
        return Vec::new();
    }
    let places = nodes
        .iter()
        .zip(on_boundary(nodes.len(), elements, boundary))
        .filter(|&(_, on)| on)
        .map(|(&place, _)| place);
    let (low, high) = bounds(nodes.iter().copied());
    let reach = SAME * distance(low, high);
    // The nodes are swept along a direction in which no rows of a lattice are aligned.
    let direction: [f64; D] = std::array::from_fn(|i| [0.8013, 0.5347, 0.2689][i]);
    let mut swept: Vec<_> = places
        .map(|place| (dot(&direction, &place), place))
        .collect();
    swept.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut found = Vec::new();
    for (index, &(along, place)) in swept.iter().enumerate() {
        let near = swept[index + 1..]
            .iter()
            .take_while(|(other, _)| other - along <= reach);
        let same = near.filter(|(_, other)| distance(place, *other) <= reach);
        found.extend(same.map(|_| place));
    }
    found
}

/// Returns true for each node on the boundary.
pub(super) fn on_boundary(count: usize, elements: &[Element], boundary: &[Facet]) -> Vec<bool> {
    let mut on_boundary = vec![false; count];
    for facet in boundary {
        let element = &elements[facet.element as usize];
        let corners = element.kind.facets()[facet.local as usize].iter();
        corners.for_each(|&c| on_boundary[element.nodes[c as usize] as usize] = true);
    }
    on_boundary
}
