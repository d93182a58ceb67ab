//! Memory that is asked for before it is read: a kernel has so few instructions for its bytes
//! that processors which guess what comes next ask too late.

/// Bytes that come from memory together.
const LINE: usize = 64;

/// Asks for what these hold, and waits for nothing.
#[cfg(target_arch = "x86_64")]
#[allow(
    unsafe_code,
    reason = "an instruction that never faults gets an address"
)]
#[inline(always)]
pub(super) fn ask_for<T>(values: &[T]) {
    use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
    let first = values.as_ptr().cast::<i8>();
    for offset in (0..size_of_val(values)).step_by(LINE) {
        // SAFETY: the instruction takes any address; this one is within the slice.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(first.add(offset)) };
    }
}

/// Asks for nothing: that is done on x86-64 alone.
#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
pub(super) fn ask_for<T>(_: &[T]) {}
