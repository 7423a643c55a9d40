//! Text that may not be UTF-8.

use std::borrow::Cow;

/// Bytes as text: UTF-8, else each byte a character of Latin-1.
pub(super) fn of_bytes(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(bytes.iter().map(|b| *b as char).collect()),
    }
}
