//! Facets as flat pieces: segments in 2-D, triangles in 3-D.

use crate::math::vector::{dot, norm, sub};
use crate::mesh::vector::{between, centre, distance};
use crate::mesh::{Facet, Mesh};

/// A flat piece of a facet; in 2-D only the first two corners are used.
pub(crate) type Piece<const D: usize> = [[f64; D]; 3];

impl<const D: usize> Mesh<D> {
    /// Returns the pieces of a facet: the facet itself, or the four triangles about the mean of a
    /// quadrilateral's nodes, as in contact.
    pub(super) fn pieces(&self, facet: Facet) -> impl Iterator<Item = Piece<D>> {
        let nodes = self.facet_nodes(facet);
        let count = nodes.len();
        let mut places = [[0.0; D]; 4];
        let slots = places.iter_mut().zip(nodes);
        slots.for_each(|(place, node)| *place = self.nodes[node as usize]);
        pieces_of(&places[..count])
    }
}

/// Returns the pieces of a facet with these corners.
pub(super) fn pieces_of<const D: usize>(
    corners: &[[f64; D]],
) -> impl Iterator<Item = Piece<D>> + use<D> {
    let count = corners.len();
    let mut places = [[0.0; D]; 4];
    places[..count].copy_from_slice(corners);
    let mean = centre(places.into_iter());
    let pieces = if count == 4 { 4 } else { 1 };
    (0..pieces).map(move |k| match count {
        4 => [places[k], places[(k + 1) % 4], mean],
        _ => [places[0], places[1], places[2]],
    })
}

/// Returns a normal vector of a piece, outward from the element of the facet. Its length is the
/// length of the segment, or twice the area of the triangle.
pub(super) fn normal<const D: usize>(piece: &Piece<D>) -> [f64; D] {
    let [a, b] = [1, 2].map(|i| sub(&piece[i], &piece[0]));
    std::array::from_fn(|i| match (D, i) {
        (2, 0) => a[1],
        (2, _) => -a[0],
        _ => {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            a[j] * b[k] - a[k] * b[j]
        }
    })
}

/// Returns the distance from a point to a piece.
pub(crate) fn distance_to<const D: usize>(piece: &Piece<D>, point: [f64; D]) -> f64 {
    let [a, b, c] = *piece;
    if D == 2 {
        return distance_to_segment(a, b, point);
    }
    // Foot of the perpendicular, from the normal equations.
    let [u, v, w] = [b, c, point].map(|p| sub(&p, &a));
    let (uu, uv, vv, uw, vw) = (
        dot(&u, &u),
        dot(&u, &v),
        dot(&v, &v),
        dot(&u, &w),
        dot(&v, &w),
    );
    let determinant = uu * vv - uv * uv;
    let (s, t) = (vv * uw - uv * vw, uu * vw - uv * uw);
    if determinant > 0.0 && s >= 0.0 && t >= 0.0 && s + t <= determinant {
        let (s, t) = (s / determinant, t / determinant);
        let foot = std::array::from_fn(|i| a[i] + s * u[i] + t * v[i]);
        return distance(foot, point);
    }
    let edges = [(a, b), (b, c), (c, a)];
    edges
        .iter()
        .map(|&(p, q)| distance_to_segment(p, q, point))
        .fold(f64::INFINITY, f64::min)
}

fn distance_to_segment<const D: usize>(a: [f64; D], b: [f64; D], point: [f64; D]) -> f64 {
    let along = sub(&b, &a);
    let share = dot(&sub(&point, &a), &along) / dot(&along, &along);
    distance(between(a, b, share.clamp(0.0, 1.0)), point)
}

/// Returns the fraction of a segment at which it passes through a piece that is extended by the
/// margin `reach`. `None` if it does not pass through or only reaches the piece.
pub(super) fn crossing<const D: usize>(
    piece: &Piece<D>,
    [a, b]: [[f64; D]; 2],
    reach: f64,
) -> Option<f64> {
    let normal = normal(piece);
    let [before, after] = [a, b].map(|p| dot(&normal, &sub(&p, &piece[0])));
    let flat = reach * norm(&normal);
    if before.abs() <= flat || after.abs() <= flat || before * after > 0.0 {
        return None;
    }
    let share = before / (before - after);
    (distance_to(piece, between(a, b, share)) <= reach).then_some(share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_to_a_triangle_are_right_in_all_regions() {
        let triangle = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        let cases = [
            ([0.5, 0.5, 3.0], 3.0),
            ([-3.0, -4.0, 0.0], 5.0),
            ([1.0, -2.0, 0.0], 2.0),
            ([2.0, 2.0, 0.0], 2.0_f64.sqrt()),
            ([5.0, 0.0, 4.0], 5.0),
        ];
        for (point, expected) in cases {
            // Numbers of order one, a few roundings.
            assert!(
                (distance_to(&triangle, point) - expected).abs() < 1e-14,
                "{point:?}"
            );
        }
        let through = crossing(&triangle, [[0.5, 0.5, 1.0], [0.5, 0.5, -3.0]], 1e-12);
        assert_eq!(through, Some(0.25));
        assert_eq!(
            crossing(&triangle, [[1.5, 1.5, 1.0], [1.5, 1.5, -3.0]], 1e-12),
            None
        );
    }
}
