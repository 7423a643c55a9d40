//! Files named on the command line: what kinds there are, how each is checked, what a run has left behind.

pub(crate) mod broken;
pub(crate) mod csv;
pub(crate) mod folders;
pub(crate) mod formats;
pub(crate) mod load;
pub(crate) mod out;
pub(crate) mod prepare;
pub(crate) mod report;
pub(crate) mod results;
pub(crate) mod scenarios;
pub(crate) mod schema_words;
pub(crate) mod share;
pub(crate) mod written;
