//! Panics as values.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    /// The last panic of this thread, while it is being watched.
    static WATCHED: RefCell<Option<Panic>> = const { RefCell::new(None) };
}

/// Where a panic happened and what it said.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panic {
    /// `src/lower.rs:12`
    pub place: String,
    /// Its message.
    pub message: String,
}

/// Runs `work` and catches its panic, of which nothing is printed.
pub fn caught<T>(work: impl FnOnce() -> T) -> Result<T, Panic> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let usual = take_hook();
        set_hook(Box::new(move |info| {
            let is_watched = WATCHED.with_borrow_mut(|watched| match watched {
                Some(panic) => {
                    let place = info.location();
                    panic.place =
                        place.map_or_else(String::new, |at| format!("{}:{}", at.file(), at.line()));
                    panic.message = info.to_string();
                    true
                }
                None => false,
            });
            if !is_watched {
                usual(info);
            }
        }));
    });
    WATCHED.set(Some(Panic::default()));
    let result = catch_unwind(AssertUnwindSafe(work));
    let panic = WATCHED.take().unwrap_or_default();
    result.map_err(|_| panic)
}
