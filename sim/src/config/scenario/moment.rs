//! Moments of a run by name: where a part of the vehicle passes an element of the track, or when an event happens.
//!
//! ```yaml
//! after: {rear_enters: climb}             # all of the train is on the element that the track file names `climb`
//! until: {event: brake, plus_s: -1}       # a second before the event that the scenario names `brake`
//! after: {event_end: outage, plus_s: 20}  # 20 s after a fault with from_s and to_s
//! ```

use crate::config::checked::Finite;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A moment of a run; exactly one key besides `plus_s`. A place is passed when it is first come to in the direction of
/// growing chainage. Names of places are those of track elements and of stretches of another adhesion.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Moment {
    /// The front of the vehicle reaches the begin of this place.
    pub(crate) front_enters: Option<String>,
    /// The front reaches the end of this place.
    pub(crate) front_leaves: Option<String>,
    /// The IMU reaches the begin of this place.
    pub(crate) imu_enters: Option<String>,
    /// The IMU reaches the end of this place.
    pub(crate) imu_leaves: Option<String>,
    /// The rear reaches the begin of this place: all of the vehicle is on it, or beyond.
    pub(crate) rear_enters: Option<String>,
    /// The rear reaches the end of this place: all of the vehicle has passed it.
    pub(crate) rear_leaves: Option<String>,
    /// This event happens or begins, for the first time if it repeats; or this point of the speed reference is reached.
    pub(crate) event: Option<String>,
    /// This event ends.
    pub(crate) event_end: Option<String>,
    /// Offset added to the moment, s; negative = earlier.
    pub(crate) plus_s: Option<Finite>,
}

/// A part of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VehiclePart {
    /// Front of the vehicle.
    Front,
    /// IMU of the vehicle.
    Imu,
    /// Rear of the vehicle.
    Rear,
}

/// A moment, resolved against track and events.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MomentOf {
    /// A part of the vehicle reaches a chainage, m; plus an offset, s.
    Passing(VehiclePart, f64, f64),
    /// An instant, s.
    Instant(f64),
}

impl Moment {
    /// Given keys with their names.
    pub(super) fn given(&self) -> Vec<(&'static str, &str)> {
        [
            ("front_enters", &self.front_enters),
            ("front_leaves", &self.front_leaves),
            ("imu_enters", &self.imu_enters),
            ("imu_leaves", &self.imu_leaves),
            ("rear_enters", &self.rear_enters),
            ("rear_leaves", &self.rear_leaves),
            ("event", &self.event),
            ("event_end", &self.event_end),
        ]
        .into_iter()
        .filter_map(|(key, name)| Some((key, name.as_deref()?)))
        .collect()
    }
}

impl fmt::Display for Moment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (key, name) in self.given() {
            match key.split_once('_') {
                Some(("event", _)) => write!(f, "when {name} ends")?,
                Some((part, does)) => write!(f, "where the {part} {does} {name}")?,
                None => write!(f, "when {name} begins")?,
            }
        }
        match self.plus_s.map_or(0.0, Finite::get) {
            0.0 => Ok(()),
            s if s > 0.0 => write!(f, " plus {s} s"),
            s => write!(f, " minus {} s", -s),
        }
    }
}
