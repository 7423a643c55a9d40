//! `monorig tune`: the same trials and winner for any number of threads and after a kill; bad studies; winners
//! included.

use crate::common::{TestFolder, row};
use std::process::{Command, Stdio};
use std::time::Duration;

/// A small study of the good scenario. A train of one unit, 30 s onto a slope.
const STUDY: &str = "\
version: 1
why: A sample.
estimator: dffrls_aekf_robust
parameters:
  delta: {from: 0.9, to: 0.9999, scale: memory}
  regression_hz: {from: 1, to: 10, integer: true}
  noise: {choices: [learnt, told]}
  outlier_hold: {choices: [true, false]}
fixed: {cutoff_hz: 2}
published: {delta: 0.95, kappa: 0.966}
tuning:
  - {scenario: scenario.yaml, set: {start.chainage_m: 58, stop.after_s: 30, events: [], expect: [], drive.controller.feedforward: none}, seeds: 1..2}
validation:
  - {scenario: scenario.yaml, set: {start.chainage_m: 58, stop.after_s: 30, events: [], expect: [], drive.controller.feedforward: none}, seeds: [7, 8]}
objective:
  metrics:
    - {metric: mass_rmse_kg, after_s: 20}
    - {metric: slope_rmse_deg, after_s: 20, weight: 2}
constraints:
  - {metric: slope_availability, at_least: 0.1}
optimiser: cma_es
budget: 14
sensitivity: {curve: 3}
";

fn dir() -> TestFolder {
    let dir = TestFolder::new();
    dir.write("study.yaml", STUDY.as_bytes());
    dir
}

const RESULTS: [&str; 5] = [
    "report.html",
    "trials.jsonl",
    "winner.yaml",
    "validation.json",
    "sensitivity.json",
];

fn results(dir: &TestFolder, out: &str) -> Vec<String> {
    let read = |name: &&str| dir.read(&format!("{out}/tune/study/{name}"));
    RESULTS.iter().map(read).collect()
}

#[test]
fn threads_kills_and_torn_lines_change_nothing() {
    let dir = dir();
    let tune = |out: &str, more: &[&str]| {
        let mut arguments = vec!["tune", "study.yaml", "--cache", "cache", "--out", out];
        arguments.extend(more);
        let (code, told, err) = dir.monorig(&arguments);
        assert_eq!(code, Some(0), "{told}{err}");
        // the folder of the report differs
        told.replace(&format!("{out}/tune"), "OUT/tune")
    };
    let told = tune("one", &["--jobs", "1"]);
    assert!(
        told.contains("winner") && told.contains("14 trials"),
        "{told}"
    );
    let whole = results(&dir, "one");
    assert_eq!(whole[1].lines().count(), 15);
    for part in [
        "Validation",
        "Sensitivity",
        "Before and after",
        "delta",
        "winner",
    ] {
        assert!(whole[0].contains(part), "no {part} in the report");
    }

    assert_eq!(tune("two", &["--jobs", "2"]), told);
    assert_eq!(results(&dir, "two"), whole);

    // killed in mid-search, whenever that is
    std::fs::create_dir_all(dir.path("killed")).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_monorig"))
        .args([
            "tune",
            "study.yaml",
            "--cache",
            "cache",
            "--out",
            "killed",
            "--jobs",
            "2",
        ])
        .current_dir(dir.path(""))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let store = dir.path("killed/tune/study/trials.jsonl");
    let lines = || std::fs::read_to_string(&store).map_or(0, |t| t.lines().count());
    while lines() < 6 && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
    let _ = child.kill(); // SIGKILL; it may have come to its end by itself
    child.wait().unwrap();
    assert_eq!(tune("killed", &["--resume"]), told);
    assert_eq!(results(&dir, "killed"), whole);

    // torn anywhere
    let bytes = whole[1].as_bytes();
    for share in [0.02, 0.3, 0.55, 0.9] {
        let cut = (bytes.len() as f64 * share) as usize;
        dir.write("two/tune/study/trials.jsonl", &bytes[..cut]);
        assert_eq!(tune("two", &["--resume"]), told, "cut at {cut}");
        assert_eq!(results(&dir, "two"), whole, "cut at {cut}");
    }

    // a changed study does not go on with the trials of another
    dir.write(
        "study.yaml",
        STUDY.replace("budget: 14", "budget: 15").as_bytes(),
    );
    let told = dir.refused(&[
        "tune",
        "study.yaml",
        "--cache",
        "cache",
        "--out",
        "two",
        "--resume",
    ]);
    assert!(
        told.contains("changed") && told.contains("--restart"),
        "{told}"
    );
    assert_eq!(dir.read("two/tune/study/trials.jsonl"), whole[1]);
}

/// The estimator in the loop, tuned for comfort: the same for any number of threads.
#[test]
fn the_closed_loop_is_tuned_too() {
    let dir = dir();
    let in_loop = STUDY
        .replace(", drive.controller.feedforward: none", "")
        .replace("metric: mass_rmse_kg", "metric: jerk_rms_mps3")
        .replace("budget: 14", "budget: 5")
        .replace("optimiser:", "evaluation: closed_loop\noptimiser:");
    dir.write("study.yaml", in_loop.as_bytes());
    for (out, jobs) in [("one", "1"), ("two", "2")] {
        let (code, told, err) = dir.monorig(&["tune", "study.yaml", "--out", out, "--jobs", jobs]);
        assert_eq!(code, Some(0), "{told}{err}");
    }
    assert_eq!(results(&dir, "one"), results(&dir, "two"));
}

/// Defaults without a valid sample in the window are no measure: refused before the search, and the same on validation
/// runs alone.
#[test]
fn defaults_that_cannot_be_measured_are_refused() {
    let blind = "{metric: mass_rmse_kg_valid, after_s: 0, until_s: 1}";
    let available = "constraints:\n  - {metric: mass_availability, at_least: 0.001}";
    let stands = STUDY.replace("seeds: [7, 8]", "seeds: [7]").replacen(
        "stop.after_s: 30, events: [], expect: [], drive.controller.feedforward: none}, seeds: [7]",
        "stop.after_s: 19, events: [], expect: [], drive.controller.feedforward: none}, seeds: [7]",
        1,
    );
    for (study, what) in [
        (
            STUDY
                .replace("{metric: mass_rmse_kg, after_s: 20}", blind)
                .replace("constraints:", available),
            "mass_rmse_kg_valid is not a number",
        ),
        (stands, "mass_rmse_kg is not a number"),
    ] {
        let dir = dir();
        dir.write("study.yaml", study.as_bytes());
        let (code, told, err) = dir.monorig(&["tune", "study.yaml"]);
        assert_eq!(code, Some(2), "{told}{err}");
        for part in ["validation[0]", what, "help:"] {
            assert!(err.contains(part), "no {part}: {err}");
        }
    }
}

/// Ranges in which the estimator fails everywhere, and bounds nobody can hold: no winner, code 1, no crash.
#[test]
fn a_study_without_a_good_trial_says_so() {
    let dir = dir();
    let hopeless = STUDY.replace("at_least: 0.1", "at_least: 1.5");
    dir.write("study.yaml", hopeless.as_bytes());
    let (code, told, err) =
        dir.monorig(&["tune", "study.yaml", "--cache", "cache", "--out", "out"]);
    assert_eq!(code, Some(1), "{told}{err}");
    assert!(told.contains("no winner"), "{told}");
    assert!(!dir.path("out/tune/study/winner.yaml").exists());
}

/// A scenario includes a winner; what it says itself has the last word.
#[test]
fn parameters_are_included() {
    let dir = dir();
    let parameters = "version: 1\nwhy: A test.\nestimator: dffrls_aekf_robust\nparameters: {delta: 0.97, sigma: 3}\n";
    dir.write("tuned.yaml", parameters.as_bytes());
    let (code, out, err) = dir.monorig(&["check", "tuned.yaml"]);
    assert_eq!(
        (code, out.as_str()),
        (Some(0), "tuned.yaml: parameters ok\n"),
        "{err}"
    );
    let run = |settings: &str| {
        let set = format!("estimators={{dffrls_aekf_robust: {settings}}}");
        let (code, _, err) = dir.monorig(&[
            "run",
            "scenario.yaml",
            "--no-rerun",
            "--set",
            "stop.after_s=30",
            "--set",
            "start.chainage_m=58",
            "--set",
            "events=[]",
            "--set",
            "expect=[]",
            "--set",
            &set,
            "--name",
            "tuned",
        ]);
        assert_eq!(code, Some(0), "{err}");
        dir.read("runs/scenario@tuned/1/metrics.json")
    };
    let included = run("{from: tuned.yaml, sigma: 5}");
    let manifest = dir.read("runs/scenario@tuned/1/manifest.json");
    assert!(
        manifest.contains("0.97") && manifest.contains("tuned.yaml"),
        "{manifest}"
    );
    assert_eq!(included, run("{delta: 0.97, sigma: 5}"));
    assert_ne!(included, run("{from: tuned.yaml}"));
}

/// Case, file, text to replace, replacement.
#[rustfmt::skip] // a table
const BAD: &[(&str, &str, &str, &str)] = &[
    ("unknown_estimator", "study.yaml", "estimator: dffrls_aekf_robust", "estimator: dffrls_ekf"),
    ("unknown_parameter", "study.yaml", "  delta: {from", "  delat: {from"),
    ("value_out_of_range", "study.yaml", "from: 0.9,", "from: 0.1,"),
    ("range_without_ends", "study.yaml", "{from: 1, to: 10, integer: true}", "{integer: true}"),
    ("range_upside_down", "study.yaml", "from: 1, to: 10", "from: 10, to: 1"),
    ("memory_of_one", "study.yaml", "to: 0.9999", "to: 1"),
    ("log_of_zero", "study.yaml", "{from: 1, to: 10, integer: true}", "{from: 0, to: 1, scale: log}"),
    ("integer_with_a_fraction", "study.yaml", "from: 1, to: 10", "from: 1.5, to: 10"),
    ("a_single_choice", "study.yaml", "[true, false]", "[true]"),
    ("a_choice_unknown", "study.yaml", "learnt, told]", "learnt, tld]"),
    ("a_flag_with_numbers", "study.yaml", "[true, false]", "[0, 1]"),
    ("a_choice_with_a_range", "study.yaml", "{choices: [learnt, told]}", "{from: 0, to: 1}"),
    ("type_unknown", "study.yaml", "estimator: dffrls_aekf_robust", "estimator: tuned\nis: dffrls_aekf_robst"),
    ("choices_and_ends", "study.yaml", "{choices: [true, false]}", "{choices: [true, false], to: 1}"),
    ("fixed_and_varying", "study.yaml", "fixed: {cutoff_hz: 2}", "fixed: {delta: 0.99}"),
    ("published_unknown", "study.yaml", "kappa: 0.966", "capa: 0.966"),
    ("unknown_metric", "study.yaml", "metric: mass_rmse_kg", "metric: mass_rms_kg"),
    ("valid_without_availability", "study.yaml", "metric: mass_rmse_kg", "metric: mass_rmse_kg_valid"),
    ("metric_of_the_train", "study.yaml", "metric: mass_rmse_kg", "metric: speed_rmse_mps"),
    ("window_empty", "study.yaml", "after_s: 20}", "after_s: 10, until_s: 9}"),
    ("constraint_bounds_nothing", "study.yaml", ", at_least: 0.1", ""),
    ("budget_too_small", "study.yaml", "budget: 14", "budget: 1"),
    ("budget_negative", "study.yaml", "budget: 14", "budget: -3"),
    ("optimiser_unknown", "study.yaml", "cma_es", "cma_ess"),
    ("optimiser_removed", "study.yaml", "cma_es", "bayesian"),
    ("front_of_one_number", "study.yaml", "optimiser: cma_es", "optimiser: nsga2"),
    ("front_without_nsga2", "study.yaml", "objective:", "objective:\n  combine: pareto"),
    ("validates_on_tuning_runs", "study.yaml", "seeds: [7, 8]", "seeds: [2, 8]"),
    ("no_validation", "study.yaml", "seeds: [7, 8]}", "seeds: []}"),
    ("scenario_not_there", "study.yaml", "- {scenario: scenario.yaml, set: {start.chainage_m: 58, stop.after_s: 30, events: [], expect: [], drive.controller.feedforward: none}, seeds: 1..2", "- {scenario: scenery.yaml, seeds: 1..2"),
    ("in_the_loop", "study.yaml", ", drive.controller.feedforward: none}, seeds: 1..2", "}, seeds: 1..2"),
    ("set_nowhere", "study.yaml", "start.chainage_m: 58, stop.after_s: 30, events: [], expect: [], drive.controller.feedforward: none}, seeds: 1..2", "stop.soon: 12}, seeds: 1..2"),
    ("scenario_is_bad", "scenario.yaml", "mass_kg: 2500", "mass_kg: 99999"),
    ("train_is_bad", "train.yaml", "torque_max_nm: 160", "torque_max_nm: -1"),
    ("unknown_key", "study.yaml", "budget:", "buget:"),
    ("no_reason", "study.yaml", "why: A sample.", "why: ''"),
    ("version", "study.yaml", "version: 1", "version: 2"),
];

#[test]
fn bad_studies() {
    let mut rows = Vec::new();
    for (case, file, from, to) in BAD {
        let dir = dir();
        let text = dir.read(file);
        assert!(text.contains(from), "{case}");
        dir.write(file, text.replacen(from, to, 1).as_bytes());
        let told = dir.refused(&["tune", "study.yaml"]);
        assert!(told.contains("help:"), "{case}: {told}");
        let checked = dir.refused(&["check", "--kind", "tuning", "study.yaml"]);
        assert!(checked.starts_with(told.trim_end()), "{case}: {checked}");
        rows.push(row(case, &told));
    }
    let snapshot = rows.join("\n");
    insta::assert_snapshot!("study", snapshot);
}

/// Case, parameter file, settings in the scenario.
#[rustfmt::skip] // a table
const BAD_PARAMETERS: &[(&str, &str, &str)] = &[
    ("unknown", "version: 1\nwhy: x\nestimator: dffrls_aekf_robust\nparameters: {delat: 0.9}\n", "{from: tuned.yaml}"),
    ("out_of_range", "version: 1\nwhy: x\nestimator: dffrls_aekf_robust\nparameters:\n  delta: 1.9\n", "{from: tuned.yaml}"),
    ("of_another_estimator", "version: 1\nwhy: x\nestimator: rail_fusion\nparameters: {}\n", "{from: tuned.yaml}"),
    ("not_there", "version: 1\nwhy: x\nestimator: dffrls_aekf_robust\nparameters: {}\n", "{from: tune.yaml}"),
    ("not_a_name", "version: 1\nwhy: x\nestimator: dffrls_aekf_robust\nparameters: {}\n", "{from: 3}"),
    ("without_a_reason", "version: 1\nwhy: ' '\nestimator: dffrls_aekf_robust\nparameters: {}\n", "{from: tuned.yaml}"),
    ("not_a_number", "version: 1\nwhy: x\nestimator: dffrls_aekf_robust\nparameters: {delta: many}\n", "{from: tuned.yaml}"),
];

#[test]
fn bad_parameter_files() {
    let mut rows = Vec::new();
    for (case, file, settings) in BAD_PARAMETERS {
        let dir = dir();
        dir.write("tuned.yaml", file.as_bytes());
        let scenario = dir.read("scenario.yaml");
        let scenario = scenario.replace("{lambda0: 0.98}", settings);
        dir.write("scenario.yaml", scenario.as_bytes());
        let told = dir.refused(&["run", "scenario.yaml"]);
        assert!(told.contains("help:"), "{case}: {told}");
        rows.push(row(case, &told));
    }
    let snapshot = rows.join("\n");
    insta::assert_snapshot!("parameters", snapshot);
}
