//! Lines on standard error.

use crate::ui::terminal;
use monorig_lab::text::spelled_out;
use std::io::Write;

/// Writes a line to standard error, except with -q. A failure to write is ignored. Names in it may come from
/// files, so hidden characters are spelled out.
pub fn note(text: &str) {
    if !terminal::quiet() {
        error(text);
    }
}

/// Writes a line to standard error at verbosity 1 (-v) and above.
pub fn detail(text: &str) {
    if terminal::verbose() {
        error(text);
    }
}

/// Writes an error to standard error, also with -q.
pub fn error(text: &str) {
    drawn(&spelled_out(text));
}

/// Writes text with control characters of a terminal to standard error, unchanged.
pub fn drawn(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}
