//! Kinds of faults of sensors, as events name them, and the sizes they can have.

use crate::sensors::fault;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// An axis of a sensor of three.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// Forward.
    Forward,
    /// Left.
    Left,
    /// Up.
    Up,
}

/// A fault of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Fault")] // the name in the JSON schema
pub enum FaultKind {
    /// No samples.
    Off,
    /// Samples lost at random, a share of `size`.
    Dropouts,
    /// The last value repeated.
    Stuck,
    /// Constant bias of `size` units.
    Bias,
    /// Bias that grows, `size` units per second.
    Drift,
    /// Values multiplied by `size`.
    Scale,
    /// White noise with a standard deviation of `size` units.
    Noise,
    /// Rare outliers of `size` units.
    Spikes,
    /// Values rounded to multiples of `size` units.
    Quantised,
    /// Dead band: zero up to `size` units, and larger values reduced by `size`.
    DeadBand,
    /// Values that follow with a play of `size` units to both sides.
    Hysteresis,
    /// Speeds in km/h, read as m/s.
    KmPerH,
    /// Accelerations in g, read as m/s².
    InG,
    /// Angles or angular rates in degrees, read as radians.
    InDegrees,
    /// Values of the wrong sign.
    WrongSign,
    /// Forward and left exchanged.
    AxesXySwapped,
    /// Forward and up exchanged.
    AxesXzSwapped,
    /// Left and up exchanged.
    AxesYzSwapped,
}

/// Properties of a fault that needs a size: the missing key of an error, the constructor from a size, the range of
/// sizes, the meaning of the size.
pub(super) type Sized = (
    &'static str,
    fn(f64) -> fault::Fault,
    RangeInclusive<f64>,
    &'static str,
);

impl FaultKind {
    /// True for a fault that needs a `size`.
    pub fn needs_size(self) -> bool {
        self.sized().is_ok()
    }

    /// True for a fault that can be on one axis of three.
    pub fn is_of_an_axis(self) -> bool {
        self.needs_size() && self != Self::Dropouts || matches!(self, Self::Stuck | Self::WrongSign)
    }

    /// Returns the name of the fault in a scenario.
    pub fn name(self) -> String {
        let name = serde_json::to_value(self);
        name.ok()
            .and_then(|v| v.as_str().map(str::to_owned))
            .unwrap_or_default()
    }

    /// Builds the fault from its size. `Err` holds the fault that takes none.
    pub(super) fn sized(self) -> Result<Sized, fault::Fault> {
        use fault::{Fault, WrongUnit};
        const ANY: RangeInclusive<f64> = f64::MIN..=f64::MAX;
        Err(match self {
            Self::Bias => {
                let help = "size in the sensor's unit";
                return Ok(("a bias needs", Fault::Bias, ANY, help));
            }
            Self::Drift => {
                let help = "size in the sensor's unit per second";
                return Ok(("a drift needs", Fault::Drift, ANY, help));
            }
            Self::Scale => {
                let help = "the factor by which values are multiplied, such as 1.1";
                return Ok(("a wrong scale needs", Fault::Scale, ANY, help));
            }
            Self::Noise => {
                let help = "the standard deviation in the sensor's unit, 0 or more";
                return Ok(("noise needs", Fault::Noise, 0.0..=f64::MAX, help));
            }
            Self::Spikes => {
                let help = "the height of a spike in the sensor's unit";
                return Ok(("spikes need", Fault::Spikes, ANY, help));
            }
            Self::Quantised => {
                let (step, help) = (
                    1e-9..=f64::MAX,
                    "the step in the sensor's unit, 1e-9 or more",
                );
                return Ok(("steps need", Fault::Quantised, step, help));
            }
            Self::DeadBand => {
                let help = "the largest value that is lost, in the sensor's unit";
                return Ok(("a dead band needs", Fault::DeadBand, 0.0..=f64::MAX, help));
            }
            Self::Hysteresis => {
                let help = "the play to one side in the sensor's unit";
                return Ok(("hysteresis needs", Fault::Hysteresis, 0.0..=f64::MAX, help));
            }
            Self::Dropouts => {
                let help = "the share of the samples that is lost, from 0 to 1";
                return Ok(("dropouts need", Fault::Dropouts, 0.0..=1.0, help));
            }
            Self::Off => Fault::Off,
            Self::Stuck => Fault::Stuck,
            Self::KmPerH => Fault::WrongUnit(WrongUnit::KmPerH),
            Self::InG => Fault::WrongUnit(WrongUnit::G),
            Self::InDegrees => Fault::WrongUnit(WrongUnit::Degrees),
            Self::WrongSign => Fault::WrongSign,
            Self::AxesXySwapped => Fault::AxesSwapped([0, 1]),
            Self::AxesXzSwapped => Fault::AxesSwapped([0, 2]),
            Self::AxesYzSwapped => Fault::AxesSwapped([1, 2]),
        })
    }
}
