//! Split of non-simplex elements into simplices about their centre.
//!
//! A quadrilateral facet becomes triangles about its own centre, as in the boundary used for
//! contact. So blocks with warped facets have the same boundary before and after, and there is no
//! choice of diagonal. A facet next to an element that stays whole has no such centre. There the
//! pyramid becomes tetrahedra over both diagonals, each of half the weight. At constant stress
//! these put the same force on all four nodes, as the facet of the whole element does. Thus partly
//! refined meshes pass the patch test.

use crate::mesh::ElementKind;

/// Returns true if an element is bisected as it is.
pub(super) fn is_simplex(kind: ElementKind) -> bool {
    matches!(kind, ElementKind::Tri3 | ElementKind::Tet4)
}

/// Returns the simplices between a facet and the centre of the element. The nodes of the facet are
/// in the order of the element's shape; `middle` adds the node at the middle of a quadrilateral.
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

/// Returns the overlapping tetrahedra over both diagonals of a quadrilateral.
pub(super) fn halves_over(facet: &[u32], centre: u32) -> Vec<Vec<u32>> {
    let corner = |k: usize| facet[k % 4];
    let over = |k: usize| vec![corner(k), corner(k + 2), corner(k + 1), centre];
    (0..4).map(over).collect()
}
