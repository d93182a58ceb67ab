//! Second-order tensors of two or three dimensions.

/// A second-order tensor, rows first.
pub(crate) type Tensor<const D: usize> = [[f64; D]; D];

/// The unit tensor.
#[inline]
pub(crate) fn identity<const D: usize>() -> Tensor<D> {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }))
}

/// a + b.
#[inline]
pub(crate) fn sum<const D: usize>(a: &Tensor<D>, b: &Tensor<D>) -> Tensor<D> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + b[i][j]))
}

/// a·b.
#[inline]
pub(crate) fn product<const D: usize>(a: &Tensor<D>, b: &Tensor<D>) -> Tensor<D> {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..D).map(|k| a[i][k] * b[k][j]).sum()))
}

/// aᵀ·b.
#[inline]
pub(crate) fn transposed_product<const D: usize>(a: &Tensor<D>, b: &Tensor<D>) -> Tensor<D> {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..D).map(|k| a[k][i] * b[k][j]).sum()))
}

/// a·bᵀ.
#[inline]
pub(crate) fn product_transposed<const D: usize>(a: &Tensor<D>, b: &Tensor<D>) -> Tensor<D> {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..D).map(|k| a[i][k] * b[j][k]).sum()))
}

/// ½(a + aᵀ).
#[inline]
pub(crate) fn symmetric<const D: usize>(a: &Tensor<D>) -> Tensor<D> {
    std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (a[i][j] + a[j][i])))
}

/// tr a.
#[inline]
pub(crate) fn trace<const D: usize>(a: &Tensor<D>) -> f64 {
    (0..D).map(|i| a[i][i]).sum()
}

/// a : b.
#[inline]
pub(crate) fn contraction<const D: usize>(a: &Tensor<D>, b: &Tensor<D>) -> f64 {
    (0..D)
        .map(|i| (0..D).map(|j| a[i][j] * b[i][j]).sum::<f64>())
        .sum()
}

/// det a.
#[inline]
pub(crate) fn determinant<const D: usize>(a: &Tensor<D>) -> f64 {
    if D == 2 {
        a[0][0] * a[1][1] - a[0][1] * a[1][0]
    } else {
        (0..3).map(|j| a[0][j] * cofactor3(a, 0, j)).sum()
    }
}

/// a⁻¹ and det a. A singular tensor gives non-finite entries.
#[inline]
pub(crate) fn inverse<const D: usize>(a: &Tensor<D>) -> (Tensor<D>, f64) {
    let determinant = determinant(a);
    let scale = 1.0 / determinant;
    let inverse = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let cofactor = if D == 2 {
                let sign = if i == j { 1.0 } else { -1.0 };
                sign * a[1 - j][1 - i]
            } else {
                cofactor3(a, j, i)
            };
            cofactor * scale
        })
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
