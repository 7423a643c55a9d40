//! A traction motor in the files of drive units and cars.

use crate::config::checked::{NonNegative, Positive};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Motor map: constant torque, constant power, cut-off.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Motor")] // the name in the JSON schema
pub struct MotorFile {
    /// N·m.
    pub torque_max_nm: Positive,
    /// kW.
    pub power_kw: Positive,
    /// Revolutions per minute.
    pub speed_max_rpm: Positive,
    /// Rotor, at the motor shaft, kg·m².
    pub inertia_kgm2: NonNegative,
    /// First-order lag of the torque, s.
    pub lag_s: NonNegative,
    /// Fastest change of the torque, N·m/s.
    pub torque_rate_nmps: Positive,
}
