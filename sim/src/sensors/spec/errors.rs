//! Differences of an instrument's values from the truth.

use crate::checked::{Finite, Fraction, NonNegative, Positive};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Differences of the values from the truth. `unit` is the instrument's SI unit. The order of effects is that of the
/// signal path (see `error_model`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Errors {
    /// Corner frequency of a first-order low-pass, Hz.
    pub bandwidth_hz: Option<Positive>,
    /// Known relative error of scale: reads (1 + scale_error) × truth.
    pub scale_error: Finite,
    /// Standard deviation of a relative error of scale drawn once a run.
    pub scale_error_sd: NonNegative,
    /// Terminal-based linearity: largest deviation at mid-range as a share of full scale; needs `range`.
    pub linearity: Fraction,
    /// Known bias, unit.
    pub bias: Finite,
    /// Standard deviation of a bias drawn once a run (turn-on repeatability, zero drift), unit.
    pub bias_sd: NonNegative,
    /// Bias of an instrument that is not calibrated, drawn once a run for each axis: [least, greatest] magnitude, sign
    /// at random, unit.
    pub switch_on_bias: Option<[NonNegative; 2]>,
    /// Growth of a wandering bias, unit/√s.
    pub bias_random_walk: NonNegative,
    /// A bias that wanders within bounds.
    pub gauss_markov: Option<Markov>,
    /// Bias and scale error that grow while the instrument warms up after switch-on.
    pub warm_up: Option<WarmUp>,
    /// White noise per sample, for any rate, unit.
    pub noise_sd: NonNegative,
    /// White noise per sample as share of the reading.
    pub noise_sd_rel: NonNegative,
    /// White noise as one-sided density, unit/√Hz: σ = density·√(rate/2).
    pub noise_density: NonNegative,
    /// White noise as random walk of its integral (angle, velocity random walk), unit·√s: σ = value·√rate.
    pub random_walk_of_integral: NonNegative,
    /// Step between two readings, unit.
    pub quantisation: Option<Positive>,
    /// Least and greatest reading, unit.
    pub range: Option<[Finite; 2]>,
    /// Shaking that grows with the speed.
    pub vibration: Option<VibrationSpec>,
    /// Hits at rail joints and bumps.
    pub hits: Option<HitSpec>,
}

impl Errors {
    /// Root mean square of the biases drawn once a run, unit: a magnitude evenly distributed from a to b has (a² + ab +
    /// b²)/3.
    pub fn drawn_bias_sd(&self) -> f64 {
        let switch_on = self.switch_on_bias.map_or(0.0, |limits| {
            let [a, b] = limits.map(NonNegative::get);
            ((a * a + a * b + b * b) / 3.0).sqrt()
        });
        self.bias_sd.get().hypot(switch_on)
    }
}

/// First-order Gauss–Markov process.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Markov {
    /// Standard deviation, unit.
    pub sd: NonNegative,
    /// Correlation time, s.
    pub time_s: Positive,
}

/// Temperature drift of an instrument switched on with the run: it warms up as 1 − exp(−t/time_s).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WarmUp {
    /// Time constant, s.
    pub time_s: Positive,
    /// Bias when warm, unit.
    #[serde(default)]
    pub bias: Finite,
    /// Relative error of scale when warm.
    #[serde(default)]
    pub scale_error: Finite,
}

/// Band-limited noise whose level grows in proportion to the speed up to `full_mps` and stays there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Vibration")] // the name in the JSON schema
pub struct VibrationSpec {
    /// Standard deviation from `full_mps` on, unit.
    pub sd: NonNegative,
    /// Speed from which on it has its full level, m/s.
    pub full_mps: Positive,
    /// Lower and upper corner frequency, Hz; the density falls by 20 dB per decade beyond each.
    pub band_hz: [Positive; 2],
}

/// Short disturbances at places of the track: one period of a sine on the axes of an accelerometer or gyro, a jump of
/// any other reading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Hits")] // the name in the JSON schema
pub struct HitSpec {
    /// A hit at every rail joint of the track.
    #[serde(default)]
    pub at_joints: bool,
    /// Number of further hits at random places, per metre travelled.
    #[serde(default)]
    pub per_m: NonNegative,
    /// [least, greatest] magnitude, sign at random, unit.
    pub size: [NonNegative; 2],
    /// Duration of one, ms.
    pub duration_ms: Positive,
}
