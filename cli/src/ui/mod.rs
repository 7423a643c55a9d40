//! The terminal: help, progress, tables, errors, Ctrl-C.

pub mod colour;
pub mod errors;
pub mod help;
pub mod interrupt;
pub mod note;
pub mod output;
pub mod progress;
pub mod prose;
pub mod summary;
pub mod tables;
pub mod terminal;
