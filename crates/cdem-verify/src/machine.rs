//! Limits of the machine on all threads: memory bandwidth and arithmetic. Kernels are compared with
//! them in the same run.

use std::hint::black_box;
use std::time::Instant;

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::timing::TRIALS;

/// Length of each array of the triad, larger than the caches.
const TRIAD: usize = 16 << 20;

/// Registers in use, enough to hide the latency of an operation. With the two constants they fill
/// the 16 of AVX2.
const REGISTERS: usize = 14;

/// Number of multiply-add rounds for each register.
const ROUNDS: usize = 4_000_000;

/// Measures the memory bandwidth of a = b + s c (McCalpin's STREAM), bytes/s. Write-allocate
/// traffic (lines read only to be overwritten) is not counted.
#[must_use]
pub fn triad() -> f64 {
    let [mut a, b, c] = [0.0, 1.0, 2.0].map(|x| vec![x; TRIAD]);
    let share = TRIAD.div_ceil(rayon::current_num_threads());
    let seconds = best_of(|| {
        let parts = a.par_chunks_mut(share).zip(b.par_chunks(share));
        parts
            .zip(c.par_chunks(share))
            .for_each(|((a, b), c): ((&mut [f64], &[f64]), &[f64])| {
                for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                    *a = b + 3.0 * c;
                }
            });
        black_box(&mut a);
    });
    (3 * 8 * TRIAD) as f64 / seconds
}

/// Measures additions and multiplications per second in registers, with SIMD. None are fused,
/// because kernels fuse none in order to give the same bits on all machines.
#[must_use]
pub fn peak_arithmetic() -> f64 {
    let mut operations = 0;
    let seconds = best_of(|| {
        let of_threads = rayon::broadcast(|_| Arch::new().dispatch(InRegisters));
        operations = of_threads.into_iter().sum();
    });
    operations as f64 / seconds
}

/// Returns the shortest time of `work`, s.
fn best_of(mut work: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..TRIALS {
        let began = Instant::now();
        work();
        best = best.min(began.elapsed().as_secs_f64());
    }
    best
}

/// Counts its operations: the output is their number.
struct InRegisters;

impl WithSimd for InRegisters {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> usize {
        let [half, one] = black_box([0.5, 1.0]).map(|x| simd.splat_f64s(x));
        let mut numbers = [one; REGISTERS];
        for _ in 0..ROUNDS {
            for number in &mut numbers {
                *number = simd.add_f64s(simd.mul_f64s(*number, half), one);
            }
        }
        black_box(&mut numbers);
        2 * REGISTERS * S::F64_LANES * ROUNDS
    }
}
