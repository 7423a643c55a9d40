//! The keys of a map file.

use super::formula::{Condition, Formula};
use crate::time::TimeUnit;
use crate::units::UnitName;
use monorig_sim::config::checked::{Finite, Fraction, NonNegative, Positive, Version1};
use monorig_sim::config::scenario::{
    Availability, Expectation, FaultKind, Integrity, KnownFailure, KnownFailureEntry, Record,
    Settings, known_failures,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A map file.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MapFile {
    /// Format version, 1.
    pub version: Version1,
    /// What the recording is, and what it shows.
    #[serde(default)]
    pub why: String,
    /// Where the recording is from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<Provenance>,
    /// The files of the log by a name of one's own, relative to this file; one alone can be given on the command line.
    #[serde(default)]
    pub files: BTreeMap<String, String>,
    /// Database of CAN messages (DBC), relative to this file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dbc: Option<String>,
    /// The column of time and its unit, unless a file has its own under `clocks`.
    #[serde(default)]
    pub time: TimeSettings,
    /// Clocks of single files, by the names of `files`.
    #[serde(default)]
    pub clocks: BTreeMap<String, Clock>,
    /// The steps of the estimators.
    #[serde(default)]
    pub step: StepSettings,
    /// Train file, car file or file of nominal values (as `monorig export` writes it), relative to this file: what estimators are told about
    /// the vehicle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vehicle: Option<String>,
    /// Nominal values where they differ from the vehicle's file, or all there is without one.
    #[serde(default)]
    pub nominal: Nominal,
    /// What the columns measure.
    pub channels: Channels,
    /// Faults put on the channels, as events of a scenario put them on sensors.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<LogFault>,
    /// What estimates are held against.
    #[serde(default)]
    pub reference: References,
    /// Estimators by name, with their parameters, as in a scenario.
    #[serde(default)]
    pub estimators: BTreeMap<String, Settings>,
    /// Bounds to hold, as in a scenario.
    #[serde(default)]
    pub expect: Vec<Expectation>,
    /// Shares of the time in which estimates must be marked valid, as in a scenario.
    #[serde(default)]
    pub availability: Availability,
    /// When an estimate marked valid is misleading, as in a scenario.
    #[serde(default)]
    pub integrity: Integrity,
    /// Bounds that do not hold, for reasons of physics, as in a scenario.
    #[serde(
        default,
        skip_serializing_if = "Vec::is_empty",
        deserialize_with = "known_failures"
    )]
    #[schemars(with = "Vec<KnownFailureEntry>")]
    pub known_failures: Vec<KnownFailure>,
    /// Recording rates.
    #[serde(default)]
    pub record: Record,
}

/// Where a recording is from.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// Who recorded what.
    pub name: String,
    /// Its licence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub licence: Option<String>,
}

/// The time of a log.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TimeSettings {
    /// Column of the time (CSV, Parquet); without it one that is called like a time. The other formats have their own time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub column: Option<String>,
    /// Unit of that column; without it by its name or type, else seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<TimeUnit>,
    /// Column of when the values were taken, in the same unit (of text and whole numbers too a number: exact to 2^53 ns), where the time
    /// above is when they were recorded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stamp: Option<String>,
    /// By which time samples are given to the estimators.
    pub order: Order,
    /// What is time zero.
    pub origin: Origin,
    /// Column of text (CSV) whose change begins a new run, in which time begins anew: a new segment.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pieces: Option<String>,
    /// A gap longer than this begins a new segment, with estimators reset, s; none = 60.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub segment_gap_s: Option<Positive>,
}

/// By which time samples are given to the estimators.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// When they were taken.
    #[default]
    Stamp,
    /// When they were recorded: MCAP has this time beside the stamp, and so has a log with `stamp`; elsewhere it is the stamp.
    Arrival,
}

/// What is time zero of a replay.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// The first row of the log.
    #[default]
    First,
    /// Zero of the log's clock.
    Zero,
}

/// The clock of a file.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Clock {
    /// Column of the time, instead of that under `time`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub column: Option<String>,
    /// Its unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<TimeUnit>,
    /// Added to its stamps, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset_s: Option<Finite>,
    /// How much the clock is too slow, parts per million: stamps grow by it from the file's first one on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drift_ppm: Option<Finite>,
}

/// The steps of the estimators.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StepSettings {
    /// Steps per second, Hz.
    pub rate_hz: Positive,
    /// What is made of several samples of a channel in a step.
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

/// What is made of several samples of a channel in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Many {
    /// Their mean, and the mean of their stamps.
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
pub struct Nominal {
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
    /// Share of motor power that reaches the rim.
    pub efficiency: Option<Fraction>,
    /// Rotating masses reflected to the rim, kg.
    pub rotating_mass_kg: Option<NonNegative>,
    /// Running-resistance coefficient.
    pub running_resistance: Option<NonNegative>,
    /// How far the IMU sits ahead of the middle of its unit, m.
    pub imu_arm_m: Option<Finite>,
}

/// What the columns of a log measure. What is not there, estimators do without.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Channels {
    /// Specific force (acceleration minus gravity: at rest on the level it is 1 g upwards).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub specific_force: Option<VectorChannel>,
    /// Angular rate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angular_rate: Option<VectorChannel>,
    /// Speeds of wheels at their circumference.
    pub wheel_speed: Vec<WheelChannel>,
    /// What drives the vehicle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub traction: Option<Traction>,
    /// Clamp cylinder pressure of each drive unit.
    pub clamp_pressure: Vec<ScalarChannel>,
    /// What the controller asked for. Without it the measured torque stands for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub command: Option<CommandChannel>,
    /// Steering angle of a car, + left.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steering_angle: Option<ScalarChannel>,
    /// Pitch of an inclinometer, + nose up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inclination: Option<ScalarChannel>,
    /// Readings for an estimator of one's own, at most four, in the unit `1`.
    pub auxiliary: Vec<ScalarChannel>,
}

/// Where an axis of an instrument points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// Towards growing chainage.
    Forward,
    /// Against it.
    Backward,
    /// To the left.
    Left,
    /// To the right.
    Right,
    /// Upwards.
    Up,
    /// Downwards.
    Down,
}

/// How an instrument is turned against the vehicle, degrees: first rolled, then pitched, then yawed.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Mount {
    /// + right side down.
    pub roll: Finite,
    /// + nose up.
    pub pitch: Finite,
    /// + nose to the left.
    pub yaw: Finite,
}

impl Default for Mount {
    fn default() -> Self {
        Self {
            roll: Finite::ZERO,
            pitch: Finite::ZERO,
            yaw: Finite::ZERO,
        }
    }
}

/// What is found from the first seconds of the log, in which the vehicle stands.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Calibrate {
    /// How long it stands from the first row on, s. Of the angular rate the bias is found; of the specific force the roll and pitch of the
    /// mount.
    pub standing_s: Positive,
    /// Slope on which it stands meanwhile, degrees, + uphill; of the specific force only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slope_deg: Option<Finite>,
}

/// Three columns of an instrument on three axes.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VectorChannel {
    /// File, by its name under `files`; not needed where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// The columns of its three axes.
    pub columns: [Formula; 3],
    /// Their unit.
    pub unit: UnitName,
    /// Where the axes point; none = forward, left, up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axes: Option<[Axis; 3]>,
    /// How it is turned against these directions.
    #[serde(default)]
    pub mount_deg: Mount,
    /// How much the sprung body that carries it pitches nose up for each g of specific force along the vehicle, degrees; taken out of the
    /// specific force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lean_deg_per_g: Option<Finite>,
    /// Bias of the three columns, in their unit, taken off first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bias: Option<[Finite; 3]>,
    /// Standard deviation of the bias that is left, in the SI unit; estimators are told it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bias_sd: Option<Positive>,
    /// What is found while the vehicle stands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibrate: Option<Calibrate>,
    /// Samples count only where this is true, such as `status == 1`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valid_if: Option<Condition>,
    /// How much later than their time samples reach the estimators, ms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub latency_ms: Option<NonNegative>,
}

/// A column of one value.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScalarChannel {
    /// File, by its name under `files`; not needed where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// The column.
    pub column: Formula,
    /// Its unit.
    pub unit: UnitName,
    /// 1, or −1 where the log counts the other way.
    #[serde(default = "plus")]
    pub sign: Finite,
    /// Samples count only where this is true.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valid_if: Option<Condition>,
    /// How much later than their time samples reach the estimators, ms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub latency_ms: Option<NonNegative>,
}

/// Columns of wheel speeds.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WheelChannel {
    /// File, by its name under `files`; not needed where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// A column for each wheel.
    pub columns: Vec<Formula>,
    /// Their unit.
    pub unit: UnitName,
    /// Whether these wheels are driven: where some are not, only those that are not are used, because they do not slip.
    #[serde(default = "yes")]
    pub driven: bool,
    /// 1, or −1 where the log counts the other way.
    #[serde(default = "plus")]
    pub sign: Finite,
    /// Samples count only where this is true.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valid_if: Option<Condition>,
    /// How much later than their time samples reach the estimators, ms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub latency_ms: Option<NonNegative>,
}

/// What drives the vehicle: one of `torque`, `force` and `power`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Traction {
    /// File, by its name under `files`; not needed where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Torque of each motor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque: Option<Vec<Formula>>,
    /// Force at the rims of all driven wheels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<Formula>,
    /// Power of all motors. The force is the power over the measured speed, above 0.5 m/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub power: Option<Formula>,
    /// Unit of it.
    pub unit: UnitName,
    /// Of a torque: revolutions of the shaft it is measured at per wheel revolution, a constant or a column; none = the vehicle's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gear_ratio: Option<Formula>,
    /// Of a power: share of it that reaches the rims; none = all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub efficiency: Option<Fraction>,
    /// 1, or −1 where the log counts the other way.
    #[serde(default = "plus")]
    pub sign: Finite,
    /// Samples count only where this is true, such as `engine_rpm / turbine_rpm < 1.1`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valid_if: Option<Condition>,
    /// How much later than their time samples reach the estimators, ms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub latency_ms: Option<NonNegative>,
}

/// A fault put on a channel of a log.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LogFault {
    /// s of the replay.
    pub from_s: NonNegative,
    /// s; none = to the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_s: Option<Positive>,
    /// What it is put on.
    pub channel: FaultedChannel,
    /// Which wheel, motor, … counted from 0; none = all of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub index: Option<usize>,
    /// What fails.
    pub fault: LogFaultKind,
    /// Size of the fault, in the unit that it needs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<Finite>,
}

/// A channel that a fault can be put on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FaultedChannel {
    /// Specific force and angular rate.
    Imu,
    /// Specific force.
    SpecificForce,
    /// Angular rate.
    AngularRate,
    /// Wheel speeds.
    WheelSpeed,
    /// Torque, force or power.
    Traction,
    /// Clamp pressures.
    ClampPressure,
    /// Steering angle.
    SteeringAngle,
    /// Inclinometer.
    Inclination,
    /// Readings of one's own.
    Auxiliary,
}

/// What can fail on a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LogFaultKind {
    /// No samples.
    Off,
    /// The last value again and again.
    Stuck,
    /// Bias that grows, `size` SI units per second.
    Drift,
    /// Values multiplied by `size`.
    Scale,
    /// Rare outliers of `size` SI units.
    Spikes,
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
    /// Stamps are off by up to `size` ms, evenly spread to both sides.
    Jitter,
    /// Samples are lost, a share of `size`.
    Loss,
}

impl LogFaultKind {
    /// The fault of the rig's sensors that it is; none of those of a log alone.
    pub fn of_rig(self) -> Option<FaultKind> {
        Some(match self {
            Self::Off => FaultKind::Off,
            Self::Stuck => FaultKind::Stuck,
            Self::Drift => FaultKind::Drift,
            Self::Scale => FaultKind::Scale,
            Self::Spikes => FaultKind::Spikes,
            Self::KmPerH => FaultKind::KmPerH,
            Self::InG => FaultKind::InG,
            Self::InDegrees => FaultKind::InDegrees,
            Self::WrongSign => FaultKind::WrongSign,
            Self::AxesXySwapped => FaultKind::AxesXySwapped,
            Self::AxesXzSwapped => FaultKind::AxesXzSwapped,
            Self::AxesYzSwapped => FaultKind::AxesYzSwapped,
            Self::Jitter | Self::Loss => return None,
        })
    }
}

/// What the controller asked for: in a step the last command that was recorded until its end.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CommandChannel {
    /// File, by its name under `files`; not needed where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Torque of each motor at its shaft; of another number of columns than drive units the sum, in equal shares.
    pub torque: Vec<Formula>,
    /// Unit of the torques.
    pub unit: UnitName,
    /// 1, or −1 where the log counts the torques the other way.
    #[serde(default = "plus")]
    pub sign: Finite,
    /// Clamp cylinder pressure, MPa; none = 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clamp_pressure_mpa: Option<Formula>,
    /// Share of the brake force, 0 to 1; none = 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub brake: Option<Formula>,
}

/// What estimates are held against, with its standard deviation.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct References {
    /// The slope under the vehicle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slope: Option<SlopeReference>,
    /// The effective slope, asin(Σ mᵢ sin θᵢ / Σ mᵢ) over the length of the vehicle; none = that under the vehicle where it is a point, else not
    /// known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effective_slope: Option<SlopeReference>,
    /// The total mass.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass: Option<MassReference>,
}

/// A reference of the slope: one of `deg`, `column` and `altitude`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SlopeReference {
    /// A constant slope, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deg: Option<Finite>,
    /// File of the column, by its name under `files`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// A column of slopes, linear between its samples.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub column: Option<Formula>,
    /// Unit of the column: rad, deg, sin, tan or %.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<UnitName>,
    /// From columns of altitude and distance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub altitude: Option<Altitude>,
    /// Standard deviation of the reference, degrees.
    pub sd_deg: NonNegative,
    /// Samples count only where this is true.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valid_if: Option<Condition>,
}

/// The slope from altitude over distance: the regression over a stated window, centred.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Altitude {
    /// Column of the altitude.
    pub column: Formula,
    /// Column of the distance along the way, in the same file.
    pub distance: Formula,
    /// Unit of both.
    pub unit: UnitName,
    /// Length of the window, m.
    pub window_m: Positive,
}

/// A reference of the mass: `kg`, or `steps`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MassReference {
    /// Total mass, kg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kg: Option<Positive>,
    /// Total mass from certain times on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<Vec<MassStep>>,
    /// Standard deviation, kg.
    pub sd_kg: NonNegative,
}

/// The mass from a time on.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MassStep {
    /// From here on, s of the replay.
    pub at_s: NonNegative,
    /// Total mass, kg.
    pub kg: Positive,
}

fn plus() -> Finite {
    Finite::new(1.0)
}

fn yes() -> bool {
    true
}
