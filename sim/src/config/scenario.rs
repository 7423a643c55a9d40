//! The scenario file, read and checked.

mod check;
mod check_expect;
mod controller;
mod estimator;
mod event;
mod expect;
mod external;
mod fault_kind;
mod find_moment;
mod instrument;
mod integrity;
mod lengths;
mod load;
mod moment;
mod named_part;
mod names;
mod nominal_vehicle;
mod parameters;
mod plant_kind;
mod published;
mod seeds;
mod wrong;

pub(crate) use controller::DEFAULT_CONTROLLER;
pub use controller::{ControllerKeys, ControllerSettings};
pub use estimator::{EstimatorKeys, Settings};
pub use event::Event;
pub use expect::{Availability, Expectation, KnownFailure, KnownFailureEntry, known_failures};
pub use external::{AnswerFaults, External, SignalNumbers, Way};
pub use fault_kind::{Axis, FaultKind};
pub use instrument::InstrumentKeys;
pub(crate) use instrument::InstrumentSettings;
pub use integrity::{Integrity, IntegrityLimits};
pub use load::{LogScenario, Scenario};
pub use moment::{Moment, MomentOf, VehiclePart};
pub use named_part::{NamedPart, PartKeys};
pub use names::valid_name;
pub use nominal_vehicle::{NominalVehicle, ToldValue};
pub use parameters::{ParameterFile, ParameterValue, Provenance};
pub use plant_kind::{PlantKeys, PlantKind, PlantSettings};
pub use published::Published;
pub use seeds::Seeds;

pub use crate::control::FeedForward;

use crate::config::checked::{Finite, NonNegative, Positive, Version1};
use crate::config::file::Document;
use crate::control::Cycle;
use crate::error::Error;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A scenario file.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScenarioFile {
    /// Format version, 1.
    pub(crate) version: Version1,
    /// Purpose of the scenario: the effect it shows.
    pub why: String,
    /// Track file, relative to this file.
    pub(crate) track: String,
    /// Train file, relative to this file; or `car`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) train: Option<String>,
    /// Car file, relative to this file, instead of `train`; the track is then a road.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) car: Option<String>,
    /// Load on the hook.
    #[serde(default)]
    pub load: Load,
    /// Chainage and speed at the start.
    #[serde(default)]
    pub(crate) start: Start,
    /// When the run ends.
    pub(crate) stop: Stop,
    /// Physics step and plant.
    #[serde(default)]
    pub physics: Physics,
    /// Drive cycle and controller.
    pub drive: DriveCycle,
    /// Sensor data sheet, relative to this file.
    pub(crate) sensors: String,
    /// Instruments that the program adds beside the instruments of the sheet, by name, with their parameters.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) instruments: BTreeMap<String, InstrumentSettings>,
    /// Nominal values given to estimators and controller where they differ from the train's data sheet.
    #[serde(default)]
    pub(crate) vehicle: NominalVehicle,
    /// Estimators by name, with their parameters; `is` names the type of an estimator with another name, `from` a
    /// parameter file.
    #[serde(default)]
    pub estimators: BTreeMap<String, Settings>,
    /// The estimator whose output the controller gets, by its name in `estimators`.
    #[serde(default)]
    pub in_loop: Option<String>,
    /// Events of the run.
    #[serde(default)]
    pub(crate) events: Vec<Event>,
    /// Obstacles beside the rail.
    #[serde(default)]
    pub(crate) obstacles: Vec<Obstacle>,
    /// The roadway around the rail; none = open space.
    #[serde(default)]
    pub(crate) roadway: Option<Roadway>,
    /// Seeds to run: a number, `1..10`, or a list; 1 if not given.
    #[serde(default)]
    pub seeds: Seeds,
    /// Recording rates.
    #[serde(default)]
    pub(crate) record: Record,
    /// Bounds that the run must hold (checked by `monorig test`).
    #[serde(default)]
    pub expect: Vec<Expectation>,
    /// Least shares of the time in which estimates are marked valid, for quantities whose error `expect` bounds without
    /// another availability.
    #[serde(default)]
    pub availability: Availability,
    /// Limits beyond which an estimate marked valid is misleading; no estimator may mislead.
    #[serde(default)]
    pub integrity: Integrity,
    /// Bounds of `expect` that cannot hold, for reasons of physics.
    #[serde(
        default,
        skip_serializing_if = "Vec::is_empty",
        deserialize_with = "known_failures"
    )]
    #[schemars(with = "Vec<KnownFailureEntry>")]
    pub known_failures: Vec<KnownFailure>,
    /// Published figures for this set-up (shown by `monorig compare`).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub published: Vec<Published>,
}

/// Load on the hook.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Mass, kg; none = the mass in the load's URDF.
    pub mass_kg: Option<NonNegative>,
}

/// Chainage and speed at the start.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Start {
    /// Chainage of the train's front, m; none = the whole train is on the track with 1 m of free rail behind it.
    #[serde(default)]
    pub chainage_m: Option<NonNegative>,
    /// Speed, m/s.
    #[serde(default = "zero")]
    pub speed_mps: Finite,
}

/// End of the run: the condition that comes first; at least one is needed.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Stop {
    /// s.
    pub after_s: Option<Positive>,
    /// Chainage of the train's front, m. A train that has not come there after `after_s`, or after
    /// [`Stop::PATIENCE_S`] if that is not given, has not finished.
    pub at_m: Option<Positive>,
}

impl ScenarioFile {
    /// Times of the events that begin after the end of the run, s.
    pub fn never_s(&self) -> impl Iterator<Item = f64> {
        let times = self.events.iter().filter_map(Event::times_s);
        let end_s = self.stop.time_limit_s();
        times.map(|(from_s, _)| from_s).filter(move |s| *s >= end_s)
    }

    /// Returns the plant of the run: the named plant, else the plant of a car, else rapier.
    pub fn plant(&self) -> PlantKind {
        self.physics.plant.clone().unwrap_or(match self.car {
            Some(_) => PlantKind::Road,
            None => PlantKind::Rapier,
        })
    }

    /// True if the estimators' computer restarts in this scenario.
    pub fn restarts(&self) -> bool {
        let restarts = |e: &Event| matches!(e, Event::Restart { .. });
        self.events.iter().any(restarts)
    }
}

impl IntegrityLimits {
    /// Returns the limits of a scenario.
    pub fn of(file: &ScenarioFile) -> Self {
        Self::from(&file.integrity)
    }
}

impl Stop {
    /// Longest run without `after_s`, s of simulated time.
    pub const PATIENCE_S: f64 = 3600.0;

    /// Time at which the run ends at the latest, s.
    pub fn time_limit_s(&self) -> f64 {
        self.after_s.map_or(Self::PATIENCE_S, Positive::get)
    }
}

fn zero() -> Finite {
    Finite::ZERO
}

/// Physics step and plant.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Physics {
    /// Step, ms.
    pub dt_ms: Positive,
    /// Plant of the train; a car has its own. Filled in when the scenario is loaded.
    pub plant: Option<PlantKind>,
    /// m/s².
    pub gravity_mps2: Positive,
}

/// Drive cycle and controller.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DriveCycle {
    /// Speed reference: points by time (`at_s`) or by chainage of the front (`at_m`), linear in between (time) or held
    /// (chainage, approached within `accel_mps2`).
    pub speed: Vec<SpeedPoint>,
    /// Period after which the speed reference by time starts over, s; none = once.
    #[serde(default)]
    pub every_s: Option<Positive>,
    /// Limit on the change of the reference, m/s².
    #[serde(default)]
    pub(crate) accel_mps2: Option<Positive>,
    /// The controller.
    #[serde(default)]
    pub controller: ControllerSettings,
}

impl DriveCycle {
    /// A speed reference by time: points in s and m/s, linear in between.
    pub fn by_time(points: &[(f64, f64)]) -> Result<Self, Error> {
        let point = |at, mps| SpeedPoint {
            at_s: Some(at),
            at_m: None,
            mps,
            name: None,
        };
        Self::of_points(points, point)
    }

    /// A speed reference by chainage of the front: points in m and m/s, approached within `accel_mps2` (m/s²).
    pub fn by_chainage(points: &[(f64, f64)], accel_mps2: f64) -> Result<Self, Error> {
        let point = |at, mps| SpeedPoint {
            at_s: None,
            at_m: Some(at),
            mps,
            name: None,
        };
        let accel_mps2 = Positive::try_from(accel_mps2)
            .map_err(|message| in_code("drive.accel_mps2", message, "m/s²"))?;
        Ok(Self {
            accel_mps2: Some(accel_mps2),
            ..Self::of_points(points, point)?
        })
    }

    /// The speed reference that the controller follows, starting at `speed_mps` (m/s).
    pub(crate) fn cycle(&self, speed_mps: f64) -> Cycle {
        let at = |p: &SpeedPoint| p.at_s.or(p.at_m).map_or(0.0, f64::from);
        let points = self.speed.iter().map(|p| (at(p), p.mps.get())).collect();
        let accel_mps2 = self.accel_mps2.map(f64::from);
        match self.speed.iter().all(|p| p.at_s.is_some()) {
            true => Cycle::by_time(points, self.every_s.map(f64::from), accel_mps2, speed_mps),
            false => Cycle::by_chainage(points, accel_mps2, speed_mps),
        }
    }

    fn of_points(
        points: &[(f64, f64)],
        point: impl Fn(NonNegative, Finite) -> SpeedPoint,
    ) -> Result<Self, Error> {
        let checked = points.iter().enumerate().map(|(i, (at, mps))| {
            let wrong = |message| in_code(&format!("drive.speed[{i}]"), message, "s or m, and m/s");
            let at = NonNegative::try_from(*at).map_err(wrong)?;
            Ok(point(at, Finite::try_from(*mps).map_err(wrong)?))
        });
        Ok(Self {
            speed: checked.collect::<Result<_, Error>>()?,
            ..Self::default()
        })
    }
}

/// A point of the speed reference; exactly one of `at_s` and `at_m`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpeedPoint {
    /// s.
    pub at_s: Option<NonNegative>,
    /// m.
    pub(crate) at_m: Option<NonNegative>,
    /// m/s.
    pub mps: Finite,
    /// Name of a point by time, for windows of expectations (`after: {event: drives_off}`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
}

/// A box beside the rail.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Obstacle {
    /// Chainage of its middle, m.
    pub at_m: NonNegative,
    /// Offset of its middle to the left, m.
    pub left_m: Finite,
    /// Offset of its middle upwards, m.
    pub up_m: Finite,
    /// Edge lengths along the rail, across, up, m.
    pub size_m: [Positive; 3],
}

/// A rectangular roadway that follows the rail.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Roadway {
    /// Clear width, the rail in the middle, m.
    pub width_m: Positive,
    /// Height of the walls above the rail's line, m.
    pub above_m: NonNegative,
    /// Depth of the floor below the rail's line, m.
    pub below_m: Positive,
}

/// Recording rates.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Record {
    /// Channels, Hz.
    pub(crate) rate_hz: Positive,
    /// Poses, Hz.
    pub(crate) pose_rate_hz: Positive,
}

/// Error at a key of a scenario without a file.
fn in_code(key: &str, message: String, help: &str) -> Error {
    Document::default().error(key, message, help)
}

impl Default for Start {
    fn default() -> Self {
        Self {
            chainage_m: None,
            speed_mps: Finite::ZERO,
        }
    }
}

impl Default for Physics {
    fn default() -> Self {
        Self {
            dt_ms: Positive::new(4.0),
            plant: None,
            gravity_mps2: Positive::new(9.81),
        }
    }
}

impl Default for Record {
    fn default() -> Self {
        Self {
            rate_hz: Positive::new(50.0),
            pose_rate_hz: Positive::new(25.0),
        }
    }
}

#[cfg(test)]
mod tests;
