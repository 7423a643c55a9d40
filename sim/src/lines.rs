//! Lines of files and pipes from other programs: of bounded length.

use std::io::{BufRead, Error, ErrorKind, Read, Result};

/// Reads a line with its end, of a limited number of bytes, and appends it to `line`. False at the end.
pub fn read_line(from: &mut impl BufRead, most: u64, line: &mut Vec<u8>) -> Result<bool> {
    let read = from.take(most + 1).read_until(b'\n', line)?;
    match read as u64 > most {
        true => Err(Error::new(
            ErrorKind::InvalidData,
            format!("a line of more than {most} bytes"),
        )),
        false => Ok(read > 0),
    }
}
