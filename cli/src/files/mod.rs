//! Files named on the command line: their kinds, their checks, and the results of runs.

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
