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
    /// Share of [`Errors::vibration`] and [`Errors::hits`] on x, y, z; `None` = all of it on each.
    pub axis_shake: Option<[f64; 3]>,
    /// Lean of the part that carries the instrument on its suspension.
    pub lean: Option<LeanSpec>,
}

/// Pitch of a sprung body under acceleration: a second-order lag with the static angle φ = `pitch_deg_per_g`·a/g, + nose up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeanSpec {
    /// Static pitch per acceleration along the track, degrees per standard gravity.
    pub pitch_deg_per_g: f64,
    /// Natural frequency, Hz.
    pub frequency_hz: f64,
    /// Damping ratio.
    pub damping: f64,
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
    /// Further time to arrival, drawn for every sample; a sample waits for those before it.
    pub arrival_jitter: Option<ArrivalJitter>,
    /// Samples are handed over at multiples of this time only, ms; 0 = as they come.
    pub bunching_ms: f64,
    /// Samples that others overtake.
    pub reordering: Option<Reordering>,
    /// Error of the clock that stamps the samples.
    pub clock: ClockSpec,
    /// What is handed over when several samples have arrived.
    pub many: Many,
}

/// Distribution of a time to arrival that differs from sample to sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ArrivalJitter {
    /// Uniform from 0 to so many ms.
    Uniform(f64),
    /// Exponential with this mean, ms, cut off at ten times the mean.
    Exponential(f64),
}

impl ArrivalJitter {
    /// Longest time to arrival, ms.
    pub fn longest_ms(self) -> f64 {
        match self {
            Self::Uniform(ms) => ms,
            Self::Exponential(mean_ms) => 10.0 * mean_ms,
        }
    }
}

/// A share of the samples, drawn at random, arrives so much later than the others and after younger ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reordering {
    /// Probability of a sample to be held up, 0…1.
    pub share: f64,
    /// Time it is held up, ms.
    pub delay_ms: f64,
}

/// Clock of an instrument: it stamps t with t + offset + drift·t.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClockSpec {
    /// Known offset, ms.
    pub offset_ms: f64,
    /// Standard deviation of an offset drawn once a run, ms.
    pub offset_sd_ms: f64,
    /// Known drift, 10⁻⁶.
    pub drift_ppm: f64,
    /// Standard deviation of a drift drawn once a run, 10⁻⁶.
    pub drift_sd_ppm: f64,
}

/// What is handed over when several samples have arrived since the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Many {
    /// Their mean, with the mean of their stamps.
    #[default]
    Mean,
    /// The one with the newest stamp; the others are dropped.
    Newest,
}

impl Sampling {
    /// This many samples per second, Hz, that arrive at once, all of them, with right stamps.
    pub fn at(rate_hz: f64) -> Self {
        Self {
            rate_hz,
            latency_ms: 0.0,
            jitter_ms: 0.0,
            dropout: 0.0,
            arrival_jitter: None,
            bunching_ms: 0.0,
            reordering: None,
            clock: ClockSpec::default(),
            many: Many::Mean,
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
    /// Standard deviation of a bias drawn once a run (turn-on repeatability, zero drift), unit.
    pub bias_sd: f64,
    /// Bias of an instrument that is not calibrated, drawn once a run for each axis: magnitude uniform between the two, sign at random,
    /// unit.
    pub switch_on_bias: Option<[f64; 2]>,
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
    /// Shaking that grows with the speed.
    pub vibration: Option<VibrationSpec>,
    /// Hits at rail joints and bumps.
    pub hits: Option<HitSpec>,
}

/// Band-limited noise whose level grows in proportion to the speed up to `full_mps` and stays there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VibrationSpec {
    /// Standard deviation from `full_mps` on, unit.
    pub sd: f64,
    /// Speed from which on it has its full level, m/s.
    pub full_mps: f64,
    /// Lower and upper corner frequency, Hz; the density falls by 20 dB per decade beyond each.
    pub band_hz: [f64; 2],
}

/// Short disturbances at places of the track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HitSpec {
    /// One at every rail joint of the track.
    pub at_joints: bool,
    /// So many more at random, per metre travelled.
    pub per_m: f64,
    /// Magnitude: uniform between the two, sign at random, unit.
    pub size: [f64; 2],
    /// How long one lasts, ms.
    pub duration_ms: f64,
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
