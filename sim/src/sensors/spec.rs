//! Specification of an instrument: plain numbers, checked where they are read.
//!
//! `unit` is the instrument's SI unit: m/s² (accelerometer), rad/s (gyro), N·m (motor torque), m/s (wheel speed), MPa (clamp
//! pressure), rad (steering angle, inclinometer). A default value means "none of it".

use std::collections::BTreeMap;

/// The instruments of a vehicle by name (see [`KINDS`](super::KINDS)).
pub type InstrumentSpecs = BTreeMap<&'static str, InstrumentSpec>;

/// One instrument.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InstrumentSpec {
    /// When values are taken and when they arrive.
    pub sampling: Sampling,
    /// How each axis differs from the truth.
    pub errors: Errors,
    /// Where it is bolted to; instruments without a mount leave it as it is.
    pub mounting: Mounting,
}

/// Place and alignment of an instrument on a link of the vehicle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mounting {
    /// `unit/link`, or `link` alone for the first unit from the front that has such a link.
    pub link: String,
    /// Known bias of x, y, z, unit; adds to [`Errors::bias`].
    pub axis_bias: [f64; 3],
    /// Known rotation of the instrument's axes against the mount's: a rotation vector in mount axes, degrees.
    pub misalignment_deg: [f64; 3],
    /// Standard deviation of a misalignment drawn once a run, each component of the rotation vector, degrees.
    pub misalignment_sd_deg: f64,
}

/// When values are taken and when they arrive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// Samples per second, Hz; at most one per physics step.
    pub rate_hz: f64,
    /// Time from taking a value to handing it over, ms.
    pub latency_ms: f64,
    /// Standard deviation of the instant a value is taken about the instant stamped on it, ms.
    pub jitter_ms: f64,
    /// Probability that a sample is lost, 0…1.
    pub dropout: f64,
}

impl Sampling {
    /// This many samples per second, Hz, without latency, jitter and drop-out.
    pub fn at(rate_hz: f64) -> Self {
        Self {
            rate_hz,
            latency_ms: 0.0,
            jitter_ms: 0.0,
            dropout: 0.0,
        }
    }
}

impl Default for Sampling {
    /// 100 Hz.
    fn default() -> Self {
        Self::at(100.0)
    }
}

/// How values differ from the truth; the order of effects is that of the signal path (see
/// [`error_model`](super::error_model)).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Corner frequency of a first-order low-pass, Hz.
    pub bandwidth_hz: Option<f64>,
    /// Known relative error of scale: reads (1 + scale_error) × truth.
    pub scale_error: f64,
    /// Standard deviation of a relative error of scale drawn once a run.
    pub scale_error_sd: f64,
    /// Terminal-based linearity: largest deviation at mid-range as a share of full scale; needs `range`.
    pub linearity: f64,
    /// Known bias, unit.
    pub bias: f64,
    /// Standard deviation of a bias drawn once a run (turn-on bias, zero drift), unit.
    pub bias_sd: f64,
    /// Growth of a wandering bias, unit/√s.
    pub bias_random_walk: f64,
    /// A bias that wanders within bounds.
    pub gauss_markov: Option<Markov>,
    /// Bias and scale error that come as the instrument warms up after it is switched on.
    pub warm_up: Option<WarmUp>,
    /// White noise per sample whatever the rate, unit.
    pub noise_sd: f64,
    /// White noise per sample as share of the reading.
    pub noise_sd_rel: f64,
    /// White noise as one-sided density, unit/√Hz: σ = density·√(rate/2).
    pub noise_density: f64,
    /// White noise as random walk of its integral (angle, velocity random walk), unit·√s: σ = value·√rate.
    pub random_walk_of_integral: f64,
    /// Step between two readings, unit.
    pub quantisation: Option<f64>,
    /// Least and greatest reading, unit.
    pub range: Option<[f64; 2]>,
}

/// First-order Gauss–Markov process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Markov {
    /// Standard deviation, unit.
    pub sd: f64,
    /// Correlation time, s.
    pub time_s: f64,
}

/// Temperature drift of an instrument switched on with the run: it warms up as 1 − exp(−t/time_s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarmUp {
    /// Time constant, s.
    pub time_s: f64,
    /// Bias when warm, unit.
    pub bias: f64,
    /// Relative error of scale when warm.
    pub scale_error: f64,
}
