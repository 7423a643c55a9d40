//! Shared by the tests of several crates: random numbers and damaged files. Depends on nothing, so that every crate
//! can use it.

pub mod mutants;
pub mod random;

pub use mutants::mutant;
pub use random::Random;
