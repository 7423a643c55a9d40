//! `monorig compare`: the same runs for all, differences run by run, published figures beside ours.

use crate::common::TestFolder;
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
        "-v",
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
    assert!(
        out.contains("12.4") && out.contains("published: Somebody 2024, table 9"),
        "{out}"
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
    for (samples, share) in [("valid", "of all"), ("common", "common valid")] {
        assert!(
            row[samples]["share"]
                .as_f64()
                .is_some_and(|s| s > 0.0 && s <= 1.0),
            "{row}"
        );
        assert!(out.contains(share), "{out}");
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
        "-v",
        "quick.yaml",
        "--seeds",
        "1..3",
        "--json",
        "c.json",
    ];
    let (code, out, err) = dir.monorig(&task);
    assert_eq!(code, Some(0), "{out}{err}");
    let bounded = sheet.contains("accelerometer") && sheet.contains("wheel_speed");
    assert!(bounded && out.contains("slope_rmse_over_bound"), "{out}");
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
    assert!(!out.contains("over_bound"), "{out}{err}");
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
        (["--seeds", "x"], "no range of seeds"),
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
