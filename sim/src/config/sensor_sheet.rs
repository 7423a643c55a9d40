//! The data sheet of a vehicle's instruments, read and checked.

use crate::config::file::{Sets, input_error, read_yaml_with, with_sets};
use crate::config::sensor_sheet_file::{Errors, Sampling, SheetFile};
use crate::error::Error;
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

    pub(crate) fn wrong(
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
