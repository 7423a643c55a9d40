//! Checks of a log and its map, from the log alone: each is a number and a verdict.
//!
//! | file | what it holds |
//! |---|---|
//! | `series` | the log in windows of a second |
//! | `statistics` | regression and correlation |
//! | `lag` | the lag of a channel against the wheels |
//! | `rules` | the checks of values |
//! | `channels` | the checks of each channel by itself: rate, gaps, share that counts, values that stay |
//! | `reference` | the checks of the reference slope: time, sign, unit |
//! | `mounting` | the checks of how the IMU is built in: box, axes, drift |
//! | `verdict` | a check and its verdict |
//! | `inspect` | the contents of a log |
//! | `proposal` | a map proposed for a log |

mod channels;
mod inspect;
mod lag;
mod mounting;
mod proposal;
mod reference;
mod rules;
mod series;
mod statistics;
mod verdict;

pub use inspect::{Inspection, TableReport, inspect};
pub use proposal::{InspectedFile, proposed_map};
pub use verdict::{ChannelReport, Check, Verdict};

pub use reference::identify;
pub(crate) use reference::reference;

use crate::drive::{Plan, calibrate};
use crate::map::Map;
use monorig_sim::error::Error;
use std::path::Path;

/// Checks a log with its map: the whole log is read once.
pub fn check(map: &Map) -> Result<Vec<Check>, Error> {
    report(map).map(|(checks, _)| checks)
}

/// A map proposed for a log, with the axes that the log shows where it can be read with that map.
pub fn with_axes(text: String, log: &Path) -> String {
    let shown = || {
        let map = Map::of_text(text.replace("???", "1"), log).ok()?;
        let series = series::Series::read(&map, &Plan::new(&map).ok()?).ok()?;
        let (axes, _) = mounting::axes_by_log(&map, &series)?;
        Some(text.replace(proposal::AXES, &format!("axes: [{axes}]")))
    };
    shown().unwrap_or(text.clone())
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
    all.extend(reference(&series.balance, series.slope_sd));
    all.extend(mounting::all(map, &plan, &series));
    all.extend(channels::all(&series));
    Ok((all, channels::reports(&series)))
}
