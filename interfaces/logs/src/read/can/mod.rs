//! CAN: frames of any file made values by a database of messages; a table a message, a column a signal.

pub(super) mod candump;
pub(super) mod dbc;
mod frames;
#[cfg(feature = "blf")]
pub(super) mod vector;
