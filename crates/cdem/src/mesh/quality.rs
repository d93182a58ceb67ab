//! Orientation of elements, checked at the points of integration.

use crate::math::vector::sub;
use crate::mesh::vector::{bounds, distance};
use crate::mesh::{CORNERS, Element, ElementKind};

/// Sign of an element's Jacobian at the Gauss points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum JacobianSign {
    /// Positive everywhere: correct.
    Positive,
    /// Negative everywhere: numbered in reverse.
    Reversed,
    /// Zero somewhere, and of one sign elsewhere.
    Flat,
    /// Two nodes at one place.
    Collapsed,
    /// Both signs.
    Folded { negative: usize, points: usize },
}

/// Jacobian, over the element's extent^D, below which it counts as zero: far above the rounding of
/// coordinates, far below any usable element.
const FLAT: f64 = 1e-12;

/// Distance of two nodes, over the element's extent, below which they count as at one place.
const COLLAPSED: f64 = 1e-9;

/// Returns the orientation of an element of `kind` with nodes at `corners`.
pub(super) fn orientation<const D: usize>(kind: ElementKind, corners: &[[f64; D]]) -> JacobianSign {
    let (low, high) = bounds(corners.iter().copied());
    let size = distance(low, high);
    let zero = FLAT * size.powi(D as i32);
    let gauss = gauss_points(kind);
    let (mut negative, mut positive) = (0, 0);
    for &point in &gauss {
        let jacobian = jacobian(kind, corners, point);
        negative += usize::from(jacobian < -zero);
        positive += usize::from(jacobian > zero);
    }
    let points = gauss.len();
    let meet = |(i, &a): (usize, &[f64; D])| {
        let mut others = corners[..i].iter();
        others.any(|&b| distance(a, b) <= COLLAPSED * size)
    };
    match (negative, positive) {
        (n, p) if n.max(p) == points && corners.iter().enumerate().any(meet) => {
            JacobianSign::Collapsed
        }
        (0, p) if p == points => JacobianSign::Positive,
        (n, 0) if n == points => JacobianSign::Reversed,
        (0, _) | (_, 0) => JacobianSign::Flat,
        _ => JacobianSign::Folded { negative, points },
    }
}

/// Returns the element with its nodes in reverse order.
pub(super) fn reversed(element: Element) -> Element {
    let order: &[usize] = match element.kind {
        ElementKind::Tri3 => &[0, 2, 1],
        ElementKind::Quad4 => &[0, 3, 2, 1],
        ElementKind::Tet4 => &[0, 1, 3, 2],
        ElementKind::Wedge6 => &[3, 4, 5, 0, 1, 2],
        ElementKind::Hex8 => &[4, 5, 6, 7, 0, 1, 2, 3],
    };
    let nodes: Vec<_> = order.iter().map(|&i| element.nodes[i]).collect();
    Element::new(element.kind, &nodes)
}

/// Returns the area or volume of an element of `kind` with nodes at `corners`, by the quadrature of
/// the orientation check.
pub(crate) fn volume<const D: usize>(kind: ElementKind, corners: &[[f64; D]]) -> f64 {
    let weight = match kind {
        ElementKind::Tri3 => 0.5,
        ElementKind::Quad4 | ElementKind::Hex8 => 1.0,
        ElementKind::Tet4 | ElementKind::Wedge6 => 1.0 / 6.0,
    };
    let points = gauss_points(kind);
    let at = |&point: &[f64; 3]| weight * jacobian(kind, corners, point);
    points.iter().map(at).sum()
}

/// 1/√3, the Gauss point on [−1, 1].
const GAUSS: f64 = 0.577_350_269_189_625_8;

fn gauss_points(kind: ElementKind) -> Vec<[f64; 3]> {
    let signs = |i: usize| CORNERS[i].map(|c| c * GAUSS);
    match kind {
        ElementKind::Tri3 | ElementKind::Tet4 => vec![[0.25; 3]],
        ElementKind::Quad4 => (0..4).map(|i| [signs(i)[0], signs(i)[1], 0.0]).collect(),
        ElementKind::Hex8 => (0..8).map(signs).collect(),
        ElementKind::Wedge6 => {
            let triangle = [
                [1.0 / 6.0; 2],
                [2.0 / 3.0, 1.0 / 6.0],
                [1.0 / 6.0, 2.0 / 3.0],
            ];
            let at = |z: f64| triangle.map(|[x, y]| [x, y, z]);
            [at(-GAUSS), at(GAUSS)].concat()
        }
    }
}

/// Returns the determinant of ∂x/∂ξ at the reference point ξ.
fn jacobian<const D: usize>(kind: ElementKind, corners: &[[f64; D]], xi: [f64; 3]) -> f64 {
    let mut matrix = [[0.0; D]; D];
    // Shape functions sum to one, so nodes may be taken relative to the first. This keeps the
    // digits of a small element far from the origin.
    for (node, &corner) in corners.iter().enumerate() {
        let x = sub(&corner, &corners[0]);
        let gradient = derivatives(kind, node, xi);
        for i in 0..D {
            for j in 0..D {
                matrix[i][j] += x[i] * gradient[j];
            }
        }
    }
    determinant(matrix)
}

/// Returns ∂N/∂ξ of the shape function of one node.
fn derivatives(kind: ElementKind, node: usize, [x, y, z]: [f64; 3]) -> [f64; 3] {
    let simplex = |node: usize| -> [f64; 3] {
        std::array::from_fn(|i| match node {
            0 => -1.0,
            n if n == i + 1 => 1.0,
            _ => 0.0,
        })
    };
    match kind {
        ElementKind::Tri3 | ElementKind::Tet4 => simplex(node),
        ElementKind::Quad4 => {
            let [a, b, _] = CORNERS[node];
            [a * (1.0 + b * y) / 4.0, b * (1.0 + a * x) / 4.0, 0.0]
        }
        ElementKind::Hex8 => {
            let [a, b, c] = CORNERS[node];
            let (u, v, w) = (1.0 + a * x, 1.0 + b * y, 1.0 + c * z);
            [a * v * w / 8.0, b * u * w / 8.0, c * u * v / 8.0]
        }
        ElementKind::Wedge6 => {
            let side = if node < 3 { -1.0 } else { 1.0 };
            let [a, b, _] = simplex(node % 3);
            let barycentric = [1.0 - x - y, x, y][node % 3];
            let half = (1.0 + side * z) / 2.0;
            [a * half, b * half, side * barycentric / 2.0]
        }
    }
}

fn determinant<const D: usize>(m: [[f64; D]; D]) -> f64 {
    let minor = |i: usize, j: usize, k: usize| m[1][j] * m[2][k] * m[0][i];
    match D {
        2 => m[0][0] * m[1][1] - m[0][1] * m[1][0],
        _ => {
            minor(0, 1, 2) - minor(0, 2, 1) + minor(1, 2, 0) - minor(1, 0, 2) + minor(2, 0, 1)
                - minor(2, 1, 0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(kind: ElementKind) -> Vec<[f64; 3]> {
        match kind {
            ElementKind::Tet4 => vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            ElementKind::Wedge6 => {
                let bottom = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
                let top = bottom.map(|[x, y, _]| [x, y, 1.0]);
                [bottom, top].concat()
            }
            _ => CORNERS.map(|c| c.map(|x| (x + 1.0) / 2.0)).to_vec(),
        }
    }

    #[test]
    fn volumes_of_unit_shapes_are_known_and_reversal_changes_their_sign() {
        let expected = [
            (ElementKind::Tet4, 1.0 / 6.0),
            (ElementKind::Wedge6, 0.5),
            (ElementKind::Hex8, 1.0),
        ];
        for (kind, value) in expected {
            let corners = unit(kind);
            // 1e-14: some tens of roundings of numbers of order one.
            assert!((volume(kind, &corners) - value).abs() < 1e-14, "{kind:?}");
            assert_eq!(orientation(kind, &corners), JacobianSign::Positive);
            let numbers: Vec<u32> = (0..kind.node_count() as u32).collect();
            let turned = reversed(Element::new(kind, &numbers));
            let corners: Vec<_> = turned
                .nodes()
                .iter()
                .map(|&n| corners[n as usize])
                .collect();
            assert!((volume(kind, &corners) + value).abs() < 1e-14, "{kind:?}");
            assert_eq!(orientation(kind, &corners), JacobianSign::Reversed);
        }
    }

    #[test]
    fn a_bow_tie_is_folded_and_a_line_is_flat() {
        let bow_tie = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let folded = orientation(ElementKind::Quad4, &bow_tie);
        assert_eq!(
            folded,
            JacobianSign::Folded {
                negative: 2,
                points: 4
            }
        );
        let collapsed = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 1.0]];
        assert_eq!(
            orientation(ElementKind::Quad4, &collapsed),
            JacobianSign::Collapsed
        );
        let line = [[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]];
        assert_eq!(orientation(ElementKind::Tri3, &line), JacobianSign::Flat);
    }
}
