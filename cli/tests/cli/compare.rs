//! `monorig compare`: the same runs for all, differences run by run, published figures beside ours.

use crate::common::{TestFolder, words};
use serde_json::Value;

const QUICK: &str = "\
version: 1
why: A quick one.
track: track.yaml
train: train.yaml
start: {chainage_m: 2}
stop: {after_s: 30}
physics: {plant: point-mass}
drive: {speed: [{at_s: 0, mps: 0}, {at_s: 3, mps: 1.5}]}
sensors: sensors.yaml
estimators: {attitude: {}}
in_loop: attitude
published:
  - {source: 'Somebody 2024, table 9', estimator: rail_fusion, metric: slope_mae_deg, value: 12.375}
";

fn dir() -> TestFolder {
    let dir = TestFolder::new();
    dir.write("quick.yaml", QUICK.as_bytes());
    dir
}

const METRICS: &str = "slope_mae_deg,slope_availability";

fn compare<'a>(more: &[&'a str]) -> Vec<&'a str> {
    let all = [
        "compare",
        "quick.yaml",
        "--seeds",
        "1..5",
        "--metrics",
        METRICS,
    ];
    [&all, more].concat()
}

/// Means and differences are those of the single runs, and an estimator that was not in the scenario runs beside the
/// others without changing them.
#[test]
fn the_table_says_what_the_runs_say() {
    let dir = dir();
    let files = ["--json", "both.json", "--csv", "both.csv"];
    let both = [&["--estimators", "attitude,rail_fusion"][..], &files].concat();
    let (code, out, err) = dir.monorig(&compare(&both));
    assert_eq!(code, Some(0), "{out}{err}");
    let table = dir.read("both.csv");
    assert!(
        table.contains("12.375") && table.contains("Somebody 2024, table 9"),
        "{table}"
    );
    let json: Value = serde_json::from_str(&dir.read("both.json")).unwrap();
    let value = |run: &Value, name: &str| {
        run["summary"]["estimators"][name]["slope_mae_deg"]
            .as_f64()
            .unwrap()
    };
    let valid = |run: &Value, name: &str| {
        run["summary"]["estimators"][name]["slope_mae_deg_valid"]
            .as_f64()
            .unwrap()
    };
    let runs = json["runs"].as_array().unwrap();
    let mean = |f: &dyn Fn(&Value) -> f64| runs.iter().map(f).sum::<f64>() / runs.len() as f64;
    let row = &json["table"][1];
    assert_eq!(
        (&row["estimator"], &row["metric"]),
        (&"rail_fusion".into(), &"slope_mae_deg".into())
    );
    let close = |told: &Value, expected: f64| {
        let told = told["mean"].as_f64().unwrap();
        assert!((told - expected).abs() < 1e-12, "{told} {expected}");
    };
    close(&row["mean"], mean(&|r| value(r, "rail_fusion")));
    close(
        &row["difference"],
        mean(&|r| {
            let common = &r["summary"]["common"]["rail_fusion"]["errors"]["slope_mae_deg"];
            common[0].as_f64().unwrap() - common[1].as_f64().unwrap()
        }),
    );
    close(&row["valid"]["mean"], mean(&|r| valid(r, "rail_fusion")));
    for samples in ["valid", "common"] {
        assert!(
            row[samples]["share"]
                .as_f64()
                .is_some_and(|s| s > 0.0 && s <= 1.0),
            "{row}"
        );
    }
    assert_eq!(row["published"]["value"], 12.375);
    assert_eq!(dir.read("both.csv").lines().count(), 1 + 2 * 2);

    let (code, ..) = dir.monorig(&compare(&["--json", "alone.json"]));
    assert_eq!(code, Some(0));
    let alone: Value = serde_json::from_str(&dir.read("alone.json")).unwrap();
    for (a, b) in alone["runs"].as_array().unwrap().iter().zip(runs) {
        let of = |run: &Value| run["summary"]["estimators"]["attitude"].clone();
        assert_eq!(of(a), of(b));
    }
}

/// Without `--metrics` the ratios to the Cramér-Rao bound stand beside the errors where the sheet bounds anything, and
/// `monorig test --metrics` tells the same numbers over all runs.
#[test]
fn errors_over_their_bound_are_shown_where_there_is_one() {
    let dir = dir();
    let sheet = dir.read("sensors.yaml");
    let task = [
        "compare",
        "quick.yaml",
        "--seeds",
        "1..3",
        "--json",
        "c.json",
    ];
    let (code, out, err) = dir.monorig(&task);
    assert_eq!(code, Some(0), "{out}{err}");
    let bounded = sheet.contains("accelerometer") && sheet.contains("wheel_speed");
    assert!(bounded && dir.read("c.json").contains("slope_rmse_over_bound"));
    let json: Value = serde_json::from_str(&dir.read("c.json")).unwrap();
    let mut ratios: Vec<f64> = json["runs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|run| &run["summary"]["estimators"]["attitude"])
        .map(|of| of["slope_rmse_over_bound"].as_f64().unwrap())
        .collect();
    ratios.sort_by(f64::total_cmp);

    let metrics = ["--metrics", "slope_rmse_over_bound"];
    let (_, out, err) =
        dir.monorig(&[&["test", "quick.yaml", "--seeds", "1..3"][..], &metrics].concat());
    let row = out.lines().find(|l| l.contains("3/3"));
    let row = row.unwrap_or_else(|| panic!("{out}{err}"));
    assert!(
        row.contains("attitude") && row.contains("quick seed"),
        "{row}"
    );
    let told: Vec<f64> = row
        .split_whitespace()
        .filter_map(|w| w.parse().ok())
        .collect();
    for (told, value) in told.iter().zip([ratios[1], ratios[2], ratios[2]]) {
        assert!((told / value - 1.0).abs() < 0.01, "{row} {ratios:?}");
    }

    // a sheet without wheel speeds bounds nothing
    let blind: String = sheet
        .lines()
        .filter(|l| !l.starts_with("wheel_speed"))
        .map(|l| format!("{l}\n"))
        .collect();
    dir.write("blind.yaml", blind.as_bytes());
    let (_, out, err) = dir.monorig(&[&task[..], &["--set", "sensors=blind.yaml"]].concat());
    let json: Value = serde_json::from_str(&dir.read("c.json")).unwrap();
    let compared = json["table"].to_string();
    assert!(!compared.contains("over_bound"), "{out}{err}");
}

#[test]
fn threads_change_nothing() {
    let dir = dir();
    for jobs in ["1", "2"] {
        let file = format!("{jobs}.json");
        let (code, ..) = dir.monorig(&compare(&["--jobs", jobs, "--json", &file]));
        assert_eq!(code, Some(0));
        assert!(dir.read(&file) == dir.read("1.json"));
    }
}

#[test]
fn what_is_not_there_is_named() {
    let dir = dir();
    for (more, says) in [
        (
            ["--estimators", "attitude,railfusion"],
            "did you mean `rail_fusion`",
        ),
        (
            ["--reference", "dffrls_aekf_robust"],
            "--reference with one of: attitude",
        ),
        (
            ["--metrics", "slope_mea_deg"],
            "did you mean `slope_mae_deg`",
        ),
        (["--seeds", "x"], "not a range of seeds"),
    ] {
        let told = dir.refused(&[&["compare", "quick.yaml"][..], &more].concat());
        assert!(told.contains(says), "{told}");
    }
    let bad = QUICK.replace("metric: slope_mae_deg", "metric: slope_mea_deg");
    dir.write("quick.yaml", bad.as_bytes());
    let told = dir.refused(&["compare", "quick.yaml"]);
    assert!(
        told.contains("quick.yaml:13:72") && told.contains("did you mean"),
        "{told}"
    );
}

/// Runs `quick.yaml` with this load from a time on; returns the folder of the run.
fn run_with_load(dir: &TestFolder, at_s: f64, load_kg: u32) -> String {
    let name = format!("{load_kg}_at_{}", (10.0 * at_s) as u32);
    let events = format!("events=[{{at_s: {at_s}, load_mass_kg: {load_kg}}}]");
    let task = [
        "run",
        "quick.yaml",
        "--no-rerun",
        "--name",
        &name,
        "--set",
        &events,
    ];
    let (code, out, err) = dir.monorig(&task);
    assert!(matches!(code, Some(0 | 1)), "{out}{err}");
    format!("runs/quick@{name}/1")
}

/// The verdict on two runs of the same scenario and seed, and of each signal that differs its JSON.
fn differences(dir: &TestFolder, runs: [&str; 2], more: &[&str]) -> (Option<i32>, Vec<Value>) {
    let task = [&["compare", runs[0], runs[1], "--json", "d.json"], more].concat();
    let (code, out, err) = dir.monorig(&task);
    let json: Value = serde_json::from_str(&dir.read("d.json")).unwrap();
    let differ = json["signals"]["differ"].as_array().unwrap().clone();
    assert_eq!(json["held"], code == Some(0), "{out}{err}");
    let verdict = words(json["verdict"].as_str().unwrap());
    assert!(words(&out).ends_with(&verdict), "{out}");
    assert!(out.lines().all(|l| l.chars().count() <= 80), "{out}");
    (code, differ)
}

/// A run differs in nothing from itself and from the same made again; another load from some time on is found at that
/// time with its size, and is none within a tolerance of its size.
#[test]
fn two_runs_differ_where_they_were_made_to() {
    let dir = dir();
    let [light, early] = [500, 1500].map(|load_kg| run_with_load(&dir, 10.0, load_kg));
    let (code, out, err) = dir.monorig(&["run", "quick.yaml", "--no-rerun"]);
    assert!(matches!(code, Some(0 | 1)), "{out}{err}");
    let (code, out, err) = dir.monorig(&["run", "quick.yaml", "--no-rerun", "--out", "again"]);
    assert!(matches!(code, Some(0 | 1)), "{out}{err}");
    let plain = "runs/quick/1";
    for other in [plain, "again/quick/1"] {
        let (code, differ) = differences(&dir, [plain, other], &[]);
        assert_eq!((code, differ.len()), (Some(0), 0));
    }

    let (code, differ) = differences(&dir, [&light, &early], &[]);
    assert_eq!(code, Some(1));
    let mass = differ
        .iter()
        .find(|s| s["name"] == "truth/total_mass")
        .unwrap();
    let first = mass["first_s"].as_f64().unwrap();
    assert!((9.999..10.1).contains(&first), "{mass}");
    assert!(
        differ
            .iter()
            .all(|s| s["first_s"].as_f64().unwrap() >= 9.999)
    );
    let [a, b] = [0, 1].map(|i| mass["first"][i].as_f64().unwrap());
    assert!((b - a - 1000.0).abs() < 1e-6, "{mass}");
    assert!(
        (mass["largest"].as_f64().unwrap() - 1000.0).abs() < 1e-6,
        "{mass}"
    );
    for (atol, expected) in [("999", Some(1)), ("1001", Some(0))] {
        let of_mass = ["--signals", "truth/total_mass", "--atol", atol];
        assert_eq!(differences(&dir, [&light, &early], &of_mass).0, expected);
    }

    // 0.2 s later: within 0.3 s it is the same, and within 0.1 s fewer samples differ than at the same time
    let late = run_with_load(&dir, 10.2, 1500);
    let beyond = |within: &str| {
        let of_mass = ["--signals", "truth/total_mass", "--within-s", within];
        let (code, differ) = differences(&dir, [&early, &late], &of_mass);
        let beyond = differ.first().map_or(0, |s| s["beyond"].as_u64().unwrap());
        assert_eq!(code, Some(i32::from(beyond > 0)));
        beyond
    };
    let [wide, narrow, none] = ["0.3", "0.1", "0"].map(beyond);
    assert!(
        wide == 0 && 0 < narrow && narrow < none,
        "{narrow} of {none}"
    );

    let files = ["--markdown", "d.md", "--html", "d.html"];
    let (code, out, err) = dir.monorig(&[&["compare", &light, &early][..], &files].concat());
    assert_eq!(code, Some(1), "{out}{err}");
    let (told, page) = (dir.read("d.md"), dir.read("d.html"));
    assert!(
        told.starts_with("**FAILED: ") && told.contains("<details>"),
        "{told}"
    );
    assert!(told.contains("| truth/total_mass"), "{told}");
    assert!(page.contains("Signals") && page.contains("<svg"));
}

#[test]
fn what_is_for_runs_or_for_scenarios_is_said() {
    let dir = dir();
    for (task, says) in [
        (
            &["compare", "quick.yaml", "--atol", "1"][..],
            "need two runs",
        ),
        (&["compare", "units"], "need two runs"),
        (
            &["compare", "units", "units", "--csv", "x.csv"],
            "need a scenario",
        ),
        (&["compare", "units", "units"], "not the folder of a run"),
        (&["compare", "units", "units", "--rtol=-1"], "zero or above"),
    ] {
        let told = words(&dir.refused(task));
        assert!(told.contains(says), "{told}");
    }
}
