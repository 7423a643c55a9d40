//! Every command that judges ends with its result, and exit code 1 never comes without a reason.

use crate::common;
use crate::common::TestFolder;
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
estimators: {{dffrls_aekf_robust: {{}}}}
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
        ("late", "did not finish"),
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

/// Replays, judged estimates, merged shards and searches end with their result, too: the last line without an indent.
#[test]
fn other_commands_end_with_their_result() {
    let dir = dir();
    let check = |task: &[&str], held: &str, failed: &str| {
        let (code, out, err) = dir.monorig(task);
        let told = format!("{task:?}\n{out}{err}");
        let mut lines = out.lines().rev();
        let last = lines.find(|l| !l.starts_with(' ')).unwrap_or_default();
        let begins = match code {
            Some(0) => held,
            Some(1) => failed,
            _ => panic!("{told}"),
        };
        assert!(!begins.is_empty() && last.starts_with(begins), "{told}");
        assert!(out.lines().all(|l| l.chars().count() <= 80), "{told}");
    };

    let map = common::project().join("tests/data/real/husky/husky.map.yaml");
    let replay = ["replay", "--map", map.to_str().unwrap(), "--no-rerun"];
    let replay = [&replay[..], &["--estimators", "attitude", "--set"]].concat();
    check(
        &[&replay[..], &["expect=[]"]].concat(),
        // its reference is too coarse for the alert limit
        "held but for 2 not judged",
        "",
    );
    let bound = "expect=[{estimator: attitude, metric: slope_rmse_deg, at_most: 1.0e-3, availability: 0.01}]";
    check(&[&replay[..], &[bound]].concat(), "", "FAILED: ");

    let run = ["run", "good.yaml", "--no-rerun", "--keep-samples"];
    let (code, out, err) = dir.monorig(&[&run[..], &["--seed", "1"]].concat());
    assert_eq!(code, Some(0), "{out}{err}");
    let rows = (5..20).map(|t| format!("{t},0.3,0.001,1\n"));
    let estimates =
        "time,slope_rad,slope_sd_rad,slope_valid\n".to_owned() + &rows.collect::<String>();
    dir.write("mine.csv", estimates.as_bytes());
    let judge = [
        "judge",
        "runs/good/1",
        "--estimates",
        "mine.csv",
        "--no-rerun",
    ];
    check(&judge, "held", "");
    let bound =
        "expect=[{estimator: judged, metric: slope_rmse_deg, at_most: 1, availability: 0.01}]";
    check(&[&judge[..], &["--set", bound]].concat(), "", "FAILED: ");

    for (scenario, held, failed) in [("good", "held", ""), ("bad", "", "FAILED: ")] {
        for shard in ["1/2", "2/2"] {
            let (file, json) = (format!("{scenario}.yaml"), format!("{}.json", &shard[..1]));
            let test = ["test", &file, "--shard", shard, "--json", &json];
            dir.monorig(&[&test[..], &["--expect", "merge"]].concat());
        }
        let merge = ["merge", "1.json", "2.json", "--into", "all.json"];
        check(&merge, held, failed);
    }

    for (least, held, failed) in [(0, "not shown with 2 runs", ""), (2, "", "FAILED: ")] {
        let search = format!(
            "version: 1\nwhy: A quick search.\nestimator: dffrls_aekf_robust\n\
             parameters: {{delta: {{choices: [0.9, 0.99]}}}}\n\
             tuning: [{{scenario: good.yaml, set: {{expect: []}}, seeds: 1..2}}]\n\
             validation: [{{scenario: good.yaml, set: {{expect: []}}, seeds: 7..8}}]\n\
             objective: {{metrics: [{{metric: slope_rmse_deg, after_s: 5}}]}}\n\
             constraints: [{{metric: slope_availability, at_least: {least}}}]\n\
             optimiser: grid\nbudget: 4\nsensitivity: {{curve: 0}}\n"
        );
        dir.write("search.yaml", search.as_bytes());
        check(&["tune", "search.yaml", "--restart"], held, failed);
    }
}
