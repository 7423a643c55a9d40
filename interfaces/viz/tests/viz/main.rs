//! Recordings for the viewer.

#![allow(clippy::unwrap_used)] // helpers of tests

mod made_up;
mod recording;
