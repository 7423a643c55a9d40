//! Longest lists of a scenario; a longer list counts as a mistake, and would need too much memory.

use super::ScenarioFile;
use super::wrong::{Wrong, wrong};

/// Most obstacles: each is a body of the physics.
const MAX_OBSTACLES: usize = 1000;
/// Largest number of estimators, and of instruments that a program adds: each has columns in a recording.
const MAX_ESTIMATORS: usize = 200;
/// Largest number of entries of any other list.
const MAX_ENTRIES: usize = 10_000;

/// Check the lists of a scenario file.
pub(super) fn check(file: &ScenarioFile) -> Result<(), Wrong> {
    for (key, length, most) in [
        ("obstacles", file.obstacles.len(), MAX_OBSTACLES),
        ("estimators", file.estimators.len(), MAX_ESTIMATORS),
        ("instruments", file.instruments.len(), MAX_ESTIMATORS),
        ("events", file.events.len(), MAX_ENTRIES),
        ("drive.speed", file.drive.speed.len(), MAX_ENTRIES),
        ("expect", file.expect.len(), MAX_ENTRIES),
        ("published", file.published.len(), MAX_ENTRIES),
    ] {
        if length > most {
            let message = format!("this list has {length} entries");
            return wrong(key, message, format!("at most {most}"));
        }
    }
    Ok(())
}
