//! `judge` and `calibrate`, over a run and over its export.

#![allow(clippy::unwrap_used)]

mod common;

use common::{Simulation, columns};
use std::fmt::Write as _;

/// A drive with speed changes on the sample's track that has kept its samples.
fn run(rig: &Simulation) -> String {
    let (code, out, err) = rig.monorig(&[
        "run",
        "scenario.yaml",
        "--keep-samples",
        "--no-rerun",
        "--plant",
        "point-mass",
        "--set",
        "events=[]",
        "--set",
        "stop.after_s=80",
        "--set",
        "drive.speed=[{at_s: 0, mps: 0}, {at_s: 3, mps: 1}, {at_s: 20, mps: 0.5}, {at_s: 35, mps: 1.4}, {at_s: 50, mps: 0.7}, {at_s: 65, mps: 1.2}]",
    ]);
    assert!(matches!(code, Some(0 | 1)), "{out}{err}");
    let name = std::fs::read_dir(rig.path("runs")).unwrap().next().unwrap();
    format!(
        "runs/{}/1",
        name.unwrap().file_name().into_string().unwrap()
    )
}

/// The estimates of the run itself, judged as if they were made elsewhere, are as good as those of the run; with 1 t on top they are 1 t off.
#[test]
fn estimates_of_the_run_are_judged_as_the_run_judged_them() {
    let rig = Simulation::new();
    let run = run(&rig);
    let all = columns(&rig.path(&run));
    let of = |name: &str| &all[&format!("estimates/dffrls_aekf_robust/{name}")];
    for (file, more_kg) in [("same.csv", 0.0), ("heavy.csv", 1000.0)] {
        let mut text = String::from("t,mass_kg,mass_sd_kg,mass_valid,slope_rad,slope_valid\n");
        for (row, t) in all["time"].iter().enumerate() {
            let at = |name: &str| of(name)[row];
            writeln!(
                text,
                "{t},{},{},{},{},{}",
                at("total_mass") + more_kg,
                at("total_mass_sd"),
                at("total_mass_valid"),
                at("grade"),
                at("grade_valid")
            )
            .unwrap();
        }
        rig.write(file, text.replace("NaN", "").as_bytes());
    }
    let judged = |file: &str| -> serde_json::Value {
        let (code, out, err) = rig.monorig(&[
            "judge",
            &run,
            "--estimates",
            file,
            "--no-rerun",
            "--out",
            "judged",
        ]);
        assert!(matches!(code, Some(0 | 1)), "{out}{err}");
        let folder = std::fs::read_dir(rig.path("judged")).unwrap();
        let mut names = folder.map(|e| e.unwrap().file_name().into_string().unwrap());
        let name = names.next().unwrap();
        assert_eq!(names.next(), None, "something is left beside the results");
        let metrics = rig.read(&format!("judged/{name}/1/metrics.json"));
        let (code, out, err) = rig.monorig(&["report", &format!("judged/{name}/1")]);
        assert_eq!(code, Some(0), "{out}{err}");
        serde_json::from_str(&metrics).unwrap()
    };
    let metrics = judged("same.csv");
    let of = |estimator: &str, metric: &str| {
        metrics["estimators"][estimator][metric]
            .as_f64()
            .unwrap_or_else(|| panic!("{estimator} {metric} in {metrics}"))
    };
    for metric in ["mass_rmse_kg", "slope_rmse_deg"] {
        let (ours, theirs) = (of("dffrls_aekf_robust", metric), of("judged", metric));
        // the table has every tenth step only
        assert!(
            (ours / theirs - 1.0).abs() < 0.02,
            "{metric}: {ours} {theirs}"
        );
    }
    // |mean |e + 1000| − 1000| is at most mean |e|
    let mae = |metrics: &serde_json::Value| {
        metrics["estimators"]["judged"]["mass_mae_kg"]
            .as_f64()
            .unwrap()
    };
    let (same, heavy) = (mae(&metrics), mae(&judged("heavy.csv")));
    assert!((heavy - 1000.0).abs() <= same + 1e-6, "{same} {heavy}");
    let told = rig.refused(&["judge", "nowhere", "--estimates", "same.csv"]);
    assert!(told.contains("no folder of a run"), "{told}");
    rig.write("bad.csv", b"t,m\n0,1\n");
    let told = rig.refused(&["judge", &run, "--estimates", "bad.csv"]);
    assert!(told.contains("mass_kg"), "{told}");
}

/// Simulator → log → parameters: a torque read 8 % too large and the running resistance of the train come out of the log within three
/// standard deviations.
#[test]
fn what_was_planted_in_a_run_is_found_in_its_log() {
    let rig = Simulation::new();
    let run = run(&rig);
    let (code, out, err) = rig.monorig(&["export", &run, "--to", "parquet", "--out", "log"]);
    assert_eq!(code, Some(0), "{out}{err}");
    let map = out
        .lines()
        .find_map(|l| l.strip_prefix("monorig replay --map "))
        .unwrap();
    let (code, out, err) = rig.monorig(&[
        "calibrate",
        "--map",
        map,
        "--known",
        "mass,slope",
        "--json",
        "found.json",
        "--set",
        "faults=[{from_s: 0, channel: traction, fault: scale, size: 1.08}]",
    ]);
    assert_eq!(code, Some(0), "{out}{err}");
    let found: serde_json::Value = serde_json::from_str(&rig.read("found.json")).unwrap();
    let get = |name: &str| {
        let all = found.as_array().unwrap().iter();
        let p = all.clone().find(|p| p["name"] == name).unwrap();
        (p["value"].as_f64().unwrap(), p["sd"].as_f64().unwrap())
    };
    let resistance = columns(&rig.path(&run))["truth/running_resistance"].clone();
    let known: Vec<f64> = resistance.into_iter().filter(|x| x.is_finite()).collect();
    let resistance = known[known.len() / 2];
    for (name, planted) in [
        ("torque gain", 1.0 / 1.08),
        ("running resistance", resistance),
    ] {
        let (value, sd) = get(name);
        let off = (value - planted).abs();
        assert!(
            off < 3.0 * sd && sd < 0.2 * planted,
            "{name}: {value} ± {sd}, planted {planted}\n{out}"
        );
    }
    let told = rig.refused(&["calibrate", "--map", map, "--known", "mass"]);
    assert!(told.contains("--known mass,slope"), "{told}");
}
