//! Lines on standard error.

use crate::ui::terminal;
use monorig_lab::text::spelled_out;
use std::io::Write;

/// Write a line to standard error, unless the user wants none: a failure to write is ignored. Names in it may come from files, so
/// hidden characters are spelled out.
pub fn note(text: &str) {
    if !terminal::quiet() {
        error(text);
    }
}

/// The same of what only those want to know who ask for more, with -v.
pub fn detail(text: &str) {
    if terminal::verbose() {
        error(text);
    }
}

/// The same of an error, which is always written.
pub fn error(text: &str) {
    drawn(&spelled_out(text));
}

/// The same with what draws on a terminal left as it is.
pub fn drawn(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}
