//! Lines on standard error.

use std::io::Write;

/// Write a line to standard error: a failure to write is ignored.
pub fn note(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}
