//! Ctrl-C: the first ends the task in good order, the second at once.

use crate::ui::note::note;
use std::sync::atomic::{AtomicBool, Ordering};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Listen from now on.
pub fn listen() {
    let handler = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    if let Err(e) = handler {
        note(&format!("Ctrl-C will end the program at once: {e}"));
    }
}

/// Whether Ctrl-C has not been pressed.
pub fn go_on() -> bool {
    !INTERRUPTED.load(Ordering::Relaxed)
}
