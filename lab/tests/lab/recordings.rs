//! The Allan deviation against another library; real recordings against the figures of the sheets that were made of
//! them.

use monorig_lab::recordings::allan::overlapping;
use monorig_lab::recordings::{ColumnFit, RecordedRow, Recording, fit};
use monorig_sim::config::checked::{NonNegative, Positive};
use monorig_sim::config::sensor_sheet::Sheet;
use monorig_sim::sensors::spec::InstrumentSpecs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Columns of a CSV file, in SI units, over its column t or time; runs by its column run, if there is one.
fn read(file: &str, columns: &[&str]) -> Recording {
    let mut reader = csv::Reader::from_path(root().join("tests/data/real").join(file)).unwrap();
    let header = reader.headers().unwrap().clone();
    let place = |name: &str| header.iter().position(|h| h == name);
    let (mut runs, mut rows) = (Vec::new(), Vec::new());
    for record in reader.records().map(Result::unwrap) {
        let number = |name: &str| record[place(name).unwrap()].trim().parse::<f64>().unwrap();
        let run = place("run").map(|i| record[i].to_owned());
        if runs.last() != Some(&run) {
            runs.push(run);
        }
        let values = columns.iter().map(|c| number(c));
        rows.push(RecordedRow {
            run: runs.len() as u32,
            t_s: number(if place("t").is_some() { "t" } else { "time" }),
            values: values.collect(),
        });
    }
    let names = columns.iter().map(|c| ((*c).to_owned(), String::new()));
    Recording::cut(names.collect(), rows).unwrap()
}

/// Columns of a table of the oracles, whose rows have no time.
fn table(name: &str) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(root().join("tests/reference/data").join(name)).unwrap();
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|l| l.split(',').map(|x| x.parse().unwrap()).collect())
        .collect();
    (0..rows[0].len())
        .map(|i| rows.iter().map(|r| r[i]).collect())
        .collect()
}

/// allantools (2024.6), `oadev`, on the same samples: equal to rounding.
#[test]
fn the_allan_deviation_agrees_with_allantools() {
    let (input, output) = (table("allan_input.csv"), table("allan_output.csv"));
    for column in 0..2 {
        let points = overlapping(&[&input[column]], 0.01);
        assert_eq!(points.len(), output[0].len());
        for (p, (tau, deviation)) in points.iter().zip(output[0].iter().zip(&output[column + 1])) {
            assert!((p.tau_s - tau).abs() < 1e-12);
            assert!(
                (p.deviation / deviation - 1.0).abs() < 1e-9,
                "{p:?} {deviation}"
            );
        }
    }
}

fn standstill() -> Vec<ColumnFit> {
    let columns = ["fx", "fy", "fz", "wx", "wy", "wz"];
    fit(&read("train_standstill/train_imu.csv", &columns))
}

fn sheet(name: &str) -> InstrumentSpecs {
    let file = root().join("assets/sensors").join(name);
    Sheet::load(&file).unwrap().specs()
}

/// Noise of the sheet: that of the standing train, within what three pieces, three axes and two units differ (a third).
#[test]
fn the_noise_of_the_uncalibrated_sheet_is_that_of_the_standing_train() {
    let specs = sheet("mems_uncalibrated.yaml");
    let fits = standstill();
    for f in &fits[..3] {
        let density = f.noise.unwrap().density();
        let stated = specs["accelerometer"].errors.noise_density.get();
        assert!(
            (density / stated - 1.0).abs() < 0.34,
            "{}: {density}",
            f.name
        );
    }
    for f in &fits[3..] {
        let walk = f.noise.unwrap().white;
        let stated = specs["gyro"].errors.random_walk_of_integral.get();
        assert!((walk / stated - 1.0).abs() < 0.34, "{}: {walk}", f.name);
    }
}

/// A standing gyro reads its bias: each axis of each unit is within the limits that the sheet draws from.
#[test]
fn the_switch_on_bias_of_the_sheet_covers_the_standing_gyros() {
    let specs = sheet("mems_uncalibrated.yaml");
    let errors = &specs["gyro"].errors;
    let [least, greatest] = errors.switch_on_bias.unwrap().map(NonNegative::get);
    let slack = 3.0 * errors.bias_sd.get();
    for f in &standstill()[3..] {
        assert_eq!(f.means.len(), 3);
        for mean in &f.means {
            let bias = mean.abs();
            assert!(
                least - slack < bias && bias < greatest + slack,
                "{}: {bias}",
                f.name
            );
        }
    }
}

/// The robot shakes as the sheet says: 50 of the 217 s that the sheet is made of. Other stretches of 50 s have 0.68
/// to 0.87 m/s² and a lower edge of 3.9 to 5.2 Hz (filtfilt of SciPy on the whole recording), and high-passes find
/// edges some 13 % lower than the periodogram that the sheet is made with: a quarter for the level, 30 % for the
/// edges.
#[test]
fn the_vibration_of_the_harsh_sheet_is_that_of_the_robot() {
    let fits = fit(&read("husky/imu_flooring_03.csv", &["ax", "wy"]));
    let specs = sheet("harsh.yaml");
    for (f, name) in fits.iter().zip(["accelerometer", "gyro"]) {
        let found = f.vibration.as_ref().unwrap();
        let stated = specs[name].errors.vibration.unwrap();
        assert!(
            (found.robust_sd / stated.sd.get() - 1.0).abs() < 0.25,
            "{name}: {found:?}"
        );
        for (edge, wanted) in found.band_hz.iter().zip(stated.band_hz.map(Positive::get)) {
            assert!((edge / wanted - 1.0).abs() < 0.30, "{name}: {found:?}");
        }
        assert!(found.colours());
        // What moves is no instrument's noise: the three terms do not describe it.
        assert!(f.noise.unwrap().misfit > 0.2, "{name}: {:?}", f.noise);
    }
}
