//! Specification of an instrument, as a data sheet holds it; every number is checked while it is read.
//!
//! An instrument has three blocks: where it sits (`mount`, not of instruments that belong to a part of the vehicle),
//! `sampling` (when values are taken and arrive) and `errors` (how they differ from the truth). A block left out means
//! "none of it". Values are in the unit of the instrument: m/s² (accelerometer), rad/s (gyro), N·m (motor torque), m/s
//! (wheel speed), MPa (clamp pressure), rad (steering angle, inclinometer).

mod errors;
mod sampling;

pub use errors::{Errors, HitSpec, Markov, VibrationSpec, WarmUp};
pub use sampling::{ArrivalJitter, ClockSpec, DelayDistribution, Many, Reordering, Sampling};

use crate::checked::{Finite, NonNegative, Positive};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The instruments of a vehicle by name (see [`KINDS`](super::instruments::KINDS)).
pub type InstrumentSpecs = BTreeMap<&'static str, InstrumentSpec>;

// The first comment is that of the block of a data sheet, as the JSON schema shows it.
/// An instrument with three axes, bolted to a link.
///
/// Every other instrument has this form too: [`MountedSensor`] and [`PlainSensor`] lack some of its keys in a data
/// sheet.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(
    rename = "InertialSensor",
    description = "An instrument with three axes, bolted to a link."
)]
pub struct InstrumentSpec {
    /// `unit/link`, or `link` alone for the first unit from the front that has such a link.
    pub mount: String,
    /// Times at which values are sampled and delivered.
    pub sampling: Sampling,
    /// Differences of each axis from the truth.
    #[serde(default)]
    pub errors: Errors,
    /// Known bias of x, y, z, unit; adds to `errors.bias`.
    #[serde(default)]
    pub axis_bias: Option<[Finite; 3]>,
    /// Known rotation of the sensor's axes against the mount's: a rotation vector in mount axes, degrees.
    #[serde(default)]
    pub misalignment_deg: Option<[Finite; 3]>,
    /// Standard deviation of a misalignment drawn once a run, each component of the rotation vector, degrees.
    #[serde(default)]
    pub misalignment_sd_deg: Option<NonNegative>,
    /// Share of `errors.vibration` and `errors.hits` on x, y, z; none = the full size on each axis.
    #[serde(default)]
    pub axis_shake: Option<[NonNegative; 3]>,
    /// Lean of the body that carries it.
    #[serde(default)]
    pub lean: Option<LeanSpec>,
}

/// An instrument with one reading, bolted to a link.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MountedSensor {
    /// `unit/link`, or `link` alone for the first unit from the front that has such a link.
    pub mount: String,
    /// Times at which values are sampled and delivered.
    pub sampling: Sampling,
    /// Differences of the values from the truth.
    #[serde(default)]
    pub errors: Errors,
    /// Lean of the body that carries it.
    #[serde(default)]
    pub lean: Option<LeanSpec>,
}

/// An instrument with one reading, at a place that the vehicle defines.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlainSensor {
    /// Times at which values are sampled and delivered.
    pub sampling: Sampling,
    /// Differences of the values from the truth.
    #[serde(default)]
    pub errors: Errors,
}

impl From<MountedSensor> for InstrumentSpec {
    fn from(s: MountedSensor) -> Self {
        Self {
            mount: s.mount,
            sampling: s.sampling,
            errors: s.errors,
            lean: s.lean,
            ..Self::default()
        }
    }
}

impl From<PlainSensor> for InstrumentSpec {
    fn from(s: PlainSensor) -> Self {
        Self {
            sampling: s.sampling,
            errors: s.errors,
            ..Self::default()
        }
    }
}

/// Pitch of a sprung body under acceleration along the track, which turns what is bolted to it: a second-order lag.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Lean")] // the name in the JSON schema
pub struct LeanSpec {
    /// Static pitch, degrees of nose up per standard gravity of forward acceleration. Adds to what the vehicle's own
    /// suspension does.
    pub pitch_deg_per_g: Finite,
    /// Natural frequency, Hz.
    pub frequency_hz: Positive,
    /// Damping ratio.
    pub damping: Positive,
}
