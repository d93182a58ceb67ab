//! Non-conforming elements of a block: they touch without being joined.

use crate::mesh::box_tree::{Box, BoxTree, widened};
use crate::mesh::coincident::{SAME, on_boundary};
use crate::mesh::simplex::{distance_to, pieces_of};
use crate::mesh::vector::{bounds, centre, distance};
use crate::mesh::{Element, Facet};

/// Returns the places on boundary facets where the neighbouring elements do not share all corners,
/// in a fixed order: hanging nodes, and triangles on quadrilaterals.
///
/// Only boundary facets can have such places: a facet of two elements is joined.
pub(super) fn unjoined<const D: usize>(
    nodes: &[[f64; D]],
    elements: &[Element],
    boundary: &[Facet],
) -> Vec<[f64; D]> {
    if elements.len() < 2 {
        return Vec::new();
    }
    let corners = |facet: &Facet| -> Vec<u32> {
        let element = &elements[facet.element as usize];
        let local = element.kind.facets()[facet.local as usize].iter();
        local.map(|&c| element.nodes[c as usize]).collect()
    };
    let facets: Vec<Vec<u32>> = boundary.iter().map(corners).collect();
    let mut found = hanging_nodes(nodes, elements, boundary, &facets);
    found.extend(triangles_on_quadrilaterals(nodes, &facets));
    found
}

/// Returns the boundary nodes that lie within a boundary facet. A node at a corner of the facet
/// does not count; that is a coincident node.
fn hanging_nodes<const D: usize>(
    nodes: &[[f64; D]],
    elements: &[Element],
    boundary: &[Facet],
    facets: &[Vec<u32>],
) -> Vec<[f64; D]> {
    let (low, high) = bounds(nodes.iter().copied());
    let reach = SAME * distance(low, high);
    let places = |facet: &[u32]| -> Vec<[f64; D]> {
        facet.iter().map(|&node| nodes[node as usize]).collect()
    };
    let around = |facet: &Vec<u32>| widened(bounds(places(facet).into_iter()), reach);
    let boxes: Vec<(Box<D>, u32)> = facets.iter().map(around).zip(0..).collect();
    let tree = BoxTree::new(boxes);
    let lies_on = |place: [f64; D], facet: &[u32]| {
        let corners = places(facet);
        let is_apart = corners
            .iter()
            .all(|&corner| distance(corner, place) > reach);
        is_apart && pieces_of(&corners).any(|piece| distance_to(&piece, place) <= reach)
    };
    let on_boundary = on_boundary(nodes.len(), elements, boundary);
    let of_boundary = nodes.iter().zip(on_boundary).filter(|&(_, on)| on);
    let hangs = |&(&place, _): &(&[f64; D], bool)| {
        let mut hangs = false;
        tree.visit(&(place, place), |facet| {
            hangs = hangs || lies_on(place, &facets[facet as usize]);
        });
        hangs
    };
    of_boundary.filter(hangs).map(|(&place, _)| place).collect()
}

/// Returns the centres of triangles with all corners on one quadrilateral: tetrahedra beside
/// hexahedra or prisms.
fn triangles_on_quadrilaterals<const D: usize>(
    nodes: &[[f64; D]],
    facets: &[Vec<u32>],
) -> Vec<[f64; D]> {
    let sorted = |corners: [u32; 3]| {
        let mut corners = corners;
        corners.sort_unstable();
        corners
    };
    let mut halves: Vec<[u32; 3]> = facets
        .iter()
        .filter_map(|facet| <[u32; 4]>::try_from(facet.as_slice()).ok())
        .flat_map(|[a, b, c, d]| [[a, b, c], [b, c, d], [c, d, a], [d, a, b]])
        .map(sorted)
        .collect();
    halves.sort_unstable();
    let triangles = facets
        .iter()
        .filter_map(|facet| <[u32; 3]>::try_from(facet.as_slice()).ok());
    triangles
        .filter(|&corners| halves.binary_search(&sorted(corners)).is_ok())
        .map(|corners| centre(corners.iter().map(|&node| nodes[node as usize])))
        .collect()
}
