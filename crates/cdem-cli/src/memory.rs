//! How the C library's allocator treats large arrays.

/// Arrays of so many bytes are taken from the system one by one, and go back to it.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const LARGE: libc::c_int = 128 << 10;

/// Gives what a model took while it was built, and frames while they were written, back to the
/// system: glibc would raise its bound to the largest array freed so far and keep what lies
/// between smaller ones, a third of the memory of a run of a million elements.
pub(crate) fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    #[allow(
        unsafe_code,
        reason = "sets a number of the allocator, before it has threads"
    )]
    // SAFETY: mallopt may be called at any time, and this parameter takes any number.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE);
    }
}
