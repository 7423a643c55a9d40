//! Writing to standard output without panicking when its reader has gone or the disk is full.

use crate::errors::CliError;
use std::io::{ErrorKind, Write};

/// Write text to standard output, and see that it has arrived.
pub fn print(text: &str) -> Result<(), CliError> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())
        .and_then(|()| out.flush())
        .map_err(|e| match e.kind() {
            ErrorKind::BrokenPipe => CliError::ReaderGone,
            _ => CliError::Output(e),
        })
}

/// Write a line to standard error; there is nobody to tell if that fails.
pub fn note(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}
