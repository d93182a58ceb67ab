//! How the C library's allocator treats large arrays.
//!
//! Left alone, glibc raises its bound of what is large to the largest array freed so far, and
//! keeps what lies between smaller ones: a third of the memory of a run of a million elements.

/// Arrays of so many bytes go back to the system while a model is built, where each is taken
/// once.
const BUILDING: i32 = 128 << 10;

/// Arrays of so many bytes go back while a model steps, where smaller ones, as a frame's
/// compressor's and the velocities of blocks that touch, are taken again and again: the system
/// would clear each anew.
const STEPPING: i32 = 2 << 20;

/// For all that is done before the first step.
pub(crate) fn before_steps() {
    give_back_from(BUILDING);
}

/// From the first step on.
pub(crate) fn while_stepping() {
    give_back_from(STEPPING);
}

#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(unsafe_code, reason = "sets a number of the C library's allocator")]
fn give_back_from(bytes: i32) {
    // SAFETY: mallopt takes the allocator's lock, and any number for this parameter.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, bytes);
    }
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn give_back_from(_: i32) {}
