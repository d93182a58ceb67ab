//! Roots of quadratic polynomials.

/// Returns the real roots of c₀ + c₁t + c₂t², ascending, without cancellation.
pub(crate) fn roots([c0, c1, c2]: [f64; 3]) -> [Option<f64>; 2] {
    if c2 == 0.0 {
        return [(c1 != 0.0).then(|| -c0 / c1), None];
    }
    let discriminant = c1 * c1 - 4.0 * c0 * c2;
    if discriminant < 0.0 {
        return [None, None];
    }
    let q = -0.5 * (c1 + discriminant.sqrt().copysign(c1));
    if q == 0.0 {
        return [Some(0.0), None]; // c₀ = c₁ = 0
    }
    let (one, two) = (q / c2, c0 / q);
    [Some(one.min(two)), Some(one.max(two))]
}
