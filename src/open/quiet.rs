//! Decoders that panic on damaged input, kept from telling the terminal.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

static HOOKED: Once = Once::new();

/// What `work` returns; `None` if it panics, about which nothing is printed: the caller has a better message, with the
/// place in the file. The hook belongs to the whole process, so it is set once, stays, and hands every panic that does
/// not come from here, on this thread, to the hook that was there before.
pub(super) fn catch_quietly<T>(work: impl FnOnce() -> T) -> Option<T> {
    HOOKED.call_once(|| {
        let before = take_hook();
        set_hook(Box::new(move |panic| {
            if !QUIET.get() {
                before(panic);
            }
        }));
    });
    QUIET.set(true);
    let caught = catch_unwind(AssertUnwindSafe(work));
    QUIET.set(false);
    caught.ok()
}

#[cfg(test)]
mod tests {
    use super::catch_quietly;

    #[test]
    fn a_panic_is_no_value_and_the_next_work_is_done() {
        assert_eq!(catch_quietly(|| [1, 2, 3][std::hint::black_box(3)]), None);
        assert_eq!(catch_quietly(|| 7), Some(7));
    }
}
