//! Hilbert order: neighbours in space become neighbours in memory.

use crate::mesh::vector::bounds;

/// Bits of a Hilbert key along each axis. 65 536 cells are finer than the elements of any mesh that
/// fits into memory.
const BITS: u32 = 16;

/// Returns the order of `points` along a Hilbert curve through their bounding cube. Points in one
/// cell keep their order.
pub(super) fn hilbert_order<const D: usize>(points: &[[f64; D]]) -> Vec<u32> {
    let (low, high) = bounds(points.iter().copied());
    let extent = (0..D).map(|i| high[i] - low[i]).fold(0.0, f64::max);
    let cells = f64::from((1_u32 << BITS) - 1);
    let factor = if extent > 0.0 { cells / extent } else { 0.0 };
    let key = |point: &[f64; D]| {
        let cell: [u32; D] = std::array::from_fn(|i| ((point[i] - low[i]) * factor) as u32);
        hilbert_key(cell)
    };
    let mut keyed: Vec<_> = points.iter().map(key).zip(0..).collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, index)| index).collect()
}

/// Returns the position of a lattice cell on the Hilbert curve.
///
/// Source: J. Skilling, Programming the Hilbert curve, AIP Conf. Proc. 707 (2004) 381–387,
/// `AxestoTranspose`.
fn hilbert_key<const D: usize>(mut x: [u32; D]) -> u64 {
    let top = 1_u32 << (BITS - 1);
    let mut bit = top;
    while bit > 1 {
        let low = bit - 1;
        for i in 0..D {
            if x[i] & bit == 0 {
                let swap = (x[0] ^ x[i]) & low;
                x[0] ^= swap;
                x[i] ^= swap;
            } else {
                x[0] ^= low;
            }
        }
        bit >>= 1;
    }
    for i in 1..D {
        x[i] ^= x[i - 1];
    }
    let mut flip = 0;
    bit = top;
    while bit > 1 {
        if x[D - 1] & bit != 0 {
            flip ^= bit - 1;
        }
        bit >>= 1;
    }
    let mut key = 0;
    for place in (0..BITS).rev() {
        for axis in x {
            key = key << 1 | u64::from((axis ^ flip) >> place & 1);
        }
    }
    key
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a lattice of 2^n cells a side, each step of a Hilbert curve goes to a neighbouring cell.
    #[test]
    fn consecutive_cells_are_neighbours() {
        let side = 8;
        let lattice: Vec<[f64; 3]> = (0..side * side * side)
            .map(|n| [n % side, n / side % side, n / side / side].map(|i| f64::from(i) + 0.5))
            .collect();
        // Two far corners make the lattice fill the cube of keys.
        let corners = [[0.0; 3], [f64::from(side); 3]];
        let points = [&lattice[..], &corners[..]].concat();
        let order = hilbert_order(&points);
        let on_lattice: Vec<_> = order
            .into_iter()
            .filter(|&i| (i as usize) < lattice.len())
            .collect();
        for pair in on_lattice.windows(2) {
            let [a, b] = [lattice[pair[0] as usize], lattice[pair[1] as usize]];
            let step: f64 = (0..3).map(|i| (a[i] - b[i]).abs()).sum();
            assert!((step - 1.0).abs() < 1e-12, "{a:?} to {b:?}");
        }
    }
}
