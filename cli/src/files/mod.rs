//! Files named on the command line: what kinds there are, how each is checked, what a run has left behind.

pub mod formats;
pub mod prepare;
pub mod results;
pub mod written;
