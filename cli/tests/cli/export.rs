//! `export`: a run as a log, and the replay of it, which is the run again.

use crate::common::{TestFolder, columns};
use std::collections::BTreeMap;

/// A run that has kept its samples: jitter, latency and dropouts of the wheel speed, and with the sample's events a
/// load change and a stuck IMU.
fn run(dir: &TestFolder, more: &[&str]) {
    let task = [
        "run",
        "scenario.yaml",
        "--keep-samples",
        "--no-rerun",
        "--plant",
        "point-mass",
        "--set",
        "stop.after_s=46",
        "--set",
        "estimators.rail_fusion={}",
    ];
    let (code, out, err) = dir.monorig(&[&task[..], more].concat());
    assert!(matches!(code, Some(0 | 1)), "{out}{err}");
}

/// Runs have the folder of their variant.
fn folder(dir: &TestFolder) -> String {
    let name = std::fs::read_dir(dir.path("runs")).unwrap().next().unwrap();
    let name = name.unwrap().file_name().into_string().unwrap();
    format!("runs/{name}/1")
}

/// Exports a run and replays the export; the columns of run and replay.
fn there_and_back(dir: &TestFolder, run: &str, format: &str) -> [BTreeMap<String, Vec<f64>>; 2] {
    let (code, out, err) = dir.monorig(&["export", run, "--to", format, "--out", format]);
    assert_eq!(code, Some(0), "{out}{err}");
    let map = std::fs::read_dir(dir.path(format)).unwrap();
    let map = map
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .find(|name| name.ends_with(".map.yaml"))
        .unwrap();
    assert!(out.contains(&map), "{out}");
    let map = format!("{format}/{map}");
    let (code, out, err) = dir.monorig(&["check", &map]);
    assert_eq!(code, Some(0), "{out}{err}");
    let again = format!("again_{format}");
    let (code, out, err) = dir.monorig(&["replay", "--map", &map, "--no-rerun", "--out", &again]);
    assert!(matches!(code, Some(0 | 1)), "{out}{err}");
    let scenario = std::fs::read_dir(dir.path(&again)).unwrap().next().unwrap();
    [
        columns(&dir.path(run)),
        columns(&scenario.unwrap().path().join("1")),
    ]
}

/// Calls `each` with the name and the two values of every number that the estimators put out.
fn compare(both: &[BTreeMap<String, Vec<f64>>; 2], mut each: impl FnMut(&str, f64, f64)) {
    let [run, again] = both;
    let of_time = |all: &BTreeMap<String, Vec<f64>>| -> BTreeMap<u64, usize> {
        let times = all["time"].iter().enumerate();
        times.map(|(row, t)| (t.to_bits(), row)).collect()
    };
    let (rows, rows_again) = (of_time(run), of_time(again));
    let mut compared = 0;
    let names: Vec<_> = run
        .keys()
        .filter(|name| name.starts_with("estimates/"))
        .collect();
    assert!(names.len() > 20, "{names:?}");
    for (t, row) in &rows {
        let Some(row_again) = rows_again.get(t) else {
            continue;
        };
        for name in &names {
            each(name, run[*name][*row], again[*name][*row_again]);
        }
        compared += 1;
    }
    assert!(
        compared * 100 > rows.len() * 99,
        "{compared} of {} rows",
        rows.len()
    );
}

#[test]
fn a_lossless_export_is_the_run_again_bit_for_bit() {
    let dir = TestFolder::new();
    run(&dir, &[]);
    let run = folder(&dir);
    let (code, out, err) = dir.monorig(&["check", &format!("{run}/samples.parquet")]);
    assert!(
        code == Some(0) && out.contains("steps of 2 ms"),
        "{out}{err}"
    );
    for format in ["csv", "parquet", "mat", "mcap", "mf4"] {
        let both = there_and_back(&dir, &run, format);
        let mut differ = Vec::new();
        compare(&both, |name, a, b| {
            if a.to_bits() != b.to_bits() && !(a.is_nan() && b.is_nan()) {
                differ.push(format!("{name}: {a} {b}"));
            }
        });
        assert!(
            differ.is_empty(),
            "{format}: {} values, {:?}",
            differ.len(),
            differ.first()
        );
    }
}

/// CAN rounds: stamps to 1 µs, forces to 1e-5 m/s², torques to 1e-3 N·m, speeds to 1e-5 m/s. A filter that is stable
/// makes differences of that order in slope (1e-5 / 9.81 rad) and mass (1e-3 N·m of some 10) of it. Without the events:
/// at the edges of a fault a detector that decides a step later makes more of it (1.5e-4 rad here).
#[test]
fn an_export_to_can_is_the_run_within_the_steps_of_its_signals() {
    let dir = TestFolder::new();
    run(&dir, &["--set", "events=[]"]);
    let both = there_and_back(&dir, &folder(&dir), "can");
    let (mut slope, mut mass) = (0.0f64, 0.0f64);
    compare(&both, |name, a, b| {
        if name.ends_with("dffrls_aekf_robust/grade") {
            slope = slope.max((a - b).abs());
        } else if name.ends_with("dffrls_aekf_robust/total_mass") {
            mass = mass.max((a / b - 1.0).abs());
        }
    });
    assert!(slope > 0.0 && slope < 1e-4, "slope differs by {slope} rad");
    assert!(mass > 0.0 && mass < 1e-3, "mass differs by {mass}");
}

#[test]
fn what_cannot_be_exported_says_why() {
    let dir = TestFolder::new();
    let (code, out, err) = dir.monorig(&[
        "run",
        "scenario.yaml",
        "--no-rerun",
        "--plant",
        "point-mass",
        "--set",
        "stop.after_s=1",
        "--set",
        "events=[]",
        "--set",
        "expect=[]",
    ]);
    assert!(matches!(code, Some(0 | 1)), "{out}{err}");
    let run = folder(&dir);
    let told = dir.refused(&["export", &run, "--to", "csv"]);
    assert!(told.contains("--keep-samples"), "{told}");
    let told = dir.refused(&["export", "nowhere", "--to", "csv"]);
    assert!(told.contains("nowhere"), "{told}");
}
