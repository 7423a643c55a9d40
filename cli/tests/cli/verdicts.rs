//! `monorig test`: green, red, and what cannot be run.

use crate::common::{TestFolder, project, words};

/// A quick scenario with these expectations (lines of YAML). Its track is short and crooked, and no estimator is judged
/// by its integrity there unless the lines say so.
fn quick(expect: &str) -> String {
    let integrity = match expect.contains("integrity:") {
        true => "",
        false => "integrity: {max_misleading_share: 1}\n",
    };
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
estimators: {{attitude: {{}}}}
seeds: 1..4
{expect}{integrity}"
    )
}

const HOLDS: &str = "expect: [{metric: speed_rmse_mps, at_most: 1}]\n";

/// The last line.
fn last(out: &str) -> &str {
    out.lines().last().unwrap_or_default()
}

fn with(scenarios: &[(&str, String)]) -> TestFolder {
    let dir = TestFolder::new();
    std::fs::create_dir_all(dir.path("all")).unwrap();
    for (name, text) in scenarios {
        let text = text
            .replace("track.yaml", "../track.yaml")
            .replace("train.yaml", "../train.yaml")
            .replace("sensors.yaml", "../sensors.yaml");
        dir.write(&format!("all/{name}.yaml"), text.as_bytes());
    }
    dir
}

#[test]
fn a_folder_of_scenarios_that_hold() {
    let dir = with(&[("one", quick(HOLDS)), ("two", quick(""))]);
    std::fs::create_dir_all(dir.path("out")).unwrap();
    let files = ["--junit", "out/verdicts.xml", "--json", "out/verdicts.json"];
    let (code, out, err) = dir.monorig(&[&["test", "all"][..], &files].concat());
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(out.contains("held    one") && out.contains("held    two"));
    let last = "held: 2 scenarios, 8 runs; 2 with weakened limits\n";
    assert!(out.ends_with(last), "{out}");
    let xml = dir.read("out/verdicts.xml");
    assert_eq!(xml.matches("<testsuite ").count(), 2, "{xml}");
    assert_eq!(xml.matches("<testcase ").count(), 5 + 4 + 2, "{xml}"); // integrity of both slopes, and the weakened limit, too
    assert!(!xml.contains("<failure"), "{xml}");
    let json: serde_json::Value = serde_json::from_str(&dir.read("out/verdicts.json")).unwrap();
    assert_eq!(json["scenarios"][0]["runs"][3]["seed"], 4);
}

/// Red names what failed: scenario, estimator, metric, bound, value, seed; in the text and in the XML.
#[test]
fn a_bound_that_does_not_hold_is_named() {
    let expect = "\
expect:
  - {metric: speed_rmse_mps, at_most: 1}
  - {estimator: attitude, metric: slope_mae_deg, after_s: 6, at_most: 1.0e-6, availability: 0.5}
";
    let dir = with(&[("one", quick(expect)), ("two", quick(HOLDS))]);
    let (code, out, err) = dir.monorig(&["test", "all", "--junit", "v.xml"]);
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(out.contains("FAILED  one") && out.contains("held    two"));
    let told = "attitude slope_mae_deg from 6 s: ";
    let said = words(&out);
    for part in [told, "is not ≤ 0.000001 (seed ", "; 0 of 4 seeds hold"] {
        assert!(said.contains(part), "{out}");
    }
    let xml = dir.read("v.xml");
    assert_eq!(xml.matches("<failure").count(), 1, "{xml}");
    assert!(xml.contains(told) && xml.contains("seeds that fail: 1, 2, 3, 4"));
}

#[test]
fn a_train_that_does_not_arrive_has_not_finished() {
    let late = quick("").replace("stop: {after_s: 60}", "stop: {after_s: 12, at_m: 100}");
    let dir = with(&[("late", late)]);
    let (code, out, _) = dir.monorig(&["test", "all", "--seeds", "3,9"]);
    assert_eq!(code, Some(1), "{out}");
    assert!(
        words(&out).contains("the run: did not finish in 12.0 s (seed 3); 0 of 2 seeds hold"),
        "{out}"
    );
}

/// A track that ends too early breaks the run down; that is this scenario's failure and no one else's.
#[test]
fn a_run_that_breaks_down_is_a_failure() {
    let far = quick("").replace("stop: {after_s: 60}", "stop: {after_s: 200}");
    let dir = with(&[("far", far), ("near", quick(HOLDS))]);
    let (code, out, _) = dir.monorig(&["test", "all", "--seeds", "1"]);
    assert_eq!(code, Some(1), "{out}");
    assert!(
        words(&out).contains("ran off the end of the track"),
        "{out}"
    );
    assert!(out.contains("held    near"), "{out}");
}

#[test]
fn a_bad_file_is_shown_and_the_others_run() {
    let bad = quick(HOLDS).replace("attitude", "attitute");
    let dir = with(&[("bad", bad), ("good", quick(HOLDS))]);
    let (code, out, err) = dir.monorig(&["test", "all"]);
    assert_eq!(code, Some(2), "{out}{err}");
    assert!(out.contains("held    good"), "{out}");
    assert!(
        err.contains("all/bad.yaml:10:24") && err.contains("did you mean `attitude`"),
        "{err}"
    );
}

#[test]
fn nothing_to_test_is_an_error() {
    let dir = with(&[("one", quick(HOLDS))]);
    std::fs::create_dir(dir.path("empty")).unwrap();
    for (arguments, says) in [
        (&["test", "empty"][..], "this folder has no scenario"),
        (
            &["test", "all", "--filter", "xyz"],
            "`xyz` fits no name of the 1 scenarios",
        ),
        (&["test", "nowhere"], "this file does not exist"),
        (
            &["test", "all", "--seeds", "4..1"],
            "write the smaller end first",
        ),
        (&["test"], "this file does not exist"),
    ] {
        let told = dir.refused(arguments);
        assert!(told.contains(says), "{told}");
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let dir = with(&[("one", quick(HOLDS)), ("two", quick(""))]);
    for jobs in ["1", "2", "5"] {
        let file = format!("{jobs}.json");
        let (code, ..) = dir.monorig(&["test", "all", "--jobs", jobs, "--json", &file]);
        assert_eq!(code, Some(0));
        assert!(dir.read(&file) == dir.read("1.json"), "{jobs} threads");
    }
}

/// A bound on an error without one on the availability is refused, and the message says what to add; each of the three
/// ways will do.
#[test]
fn an_error_is_not_bounded_without_its_availability() {
    let bound = "expect:\n  - {estimator: attitude, metric: METRIC, after_s: 6, at_most: 5}\n";
    for metric in ["slope_rmse_deg", "slope_rmse_deg_valid"] {
        let bare = bound.replace("METRIC", metric);
        let dir = with(&[("one", quick(&bare))]);
        let (code, _, err) = dir.monorig(&["test", "all"]);
        assert_eq!(code, Some(2), "{err}");
        for part in [
            "no availability says how much of the time its slope must be valid",
            "`availability: 0.9` in this expectation",
            "metric: slope_availability, at_least: 0.9",
            "`availability: {slope: 0.9}`",
        ] {
            assert!(err.contains(part), "{err}");
        }
        // one over another time is none beside it
        let elsewhere = format!(
            "{bare}  - {{estimator: attitude, metric: slope_availability, at_least: 0.5}}\n"
        );
        let dir = with(&[("one", quick(&elsewhere))]);
        assert_eq!(dir.monorig(&["test", "all"]).0, Some(2));
        for good in [
            bare.replace("at_most: 5", "at_most: 5, availability: 0.5"),
            format!("{bare}availability: {{slope: 0.5}}\n"),
            format!(
                "{bare}  - {{estimator: attitude, metric: slope_availability, after_s: 6, at_least: 0.5}}\n"
            ),
        ] {
            let dir = with(&[("one", quick(&good))]);
            let (code, out, err) = dir.monorig(&["test", "all", "--seeds", "1"]);
            assert_eq!(code, Some(0), "{good}{out}{err}");
        }
    }
}

/// An expectation of the availability is checked over the time of the error.
#[test]
fn the_availability_beside_an_error_is_a_bound() {
    let expect = "expect:\n  - {estimator: attitude, metric: mass_rmse_kg, after_s: 6, at_most: 9.0e+5, availability: 0.5}\n";
    let dir = with(&[("one", quick(expect))]);
    let (code, out, _) = dir.monorig(&["test", "all", "--seeds", "1"]);
    assert_eq!(code, Some(1), "{out}"); // it does not estimate the mass
    assert!(
        words(&out).contains("attitude mass_availability from 6 s: 0.0000 is not ≥ 0.5"),
        "{out}"
    );
}

const MISLEADING: &str =
    "integrity: {k: 1.0e-6, slope_alert_deg: 1.0e-6, effective_slope_alert_deg: 90}\n";

/// Limits that any error exceeds: the scenario is red although all that it expects holds, and the finding stands above
/// all else.
#[test]
fn what_misleads_is_red_and_named_first() {
    let dir = with(&[("one", quick(&format!("{HOLDS}{MISLEADING}")))]);
    let (code, out, _) = dir.monorig(&["test", "all", "--junit", "v.xml"]);
    assert_eq!(code, Some(1), "{out}");
    let first = "\n\none:\n  finding: attitude marks a slope valid that is";
    assert!(out.contains(first), "{out}");
    let xml = dir.read("v.xml");
    assert!(
        xml.contains("<failure") && xml.contains("attitude slope_misleading_share"),
        "{xml}"
    );
    let (code, out, err) = dir.monorig(&["run", "all/one.yaml", "--no-rerun"]);
    assert_eq!(code, Some(1), "{out}{err}");
    let told = "FAILED: attitude slope_misleading_share: ";
    assert!(
        out.contains(told) && last(&out).starts_with("FAILED: 1 of "),
        "{out}"
    );
    for tolerated in [
        "integrity: {k: 1.0e-6, slope_alert_deg: 1.0e-6, effective_slope_alert_deg: 90, reference_only: [attitude]}\n",
        "integrity: {k: 1.0e-6, slope_alert_deg: 1.0e-6, effective_slope_alert_deg: 90, max_misleading_share: 1}\n",
    ] {
        let dir = with(&[("one", quick(&format!("{HOLDS}{tolerated}")))]);
        let (code, out, _) = dir.monorig(&["test", "all", "--seeds", "1", "-v"]);
        assert_eq!(code, Some(0), "{out}");
        assert!(out.contains("finding: "), "{out}");
    }
}

#[test]
fn a_known_failure_is_shown_and_not_red_until_it_is_worse_or_holds() {
    let expect = |bound: &str| {
        format!(
            "expect:\n  - {{estimator: attitude, metric: slope_mae_deg, after_s: 6, at_most: {bound}, availability: 0.5}}\n\
             known_failures:\n  - {{estimator: attitude, metric: slope_mae_deg, no_worse_than: FLOOR, why: a bias of the accelerometer}}\n"
        )
        .replace("FLOOR", "30")
    };
    let deep = quick(&expect("1.0e-6"));
    let dir = with(&[("one", deep.clone())]);
    let (code, out, _) = dir.monorig(&["test", "all", "--junit", "v.xml", "--json", "v.json"]);
    assert_eq!(code, Some(0), "{out}");
    // a floor of many times what is measured could hide anything
    assert!(words(&out).contains("; 1 with weakened limits"), "{out}");
    let json: serde_json::Value = serde_json::from_str(&dir.read("v.json")).unwrap();
    let runs = json["scenarios"][0]["runs"].as_array().unwrap();
    let value = |run: &serde_json::Value| run["summary"]["expectations"][0]["value"].as_f64();
    let worst = runs.iter().filter_map(value).fold(0.0, f64::max);
    for (times, weakened) in [(1.1, false), (1.9, false), (2.1, true), (20.0, true)] {
        let floor = format!("no_worse_than: {:e}", times * worst);
        let dir = with(&[("one", deep.replace("no_worse_than: 30", &floor))]);
        let (code, out, _) = dir.monorig(&["test", "all", "-v"]);
        assert_eq!(code, Some(0), "{out}");
        let told = words(&out).contains("with a floor of");
        assert_eq!(told, weakened, "{times}: {out}");
    }
    for floor in ["90", "180", "1.0e+9"] {
        let bottomless = deep.replace("no_worse_than: 30", &format!("no_worse_than: {floor}"));
        let dir = with(&[("one", bottomless)]);
        let (code, out, err) = dir.monorig(&["test", "all"]);
        assert!(
            code == Some(2) && words(&err).contains("has no floor"),
            "{out}{err}"
        );
    }
    let known = "known failures (reasons: -v)\n  attitude    1 in 1 scenario: slope_mae_deg\n";
    assert!(out.contains(known), "{out}");
    assert!(
        last(&out).starts_with("held but for 1 known failure: 1 scenario, 4 runs"),
        "{out}"
    );
    let (_, all, _) = dir.monorig(&["test", "all", "-v"]);
    let why = "known failure: a bias of the accelerometer\n    attitude slope_mae_deg from 6 s: ";
    assert!(all.contains(why), "{all}");
    assert!(out.lines().all(|l| l.chars().count() <= 80), "{out}");
    let xml = dir.read("v.xml");
    assert!(
        xml.contains("<skipped") && xml.contains("a bias of the accelerometer"),
        "{xml}"
    );
    assert!(
        dir.read("v.json")
            .contains("\"known_failure\": \"a bias of the accelerometer\"")
    );

    let worse = quick(&expect("1.0e-6").replace("no_worse_than: 30", "no_worse_than: 2.0e-6"));
    let dir = with(&[("one", worse)]);
    let (code, out, _) = dir.monorig(&["test", "all"]);
    assert_eq!(code, Some(1), "{out}");
    assert!(
        words(&out).contains("this is not the known failure"),
        "{out}"
    );

    let dir = with(&[("one", quick(&expect("45")))]);
    let (code, out, _) = dir.monorig(&["test", "all"]);
    assert_eq!(code, Some(0), "{out}"); // four runs may hold it by chance
    let (code, out, _) = dir.monorig(&["test", "all", "--seeds", "1..10"]);
    assert_eq!(code, Some(1), "{out}");
    let told = words(&out);
    assert!(
        told.contains("holds in 10 of 10 seeds")
            && told.contains("remove it from `known_failures`"),
        "{out}"
    );

    for (known, says) in [
        (
            "{estimator: attitude, metric: slope_rmse_deg, no_worse_than: 1, why: x}",
            "`expect` has no bound of this estimator and metric",
        ),
        (
            "{estimator: attitude, metric: mass_availability, no_worse_than: 0.5, why: x}",
            "the scenario has no bound on `mass_availability`",
        ),
        (
            "{estimator: attitude, metric: slope_mae_deg, no_worse_than: 30, why: ''}",
            "needs a reason",
        ),
    ] {
        let text = expect("1").replace("{estimator: attitude, metric: slope_mae_deg, no_worse_than: 30, why: a bias of the accelerometer}", known);
        let dir = with(&[("one", quick(&text))]);
        let (code, _, err) = dir.monorig(&["test", "all"]);
        assert!(code == Some(2) && err.contains(says), "{err}");
    }
}

/// Every estimator that a scenario names is judged by its marks, also where bounds are about others; one that is listed
/// as for reference only is not.
#[test]
fn every_named_estimator_is_judged() {
    let of_fusion = "expect: [{estimator: rail_fusion, metric: slope_availability, after_s: 6, at_least: 0.1}]\n";
    for (reference_only, judged) in [
        ("[]", ["attitude", "rail_fusion"].as_slice()),
        ("[attitude]", &["rail_fusion"]),
    ] {
        let marks = MISLEADING.replace("}", &format!(", reference_only: {reference_only}}}"));
        let text = quick(&format!("{of_fusion}{marks}"))
            .replace("{attitude: {}}", "{attitude: {}, rail_fusion: {}}");
        let dir = with(&[("one", text)]);
        let (code, out, _) = dir.monorig(&["test", "all", "--seeds", "1", "--junit", "v.xml"]);
        assert_eq!(code, Some(1), "{out}");
        let xml = dir.read("v.xml");
        for name in ["attitude", "rail_fusion"] {
            let is_there = xml.contains(&format!("{name} slope_misleading_share"));
            assert_eq!(is_there, judged.contains(&name), "{name}: {xml}");
        }
    }
}

/// Other seeds, as many as the scenario has; the share of the checks that hold is told.
#[test]
fn seeds_from_another_one_on() {
    let dir = with(&[("one", quick(HOLDS))]);
    let args = ["test", "all", "--seeds-from", "71", "--json", "v.json"];
    let (code, out, err) = dir.monorig(&args);
    assert_eq!(code, Some(0), "{out}{err}");
    let told = "seeds from 71: 5 of 5 checks hold, 100.0 %";
    assert!(out.contains(told), "{out}");
    let json: serde_json::Value = serde_json::from_str(&dir.read("v.json")).unwrap();
    let runs = json["scenarios"][0]["runs"].as_array().unwrap();
    let seeds: Vec<u64> = runs
        .iter()
        .map(|run| run["seed"].as_u64().unwrap())
        .collect();
    assert_eq!(seeds, [71, 72, 73, 74]);
    let both = ["test", "all", "--seeds-from", "71", "--seeds", "3"];
    assert_eq!(dir.monorig(&both).0, Some(2));
}

/// A window by the name of a place is that of the instants at which the vehicle comes to it.
#[test]
fn windows_by_name_are_windows_in_seconds() {
    let text = quick("expect:\n  - {metric: speed_rmse_mps, after: {event: at_speed, plus_s: 2}, until: {event: lost}, at_most: 1}\n")
        .replace("mps: 1.5}", "mps: 1.5, name: at_speed}")
        .replace("seeds: 1..4\n", "seeds: 1\nevents: [{name: lost, from_s: 30, sensor: gyro, fault: off}]\n");
    let dir = with(&[("one", text.clone())]);
    let (code, out, err) = dir.monorig(&["test", "all", "--json", "v.json"]);
    assert_eq!(code, Some(0), "{out}{err}");
    let json: serde_json::Value = serde_json::from_str(&dir.read("v.json")).unwrap();
    let verdict = &json["scenarios"][0]["runs"][0]["summary"]["expectations"][0];
    assert_eq!(
        (&verdict["after_s"], &verdict["until_s"]),
        (&5.0.into(), &30.0.into())
    );
    let wrong = text.replace("event: lost", "event: losst");
    let dir = with(&[("one", wrong)]);
    let (code, _, err) = dir.monorig(&["test", "all"]);
    assert!(
        code == Some(2)
            && err.contains("did you mean `lost`?")
            && err.contains("expect[0].until.event"),
        "{err}"
    );
}

/// A paper's claim is a known failure where the vehicle is not known; of one that is told exactly it holds.
#[test]
fn claims_hold_of_a_vehicle_that_is_told_exactly() {
    let dir = TestFolder::new();
    let scenario = project().join("scenarios/liu2023_section1.yaml");
    let task = ["test", scenario.to_str().unwrap(), "--seeds", "1..3"];
    let exact = [
        "--set",
        "vehicle.exact.all=the claims are of a known vehicle",
    ];
    let (code, out, err) = dir.monorig(&[&task[..], &exact, &["--json", "t.json"]].concat());
    assert_eq!(code, Some(0), "{out}{err}");
    let told: serde_json::Value = serde_json::from_str(&dir.read("t.json")).unwrap();
    let checks = told["scenarios"][0]["checks"].as_array().unwrap();
    let claims = checks
        .iter()
        .filter(|check| !check["known_failure"].is_null());
    let claims: Vec<_> = claims.collect();
    assert!(claims.len() >= 3, "{checks:?}");
    for claim in claims {
        let failing = claim["failing"].as_array().unwrap();
        assert!(failing.is_empty(), "{claim}");
    }
}

/// The scenarios that a test ran, by the names in its lines.
fn tested(out: &str) -> Vec<&str> {
    let lines = out.lines();
    let lines = lines.filter(|l| l.starts_with("held    ") || l.starts_with("FAILED  "));
    lines.filter_map(|l| l.split_whitespace().nth(1)).collect()
}

/// Scenarios that failed are tested again until they hold, other scenarios are left alone, and `-x` ends at the first
/// failure.
#[test]
fn what_failed_last_is_tested_again() {
    const FAILS: &str = "expect: [{metric: speed_rmse_mps, at_most: 1.0e-9}]\n";
    let names = ["a_good", "b_bad", "c_good", "d_bad"];
    let text = |name: &str| quick(if name.contains("bad") { FAILS } else { HOLDS });
    let dir = with(&names.map(|name| (name, text(name))));
    let test = |more: &[&str]| {
        let (code, out, err) = dir.monorig(&[&["test", "all", "--seeds", "1"], more].concat());
        (code, out + &err)
    };
    let (code, out) = test(&["--lf"]);
    assert_eq!(
        (code, tested(&out).len()),
        (Some(1), 4),
        "nothing is known: {out}"
    );
    let (_, out) = test(&["-x"]);
    assert_eq!(tested(&out), ["a_good", "b_bad"], "{out}");
    assert!(out.contains("2 scenarios not tested"), "{out}");
    // those that were not tested stay as they were
    let (_, out) = test(&["--lf", "--durations", "1"]);
    assert_eq!(tested(&out), ["b_bad", "d_bad"], "{out}");
    assert_eq!(
        out.lines().skip_while(|l| *l != "slowest scenarios").nth(2),
        Some(""),
        "{out}"
    );
    dir.write("all/b_bad.yaml", dir.read("all/a_good.yaml").as_bytes());
    assert_eq!(tested(&test(&["--lf"]).1), ["b_bad", "d_bad"]);
    assert_eq!(tested(&test(&["--lf"]).1), ["d_bad"]);
    let (_, out) = test(&["-k", "good and not c or d_"]);
    assert_eq!(tested(&out), ["a_good", "d_bad"], "{out}");
}
