//! Shape functions and quadrature on the reference elements.
//!
//! Triangles and tetrahedra use the unit simplex, quadrilaterals and hexahedra [−1, 1]^D, wedges
//! triangle × [−1, 1]. Coordinates always have three components; those beyond the dimension are 0
//! and unused.

use crate::mesh::{CORNERS, ElementKind};

/// Values and reference gradients of the shape functions of an element at a point. Only the first
/// `node_count` entries are used.
pub(crate) struct ShapeFunctions {
    pub(crate) values: [f64; 8],
    pub(crate) gradients: [[f64; 3]; 8],
}

/// A point of a quadrature rule on a reference element.
#[derive(Clone, Copy)]
pub(super) struct QuadraturePoint {
    pub(super) position: [f64; 3],
    pub(super) weight: f64,
}

/// Returns the position of corner `a` of `kind` on the reference element.
pub(crate) fn corner(kind: ElementKind, a: usize) -> [f64; 3] {
    match kind {
        ElementKind::Tri3 | ElementKind::Tet4 => {
            std::array::from_fn(|i| if i + 1 == a { 1.0 } else { 0.0 })
        }
        ElementKind::Quad4 => [CORNERS[a][0], CORNERS[a][1], 0.0],
        ElementKind::Hex8 => CORNERS[a],
        ElementKind::Wedge6 => {
            let [x, y, _] = corner(ElementKind::Tri3, a % 3);
            [x, y, if a < 3 { -1.0 } else { 1.0 }]
        }
    }
}

/// Returns the shape functions of `kind` at the reference point `at`.
pub(crate) fn shape(kind: ElementKind, at: [f64; 3]) -> ShapeFunctions {
    match kind {
        ElementKind::Tri3 | ElementKind::Tet4 => simplex(kind.dimension(), at),
        ElementKind::Quad4 | ElementKind::Hex8 => tensor_product(kind.dimension(), at),
        ElementKind::Wedge6 => wedge(at),
    }
}

fn simplex(dimension: usize, at: [f64; 3]) -> ShapeFunctions {
    let mut shape = ShapeFunctions {
        values: [0.0; 8],
        gradients: [[0.0; 3]; 8],
    };
    shape.values[0] = 1.0;
    for i in 0..dimension {
        shape.values[0] -= at[i];
        shape.gradients[0][i] = -1.0;
        shape.values[i + 1] = at[i];
        shape.gradients[i + 1][i] = 1.0;
    }
    shape
}

fn tensor_product(dimension: usize, at: [f64; 3]) -> ShapeFunctions {
    let mut shape = ShapeFunctions {
        values: [0.0; 8],
        gradients: [[0.0; 3]; 8],
    };
    for (a, corner) in CORNERS.iter().enumerate().take(1 << dimension) {
        let factor = |i: usize| 0.5 * (1.0 + corner[i] * at[i]);
        shape.values[a] = (0..dimension).map(factor).product();
        for i in 0..dimension {
            let others: f64 = (0..dimension).filter(|&j| j != i).map(factor).product();
            shape.gradients[a][i] = 0.5 * corner[i] * others;
        }
    }
    shape
}

fn wedge(at: [f64; 3]) -> ShapeFunctions {
    let triangle = simplex(2, at);
    let mut shape = ShapeFunctions {
        values: [0.0; 8],
        gradients: [[0.0; 3]; 8],
    };
    for a in 0..6 {
        let (corner, side) = (a % 3, if a < 3 { -1.0 } else { 1.0 });
        let along = 0.5 * (1.0 + side * at[2]);
        let [x, y, _] = triangle.gradients[corner];
        shape.values[a] = triangle.values[corner] * along;
        shape.gradients[a] = [x * along, y * along, triangle.values[corner] * 0.5 * side];
    }
    shape
}

/// Returns the full quadrature of stiffness and internal force: 1, 4, 1, 6 and 8 points. It also
/// integrates volume and row-sum masses of straight-sided elements exactly.
pub(super) fn stiffness_rule(kind: ElementKind) -> Vec<QuadraturePoint> {
    match kind {
        ElementKind::Tri3 => vec![point([1.0 / 3.0, 1.0 / 3.0, 0.0], 0.5)],
        ElementKind::Tet4 => vec![point([0.25; 3], 1.0 / 6.0)],
        ElementKind::Quad4 => square_rule(&gauss2()),
        ElementKind::Hex8 => extrude(&square_rule(&gauss2()), &gauss2()),
        ElementKind::Wedge6 => extrude(&triangle_rule(), &gauss2()),
    }
}

/// Returns the quadrature that is exact for the consistent mass matrix: degree 2 on simplices, 3
/// per direction on quadrilaterals, 4 on hexahedra (N_a N_b det J), 3 across and 4 along wedges.
pub(super) fn mass_rule(kind: ElementKind) -> Vec<QuadraturePoint> {
    match kind {
        ElementKind::Tri3 => triangle_rule(),
        ElementKind::Tet4 => tetrahedron_rule(),
        ElementKind::Quad4 => square_rule(&gauss2()),
        ElementKind::Hex8 => extrude(&square_rule(&gauss3()), &gauss3()),
        ElementKind::Wedge6 => extrude(&collapsed_triangle_rule(), &gauss3()),
    }
}

fn point(position: [f64; 3], weight: f64) -> QuadraturePoint {
    QuadraturePoint { position, weight }
}

/// Gauss–Legendre, degree 3: (position, weight) on [−1, 1].
fn gauss2() -> Vec<(f64, f64)> {
    let x = 1.0 / 3f64.sqrt();
    vec![(-x, 1.0), (x, 1.0)]
}

/// Gauss–Legendre, degree 5.
fn gauss3() -> Vec<(f64, f64)> {
    let x = 0.6f64.sqrt();
    vec![(-x, 5.0 / 9.0), (0.0, 8.0 / 9.0), (x, 5.0 / 9.0)]
}

/// Degree 2, three inner points.
fn triangle_rule() -> Vec<QuadraturePoint> {
    let (s, t) = (1.0 / 6.0, 2.0 / 3.0);
    [[s, s, 0.0], [t, s, 0.0], [s, t, 0.0]]
        .map(|position| point(position, 1.0 / 6.0))
        .to_vec()
}

/// Degree 4: the square folded onto the triangle, x = u, y = v(1 − u).
fn collapsed_triangle_rule() -> Vec<QuadraturePoint> {
    let fold = |p: &QuadraturePoint| {
        let (u, v) = (0.5 * (1.0 + p.position[0]), 0.5 * (1.0 + p.position[1]));
        point([u, v * (1.0 - u), 0.0], 0.25 * p.weight * (1.0 - u))
    };
    square_rule(&gauss3()).iter().map(fold).collect()
}

/// Degree 2, four inner points.
fn tetrahedron_rule() -> Vec<QuadraturePoint> {
    let (s, t) = ((5.0 - 5f64.sqrt()) / 20.0, (5.0 + 3.0 * 5f64.sqrt()) / 20.0);
    [[s, s, s], [t, s, s], [s, t, s], [s, s, t]]
        .map(|position| point(position, 1.0 / 24.0))
        .to_vec()
}

fn square_rule(line: &[(f64, f64)]) -> Vec<QuadraturePoint> {
    let row = |&(y, wy): &(f64, f64)| line.iter().map(move |&(x, wx)| point([x, y, 0.0], wx * wy));
    line.iter().flat_map(row).collect()
}

fn extrude(base: &[QuadraturePoint], line: &[(f64, f64)]) -> Vec<QuadraturePoint> {
    let layer = |&(z, w): &(f64, f64)| {
        base.iter()
            .map(move |p| point([p.position[0], p.position[1], z], p.weight * w))
    };
    line.iter().flat_map(layer).collect()
}
