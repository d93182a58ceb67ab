//! Second-order tensors of two or three dimensions.

/// A second-order tensor, rows first.
pub(crate) type Tensor<const D: usize> = [[f64; D]; D];

/// The tensor of these entries, by plain loops: the arrays' own `map` and
/// `from_fn` stay calls where the optimiser does not see the whole crate.
#[inline]
pub(crate) fn filled<const D: usize>(entry: impl Fn(usize, usize) -> f64) -> Tensor<D> {
    let mut tensor = [[0.0; D]; D];
    for i in 0..D {
        for j in 0..D {
            tensor[i][j] = entry(i, j);
        }
    }
    tensor
}

/// Σ term(k) over the components.
#[inline]
fn contracted<const D: usize>(term: impl Fn(usize) -> f64) -> f64 {
    let mut sum = term(0);
    for k in 1..D {
        sum += term(k);
    }
    sum
}

/// s·a.
#[inline]
pub(super) fn scaled<const D: usize>(s: f64, a: &Tensor<D>) -> Tensor<D> {
    filled(|i, j| s * a[i][j])
}

/// The unit tensor.
#[inline]
pub(crate) fn identity<const D: usize>() -> Tensor<D> {
    filled(|i, j| if i == j { 1.0 } else { 0.0 })
}

/// a + b.
#[inline]
pub(crate) fn sum<const D: usize>(a: &Tensor<D>, b: &Tensor<D>) -> Tensor<D> {
    filled(|i, j| a[i][j] + b[i][j])
}

/// a·b.
#[inline]
pub(crate) fn product<const D: usize>(a: &Tensor<D>, b: &Tensor<D>) -> Tensor<D> {
    filled(|i, j| contracted::<D>(|k| a[i][k] * b[k][j]))
}

/// aᵀ·b.
#[inline]
pub(crate) fn transposed_product<const D: usize>(a: &Tensor<D>, b: &Tensor<D>) -> Tensor<D> {
    filled(|i, j| contracted::<D>(|k| a[k][i] * b[k][j]))
}

/// a·bᵀ.
#[inline]
pub(crate) fn product_transposed<const D: usize>(a: &Tensor<D>, b: &Tensor<D>) -> Tensor<D> {
    filled(|i, j| contracted::<D>(|k| a[i][k] * b[j][k]))
}

/// ½(a + aᵀ).
#[inline]
pub(crate) fn symmetric<const D: usize>(a: &Tensor<D>) -> Tensor<D> {
    filled(|i, j| 0.5 * (a[i][j] + a[j][i]))
}

/// tr a.
#[inline]
pub(crate) fn trace<const D: usize>(a: &Tensor<D>) -> f64 {
    contracted::<D>(|i| a[i][i])
}

/// a : b.
#[inline]
pub(crate) fn contraction<const D: usize>(a: &Tensor<D>, b: &Tensor<D>) -> f64 {
    contracted::<D>(|i| contracted::<D>(|j| a[i][j] * b[i][j]))
}

/// det a.
#[inline]
pub(crate) fn determinant<const D: usize>(a: &Tensor<D>) -> f64 {
    if D == 2 {
        a[0][0] * a[1][1] - a[0][1] * a[1][0]
    } else {
        contracted::<3>(|j| a[0][j] * cofactor3(a, 0, j))
    }
}

/// a⁻¹ and det a. A singular tensor gives non-finite entries.
#[inline]
pub(crate) fn inverse<const D: usize>(a: &Tensor<D>) -> (Tensor<D>, f64) {
    let determinant = determinant(a);
    let scale = 1.0 / determinant;
    let inverse = filled(|i, j| {
        let cofactor = if D == 2 {
            let sign = if i == j { 1.0 } else { -1.0 };
            sign * a[1 - j][1 - i]
        } else {
            cofactor3(a, j, i)
        };
        cofactor * scale
    });
    (inverse, determinant)
}

/// Cofactor (i, j) of a 3×3 tensor; cyclic indices carry the sign.
#[inline]
fn cofactor3<const D: usize>(a: &Tensor<D>, i: usize, j: usize) -> f64 {
    let (i1, i2, j1, j2) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
    a[i1][j1] * a[i2][j2] - a[i1][j2] * a[i2][j1]
}

/// Smallest and largest principal value of a symmetric tensor: quadratic
/// formula in 2-D, the trigonometric solution of the cubic (Smith 1961) in 3-D.
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
