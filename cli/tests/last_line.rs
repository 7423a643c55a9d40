//! Every command that judges ends with its result, and exit code 1 never comes without a reason.

#![allow(clippy::unwrap_used)]

mod common;

use common::TestFolder;
use serde_json::Value;

/// A quick scenario with this bound on its speed; limits of integrity that nothing exceeds unless `limits` says so.
fn quick(bound: &str, limits: &str) -> String {
    format!(
        "\
version: 1
why: A quick one.
track: track.yaml
train: train.yaml
start: {{chainage_m: 2}}
stop: {{after_s: 20}}
physics: {{plant: point-mass}}
drive: {{speed: [{{at_s: 0, mps: 0}}, {{at_s: 3, mps: 1.5}}]}}
sensors: sensors.yaml
estimators: {{dffrls_aukf_robust: {{}}}}
seeds: 1..2
expect: [{{metric: speed_rmse_mps, at_most: {bound}}}]
integrity: {{{limits}}}
"
    )
}

const STUDY: &str = "\
version: 1
why: A spread.
scenario: SCENARIO.yaml
runs: 2
vary: [{path: load.mass_kg, uniform: [0, 2500]}]
";

/// Limits of integrity that any error exceeds: an implied bound fails, and no stated one.
const ANY_MISLEADS: &str = "k: 1.0e-6, slope_alert_deg: 1.0e-6, effective_slope_alert_deg: 90";

fn dir() -> TestFolder {
    let dir = TestFolder::new();
    for (name, bound, limits) in [
        ("good", "1", "max_misleading_share: 1"),
        ("bad", "1.0e-9", "max_misleading_share: 1"),
        ("misleading", "1", ANY_MISLEADS),
    ] {
        dir.write(&format!("{name}.yaml"), quick(bound, limits).as_bytes());
        let study = STUDY.replace("SCENARIO", name);
        dir.write(&format!("{name}_study.yaml"), study.as_bytes());
    }
    let late = quick("1", "max_misleading_share: 1");
    let late = late.replace("stop: {after_s: 20}", "stop: {after_s: 12, at_m: 100}");
    dir.write("late.yaml", late.as_bytes());
    dir
}

/// The commands over a good scenario end with `held`, over one that fails with `FAILED` and a reason above it.
#[test]
fn the_last_line_is_the_result() {
    let dir = dir();
    let (code, out, err) = dir.monorig(&["run", "good.yaml", "--no-rerun", "--keep-samples"]);
    assert_eq!(code, Some(0), "{out}{err}");
    for (scenario, reason) in [
        ("good", ""),
        ("bad", "speed_rmse_mps"),
        ("misleading", "valid that is"),
        ("late", "did not come to its end"),
    ] {
        let file = format!("{scenario}.yaml");
        let mut tasks = vec![
            vec!["run", &file, "--no-rerun"],
            vec!["run", &file, "--no-rerun", "--seed", "1..2"],
            vec!["test", &file],
        ];
        let study = format!("{scenario}_study.yaml");
        if scenario != "late" {
            tasks.push(vec!["study", &study]);
        } else {
            tasks.push(vec!["compare", &file]);
        }
        for task in tasks {
            let (code, out, err) = dir.monorig(&task);
            let told = format!("{task:?}\n{out}{err}");
            let last = out.lines().last().unwrap_or_default();
            match code {
                Some(0) => assert!(reason.is_empty() && last.starts_with("held"), "{told}"),
                Some(1) => {
                    assert!(!reason.is_empty() && last.starts_with("FAILED"), "{told}");
                    let words = common::words(&out);
                    let why = match task.first() {
                        Some(&"compare") => "is left out",
                        _ => reason,
                    };
                    assert!(words.contains(why), "{told}");
                }
                _ => panic!("{told}"),
            }
            assert!(out.lines().all(|l| l.chars().count() <= 80), "{told}");
        }
    }
    // a screen: the usual run and test
    for task in [
        &["run", "good.yaml", "--no-rerun"][..],
        &["test", "good.yaml"],
    ] {
        let (_, out, _) = dir.monorig(task);
        assert!(out.lines().count() <= 24, "{out}");
    }
}

/// With `--json -` standard output is JSON and nothing else, and says what the exit code says.
#[test]
fn json_goes_to_standard_output() {
    let dir = dir();
    for (task, code, verdict) in [
        (
            &["run", "good.yaml", "--no-rerun"][..],
            0,
            "/runs/0/verdict",
        ),
        (&["run", "bad.yaml", "--no-rerun"], 1, "/runs/0/verdict"),
        (&["test", "bad.yaml"], 1, "/verdict"),
        (&["study", "good_study.yaml"], 0, "/verdict"),
        (&["compare", "good.yaml"], 0, ""),
    ] {
        let (found, out, err) = dir.monorig(&[task, &["--json", "-"]].concat());
        assert_eq!(found, Some(code), "{task:?}{out}{err}");
        let json: Value =
            serde_json::from_str(&out).unwrap_or_else(|e| panic!("{task:?} {e}{out}"));
        let told = json.pointer(verdict).and_then(Value::as_str);
        if let Some(told) = told {
            assert_eq!(told.starts_with("FAILED"), code == 1, "{told}");
        }
        assert_eq!(told.is_some(), !verdict.is_empty(), "{out}");
        assert!(!err.trim().is_empty(), "people read standard error");
        assert!(!dir.path("-").exists());
    }
}
