//! monorig-logs: recorded logs in, as measurements of the loop.
//!
//! | room | what is in it |
//! |---|---|
//! | [`read`] | one file a format: rows of a log with stamp, arrival and place, in the order of the file, in chunks |
//! | [`merge`] | rows of several files in the order of time, read by a thread for each file |
//! | [`time`] [`units`] [`expression`] | stamps in ns, the closed list of units, expressions of columns |
//! | [`map`] | the map file: which column is which measurement |
//! | [`drive`] | rows through the map into steps of measurements, references and commands |
//! | [`replay`] | a log and its map as a [`Simulation`](monorig_sim::Simulation): the loop of a run, with a plant and instruments that play back |
//! | [`export`] | a run out as a log, with its map |
//! | `ghost` | the vehicle of the map on the drive of the log, beside it |
//! | [`identify`] | parameters of vehicle and instruments from a log whose mass and slope are known |
//! | [`noise`] [`standing`] | noise of a log, and the parameters of estimators that stand for it; its IMU while the vehicle stands |
//! | [`judge`] | estimates made elsewhere, played back beside those in the loop |
//! | [`inspect`] | what is in a log, and a map proposed for it |
//! | [`check`] | what is wrong with a log and its map, from the log alone |
//!
//! ```no_run
//! # fn main() -> Result<(), monorig_sim::Error> {
//! use monorig_logs::{map::Map, replay::{self, ReplayOptions}};
//! use monorig_sim::Registry;
//!
//! let map = Map::load("drive.map.yaml".as_ref())?;
//! let mut simulation = replay::simulation(&map, &ReplayOptions::default(), &Registry::default())?;
//! simulation.run(&mut [])?;
//! # Ok(())
//! # }
//! ```

pub mod check;
pub mod drive;
pub mod export;
pub mod expression;
mod ghost;
pub mod identify;
pub mod inspect;
pub mod judge;
pub mod map;
pub mod merge;
pub mod noise;
pub mod read;
pub mod replay;
pub mod standing;
pub mod time;
pub mod units;
mod wheel_radius;

use monorig_sim::error::{Error, InputError};
use std::path::Path;

/// Something wrong in a log: file, line (of text) or none, what is wrong, and what would be right.
pub fn wrong(
    file: &Path,
    line: Option<usize>,
    message: impl Into<String>,
    help: impl Into<String>,
) -> Error {
    InputError {
        file: file.into(),
        line,
        column: line.map(|_| 1),
        key: String::new(),
        message: message.into(),
        help: help.into(),
    }
    .into()
}

/// The operating system refused to read.
pub(crate) fn io(file: &Path, source: std::io::Error) -> Error {
    Error::Io {
        path: file.into(),
        source,
    }
}
