//! Keys of a single channel of the map file.

use super::formula::{Condition, Formula};
use crate::notation::UnitName;
use monorig_sim::config::checked::{Finite, Fraction, NonNegative, Positive};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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

fn plus() -> Finite {
    Finite::new(1.0)
}

fn yes() -> bool {
    true
}
