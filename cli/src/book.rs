//! The Rust blocks of the book, compiled as tests of the documentation. `tests/laws/docs.rs` sees to it that every page
//! with such a block is here.

#[doc = include_str!("../../docs/src/own_parts.md")]
struct OwnParts;
