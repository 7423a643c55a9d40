//! Keys of a single channel of the map file.

use super::formula::{Condition, Formula};
use crate::notation::UnitName;
use monorig_sim::config::checked::{Finite, Fraction, NonNegative, Positive};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The direction of an instrument's axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Axis {
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

/// Rotation of an instrument against the vehicle, degrees: first rolled, then pitched, then yawed.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Mount {
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

/// Calibration in the first seconds of the log, while the vehicle stands.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Calibrate {
    /// Time at standstill from the first row on, s. Of the angular rate the bias is found; of the specific force the
    /// roll and pitch of the mount.
    pub standing_s: Positive,
    /// Slope during the standstill, degrees, + uphill; only for the specific force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slope_deg: Option<Finite>,
}

/// Three columns of an instrument on three axes.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct VectorChannel {
    /// File, by its name under `files`; not needed if the map has only one file.
    pub file: Option<String>,
    /// The columns of its three axes; `none` for one that the instrument does not have or the log does not hold: it is
    /// taken for what it is on a level vehicle at rest.
    pub columns: [Formula; 3],
    /// Their unit.
    pub unit: UnitName,
    /// Directions of the axes; none = forward, left, up.
    pub axes: Option<[Axis; 3]>,
    /// Rotation of the instrument against these directions.
    #[serde(default)]
    pub mount_deg: Mount,
    /// Pitch (nose up) of the sprung body with the instrument per g of specific force along the vehicle, degrees; the
    /// specific force is corrected for it.
    pub lean_deg_per_g: Option<Finite>,
    /// Bias of the three columns, in their unit, subtracted first.
    pub bias: Option<[Finite; 3]>,
    /// Standard deviation of the remaining bias, in the SI unit, for the estimators.
    pub bias_sd: Option<Positive>,
    /// Values that are found at standstill.
    pub calibrate: Option<Calibrate>,
    /// Samples count only where this is true, such as `status == 1`.
    pub valid_if: Option<Condition>,
    /// Delay of samples on their way to the estimators, ms.
    pub latency_ms: Option<NonNegative>,
}

/// A column of one value.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ScalarChannel {
    /// File, by its name under `files`; not needed if the map has only one file.
    pub file: Option<String>,
    /// The column.
    pub column: Formula,
    /// Its unit.
    pub unit: UnitName,
    /// 1, or −1 if the log has the other sign.
    #[serde(default = "plus")]
    pub sign: Finite,
    /// Samples count only where this is true.
    pub valid_if: Option<Condition>,
    /// Delay of samples on their way to the estimators, ms.
    pub latency_ms: Option<NonNegative>,
}

/// Columns of wheel speeds.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct WheelChannel {
    /// File, by its name under `files`; not needed if the map has only one file.
    pub file: Option<String>,
    /// A column for each wheel.
    pub columns: Vec<Formula>,
    /// Their unit.
    pub unit: UnitName,
    /// True for driven wheels. Where some wheels are not driven only those are used, because they do not slip.
    #[serde(default = "yes")]
    pub driven: bool,
    /// 1, or −1 if the log has the other sign.
    #[serde(default = "plus")]
    pub sign: Finite,
    /// Factor on the value, as `monorig log calibrate --apply` writes it; none = 1.
    pub gain: Option<Positive>,
    /// Samples count only where this is true.
    pub valid_if: Option<Condition>,
    /// Delay of samples on their way to the estimators, ms.
    pub latency_ms: Option<NonNegative>,
}

/// Torque, force or power that drives the vehicle: one of the three.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Traction {
    /// File, by its name under `files`; not needed if the map has only one file.
    pub file: Option<String>,
    /// Torque of each motor.
    pub torque: Option<Vec<Formula>>,
    /// Force at the rims of all driven wheels.
    pub force: Option<Formula>,
    /// Power of all motors. The force is the power over the measured speed, above 0.5 m/s.
    pub power: Option<Formula>,
    /// Unit of it.
    pub unit: UnitName,
    /// Of a torque: revolutions of the shaft it is measured at per wheel revolution, a constant or a column; none = the
    /// vehicle's.
    pub gear_ratio: Option<Formula>,
    /// Of a power: share of it that reaches the rims; none = all.
    pub efficiency: Option<Fraction>,
    /// 1, or −1 if the log has the other sign.
    #[serde(default = "plus")]
    pub sign: Finite,
    /// Factor on the value, as `monorig log calibrate --apply` writes it; none = 1.
    pub gain: Option<Positive>,
    /// Samples count only where this is true, such as `engine_rpm / turbine_rpm < 1.1`.
    pub valid_if: Option<Condition>,
    /// Delay of samples on their way to the estimators, ms.
    pub latency_ms: Option<NonNegative>,
}

/// The command of the controller: in a step the last one that was recorded until its end.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct CommandChannel {
    /// File, by its name under `files`; not needed if the map has only one file.
    pub file: Option<String>,
    /// Torque of each motor at its shaft; if the numbers of columns and drive units differ, the sum is shared equally.
    /// None = the measured one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub torque: Vec<Formula>,
    /// Unit of the torques.
    pub unit: Option<UnitName>,
    /// 1, or −1 if the log has the other sign for torques.
    #[serde(default = "plus")]
    pub sign: Finite,
    /// Clamp cylinder pressure, MPa; none = 0.
    pub clamp_pressure_mpa: Option<Formula>,
    /// Share of the brake force, 0 to 1; none = 0. Above 0 the vehicle brakes, and its motion is not that of the
    /// traction.
    pub brake: Option<Formula>,
}

fn plus() -> Finite {
    Finite::new(1.0)
}

fn yes() -> bool {
    true
}
