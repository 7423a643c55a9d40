//! Runs foreign code so that its panics become errors: decoders of other libraries, which panic on some damaged files
//! (arrow-ipc 58), and the estimators, controllers and plants of a program of one's own.

use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    /// True while foreign code runs on this thread.
    static GUARDED: Cell<bool> = const { Cell::new(false) };
    /// Message of the last panic of foreign code, with its place.
    static TOLD: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Runs foreign code. A panic of it is an error with its message and place, and nothing of it is printed. Panics
/// elsewhere, on other threads too, are printed as ever.
pub fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let others = take_hook();
        set_hook(Box::new(move |panic| match GUARDED.get() {
            true => TOLD.set(told(panic)),
            false => others(panic),
        }));
    });
    let outer = GUARDED.replace(true);
    let done = catch_unwind(AssertUnwindSafe(work));
    GUARDED.set(outer);
    done.map_err(|_| TOLD.take())
}

/// Runs a decoder. The words of its panics are of no use to whoever has a damaged file.
pub fn decoded<T>(decode: impl FnOnce() -> T) -> Result<T, &'static str> {
    guarded(decode).map_err(|_| "the decoder cannot read it")
}

/// The message of a panic and the place in the source: "no such wheel (src/main.rs:12)".
fn told(panic: &PanicHookInfo<'_>) -> String {
    let message = panic.payload_as_str().unwrap_or("it panicked");
    match panic.location() {
        Some(place) => format!("{message} ({}:{})", place.file(), place.line()),
        None => message.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_error_with_its_message_and_place() {
        assert_eq!(guarded(|| 7), Ok(7));
        let wheel = 3;
        for (told, message) in [
            (guarded(|| panic!("damaged")), "damaged ("),
            (guarded(|| panic!("no wheel {wheel}")), "no wheel 3 ("),
            (guarded(|| std::panic::panic_any(5)), "it panicked ("),
        ] {
            let told: String = told.unwrap_err();
            assert!(
                told.starts_with(message) && told.contains("guarded.rs:"),
                "{told}"
            );
        }
    }

    /// Within guarded code another panic is one of the inner part, and the outer one goes on.
    #[test]
    fn guards_nest() {
        let outer = guarded(|| guarded(|| panic!("inner")).map(|()| 1).is_err());
        assert_eq!(outer, Ok(true));
    }
}
