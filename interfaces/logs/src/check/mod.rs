//! Checks of a log and its map, from the log alone: each is a number and a verdict.
//!
//! | file | what it holds |
//! |---|---|
//! | `series` | the log in windows of a second |
//! | `statistics` | regression and correlation |
//! | `lag` | the lag of a channel against the wheels |
//! | `rules` | the checks of values |
//! | `channels` | the checks of each channel by itself: rate, gaps, share that counts, values that stay |
//! | `mounting` | the checks of how the IMU is built in: box, axes, drift |
//! | `inspect` | the contents of a log |
//! | `proposal` | a map proposed for a log |

mod channels;
mod inspect;
mod lag;
mod mounting;
mod proposal;
mod rules;
mod series;
mod statistics;

pub use inspect::{Inspection, TableReport, inspect};
pub use proposal::{InspectedFile, proposed_map};

use crate::drive::{Plan, calibrate};
use crate::map::Map;
use monorig_sim::error::Error;

/// The verdict of a check.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// Nothing is wrong.
    Good,
    /// Something is wrong, and what it may be.
    Bad(String),
    /// The log does not show it, and why.
    Unknown(String),
}

/// A check: the quantity, the number that was found, and its meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// The quantity that was checked.
    pub what: String,
    /// The number; not a number where there is none.
    pub value: f64,
    /// Its unit.
    pub unit: &'static str,
    /// The good numbers, in words.
    pub good: String,
    /// Its meaning.
    pub verdict: Verdict,
}

/// Figures of the samples of a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelReport {
    /// Its name.
    pub name: String,
    /// Samples per second, by the median step, Hz.
    pub rate_hz: f64,
    /// Standard deviation of the steps that are no gaps, ms.
    pub jitter_ms: f64,
    /// Steps of more than five times the median.
    pub gaps: u64,
    /// The longest of them, s; 0 of none.
    pub longest_gap_s: f64,
    /// Samples with the stamp of the one before.
    pub duplicates: u64,
    /// Share of the samples that count.
    pub valid: f64,
}

/// Checks a log with its map: the whole log is read once.
pub fn check(map: &Map) -> Result<Vec<Check>, Error> {
    report(map).map(|(checks, _)| checks)
}

/// The checks of a log with its map, and the figures of each channel.
pub fn report(map: &Map) -> Result<(Vec<Check>, Vec<ChannelReport>), Error> {
    let mut plan = Plan::new(map)?;
    let mut all = Vec::new();
    match calibrate(map, &mut plan) {
        Ok(_) => {}
        Err(Error::Input(e)) if e.key.contains("calibrate") => all.push(Check {
            what: "calibration".into(),
            value: f64::NAN,
            unit: "",
            good: "the vehicle stands".into(),
            verdict: Verdict::Bad(e.message),
        }),
        Err(e) => return Err(e),
    }
    let series = series::Series::read(map, &plan)?;
    all.extend(rules::all(map, &plan, &series));
    all.extend(mounting::all(map, &plan, &series));
    all.extend(channels::all(&series));
    Ok((all, channels::reports(&series)))
}
