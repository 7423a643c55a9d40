//! The data sheet of a train's instruments: what the YAML says, checked while it is read.
//!
//! Every instrument has three blocks: where it sits (`mount`, inertial instruments only), `sampling` (when values are
//! taken and arrive) and `errors` (how they differ from the truth). A block left out means "none of it"; an instrument
//! left out is not fitted. Values are in the instrument's SI unit: m/s² (accelerometer), rad/s (gyro), N·m (motor
//! torque), m/s (wheel speed), MPa (clamp pressure), rad (steering angle).

use crate::checked::{Finite, Fraction, NonNegative, Positive, Version1};
use crate::error::Error;
use crate::file::{Sets, input_error, read_yaml_with, with_sets};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Longest latency that makes sense; also bounds the memory of the delay line.
const MAX_LATENCY_MS: f64 = 10_000.0;
/// Largest misalignment that still is one, degrees.
const MAX_MISALIGNMENT_DEG: f64 = 30.0;

/// A sensor sheet and the file it came from.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// Where it was read.
    pub file: PathBuf,
    /// What it says.
    pub data: SheetFile,
}

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
}

/// An instrument with three axes, bolted to a link.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InertialSensor {
    /// `unit/link`, or `link` alone for the first unit from the front that has such a link.
    pub mount: String,
    /// When values are taken and arrive.
    pub sampling: Sampling,
    /// How each axis differs from the truth.
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
}

/// An instrument with one reading, which sits where the vehicle has it.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlainSensor {
    /// When values are taken and arrive.
    pub sampling: Sampling,
    /// How values differ from the truth.
    #[serde(default)]
    pub errors: Errors,
}

/// When values are taken and when they arrive.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sampling {
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
}

/// How values differ from the truth. `unit` is the instrument's SI unit; the order of effects is that of the signal path
/// (see `error_model`).
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
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
    /// Standard deviation of a bias drawn once a run (turn-on bias, zero drift), unit.
    pub bias_sd: NonNegative,
    /// Growth of a wandering bias, unit/√s.
    pub bias_random_walk: NonNegative,
    /// A bias that wanders within bounds.
    pub gauss_markov: Option<Markov>,
    /// Bias and scale error that come as the instrument warms up after it is switched on.
    pub warm_up: Option<WarmUp>,
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
}

/// First-order Gauss–Markov process.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Markov {
    /// Standard deviation, unit.
    pub sd: NonNegative,
    /// Correlation time, s.
    pub time_s: Positive,
}

/// Temperature drift of an instrument switched on with the run: it warms up as 1 − exp(−t/time_s).
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WarmUp {
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

impl Default for Errors {
    fn default() -> Self {
        Self {
            bandwidth_hz: None,
            scale_error: Finite::ZERO,
            scale_error_sd: zero(),
            linearity: never(),
            bias: Finite::ZERO,
            bias_sd: zero(),
            bias_random_walk: zero(),
            gauss_markov: None,
            warm_up: None,
            noise_sd: zero(),
            noise_sd_rel: zero(),
            noise_density: zero(),
            random_walk_of_integral: zero(),
            quantisation: None,
            range: None,
        }
    }
}

impl Sheet {
    /// Read and check a sheet.
    pub fn load(file: &Path) -> Result<Self, Error> {
        Self::load_with(file, &Sets::default())
    }

    /// The same with changes made to it.
    pub fn load_with(file: &Path, sets: &Sets) -> Result<Self, Error> {
        let sheet = Self::new(file.into(), read_yaml_with(file, sets)?);
        sheet.map_err(|e| with_sets(e, sets))
    }

    /// Check a sheet already parsed; `file` is named in errors.
    pub fn new(file: PathBuf, data: SheetFile) -> Result<Self, Error> {
        let sheet = Self { file, data };
        sheet.check()?;
        Ok(sheet)
    }

    fn check(&self) -> Result<(), Error> {
        let d = &self.data;
        let inertial = [("accelerometer", &d.accelerometer), ("gyro", &d.gyro)];
        let plain = [
            ("motor_torque", &d.motor_torque),
            ("wheel_speed", &d.wheel_speed),
            ("clamp_pressure", &d.clamp_pressure),
            ("steering_angle", &d.steering_angle),
        ];
        if inertial.iter().all(|(_, s)| s.is_none()) && plain.iter().all(|(_, s)| s.is_none()) {
            return Err(self.wrong(
                "",
                "no instrument is fitted",
                "give at least one of accelerometer, gyro, motor_torque, wheel_speed, clamp_pressure, steering_angle",
            ));
        }
        for (name, sensor) in inertial {
            let Some(sensor) = sensor else { continue };
            self.check_blocks(name, &sensor.sampling, &sensor.errors)?;
            let known = sensor.misalignment_deg.map_or(0.0, |v| {
                v.iter().fold(0.0, |m: f64, x| m.max(x.get().abs()))
            });
            let drawn = sensor.misalignment_sd_deg.map_or(0.0, |x| x.get());
            for (key, size) in [("misalignment_deg", known), ("misalignment_sd_deg", drawn)] {
                if size > MAX_MISALIGNMENT_DEG {
                    return Err(self.wrong(
                        format!("{name}.{key}"),
                        format!("{size}° is no misalignment any more"),
                        format!("at most {MAX_MISALIGNMENT_DEG}°; turn the mount's link in the URDF instead"),
                    ));
                }
            }
        }
        for (name, sensor) in plain {
            if let Some(sensor) = sensor {
                self.check_blocks(name, &sensor.sampling, &sensor.errors)?;
            }
        }
        Ok(())
    }

    fn check_blocks(&self, name: &str, sampling: &Sampling, errors: &Errors) -> Result<(), Error> {
        let period_ms = 1e3 / sampling.rate_hz.get();
        if sampling.jitter_ms.get() > 0.2 * period_ms {
            return Err(self.wrong(
                format!("{name}.sampling.jitter_ms"),
                format!(
                    "{} ms is too much for a period of {period_ms} ms",
                    sampling.jitter_ms.get()
                ),
                "at most a fifth of the period, so that samples keep their order",
            ));
        }
        if sampling.latency_ms.get() > MAX_LATENCY_MS {
            return Err(self.wrong(
                format!("{name}.sampling.latency_ms"),
                format!(
                    "{} ms is longer than {MAX_LATENCY_MS} ms",
                    sampling.latency_ms.get()
                ),
                "the time from taking a value to handing it over, in milliseconds",
            ));
        }
        match errors.range {
            Some([low, high]) if low >= high => Err(self.wrong(
                format!("{name}.errors.range"),
                format!("{} is not below {}", low.get(), high.get()),
                "write [least, greatest]",
            )),
            None if errors.linearity.get() > 0.0 => Err(self.wrong(
                format!("{name}.errors.linearity"),
                "linearity is a share of full scale, but no range is given",
                "add `range: [least, greatest]`",
            )),
            _ => Ok(()),
        }
    }

    /// The instruments can be fitted to this vehicle: only a car is steered, only a train has clamps.
    pub fn check_vehicle(&self, car: bool) -> Result<(), Error> {
        let (train_only, car_only) = (&self.data.clamp_pressure, &self.data.steering_angle);
        match (car, train_only, car_only) {
            (true, Some(_), _) => Err(self.wrong(
                "clamp_pressure",
                "a car has no clamps",
                "leave it out of the sheet",
            )),
            (false, _, Some(_)) => Err(self.wrong(
                "steering_angle",
                "a train is not steered",
                "leave it out of the sheet",
            )),
            _ => Ok(()),
        }
    }

    pub(super) fn wrong(
        &self,
        key: impl Into<String>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Error {
        input_error(&self.file, key, message, help)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Sheet, Error> {
        let folder = std::env::temp_dir().join(format!(
            "monorig-sheet-{}-{:?}",
            std::process::id(),
            std::thread::current().id()
        ));
        std::fs::create_dir_all(&folder).unwrap();
        let file = folder.join("sheet.yaml");
        std::fs::write(&file, text).unwrap();
        let sheet = Sheet::load(&file);
        std::fs::remove_dir_all(&folder).unwrap();
        sheet
    }

    fn key_of(error: Error) -> String {
        match error {
            Error::Input(e) => e.key,
            other => panic!("not an input error: {other}"),
        }
    }

    const ONE: &str =
        "version: 1\nsource: test\ngyro: {mount: imu_link, sampling: {rate_hz: 100}}\n";

    #[test]
    fn a_small_sheet_is_read_with_no_errors_by_default() {
        let sheet = parse(ONE).unwrap();
        let gyro = sheet.data.gyro.unwrap();
        assert_eq!(gyro.sampling.rate_hz.get(), 100.0);
        assert_eq!(gyro.errors.noise_density.get(), 0.0);
        assert!(sheet.data.accelerometer.is_none());
    }

    #[test]
    fn wrong_sheets_are_refused_at_the_right_key() {
        let base = "version: 1\nsource: test\n";
        let cases = [
            (
                "version: 2\nsource: x\ngyro: {mount: a, sampling: {rate_hz: 1}}".to_string(),
                "version",
            ),
            (base.into(), ""),
            (
                format!("{base}gyro: {{mount: a, sampling: {{rate_hz: 0}}}}"),
                "gyro.sampling.rate_hz",
            ),
            (
                format!("{base}gyro: {{mount: a, sampling: {{rate_hz: .nan}}}}"),
                "gyro.sampling.rate_hz",
            ),
            (
                format!("{base}gyro: {{mount: a, sampling: {{rate_hz: 100, dropout: 1.5}}}}"),
                "gyro.sampling.dropout",
            ),
            (
                format!("{base}gyro: {{mount: a, sampling: {{rate_hz: 100, jitter_ms: 3}}}}"),
                "gyro.sampling.jitter_ms",
            ),
            (
                format!("{base}gyro: {{mount: a, sampling: {{rate_hz: 100, latency_ms: 1e6}}}}"),
                "gyro.sampling.latency_ms",
            ),
            (
                format!(
                    "{base}gyro: {{mount: a, sampling: {{rate_hz: 100}}, misalignment_sd_deg: 45}}"
                ),
                "gyro.misalignment_sd_deg",
            ),
            (
                format!(
                    "{base}wheel_speed: {{sampling: {{rate_hz: 100}}, errors: {{noise_sd: -1}}}}"
                ),
                "wheel_speed.errors.noise_sd",
            ),
            (
                format!(
                    "{base}wheel_speed: {{sampling: {{rate_hz: 100}}, errors: {{range: [1, -1]}}}}"
                ),
                "wheel_speed.errors.range",
            ),
            (
                format!(
                    "{base}wheel_speed: {{sampling: {{rate_hz: 100}}, errors: {{linearity: 0.01}}}}"
                ),
                "wheel_speed.errors.linearity",
            ),
        ];
        for (text, key) in cases {
            assert_eq!(key_of(parse(&text).expect_err(&text)), key, "{text}");
        }
        for text in [
            format!("{base}gyro: {{mount: a}}"),
            format!("{base}gyro: {{mount: a, sampling: {{rate_hz: 100}}, colour: red}}"),
            format!("{base}wheel_speed: {{mount: a, sampling: {{rate_hz: 100}}}}"),
        ] {
            assert!(matches!(parse(&text), Err(Error::Input(_))), "{text}");
        }
    }
}
