//! Second-order tensors of two or three dimensions.

use crate::element::simd::Real;

/// A second-order tensor, rows first.
pub(crate) type Tensor<const D: usize, T = f64> = [[T; D]; D];

/// Returns the tensor of these entries. It uses plain loops: `map` and `from_fn` of arrays stay
/// calls where the optimiser does not see the whole crate.
#[inline(always)]
pub(crate) fn filled<const D: usize, T: Copy>(entry: impl Fn(usize, usize) -> T) -> Tensor<D, T> {
    let mut tensor = [[entry(0, 0); D]; D];
    for i in 0..D {
        for j in 0..D {
            tensor[i][j] = entry(i, j);
        }
    }
    tensor
}

/// Returns Σ term(k) over the components.
#[inline(always)]
pub(super) fn contracted<const D: usize, T: Real>(term: impl Fn(usize) -> T) -> T {
    let mut sum = term(0);
    for k in 1..D {
        sum += term(k);
    }
    sum
}

/// Returns s·a.
#[inline(always)]
pub(super) fn scaled<const D: usize, T: Real>(s: T, a: &Tensor<D, T>) -> Tensor<D, T> {
    filled(|i, j| s * a[i][j])
}

/// Returns 1 + a.
#[inline(always)]
pub(crate) fn with_unit<const D: usize, T: Real>(a: &Tensor<D, T>) -> Tensor<D, T> {
    let mut sum = *a;
    for i in 0..D {
        sum[i][i] += a[i][i].constant(1.0);
    }
    sum
}

/// Returns a + b.
#[inline(always)]
pub(crate) fn sum<const D: usize, T: Real>(a: &Tensor<D, T>, b: &Tensor<D, T>) -> Tensor<D, T> {
    filled(|i, j| a[i][j] + b[i][j])
}

/// Returns a − b.
#[inline(always)]
pub(super) fn difference<const D: usize, T: Real>(
    a: &Tensor<D, T>,
    b: &Tensor<D, T>,
) -> Tensor<D, T> {
    filled(|i, j| a[i][j] - b[i][j])
}

/// Returns a·b.
#[inline(always)]
pub(crate) fn product<const D: usize, T: Real>(a: &Tensor<D, T>, b: &Tensor<D, T>) -> Tensor<D, T> {
    filled(|i, j| contracted::<D, T>(|k| a[i][k] * b[k][j]))
}

/// Returns aᵀ·b.
#[inline(always)]
pub(crate) fn transposed_product<const D: usize, T: Real>(
    a: &Tensor<D, T>,
    b: &Tensor<D, T>,
) -> Tensor<D, T> {
    filled(|i, j| contracted::<D, T>(|k| a[k][i] * b[k][j]))
}

/// Returns a·bᵀ.
#[inline(always)]
pub(crate) fn product_transposed<const D: usize, T: Real>(
    a: &Tensor<D, T>,
    b: &Tensor<D, T>,
) -> Tensor<D, T> {
    filled(|i, j| contracted::<D, T>(|k| a[i][k] * b[j][k]))
}

/// Returns ½(a + aᵀ).
#[inline(always)]
pub(crate) fn symmetric<const D: usize, T: Real>(a: &Tensor<D, T>) -> Tensor<D, T> {
    filled(|i, j| a[i][j].constant(0.5) * (a[i][j] + a[j][i]))
}

/// Returns tr a.
#[inline(always)]
pub(crate) fn trace<const D: usize, T: Real>(a: &Tensor<D, T>) -> T {
    contracted::<D, T>(|i| a[i][i])
}

/// Returns a : b.
#[inline(always)]
pub(crate) fn contraction<const D: usize, T: Real>(a: &Tensor<D, T>, b: &Tensor<D, T>) -> T {
    contracted::<D, T>(|i| contracted::<D, T>(|j| a[i][j] * b[i][j]))
}

/// Returns det a.
#[inline(always)]
pub(crate) fn determinant<const D: usize, T: Real>(a: &Tensor<D, T>) -> T {
    if D == 2 {
        a[0][0] * a[1][1] - a[0][1] * a[1][0]
    } else {
        contracted::<3, T>(|j| a[0][j] * cofactor3(a, 0, j))
    }
}

/// Returns a⁻¹ and det a. A singular tensor gives non-finite entries.
#[inline(always)]
pub(crate) fn inverse<const D: usize, T: Real>(a: &Tensor<D, T>) -> (Tensor<D, T>, T) {
    let determinant = determinant(a);
    let scale = determinant.constant(1.0) / determinant;
    (filled(|i, j| cofactor(a, j, i) * scale), determinant)
}

/// Returns det a · a⁻ᵀ.
#[inline(always)]
pub(super) fn cofactors<const D: usize, T: Real>(a: &Tensor<D, T>) -> Tensor<D, T> {
    filled(|i, j| cofactor(a, i, j))
}

#[inline(always)]
fn cofactor<const D: usize, T: Real>(a: &Tensor<D, T>, i: usize, j: usize) -> T {
    if D == 2 {
        let entry = a[1 - i][1 - j];
        entry.constant(if i == j { 1.0 } else { -1.0 }) * entry
    } else {
        cofactor3(a, i, j)
    }
}

/// Returns cofactor (i, j) of a 3×3 tensor; cyclic indices give the sign.
#[inline(always)]
fn cofactor3<const D: usize, T: Real>(a: &Tensor<D, T>, i: usize, j: usize) -> T {
    let (i1, i2, j1, j2) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
    a[i1][j1] * a[i2][j2] - a[i1][j2] * a[i2][j1]
}

/// Returns the smallest and the largest principal value of a symmetric tensor: quadratic formula in
/// 2-D, the trigonometric solution of the cubic (Smith 1961) in 3-D.
pub(crate) fn extreme_principal_values<const D: usize>(a: &Tensor<D>) -> (f64, f64) {
    let mean = trace(a) / D as f64;
    let mut deviator = *a;
    for i in 0..D {
        deviator[i][i] -= mean;
    }
    if D == 2 {
        let radius = (0.5 * contraction(&deviator, &deviator)).sqrt();
        return (mean - radius, mean + radius);
    }
    let radius = (contraction(&deviator, &deviator) / 6.0).sqrt();
    if radius == 0.0 {
        return (mean, mean);
    }
    let scaled: Tensor<D> = deviator.map(|row| row.map(|x| x / radius));
    let angle = (0.5 * determinant(&scaled)).clamp(-1.0, 1.0).acos() / 3.0;
    let third = std::f64::consts::TAU / 3.0;
    (
        mean + 2.0 * radius * (angle + third).cos(),
        mean + 2.0 * radius * angle.cos(),
    )
}
