//! The data sheet of a vehicle's instruments, read and checked.

use crate::checked::{Finite, NonNegative, Positive};
use crate::config::file::{Sets, read_yaml_with, with_sets};
use crate::error::{DataError, Error};
use crate::sensors::instruments::{KINDS, SheetFile};
use crate::sensors::spec::{ClockSpec, Errors, InstrumentSpec, InstrumentSpecs, Sampling};
use std::path::{Path, PathBuf};

/// Longest accepted latency; it also bounds the memory of the delay line.
const MAX_LATENCY_MS: f64 = 10_000.0;
/// Largest accepted offset of a clock.
const MAX_CLOCK_OFFSET_MS: f64 = 60_000.0;
/// Largest drift of a clock, millionths: a clock that loses a tenth.
const MAX_CLOCK_DRIFT_PPM: f64 = 1e5;
/// Highest upper corner of a vibration: the physics has steps of milliseconds.
const MAX_VIBRATION_HZ: f64 = 1000.0;
/// Largest static pitch of a sprung body.
const MAX_LEAN_DEG_PER_G: f64 = 30.0;
/// Largest accepted misalignment, degrees.
const MAX_MISALIGNMENT_DEG: f64 = 30.0;

/// A sensor sheet and the file it came from.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// The file it was read from.
    pub file: PathBuf,
    /// The contents.
    pub data: SheetFile,
}

impl Sheet {
    /// Read and check a sheet.
    pub fn load(file: &Path) -> Result<Self, Error> {
        Self::load_with(file, &Sets::default())
    }

    /// Loads a sensor sheet with changes.
    pub fn load_with(file: &Path, sets: &Sets) -> Result<Self, Error> {
        let sheet = Self::new(file.into(), read_yaml_with(file, sets)?);
        sheet.map_err(|e| with_sets(e, sets))
    }

    /// Check a sheet already parsed; `file` is named in errors.
    pub fn new(file: PathBuf, data: SheetFile) -> Result<Self, Error> {
        let sheet = Self { file, data };
        match sheet.check() {
            Ok(()) => Ok(sheet),
            Err(e) => Err(e.in_file(&sheet.file)),
        }
    }

    /// The instruments that are fitted.
    pub fn specs(&self) -> InstrumentSpecs {
        self.data.fitted().into_iter().collect()
    }

    fn check(&self) -> Result<(), DataError> {
        let fitted = self.data.fitted();
        if fitted.is_empty() {
            let names: Vec<&str> = KINDS.iter().map(|kind| kind.name).collect();
            return Err(DataError::new(
                "",
                "no instrument is fitted",
                format!("give at least one of {}", names.join(", ")),
            ));
        }
        for (name, spec) in fitted {
            check_sampling(&spec.sampling)
                .and_then(|()| check_clock(&spec.sampling.clock))
                .and_then(|()| check_errors(&spec.errors))
                .and_then(|()| check_shake(&spec.errors))
                .and_then(|()| check_mounting(&spec))
                .map_err(|e| e.under(name))?;
        }
        Ok(())
    }
}

impl From<Sheet> for InstrumentSpecs {
    fn from(sheet: Sheet) -> Self {
        sheet.specs()
    }
}

fn check_sampling(sampling: &Sampling) -> Result<(), DataError> {
    let (period_ms, jitter_ms) = (1e3 / sampling.rate_hz.get(), sampling.jitter_ms.get());
    if jitter_ms > 0.2 * period_ms {
        return Err(DataError::new(
            "sampling.jitter_ms",
            format!("{jitter_ms} ms is too much for a period of {period_ms} ms"),
            "at most a fifth of the period, so that samples keep their order",
        ));
    }
    let jitter = sampling.arrival_jitter;
    for (key, ms) in [
        ("latency_ms", sampling.latency_ms.get()),
        ("arrival_jitter.ms", jitter.map_or(0.0, |j| j.longest_ms())),
        ("bunching_ms", sampling.bunching_ms.get()),
        (
            "reordering.delay_ms",
            sampling.reordering.map_or(0.0, |r| r.delay_ms.get()),
        ),
    ] {
        if ms > MAX_LATENCY_MS {
            return Err(DataError::new(
                format!("sampling.{key}"),
                format!("samples would be {ms} ms late, more than {MAX_LATENCY_MS} ms"),
                "use the time from taking a value to delivering it, in milliseconds",
            ));
        }
    }
    Ok(())
}

fn check_clock(clock: &ClockSpec) -> Result<(), DataError> {
    for (key, size, limit) in [
        ("offset_ms", clock.offset_ms.get(), MAX_CLOCK_OFFSET_MS),
        (
            "offset_sd_ms",
            clock.offset_sd_ms.get(),
            MAX_CLOCK_OFFSET_MS,
        ),
        ("drift_ppm", clock.drift_ppm.get(), MAX_CLOCK_DRIFT_PPM),
        (
            "drift_sd_ppm",
            clock.drift_sd_ppm.get(),
            MAX_CLOCK_DRIFT_PPM,
        ),
    ] {
        if size.abs() > limit {
            return Err(DataError::new(
                format!("sampling.clock.{key}"),
                format!("{size} is too large for the error of a clock"),
                format!("at most {limit}"),
            ));
        }
    }
    Ok(())
}

fn check_shake(errors: &Errors) -> Result<(), DataError> {
    if let Some([low, high]) = errors.vibration.map(|v| v.band_hz.map(Positive::get))
        && (low >= high || high > MAX_VIBRATION_HZ)
    {
        return Err(DataError::new(
            "errors.vibration.band_hz",
            format!("{low} to {high} Hz is not a band"),
            format!("write [lower, upper] corner, upper at most {MAX_VIBRATION_HZ} Hz"),
        ));
    }
    let hits = errors.hits.map(|h| h.size);
    for (key, limits) in [
        ("hits.size", hits),
        ("switch_on_bias", errors.switch_on_bias),
    ] {
        if let Some([least, greatest]) = limits.map(|l| l.map(NonNegative::get))
            && least > greatest
        {
            return Err(DataError::new(
                format!("errors.{key}"),
                format!("{least} is above {greatest}"),
                "write [least, greatest] magnitude",
            ));
        }
    }
    match errors.hits {
        Some(h) if !h.at_joints && h.per_m.get() == 0.0 => Err(DataError::new(
            "errors.hits",
            "these hits have neither joints nor random places",
            "`at_joints: true`, or `per_m` above 0",
        )),
        _ => Ok(()),
    }
}

fn check_errors(errors: &Errors) -> Result<(), DataError> {
    match errors.range.map(|r| r.map(Finite::get)) {
        Some([low, high]) if low >= high => Err(DataError::new(
            "errors.range",
            format!("{low} is not below {high}"),
            "write [least, greatest]",
        )),
        None if errors.linearity.get() > 0.0 => Err(DataError::new(
            "errors.linearity",
            "linearity is a share of full scale, but the range is missing",
            "add `range: [least, greatest]`",
        )),
        _ => Ok(()),
    }
}

fn check_mounting(spec: &InstrumentSpec) -> Result<(), DataError> {
    if let Some(pitch) = spec.lean.map(|lean| lean.pitch_deg_per_g.get())
        && pitch.abs() > MAX_LEAN_DEG_PER_G
    {
        return Err(DataError::new(
            "lean.pitch_deg_per_g",
            format!("{pitch}° per g is too soft for a suspension"),
            format!("at most {MAX_LEAN_DEG_PER_G}; cars have 1 to 4"),
        ));
    }
    let known = spec.misalignment_deg.unwrap_or_default();
    let known = known.iter().fold(0.0, |m: f64, x| m.max(x.get().abs()));
    let drawn = spec.misalignment_sd_deg.map_or(0.0, NonNegative::get);
    for (key, size) in [("misalignment_deg", known), ("misalignment_sd_deg", drawn)] {
        if size > MAX_MISALIGNMENT_DEG {
            return Err(DataError::new(
                key,
                format!("{size}° is too large for a misalignment"),
                format!(
                    "use at most {MAX_MISALIGNMENT_DEG}°; turn the mount's link in the URDF instead"
                ),
            ));
        }
    }
    Ok(())
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
