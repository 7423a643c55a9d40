//! Laws across the crates: the physics, the source itself, the documents.

#![allow(clippy::unwrap_used)] // helpers of tests

mod docs;
mod events;
mod keys;
mod locks;
mod own_parts;
mod physics_laws;
mod road_laws;
mod source;
mod tuning;
