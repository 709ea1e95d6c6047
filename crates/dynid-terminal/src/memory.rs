//! The memory of the program: where it comes from, and when it goes back to the system.

/// The C library musl maps large blocks one by one and gives them back at once, which makes a design three times slower.
#[cfg(target_env = "musl")]
#[global_allocator]
static ALLOCATOR: dlmalloc::GlobalDlmalloc = dlmalloc::GlobalDlmalloc;

/// Gives back what is free, between the steps of a run.
///
/// The C library of GNU keeps what a thread freed for that thread, and up to twice the largest block of each: with a log of a million rows
/// a third of the log's peak. Elsewhere nothing is done.
pub(crate) fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    #[expect(
        unsafe_code,
        reason = "a function of the C library that takes no pointer and leaves blocks in use alone"
    )]
    // SAFETY: `malloc_trim` may be called at any time from any thread.
    unsafe {
        libc::malloc_trim(0);
    }
}
