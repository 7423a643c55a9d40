//! monorig-logs: recorded logs in, as measurements of the loop.
//!
//! | room | what is in it |
//! |---|---|
//! | `notation` | times, units and formulas of columns, as logs and map files write them |
//! | [`read`] | one file a format: rows with stamp, arrival and place, in chunks; several files merged on one clock |
//! | [`map`] | the map file: the measurement that each column is |
//! | [`drive`] | rows through the map into steps of measurements, references and commands |
//! | [`identify`] | parameters of vehicle and instruments from a log whose mass and slope are known; its noise |
//! | [`replay`] | a log and its map as a [`Simulation`](monorig_sim::Simulation): the loop of a run, with a plant and instruments that play back |
//! | [`check`] | the contents of a log, and checks of it and its map |
//! | [`export`] | a run out as a log, with its map |
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
pub mod identify;
pub mod map;
mod notation;
pub mod read;
pub mod replay;

use monorig_sim::error::Error;
pub(crate) use monorig_sim::error::wrong;
use std::path::Path;

/// The operating system refused to read.
pub(crate) fn io(file: &Path, source: std::io::Error) -> Error {
    Error::at(file)(source)
}
