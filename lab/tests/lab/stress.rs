//! Laws of the stress battery.

use monorig_estimators::{Command, Error, Estimate, Estimator, Measurements};
use monorig_lab::batch::in_order;
use monorig_lab::stress::{
    Battery, Condition, Group, Matrix, NOMINAL, Pairing, StressRun, WantedEstimator,
};
use monorig_sim::closed_loop::registry::Registry;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

monorig_estimators::params! {
    /// Parameters of the boaster.
    BoasterParams { mass_kg ["kg"] = 200e3, 1.0 => 1e6, "The mass it always reports."; }
}

/// Marks the same wrong values valid all the time, with small standard deviations.
struct Boaster(f64);

impl Estimator for Boaster {
    fn step(&mut self, z: &Measurements, _: &Command, _: f64) -> Result<Estimate, Error> {
        let mut e = Estimate::at(z.t);
        for (value, wrong, sd) in [
            (&mut e.total_mass_kg, self.0, 1.0),
            (&mut e.grade_rad, 0.5, 1e-3),
            (&mut e.effective_grade_rad, 0.5, 1e-3),
        ] {
            (value.value, value.sd, value.valid) = (wrong, sd, true);
        }
        Ok(e)
    }
    fn reset(&mut self) {}
}

fn registry() -> Registry {
    let mut registry = Registry::default();
    registry
        .estimator("boaster", |_, p: &BoasterParams| Boaster(p.mass_kg))
        .unwrap();
    registry
}

fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

fn shipped() -> Vec<Condition> {
    Condition::load_all(&[project("assets/conditions")]).unwrap()
}

fn sets(all: &[(&str, &str)]) -> Vec<(String, String)> {
    let all = all.iter();
    all.map(|(p, v)| ((*p).to_owned(), (*v).to_owned()))
        .collect()
}

fn wanted(names: &[&str]) -> Vec<WantedEstimator> {
    names.iter().map(|n| ((*n).to_owned(), None)).collect()
}

fn run(battery: &Battery, registry: &Registry) -> Vec<StressRun> {
    let mut runs = Vec::new();
    let work = |i| battery.run(i, registry, &|| true).unwrap().unwrap();
    in_order(
        NonZeroUsize::new(2).unwrap(),
        0..battery.runs(),
        work,
        |run| {
            runs.push(run);
            Ok::<_, ()>(())
        },
    )
    .unwrap();
    runs
}

/// Every condition that monorig ships gives the estimators other measurements, or tells them another vehicle, at least
/// in a run of the whole train of this length; and no run breaks down.
fn each_changes_what_estimators_are_given(conditions: Vec<Condition>, stop_s: &str) {
    let registry = registry();
    let scenarios = [project("scenarios/stress/whole_train.yaml")];
    let sets = sets(&[("seeds", "1"), ("stop.after_s", stop_s)]);
    let estimators = wanted(&["boaster"]);
    let battery = Battery::load(
        &scenarios,
        conditions,
        Pairing::Every,
        &estimators,
        &sets,
        &registry,
    )
    .unwrap();
    assert!(battery.left_out().is_empty(), "{:?}", battery.left_out());
    let runs = run(&battery, &registry);
    for run in &runs {
        assert_eq!(run.error, None, "{}", run.words());
    }
    let matrix = Matrix::of(&battery.rows(), battery.estimators(), &runs);
    for cell in &matrix.cells {
        let expected = usize::from(cell.condition != NOMINAL);
        assert_eq!(cell.changed, expected, "{} changes nothing", cell.condition);
        // and what is always wrong and always valid misleads under every condition
        for f in cell.quantities() {
            // an estimate for which nothing comes, or whose computer is down, loses its mark
            let silent = cell.condition.starts_with("silence_") || cell.condition == "power_cycle";
            assert!(f.valid == Some(1.0) || silent, "{}", cell.condition);
            assert_eq!(f.misleading, Some(1.0), "{}", cell.condition);
            assert_eq!(f.overconfident, Some(1.0), "{}", cell.condition);
            assert_eq!(f.recovery_s, None, "{}", cell.condition);
        }
    }
}

/// A quarter of a minute for conditions that act from the start on, longer for those with events or at a place of the
/// rail, which have all acted by then.
#[test]
fn every_condition_changes_what_estimators_are_given() {
    let all = shipped();
    assert!(all.len() > 90);
    let is_late = |c: &Condition| c.over_s() > 20.0 || c.group() == Group::Rail;
    let (late, early): (Vec<_>, Vec<_>) = all.into_iter().partition(is_late);
    let (early, at_once) = early.into_iter().partition(|c| c.over_s() > 0.0);
    each_changes_what_estimators_are_given(at_once, "15");
    each_changes_what_estimators_are_given(early, "32");
    each_changes_what_estimators_are_given(late, "72");
}

#[test]
#[ignore = "a soak, which .ci/run makes"]
fn soak_every_condition_changes_what_estimators_are_given_in_a_whole_run() {
    each_changes_what_estimators_are_given(shipped(), "110");
}

/// A condition that sets a value to what it is changes no bit, and a real one does.
#[test]
fn a_condition_without_effect_has_the_nominal_figures() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, rest: &str| {
        let text = format!("version: 1\ncondition: a test\n{rest}\n");
        std::fs::write(folder.path().join(name), text).unwrap();
    };
    write("same.yaml", "group: train\nset: {load.mass_kg: 10000}");
    write("told.yaml", "group: told\ntold_factor: {tare_kg: 1.0}");
    write("heavier.yaml", "group: train\nset: {load.mass_kg: 10001}");
    let conditions = Condition::load_all(&[folder.path().into()]).unwrap();
    let registry = Registry::default();
    let scenarios = [project("scenarios/stress/point_mass.yaml")];
    let sets = sets(&[("stop.after_s", "20"), ("vehicle.exact.all", "a test")]);
    let battery = Battery::load(
        &scenarios,
        conditions,
        Pairing::Every,
        &[],
        &sets,
        &registry,
    )
    .unwrap();
    let runs = run(&battery, &registry);
    let matrix = Matrix::of(&battery.rows(), battery.estimators(), &runs);
    for estimator in battery.estimators() {
        let cell = |name: &str| {
            let mut all = matrix.cells.iter();
            let found = all.find(|c| c.condition == name && &c.estimator == estimator);
            let mut found = found.unwrap().clone();
            found.condition = NOMINAL.into();
            found
        };
        let nominal = cell(NOMINAL);
        assert!(nominal.runs == 2 && nominal.slope.error.is_some());
        assert_eq!(cell("same"), nominal);
        assert_eq!(cell("told"), nominal);
        assert_ne!(cell("heavier"), nominal);
        assert_eq!(cell("heavier").changed, 2);
    }
}

/// A cell over several runs is the mean over their samples, and its recovery that of the slowest.
#[test]
fn a_cell_is_taken_over_the_samples_of_its_runs() {
    let run = |index: u64, valid: f64, error: f64, recovered: f64| -> StressRun {
        let figures = serde_json::json!({
            "slope_availability": valid, "slope_rmse_deg_valid": error, "slope_misleading_share": error,
            "slope_recovered_s": recovered,
        });
        serde_json::from_value(serde_json::json!({
            "index": index, "condition": "oil", "scenario": "s", "seed": index, "given": "",
            "estimators": {"mine": figures},
        }))
        .unwrap()
    };
    let runs = [run(0, 0.2, 0.3, 50.0), run(1, 0.6, 0.1, 42.0)];
    let rows = serde_json::json!([{"condition": "oil", "words": "", "over_s": 40.0}]);
    let rows: Vec<_> = serde_json::from_value(rows).unwrap();
    let matrix = Matrix::of(&rows, &["mine".into()], &runs);
    let slope = matrix.cells[0].slope;
    assert_eq!(slope.valid, Some(0.4));
    let rms = f64::sqrt((0.2 * 0.09 + 0.6 * 0.01) / 0.8);
    assert!((slope.error.unwrap() - rms).abs() < 1e-15);
    assert!((slope.misleading.unwrap() - 0.12 / 0.8).abs() < 1e-15);
    assert_eq!(slope.recovery_s, Some(10.0));
    assert_eq!(matrix.cells[0].mass.valid, None);
}
