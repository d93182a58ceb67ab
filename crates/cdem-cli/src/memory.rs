//! Settings of the C library's allocator for large arrays.
//!
//! By default glibc raises its threshold for large arrays to the largest array freed so far, and
//! keeps the memory between smaller ones: a third of the memory of a run with a million elements.

/// Size from which arrays go back to the system while a model is built, bytes. There each array is
/// allocated once.
const BUILDING: i32 = 128 << 10;

/// Size from which arrays go back to the system while a model steps, bytes. Smaller ones, such as
/// those of a frame's compressor and the velocities of blocks in contact, are allocated again and
/// again; the system would clear each one anew.
const STEPPING: i32 = 2 << 20;

/// Sets the threshold for everything before the first step.
pub(crate) fn before_steps() {
    give_back_from(BUILDING);
}

/// Sets the threshold for the steps.
pub(crate) fn while_stepping() {
    give_back_from(STEPPING);
}

#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(unsafe_code, reason = "sets a number of the C library's allocator")]
fn give_back_from(bytes: i32) {
    // SAFETY: mallopt takes the allocator's lock, and accepts any number for this parameter.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, bytes);
    }
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn give_back_from(_: i32) {}
