//! Shared by the tests of several crates: random numbers, damaged files, tools of the machine. Depends on nothing, so
//! that every crate can use it.

pub mod mutants;
pub mod random;
pub mod tools;

pub use mutants::mutant;
pub use random::Random;
pub use tools::{c_compiler, tools};
