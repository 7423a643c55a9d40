//! The keys of a map file.

use super::channels::Channels;
use super::faulted_channel::FaultedChannel;
use super::reference_keys::References;
use crate::notation::TimeUnit;
use monorig_sim::config::checked::{Finite, Fraction, NonNegative, Positive, Version1};
use monorig_sim::config::scenario::{
    Availability, Expectation, FaultKind, Integrity, KnownFailure, KnownFailureEntry, Record,
    Settings, known_failures,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A map file.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MapFile {
    /// Format version, 1.
    pub(crate) version: Version1,
    /// Description of the recording, and of its purpose.
    #[serde(default)]
    pub(crate) why: String,
    /// Source of the recording.
    pub(crate) source: Option<Provenance>,
    /// Files of the log, each with a name of your choice, relative to this file; a single file can be given on the
    /// command line.
    #[serde(default)]
    pub(crate) files: BTreeMap<String, String>,
    /// Database of CAN messages (DBC), relative to this file.
    pub(crate) dbc: Option<String>,
    /// The column of time and its unit, unless a file has its own under `clocks`.
    #[serde(default)]
    pub(crate) time: TimeSettings,
    /// Clocks of single files, by the names of `files`.
    #[serde(default)]
    pub(crate) clocks: BTreeMap<String, Clock>,
    /// The steps of the estimators.
    #[serde(default)]
    pub(crate) step: StepSettings,
    /// Train file, car file or file of nominal values (as `monorig log export` writes it), relative to this file: the
    /// nominal vehicle, which estimators are given.
    pub(crate) vehicle: Option<String>,
    /// The part of the log that is played; none = the whole log.
    #[serde(default, skip_serializing_if = "Trim::is_all")]
    pub(crate) trim: Trim,
    /// Nominal values that differ from the vehicle's file, or all nominal values without such a file.
    #[serde(default)]
    pub(crate) nominal: Nominal,
    /// The measurements in the columns.
    pub(crate) channels: Channels,
    /// Faults of the channels, like the events of a scenario for sensors.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) faults: Vec<LogFault>,
    /// References with which estimates are compared.
    #[serde(default)]
    pub(crate) reference: References,
    /// Estimators by name, with their parameters, as in a scenario.
    #[serde(default)]
    pub(crate) estimators: BTreeMap<String, Settings>,
    /// Source of the measurement noise for estimators; none = from the log if it exceeds an estimator's default.
    pub(crate) noise: Option<NoiseSource>,
    /// Bounds to hold, as in a scenario.
    #[serde(default)]
    pub(crate) expect: Vec<Expectation>,
    /// Least shares of the time in which estimates are marked valid, as in a scenario.
    #[serde(default)]
    pub(crate) availability: Availability,
    /// Limits beyond which an estimate marked valid is misleading, as in a scenario.
    #[serde(default)]
    pub(crate) integrity: Integrity,
    /// Bounds that cannot hold, for reasons of physics, as in a scenario.
    #[serde(
        default,
        skip_serializing_if = "Vec::is_empty",
        deserialize_with = "known_failures"
    )]
    #[schemars(with = "Vec<KnownFailureEntry>")]
    pub(crate) known_failures: Vec<KnownFailure>,
    /// Recording rates.
    #[serde(default)]
    pub(crate) record: Record,
}

/// Source of the measurement noise for estimators.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseSource {
    /// From the log: `wheel_speed_sd_mps` and `accel_sd_mps2` of estimators whose parameters do not set them.
    FromLog,
    /// The defaults of the estimators.
    Defaults,
}

/// The source of a recording.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Provenance {
    /// Author and name of the recording.
    pub name: String,
    /// Its licence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub licence: Option<String>,
}

/// The time of a log.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct TimeSettings {
    /// Column of the time (CSV, Parquet); without this key a column whose name shows a time. The other formats have
    /// their own time.
    pub column: Option<String>,
    /// Unit of the time column; without this key by its name or type, else seconds.
    pub unit: Option<TimeUnit>,
    /// Number of bits after which the counter of the time column wraps, such as 32.
    pub wraps: Option<u32>,
    /// Column of when the values were taken, in the same unit (of text and whole numbers too a number: exact to 2^53
    /// ns), where the time above is when they were recorded.
    pub stamp: Option<String>,
    /// Time by which samples reach the estimators.
    pub order: Order,
    /// Time zero of the replay.
    pub origin: Origin,
    /// Column of text (CSV) whose change begins a new run, in which time begins again: a new segment.
    pub pieces: Option<String>,
    /// A gap longer than this begins a new segment, with estimators reset, s; none = 60.
    pub segment_gap_s: Option<Positive>,
}

/// Time by which samples reach the estimators.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Order {
    /// The time at which the values were measured.
    #[default]
    Stamp,
    /// The time at which the values were recorded: MCAP has it beside the stamp, and so has a log with `stamp`;
    /// elsewhere it is the stamp.
    Arrival,
}

/// Time zero of a replay.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Origin {
    /// The first row of the log.
    #[default]
    First,
    /// Zero of the log's clock.
    Zero,
}

/// The part of a log that is played.
#[serde_with::skip_serializing_none]
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Trim {
    /// Begin, s of the replay.
    pub from_s: Option<NonNegative>,
    /// End, s of the replay.
    pub until_s: Option<Positive>,
}

impl Trim {
    fn is_all(&self) -> bool {
        *self == Self::default()
    }
}

/// The clock of a file.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Clock {
    /// Column of the time, instead of the column under `time`.
    pub column: Option<String>,
    /// Its unit.
    pub unit: Option<TimeUnit>,
    /// Number of bits after which its counter wraps.
    pub wraps: Option<u32>,
    /// Offset added to its stamps, s.
    pub offset_s: Option<Finite>,
    /// Rate by which the clock is too slow, parts per million: stamps grow by it from the file's first one on.
    pub drift_ppm: Option<Finite>,
}

/// The steps of the estimators.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct StepSettings {
    /// Steps per second, Hz.
    pub rate_hz: Positive,
    /// Sample that replaces several samples of a channel in a step.
    pub many: Many,
}

impl Default for StepSettings {
    fn default() -> Self {
        Self {
            rate_hz: Positive::new(100.0),
            many: Many::default(),
        }
    }
}

/// Sample that replaces several samples of a channel in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Many {
    /// Mean of the samples, and mean of their stamps.
    #[default]
    Mean,
    /// The last one.
    Newest,
    /// The first one.
    Oldest,
}

/// Nominal values of the vehicle.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Nominal {
    /// Mass of the empty vehicle, kg.
    pub tare_kg: Option<Positive>,
    /// Smallest and largest total mass thought possible, kg; none = half to twice the tare, or the vehicle's.
    pub mass_range_kg: Option<[Positive; 2]>,
    /// Number of drive units.
    pub drives: Option<Positive>,
    /// Radius of the driven wheels, m.
    pub wheel_radius_m: Option<Positive>,
    /// Motor revolutions per wheel revolution.
    pub gear_ratio: Option<Positive>,
    /// Share of motor power that reaches the wheel rim.
    pub efficiency: Option<Fraction>,
    /// Rotating masses reflected to the rim, kg.
    pub rotating_mass_kg: Option<NonNegative>,
    /// Running-resistance coefficient.
    pub running_resistance: Option<NonNegative>,
    /// Distance of the IMU ahead of the middle of its unit, m.
    pub imu_arm_m: Option<Finite>,
    /// Of a road vehicle: drag coefficient times frontal area, m². Where one value of a road vehicle is told and no
    /// file has them, the others are those of a compact car: 0.65.
    pub drag_area_m2: Option<NonNegative>,
    /// Density of the air, kg/m³; 1.2.
    pub air_density_kgpm3: Option<Positive>,
    /// From the centre of gravity forward to the front axle, m; 1.1.
    pub front_axle_m: Option<Positive>,
    /// From the centre of gravity back to the rear axle, m; 1.5.
    pub rear_axle_m: Option<Positive>,
    /// Cornering stiffness of the tyres of the front axle, N/rad; 80 000.
    pub front_cornering_npr: Option<Positive>,
    /// Cornering stiffness of the tyres of the rear axle, N/rad; 80 000.
    pub rear_cornering_npr: Option<Positive>,
}

/// A fault of a channel of a log.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LogFault {
    /// s of the replay.
    pub from_s: NonNegative,
    /// s; none = to the end.
    pub to_s: Option<Positive>,
    /// Channel of the fault.
    pub channel: FaultedChannel,
    /// Number of the wheel, motor, … from 0; none = all.
    pub index: Option<usize>,
    /// Kind of fault.
    pub fault: LogFaultKind,
    /// Size of the fault, in the unit that it needs.
    pub size: Option<Finite>,
}

/// A kind of fault of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum LogFaultKind {
    /// No samples.
    Off,
    /// The last value repeated.
    Stuck,
    /// Constant bias of `size` SI units.
    Bias,
    /// Bias that grows, `size` SI units per second.
    Drift,
    /// Values multiplied by `size`.
    Scale,
    /// White noise with a standard deviation of `size` SI units.
    Noise,
    /// Rare outliers of `size` SI units.
    Spikes,
    /// Values rounded to multiples of `size` SI units.
    Quantised,
    /// Speeds in km/h, read as m/s.
    KmPerH,
    /// Accelerations in g, read as m/s².
    InG,
    /// Angles or angular rates in degrees, read as radians.
    InDegrees,
    /// Values of the wrong sign, on all axes.
    WrongSign,
    /// Forward and left exchanged.
    AxesXySwapped,
    /// Forward and up exchanged.
    AxesXzSwapped,
    /// Left and up exchanged.
    AxesYzSwapped,
    /// Stamps have errors up to ±`size` ms, uniformly distributed.
    Jitter,
    /// Samples are lost, a share of `size`.
    Loss,
    /// Samples come `size` ms late, with stamps of when they come: a clock that is behind.
    Lag,
}

impl LogFaultKind {
    /// Fault of the rig's sensors; `None` for a fault that only logs have.
    pub fn of_rig(self) -> Option<FaultKind> {
        let named = serde_json::to_value(self);
        named.and_then(serde_json::from_value).ok()
    }
}

/// Names and descriptions of the faults that only logs have.
pub fn faults_of_logs() -> Vec<(String, String)> {
    let schema = serde_json::to_value(schemars::schema_for!(LogFaultKind)).unwrap_or_default();
    let all = schema.get("oneOf").and_then(|all| all.as_array().cloned());
    let each = all.into_iter().flatten().filter_map(|fault| {
        let text = |key: &str| fault.get(key)?.as_str().map(str::to_owned);
        let kind: LogFaultKind = serde_json::from_value(fault.get("const")?.clone()).ok()?;
        kind.of_rig()
            .is_none()
            .then(|| Some((text("const")?, text("description")?)))?
    });
    each.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_of_logs_alone_have_names_and_descriptions() {
        let all = faults_of_logs();
        let names: Vec<&str> = all.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["jitter", "loss", "lag"]);
        assert!(all.iter().all(|(_, text)| text.contains("`size`")));
    }
}
