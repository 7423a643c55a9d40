//! An estimator and a controller of another crate, through runs, studies and tuning: a registry is all that it takes.

use monorig_estimators::{Command, Error, Estimate, Estimator, Internal, Measurements, Real};
use monorig_estimators::{Value, Vehicle, choices, params};
use monorig_lab::batch::{Plan, RunSpec, run_one};
use monorig_lab::tuning::TuningStudy;
use monorig_lab::tuning::run::{Ended, TuningRun, run};
use monorig_lab::tuning::search::Begin;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::control::{Controller, ControllerSetup, Perception, Reference};
use monorig_sim::record::identity::Identity;
use std::path::{Path, PathBuf};

choices! {
    /// Mass that is added.
    Extra {
        /// Nothing.
        Nothing = "nothing",
        /// A tonne.
        Tonne = "tonne",
    }
}

params! {
    /// Parameters of an estimator that reports what it is told.
    OracleParams {
        mass_kg ["kg"] = 8e3, 1e3 => 1e5, "The mass it reports.";
        doubled [flag] = true, "Report twice the mass.";
        extra [choice Extra] = Extra::Tonne, "What is added.";
    }
}

/// Reports a constant mass and a level track. It allocates: its past is in a `Vec`.
struct Oracle {
    mass_kg: Real,
    past: Vec<Real>,
}

impl Oracle {
    fn new(_: &Vehicle, p: &OracleParams) -> Self {
        let factor = if p.doubled { 2.0 } else { 1.0 };
        let extra = match p.extra {
            Extra::Nothing => 0.0,
            Extra::Tonne => 1e3,
        };
        Self {
            mass_kg: factor * p.mass_kg + extra,
            past: Vec::new(),
        }
    }
}

impl Estimator for Oracle {
    fn step(&mut self, z: &Measurements, _: &Command, dt: Real) -> Result<Estimate, Error> {
        self.past.push(dt);
        let value = |value| Value {
            value,
            sd: 1.0,
            valid: true,
        };
        let mut estimate = Estimate::at(z.t);
        estimate.total_mass_kg = value(self.mass_kg);
        estimate.grade_rad = value(0.0);
        estimate.effective_grade_rad = value(0.0);
        Ok(estimate)
    }
    fn reset(&mut self) {
        self.past.clear();
    }
    fn internals(&self) -> &[Internal] {
        const { &[Internal::new("steps", "-")] }
    }
    fn internal_values(&self, values: &mut [Real]) {
        values.fill(self.past.len() as Real);
    }
}

params! {
    /// Parameters of a controller with one gain.
    GainParams { gain ["N·m·s/m"] = 200.0, 0.0 => 1e4, "Torque per speed error."; }
}

struct Gain(f64);

impl Controller for Gain {
    fn control(&mut self, reference: &Reference, seen: &Perception, _: f64) -> Command {
        let mut command = reference.command();
        command
            .motor_torque_nm
            .fill(self.0 * (reference.speed_mps - seen.speed_mps));
        command
    }
}

fn registry() -> Registry {
    let mut registry = Registry::default();
    registry
        .estimator("oracle", Oracle::new)
        .expect("a new name");
    let gain = |_: &Vehicle, _: &ControllerSetup, p: &GainParams| Gain(p.gain);
    registry.controller("gain", gain).expect("a new name");
    registry
}

/// A scenario with `estimators` and `controller`, in a folder.
fn write(folder: &Path, estimators: &str, controller: &str) -> PathBuf {
    let assets = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets");
    let text = format!(
        "version: 1\nwhy: A test.\ntrack: '{assets}/tracks/liu2023_section1.yaml'\n\
         train: '{assets}/trains/dx80_176y.yaml'\nload: {{mass_kg: 10000}}\n\
         sensors: '{assets}/sensors/liu2023.yaml'\nphysics: {{plant: point-mass}}\nstop: {{after_s: 20}}\n\
         drive:\n  speed: [{{at_s: 0, mps: 0}}, {{at_s: 4, mps: 1.0}}]\n  controller: {controller}\n\
         estimators: {estimators}\nin_loop: oracle\n"
    );
    let path = folder.join("scenario.yaml");
    std::fs::write(&path, text).expect("written");
    path
}

fn spec(scenario: PathBuf) -> RunSpec {
    RunSpec {
        index: 0,
        scenario,
        changes: Default::default(),
        inputs: Default::default(),
        seed: 1,
        draws: Default::default(),
        reference: None,
    }
}

fn summary(
    estimators: &str,
    controller: &str,
) -> Result<monorig_lab::verdicts::summary::Summary, String> {
    let folder = tempfile::tempdir().expect("folder");
    let spec = spec(write(folder.path(), estimators, controller));
    let result = run_one(&spec, &registry(), &|| true).expect("not interrupted");
    result.summary.ok_or(result.error.unwrap_or_default())
}

/// Panics in its second second.
struct Panics;

impl Estimator for Panics {
    fn step(&mut self, z: &Measurements, _: &Command, _: Real) -> Result<Estimate, Error> {
        assert!(z.t.s() < 1.0, "no such wheel");
        Ok(Estimate::at(z.t))
    }
    fn reset(&mut self) {}
}

/// A panic of a foreign estimator is the result of its run, with its message; whoever made the run goes on.
#[test]
fn a_panic_of_a_foreign_estimator_is_the_result_of_its_run() {
    let folder = tempfile::tempdir().expect("folder");
    let estimators = "{oracle: {mass_kg: 15000}, mine: {is: panics}}";
    let spec = spec(write(folder.path(), estimators, "{kind: gain}"));
    let mut registry = registry();
    let panics = |_: &Vehicle, _: &OracleParams| Panics;
    registry.estimator("panics", panics).expect("a new name");
    let result = run_one(&spec, &registry, &|| true).expect("not interrupted");
    let told = result.error.expect("an error");
    let words = [
        "the estimator mine broke down at t = 1.0",
        "panicked: no such wheel (",
    ];
    assert!(words.iter().all(|w| told.contains(w)), "{told}");
    assert!(result.summary.is_none());
}

/// Metrics and a controller of another crate get the values that it reports.
#[test]
fn foreign_parts_run_and_are_measured() {
    let estimators = "{oracle: {mass_kg: 15000, doubled: false, extra: nothing}, \
        other: {is: oracle, mass_kg: 15000, doubled: false}}";
    let run = |controller: &str| summary(estimators, controller).expect("a run");
    let ours = run("{feedforward: estimate}");
    assert!(ours.never_valid.is_empty() && ours.refusals.is_empty());
    let error = |name: &str| ours.estimators[name]["mass_error_max_kg"].expect("measured");
    assert!((error("oracle") - error("other")).abs() == 1e3);

    let speed = |gain: &str| run(gain).run["speed_rmse_mps"].expect("measured");
    // a higher gain leaves a smaller error, and one of nothing the whole speed
    let (none, low, high) = (
        speed("{kind: gain, gain: 0}"),
        speed("{kind: gain, gain: 50}"),
        speed("{kind: gain, gain: 500}"),
    );
    assert!(
        none > 0.9 && none > low && low > high,
        "{none} {low} {high}"
    );
}

#[test]
fn their_parameters_are_checked_like_ours() {
    for (estimators, controller, told) in [
        ("{oracel: {}, oracle: {}}", "{}", "did you mean `oracle`"),
        ("{oracle: {mas_kg: 1}}", "{}", "did you mean `mass_kg`"),
        ("{oracle: {mass_kg: 1}}", "{}", "1000…100000 kg"),
        ("{oracle: {doubled: 1}}", "{}", "true or false"),
        ("{oracle: {extra: ton}}", "{}", "one of nothing, tonne"),
        ("{oracle: {}}", "{kind: gian}", "did you mean `gain`"),
        ("{oracle: {}}", "{kind: gain, gain: -1}", "0…10000"),
    ] {
        let error = summary(estimators, controller).expect_err("refused");
        assert!(error.contains(told), "{estimators} {controller}: {error}");
    }
}

#[test]
fn a_study_of_a_foreign_estimator_is_planned() {
    let folder = tempfile::tempdir().expect("folder");
    write(folder.path(), "{oracle: {}}", "{}");
    let path = folder.path().join("study.yaml");
    let text = "version: 1\nwhy: A test.\nscenario: scenario.yaml\nruns: 3\n\
        vary: [{path: estimators.oracle.extra, choice: [nothing, tonne]}]\n";
    std::fs::write(&path, text).expect("written");
    assert!(Plan::load(&path, &Registry::default()).is_err());
    let plan = Plan::load(&path, &registry()).expect("a plan");
    for index in 0..plan.runs() {
        let result = run_one(&plan.spec(index), &registry(), &|| true).expect("not interrupted");
        assert!(result.finished(), "{:?}", result.error);
    }
}

/// The mass that is right is known: a grid must find it, together with the flag and the word that leave it as it is.
#[test]
fn numbers_flags_and_words_are_tuned() {
    let truth = {
        let right = summary(
            "{oracle: {mass_kg: 10000, doubled: false, extra: nothing}}",
            "{}",
        );
        let error = right.expect("a run").estimators["oracle"]["mass_rmse_kg"].expect("measured");
        10_000.0 + error
    };
    for evaluation in ["replay", "closed_loop"] {
        let folder = tempfile::tempdir().expect("folder");
        write(folder.path(), "{oracle: {}}", "{feedforward: none}");
        let text = format!(
            "version: 1\nwhy: A test.\nestimator: oracle\nevaluation: {evaluation}\n\
             parameters:\n  mass_kg: {{choices: [10000, {truth}, 60000]}}\n  doubled: {{choices: [true, false]}}\n  \
             extra: {{choices: [tonne, nothing]}}\n\
             tuning: [{{scenario: scenario.yaml, seeds: [1]}}]\nvalidation: [{{scenario: scenario.yaml, seeds: [2]}}]\n\
             objective: {{metrics: [{{metric: mass_rmse_kg}}]}}\noptimiser: grid\nbudget: 13\nsensitivity: {{curve: 3}}\n"
        );
        let path = folder.path().join("study.yaml");
        std::fs::write(&path, text).expect("written");
        let study = TuningStudy::load(&path, &registry()).expect("a study");
        let task = TuningRun {
            folder: folder.path().join("out"),
            cache: folder.path().join("cache"),
            jobs: 1,
            begin: Begin::New,
            monorig: Identity::of_program(None),
        };
        let Ended::Finished(result) = run(&study, &task, &()).expect("a search") else {
            panic!("it was stopped");
        };
        let best = result.best().expect("a winner");
        let text = serde_json::to_value(&best.parameters).expect("JSON");
        assert_eq!(text["mass_kg"], truth, "{evaluation}");
        assert_eq!(text["doubled"], false, "{evaluation}");
        assert_eq!(text["extra"], "nothing", "{evaluation}");
        let page = std::fs::read_to_string(task.folder.join("report.html")).expect("a report");
        assert!(
            page.contains("winner nothing"),
            "words are marked in the report"
        );
    }
}
