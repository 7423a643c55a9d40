//! One estimator several times in a run, under other names: every command, every file it leaves.

use crate::common::{TestFolder, columns};
use serde_json::Value;

const TYPE: &str = "dffrls_aekf_robust";

/// `plain` has no parameters: it is the type under another name. `tuned` has one and drives the train.
const SCENARIO: &str = "\
version: 1
why: One type, three instances.
track: track.yaml
train: train.yaml
start: {chainage_m: 58}
stop: {after_s: 30}
physics: {plant: point-mass}
drive:
  speed: [{at_s: 0, mps: 0}, {at_s: 3, mps: 1.5}]
  controller: {feedforward: estimate}
sensors: sensors.yaml
vehicle: {exact: {all: a test}}
estimators:
  dffrls_aekf_robust: {}
  plain: {is: dffrls_aekf_robust}
  tuned: {is: dffrls_aekf_robust, delta: 0.9}
in_loop: tuned
expect:
  - {estimator: tuned, metric: slope_availability, at_least: 0}
integrity: {max_misleading_share: 1}
";

const STUDY: &str = "\
version: 1
why: A spread.
scenario: quick.yaml
runs: 3
vary:
  - {path: estimators.tuned.delta, uniform: [0.9, 0.99]}
";

const TUNING: &str = "\
version: 1
why: A sample.
estimator: tuned
is: dffrls_aekf_robust
evaluation: closed_loop
parameters:
  delta: {from: 0.9, to: 0.9999, scale: memory}
tuning:
  - {scenario: quick.yaml, seeds: [1]}
validation:
  - {scenario: quick.yaml, seeds: [7]}
objective: {metrics: [{metric: slope_rmse_deg, after_s: 20}]}
optimiser: random
budget: 4
sensitivity: {curve: 0}
";

fn dir() -> TestFolder {
    let dir = TestFolder::new();
    for (name, text) in [
        ("quick.yaml", SCENARIO),
        ("spread.yaml", STUDY),
        ("tuning.yaml", TUNING),
    ] {
        dir.write(name, text.as_bytes());
    }
    dir
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

fn names(estimators: &Value) -> Vec<String> {
    estimators.as_object().unwrap().keys().cloned().collect()
}

fn held(dir: &TestFolder, arguments: &[&str]) -> String {
    let (code, out, err) = dir.monorig(arguments);
    assert_eq!(code, Some(0), "{arguments:?}\n{out}{err}");
    out
}

const INSTANCES: [&str; 3] = [TYPE, "plain", "tuned"];

#[test]
fn an_instance_has_its_name_everywhere_in_a_run_and_its_report() {
    let dir = dir();
    let told = held(&dir, &["run", "quick.yaml", "--no-rerun"]);
    assert!(INSTANCES.iter().all(|name| told.contains(name)), "{told}");
    let metrics = json(&dir.read("runs/quick/1/metrics.json"));
    assert_eq!(names(&metrics["estimators"]), INSTANCES);
    assert_eq!(metrics["expectations"][0]["estimator"], "tuned");
    let manifest = json(&dir.read("runs/quick/1/manifest.json"));
    assert_eq!(manifest["resolved"]["estimators"]["tuned"]["is"], TYPE);

    let columns = columns(&dir.path("runs/quick/1"));
    let estimates: Vec<&String> = columns
        .keys()
        .filter(|c| c.starts_with("estimates/plain/"))
        .collect();
    assert!(estimates.len() >= 10, "{estimates:?}");
    let bits = |name: &str| -> Vec<u64> { columns[name].iter().map(|x| x.to_bits()).collect() };
    for name in estimates {
        let of = |instance: &str| bits(&name.replace("/plain/", &format!("/{instance}/")));
        assert_eq!(of("plain"), of(TYPE), "{name}");
    }
    let mass = "estimates/tuned/total_mass";
    assert_ne!(bits(mass), bits("estimates/plain/total_mass"));
    assert!(columns.keys().any(|c| c.starts_with("internals/tuned/")));

    held(&dir, &["report", "runs/quick/1"]);
    let report = dir.read("runs/quick/1/report.html");
    for part in ["Total mass: tuned", "Slope: plain", "delta = 0.9", TYPE] {
        assert!(report.contains(part), "no {part}");
    }
}

#[test]
fn an_instance_has_its_name_in_tests_comparisons_and_studies() {
    let dir = dir();
    held(&dir, &["test", "quick.yaml", "--json", "tested.json"]);
    let tested = json(&dir.read("tested.json"));
    let summary = &tested["scenarios"][0]["runs"][0]["summary"];
    assert_eq!(names(&summary["estimators"]), INSTANCES);

    // named in the scenario, and added on the command line
    let told = held(
        &dir,
        &[
            "compare",
            "quick.yaml",
            "--estimators",
            "tuned,other=dffrls_aekf_robust,dffrls_aekf_robust",
            "--set",
            "estimators.other.delta=0.9",
            "--metrics",
            "slope_mae_deg",
            "--seeds",
            "1..2",
            "--json",
            "compared.json",
        ],
    );
    assert!(told.contains("tuned ¹"), "{told}");
    let compared = json(&dir.read("compared.json"));
    assert_eq!(compared["estimators"]["other"]["is"], TYPE);
    let mean = |i: usize| compared["table"][i]["mean"]["mean"].as_f64().unwrap();
    assert_eq!(mean(0), mean(1), "the same type and parameters");
    assert_ne!(mean(0), mean(2));
    held(&dir, &["report", "compared.json"]);
    let report = dir.read("compared.html");
    assert!(report.contains("other") && report.contains("delta = 0.9"));

    held(&dir, &["study", "spread.yaml"]);
    let results = dir.read("runs/spread/results.jsonl");
    for run in results.lines().skip(1) {
        let run = json(run);
        assert_eq!(names(&run["summary"]["estimators"]), INSTANCES);
    }
}

/// The winner's file is of the type, so that any instance can include it.
#[test]
fn an_instance_is_tuned_in_the_loop_and_its_winner_included() {
    let dir = dir();
    held(&dir, &["tune", "tuning.yaml"]);
    let winner = dir.read("runs/tune/tuning/winner.yaml");
    assert!(winner.contains(&format!("estimator: {TYPE}")), "{winner}");
    let from = "estimators={tuned: {is: dffrls_aekf_robust, from: runs/tune/tuning/winner.yaml}}";
    held(&dir, &["run", "quick.yaml", "--no-rerun", "--set", from]);
}

#[test]
fn what_cannot_be_an_instance_is_refused() {
    let dir = dir();
    for (arguments, part) in [
        (
            &[
                "run",
                "quick.yaml",
                "--set",
                "estimators.tuned.is=dffrls_aekf_robst",
            ][..],
            "did you mean `dffrls_aekf_robust`?",
        ),
        (
            &["run", "quick.yaml", "--set", "estimators.tuned.delat=0.9"],
            "did you mean `delta`?",
        ),
        (&["run", "quick.yaml", "--set", "in_loop=tund"], "tuned"),
        (
            &["compare", "quick.yaml", "--estimators", "tuned=rail_fusion"],
            "`tuned` is dffrls_aekf_robust in this scenario",
        ),
        (
            &["compare", "quick.yaml", "--estimators", "a=nothing_like_it"],
            "there is no estimator `nothing_like_it`",
        ),
        (
            &["compare", "quick.yaml", "--estimators", "a="],
            "write NAME or NAME=TYPE",
        ),
    ] {
        let told = dir.refused(arguments);
        assert!(told.contains(part), "{arguments:?}: {told}");
    }
}
