//! Fault of a scenario file: key, message, help.

/// A mistake in a scenario: its key, the message and the remedy.
#[derive(Debug)]
pub(super) struct Wrong {
    pub key: String,
    pub message: String,
    pub help: String,
}

pub(super) fn wrong<T>(
    key: impl Into<String>,
    message: impl Into<String>,
    help: impl Into<String>,
) -> Result<T, Wrong> {
    Err(Wrong {
        key: key.into(),
        message: message.into(),
        help: help.into(),
    })
}
