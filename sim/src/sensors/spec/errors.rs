//! The format of the data sheet of a vehicle's instruments.
//!
//! Every instrument has three blocks: where it sits (`mount`, not of instruments that belong to a part of the vehicle),
//! `sampling` (when values are taken and arrive) and `errors` (how they differ from the truth). A block left out means "none
//! of it"; an instrument left out is not fitted. Values are in the instrument's SI unit: m/s² (accelerometer), rad/s (gyro),
//! N·m (motor torque), m/s (wheel speed), MPa (clamp pressure), rad (steering angle, inclinometer).

pub use super::sensor_world_file::{
    ArrivalJitterFile, ClockFile, HitsFile, LeanFile, ManyFile, ReorderingFile, VibrationFile,
};
use crate::config::checked::{Finite, Fraction, NonNegative, Positive, Version1};
use crate::sensors::spec::{self, InstrumentSpec, Mounting};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A sensor sheet file.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SheetFile {
    /// Format version, 1.
    pub version: Version1,
    /// Where the figures come from.
    pub source: String,
    /// Three-axis accelerometer, m/s².
    #[serde(default)]
    pub accelerometer: Option<InertialSensor>,
    /// Three-axis gyro, rad/s.
    #[serde(default)]
    pub gyro: Option<InertialSensor>,
    /// Torque at the motor shaft, one per drive unit, N·m.
    #[serde(default)]
    pub motor_torque: Option<PlainSensor>,
    /// Circumferential speed of the friction wheels, one per drive unit, m/s.
    #[serde(default)]
    pub wheel_speed: Option<PlainSensor>,
    /// Pressure in the clamp cylinder, one per drive unit, MPa.
    #[serde(default)]
    pub clamp_pressure: Option<PlainSensor>,
    /// Angle of the front wheels of a car, rad.
    #[serde(default)]
    pub steering_angle: Option<PlainSensor>,
    /// Pitch against the apparent vertical (of gravity and acceleration), rad.
    #[serde(default)]
    pub inclinometer: Option<MountedSensor>,
}

impl SheetFile {
    /// Every instrument a sheet can have, by name, in the order of the file; `None` is not fitted.
    pub fn instruments(&self) -> [(&'static str, Option<InstrumentSpec>); 7] {
        [
            ("accelerometer", spec_of(&self.accelerometer)),
            ("gyro", spec_of(&self.gyro)),
            ("motor_torque", spec_of(&self.motor_torque)),
            ("wheel_speed", spec_of(&self.wheel_speed)),
            ("clamp_pressure", spec_of(&self.clamp_pressure)),
            ("steering_angle", spec_of(&self.steering_angle)),
            ("inclinometer", spec_of(&self.inclinometer)),
        ]
    }
}

fn spec_of<'a, T>(block: &'a Option<T>) -> Option<InstrumentSpec>
where
    InstrumentSpec: From<&'a T>,
{
    block.as_ref().map(InstrumentSpec::from)
}

/// An instrument with three axes, bolted to a link.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InertialSensor {
    /// `unit/link`, or `link` alone for the first unit from the front that has such a link.
    pub mount: String,
    /// When values are taken and arrive.
    pub sampling: SamplingFile,
    /// How each axis differs from the truth.
    #[serde(default)]
    pub errors: ErrorsFile,
    /// Known bias of x, y, z, unit; adds to `errors.bias`.
    #[serde(default)]
    pub axis_bias: Option<[Finite; 3]>,
    /// Known rotation of the sensor's axes against the mount's: a rotation vector in mount axes, degrees.
    #[serde(default)]
    pub misalignment_deg: Option<[Finite; 3]>,
    /// Standard deviation of a misalignment drawn once a run, each component of the rotation vector, degrees.
    #[serde(default)]
    pub misalignment_sd_deg: Option<NonNegative>,
    /// Share of `errors.vibration` and `errors.hits` on x, y, z; none = all of it on each.
    #[serde(default)]
    pub axis_shake: Option<[NonNegative; 3]>,
    /// Lean of the body that carries it.
    #[serde(default)]
    pub lean: Option<LeanFile>,
}

/// An instrument with one reading, bolted to a link.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MountedSensor {
    /// `unit/link`, or `link` alone for the first unit from the front that has such a link.
    pub mount: String,
    /// When values are taken and arrive.
    pub sampling: SamplingFile,
    /// How values differ from the truth.
    #[serde(default)]
    pub errors: ErrorsFile,
    /// Lean of the body that carries it.
    #[serde(default)]
    pub lean: Option<LeanFile>,
}

/// An instrument with one reading, which sits where the vehicle has it.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlainSensor {
    /// When values are taken and arrive.
    pub sampling: SamplingFile,
    /// How values differ from the truth.
    #[serde(default)]
    pub errors: ErrorsFile,
}

/// When values are taken and when they arrive.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Sampling")] // the name in the JSON schema
pub struct SamplingFile {
    /// Samples per second; at most one per physics step.
    pub rate_hz: Positive,
    /// Time from taking a value to handing it over, ms.
    #[serde(default = "zero")]
    pub latency_ms: NonNegative,
    /// Standard deviation of the instant a value is taken about the instant stamped on it, ms.
    #[serde(default = "zero")]
    pub jitter_ms: NonNegative,
    /// Probability that a sample is lost.
    #[serde(default = "never")]
    pub dropout: Fraction,
    /// Further time to arrival, drawn for every sample; a sample waits for those before it.
    #[serde(default)]
    pub arrival_jitter: Option<ArrivalJitterFile>,
    /// Samples are handed over at multiples of this time only, ms; 0 = as they come.
    #[serde(default = "zero")]
    pub bunching_ms: NonNegative,
    /// A share of samples that arrives late and out of order.
    #[serde(default)]
    pub reordering: Option<ReorderingFile>,
    /// Error of the clock that stamps the samples.
    #[serde(default)]
    pub clock: ClockFile,
    /// What is handed over when several samples have arrived within a step.
    #[serde(default)]
    pub many: ManyFile,
}

/// How values differ from the truth. `unit` is the instrument's SI unit; the order of effects is that of the signal path
/// (see `error_model`).
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Errors")] // the name in the JSON schema
pub struct ErrorsFile {
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
    /// Bias of an instrument that is not calibrated, drawn once a run for each axis: [least, greatest] magnitude, sign at random, unit.
    pub switch_on_bias: Option<[NonNegative; 2]>,
    /// Growth of a wandering bias, unit/√s.
    pub bias_random_walk: NonNegative,
    /// A bias that wanders within bounds.
    pub gauss_markov: Option<MarkovFile>,
    /// Bias and scale error that come as the instrument warms up after it is switched on.
    pub warm_up: Option<WarmUpFile>,
    /// White noise per sample whatever the rate, unit.
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
    pub vibration: Option<VibrationFile>,
    /// Hits at rail joints and bumps.
    pub hits: Option<HitsFile>,
}

/// First-order Gauss–Markov process.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Markov")] // the name in the JSON schema
pub struct MarkovFile {
    /// Standard deviation, unit.
    pub sd: NonNegative,
    /// Correlation time, s.
    pub time_s: Positive,
}

/// Temperature drift of an instrument switched on with the run: it warms up as 1 − exp(−t/time_s).
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "WarmUp")] // the name in the JSON schema
pub struct WarmUpFile {
    /// Time constant, s.
    pub time_s: Positive,
    /// Bias when warm, unit.
    #[serde(default = "none")]
    pub bias: Finite,
    /// Relative error of scale when warm.
    #[serde(default = "none")]
    pub scale_error: Finite,
}

fn none() -> Finite {
    Finite::ZERO
}

fn zero() -> NonNegative {
    NonNegative::new(0.0)
}

fn never() -> Fraction {
    Fraction::new(0.0)
}

impl Default for ErrorsFile {
    fn default() -> Self {
        Self {
            bandwidth_hz: None,
            scale_error: Finite::ZERO,
            scale_error_sd: zero(),
            linearity: never(),
            bias: Finite::ZERO,
            bias_sd: zero(),
            switch_on_bias: None,
            bias_random_walk: zero(),
            gauss_markov: None,
            warm_up: None,
            noise_sd: zero(),
            noise_sd_rel: zero(),
            noise_density: zero(),
            random_walk_of_integral: zero(),
            quantisation: None,
            range: None,
            vibration: None,
            hits: None,
        }
    }
}

impl From<&InertialSensor> for InstrumentSpec {
    fn from(s: &InertialSensor) -> Self {
        let vector = |v: Option<[Finite; 3]>| v.map_or([0.0; 3], |v| v.map(|x| x.get()));
        Self {
            sampling: s.sampling.into(),
            errors: s.errors.into(),
            mounting: Mounting {
                link: s.mount.clone(),
                axis_bias: vector(s.axis_bias),
                misalignment_deg: vector(s.misalignment_deg),
                misalignment_sd_deg: s.misalignment_sd_deg.map_or(0.0, |x| x.get()),
                axis_shake: s.axis_shake.map(|shares| shares.map(|x| x.get())),
                lean: s.lean.map(spec::LeanSpec::from),
            },
        }
    }
}

impl From<&MountedSensor> for InstrumentSpec {
    fn from(s: &MountedSensor) -> Self {
        Self {
            sampling: s.sampling.into(),
            errors: s.errors.into(),
            mounting: Mounting {
                link: s.mount.clone(),
                lean: s.lean.map(spec::LeanSpec::from),
                ..Mounting::default()
            },
        }
    }
}

impl From<&PlainSensor> for InstrumentSpec {
    fn from(s: &PlainSensor) -> Self {
        Self {
            sampling: s.sampling.into(),
            errors: s.errors.into(),
            mounting: Mounting::default(),
        }
    }
}

impl From<SamplingFile> for spec::Sampling {
    fn from(s: SamplingFile) -> Self {
        Self {
            rate_hz: s.rate_hz.get(),
            latency_ms: s.latency_ms.get(),
            jitter_ms: s.jitter_ms.get(),
            dropout: s.dropout.get(),
            arrival_jitter: s.arrival_jitter.map(spec::ArrivalJitter::from),
            bunching_ms: s.bunching_ms.get(),
            reordering: s.reordering.map(spec::Reordering::from),
            clock: s.clock.into(),
            many: s.many.into(),
        }
    }
}

impl From<ErrorsFile> for spec::Errors {
    fn from(e: ErrorsFile) -> Self {
        Self {
            bandwidth_hz: e.bandwidth_hz.map(f64::from),
            scale_error: e.scale_error.get(),
            scale_error_sd: e.scale_error_sd.get(),
            linearity: e.linearity.get(),
            bias: e.bias.get(),
            bias_sd: e.bias_sd.get(),
            switch_on_bias: e.switch_on_bias.map(|b| b.map(|x| x.get())),
            bias_random_walk: e.bias_random_walk.get(),
            gauss_markov: e.gauss_markov.map(|m| spec::Markov {
                sd: m.sd.get(),
                time_s: m.time_s.get(),
            }),
            warm_up: e.warm_up.map(|w| spec::WarmUp {
                time_s: w.time_s.get(),
                bias: w.bias.get(),
                scale_error: w.scale_error.get(),
            }),
            noise_sd: e.noise_sd.get(),
            noise_sd_rel: e.noise_sd_rel.get(),
            noise_density: e.noise_density.get(),
            random_walk_of_integral: e.random_walk_of_integral.get(),
            quantisation: e.quantisation.map(f64::from),
            range: e.range.map(|r| r.map(f64::from)),
            vibration: e.vibration.map(spec::VibrationSpec::from),
            hits: e.hits.map(spec::HitSpec::from),
        }
    }
}
