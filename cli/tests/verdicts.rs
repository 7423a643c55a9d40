//! `monorig test`: green, red, and what cannot be run.

#![allow(clippy::unwrap_used)]

mod common;

use common::Simulation;

/// A quick scenario with these expectations (lines of YAML).
fn quick(expect: &str) -> String {
    format!(
        "\
version: 1
why: A quick one.
track: track.yaml
train: train.yaml
start: {{chainage_m: 2}}
stop: {{after_s: 60}}
physics: {{plant: point-mass}}
drive: {{speed: [{{at_s: 0, mps: 0}}, {{at_s: 3, mps: 1.5}}]}}
sensors: sensors.yaml
estimators: {{dffrls_aukf_robust: {{}}}}
seeds: 1..4
{expect}"
    )
}

const HOLDS: &str = "expect: [{metric: speed_rmse_mps, at_most: 1}]\n";

fn with(scenarios: &[(&str, String)]) -> Simulation {
    let rig = Simulation::new();
    std::fs::create_dir_all(rig.path("all")).unwrap();
    for (name, text) in scenarios {
        let text = text
            .replace("track.yaml", "../track.yaml")
            .replace("train.yaml", "../train.yaml")
            .replace("sensors.yaml", "../sensors.yaml");
        rig.write(&format!("all/{name}.yaml"), text.as_bytes());
    }
    rig
}

#[test]
fn a_folder_of_scenarios_that_hold() {
    let rig = with(&[("one", quick(HOLDS)), ("two", quick(""))]);
    let files = ["--junit", "out/verdicts.xml", "--json", "out/verdicts.json"];
    let (code, out, err) = rig.monorig(&[&["test", "all"][..], &files].concat());
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(out.contains("held    one") && out.contains("held    two"));
    assert!(out.ends_with("2 scenarios, 8 runs: 2 held, 0 failed\n"));
    let xml = rig.read("out/verdicts.xml");
    assert_eq!(xml.matches("<testsuite ").count(), 2, "{xml}");
    assert_eq!(xml.matches("<testcase ").count(), 3 + 2, "{xml}");
    assert!(!xml.contains("<failure"), "{xml}");
    let json: serde_json::Value = serde_json::from_str(&rig.read("out/verdicts.json")).unwrap();
    assert_eq!(json["scenarios"][0]["runs"][3]["seed"], 4);
}

/// Red names what failed: scenario, estimator, metric, bound, value, seed; in the text and in the XML.
#[test]
fn a_bound_that_does_not_hold_is_named() {
    let expect = "\
expect:
  - {metric: speed_rmse_mps, at_most: 1}
  - {estimator: dffrls_aukf_robust, metric: slope_mae_deg, after_s: 6, at_most: 1.0e-6}
";
    let rig = with(&[("one", quick(expect)), ("two", quick(HOLDS))]);
    let (code, out, err) = rig.monorig(&["test", "all", "--junit", "v.xml"]);
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(out.contains("FAILED  one") && out.contains("held    two"));
    let told = "dffrls_aukf_robust slope_mae_deg from 6 s: ";
    let line = out.lines().find(|l| l.contains(told)).unwrap();
    for part in ["is not ≤ 0.000001 (seed ", "; 0 of 4 seeds hold"] {
        assert!(line.contains(part), "{line}");
    }
    let xml = rig.read("v.xml");
    assert_eq!(xml.matches("<failure").count(), 1, "{xml}");
    assert!(xml.contains(told) && xml.contains("seeds that fail: 1, 2, 3, 4"));
}

#[test]
fn a_train_that_does_not_arrive_has_not_finished() {
    let late = quick("").replace("stop: {after_s: 60}", "stop: {after_s: 12, at_m: 100}");
    let rig = with(&[("late", late)]);
    let (code, out, _) = rig.monorig(&["test", "all", "--seeds", "3,9"]);
    assert_eq!(code, Some(1), "{out}");
    assert!(
        out.contains("the run: did not come to its end in 12.0 s (seed 3); 0 of 2 seeds hold"),
        "{out}"
    );
}

/// A track that ends too early breaks the run down; that is this scenario's failure and no one else's.
#[test]
fn a_run_that_breaks_down_is_a_failure() {
    let far = quick("").replace("stop: {after_s: 60}", "stop: {after_s: 200}");
    let rig = with(&[("far", far), ("near", quick(HOLDS))]);
    let (code, out, _) = rig.monorig(&["test", "all", "--seeds", "1"]);
    assert_eq!(code, Some(1), "{out}");
    assert!(out.contains("ran off the end of the track"), "{out}");
    assert!(out.contains("held    near"), "{out}");
}

#[test]
fn a_bad_file_is_shown_and_the_others_run() {
    let bad = quick(HOLDS).replace("dffrls_aukf_robust", "dffrls_aukv_robust");
    let rig = with(&[("bad", bad), ("good", quick(HOLDS))]);
    let (code, out, err) = rig.monorig(&["test", "all"]);
    assert_eq!(code, Some(2), "{out}{err}");
    assert!(out.contains("held    good"), "{out}");
    assert!(
        err.contains("all/bad.yaml:10:34") && err.contains("did you mean `dffrls_aukf_robust`"),
        "{err}"
    );
}

#[test]
fn nothing_to_test_is_an_error() {
    let rig = with(&[("one", quick(HOLDS))]);
    std::fs::create_dir(rig.path("empty")).unwrap();
    for (arguments, says) in [
        (
            &["test", "empty"][..],
            "there is no scenario in this folder",
        ),
        (
            &["test", "all", "--filter", "xyz"],
            "none of 1 scenarios has `xyz`",
        ),
        (&["test", "nowhere"], "there is no such file"),
        (
            &["test", "all", "--seeds", "4..1"],
            "write the smaller end first",
        ),
        (&["test"], "there is no such file"),
    ] {
        let told = rig.refused(arguments);
        assert!(told.contains(says), "{told}");
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let rig = with(&[("one", quick(HOLDS)), ("two", quick(""))]);
    for jobs in ["1", "2", "5"] {
        let file = format!("{jobs}.json");
        let (code, ..) = rig.monorig(&["test", "all", "--jobs", jobs, "--json", &file]);
        assert_eq!(code, Some(0));
        assert!(rig.read(&file) == rig.read("1.json"), "{jobs} threads");
    }
}
