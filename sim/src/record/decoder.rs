//! Decoders of other libraries, held at arm's length: they panic on some damaged files (arrow-ipc 58), and that ends
//! here.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    /// True while a decoder runs on this thread.
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Run a decoder. A panic of it is an error, and nothing of it is printed. Panics elsewhere, on other threads too, are
/// printed as ever.
pub fn guarded<T>(decode: impl FnOnce() -> T) -> Result<T, &'static str> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let others = take_hook();
        set_hook(Box::new(move |panic| {
            if !GUARDED.get() {
                others(panic);
            }
        }));
    });
    let outer = GUARDED.replace(true);
    let done = catch_unwind(AssertUnwindSafe(decode));
    GUARDED.set(outer);
    done.map_err(|_| "its decoder can make nothing of it")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_error() {
        assert_eq!(guarded(|| 7), Ok(7));
        assert!(guarded(|| -> u8 { panic!("damaged") }).is_err());
    }
}
