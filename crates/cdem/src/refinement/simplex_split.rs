//! Elements that are no simplices, as simplices about their centre.
//!
//! A quadrilateral facet becomes triangles about its own centre, as the surface that
//! contact sees: blocks whose facets warp have the same surface before and after, and
//! no diagonal is to be chosen. Before an element that stays whole there is no such
//! centre: the pyramid there is tetrahedra over both diagonals, each of half the weight.
//! Of constant stress these put the same force on all four nodes, as the facet of the
//! whole element does, so that meshes which are refined in part pass the patch test.

use crate::mesh::ElementKind;

/// Whether an element is bisected as it is.
pub(super) fn is_simplex(kind: ElementKind) -> bool {
    matches!(kind, ElementKind::Tri3 | ElementKind::Tet4)
}

/// Simplices between a facet, its nodes in the order of the element's shape, and the
/// centre of the element; `middle` makes the node in the middle of a quadrilateral.
pub(super) fn pieces_over(
    facet: &[u32],
    centre: u32,
    middle: impl FnOnce(&[u32]) -> u32,
) -> Vec<Vec<u32>> {
    match *facet {
        [a, b] => vec![vec![a, b, centre]],
        [a, b, c] => vec![vec![a, c, b, centre]],
        _ => {
            let middle = middle(facet);
            let next = facet.iter().cycle().skip(1);
            let sides = facet.iter().zip(next);
            sides.map(|(&a, &b)| vec![b, a, middle, centre]).collect()
        }
    }
}

/// Tetrahedra over both diagonals of a quadrilateral, which lie in each other.
pub(super) fn halves_over(facet: &[u32], centre: u32) -> Vec<Vec<u32>> {
    let corner = |k: usize| facet[k % 4];
    let over = |k: usize| vec![corner(k), corner(k + 2), corner(k + 1), centre];
    (0..4).map(over).collect()
}
