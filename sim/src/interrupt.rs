//! The wish to end, such as Ctrl-C: the loop and everything that waits for parts of others look for it.

use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Asks everything to end in good order; true if that was asked for before.
pub fn request() -> bool {
    REQUESTED.swap(true, Ordering::Relaxed)
}

/// True once everything is to end.
pub fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}
