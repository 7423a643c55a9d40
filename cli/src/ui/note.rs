//! Words on standard error.

use std::io::Write;

/// Write a line to standard error; there is nobody to tell if that fails.
pub fn note(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}
