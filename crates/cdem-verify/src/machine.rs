//! What the machine gives, on all threads: limits that kernels are held against in the same run.

use std::hint::black_box;
use std::time::Instant;

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::timing::TRIALS;

/// Numbers of each array of the triad: more than caches hold.
const TRIAD: usize = 16 << 20;

/// Registers that are worked on, so that an operation need not wait for the one before: with the two
/// constants all that AVX2 has.
const REGISTERS: usize = 14;

/// Times that each is multiplied and added to.
const ROUNDS: usize = 4_000_000;

/// Bytes a second of a = b + s c (McCalpin's STREAM), those that the caches fetch only to overwrite
/// them not counted.
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

/// Additions and multiplications a second of numbers in registers, as many side by side as these
/// hold. None are fused: kernels fuse none, for the same bits on all machines.
#[must_use]
pub fn peak_arithmetic() -> f64 {
    let mut operations = 0;
    let seconds = best_of(|| {
        let of_threads = rayon::broadcast(|_| Arch::new().dispatch(InRegisters));
        operations = of_threads.into_iter().sum();
    });
    operations as f64 / seconds
}

/// What a thing takes at best, s.
fn best_of(mut work: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..TRIALS {
        let began = Instant::now();
        work();
        best = best.min(began.elapsed().as_secs_f64());
    }
    best
}

/// Tells how many operations it did.
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
