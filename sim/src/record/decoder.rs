//! Decoders of other libraries, held at arm's length: they panic on some damaged files (arrow-ipc 58), and that ends here.

use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};

/// Run a decoder. A panic of it is an error, and nothing of it is printed.
pub fn guarded<T>(decode: impl FnOnce() -> T) -> Result<T, &'static str> {
    let hook = take_hook();
    set_hook(Box::new(|_| {}));
    let done = catch_unwind(AssertUnwindSafe(decode));
    set_hook(hook);
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
