//! Prefetch of memory. A kernel has so few instructions per byte that hardware prefetchers are too
//! late.

/// Bytes of a cache line.
const LINE: usize = 64;

/// Prefetches the memory of `values` without waiting.
#[cfg(target_arch = "x86_64")]
#[allow(
    unsafe_code,
    reason = "an instruction that never faults gets an address"
)]
#[inline(always)]
pub(super) fn prefetch<T>(values: &[T]) {
    use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
    let first = values.as_ptr().cast::<i8>();
    for offset in (0..size_of_val(values)).step_by(LINE) {
        // SAFETY: the instruction takes any address; this one is within the slice.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(first.add(offset)) };
    }
}

/// Does nothing: prefetch is implemented on x86-64 only.
#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
pub(super) fn prefetch<T>(_: &[T]) {}
