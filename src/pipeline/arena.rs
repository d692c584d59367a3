//! One heap for all threads, and what is free in it goes back between stages.
//!
//! GNU's allocator gives every thread a heap of its own and leaves what is freed there to that thread: with eight
//! threads and a budget of 128 MiB it held 304 MiB, with one heap 130, in the same time. Blocks of 32 MiB
//! and more are not taken from heaps at all.
//!
//! # Contract
//! `mallopt` sets a number inside the allocator and is safe by itself. It is called before other threads are
//! started, since it does not change threads that have a heap already. `malloc_trim` and `mallinfo` take the heap's own
//! lock; `mallinfo`, which every version of the library has, may run beside anything but `mallopt` and the first allocation.
#![allow(unsafe_code)]

/// Blocks below this size come from the heap, bytes: the largest that the allocator takes.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const OWN_PAGES_BYTES: libc::c_int = 32 << 20;
/// What may lie idle at the end of the heap, bytes.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const IDLE_BYTES: libc::c_int = 64 << 20;

/// Makes all threads that are started from now on share one heap, which keeps some of what is freed: pages that the
/// system takes and gives again are cleared each time (4 % of the time of a million triangles). A program does this
/// first; a library leaves it to the program.
pub fn share_one_heap() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: the calls have no preconditions. If they are refused, memory is only used less sparingly.
    unsafe {
        libc::mallopt(libc::M_ARENA_MAX, 1);
        libc::mallopt(libc::M_MMAP_THRESHOLD, OWN_PAGES_BYTES);
        libc::mallopt(libc::M_TRIM_THRESHOLD, IDLE_BYTES);
    }
}

/// Gives back to the system what is free in the heap, where that is much. The next stage does not need it in the same
/// pieces: the index of 10 million triangles left 190 MiB, which lay idle beside the largest tiles.
pub fn return_free_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: `share_one_heap` has returned before anything is computed. Figures above 4 GiB wrap round: then what is free
    // may stay until the next stage.
    unsafe {
        if libc::mallinfo().fordblks as u32 > IDLE_BYTES as u32 {
            libc::malloc_trim(0);
        }
    }
}
