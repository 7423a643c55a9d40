//! The Rerun viewer, behind the feature `viewer`: a program built without it runs, tests, tunes and reports all the
//! same, but makes no recordings for the viewer and reads none.

#[cfg(feature = "viewer")]
mod rerun;
#[cfg(feature = "viewer")]
pub use rerun::{LIVE_CHUNK_S, read, sink};

#[cfg(not(feature = "viewer"))]
mod none;
#[cfg(not(feature = "viewer"))]
pub use none::{LIVE_CHUNK_S, read, sink};

/// The note shown once in place of a recording.
pub fn not_written(file: &str) -> String {
    format!("{file} is not written: this program was built without the viewer (feature `viewer`)")
}
