//! A run out as a log and in again: the estimates of the replay are those of the run, in every format.

use monorig_estimators::Estimate;
use monorig_logs::export::{ExportFormat, SAMPLES, SampleRecorder, export};
use monorig_logs::map::Map;
use monorig_logs::replay::{ReplayOptions, simulation};
use monorig_sim::closed_loop::resolved;
use monorig_sim::config::file::Sets;
use monorig_sim::config::scenario::Scenario;
use monorig_sim::record::identity::Identity;
use monorig_sim::record::manifest::{self, Manifest};
use monorig_sim::{Registry, Simulation, StepFrame};
use std::collections::BTreeMap;
use std::path::Path;

/// Estimates of all estimators by the time of the step, ns.
type Estimates = BTreeMap<i64, Vec<Estimate>>;

fn watch(simulation: &mut Simulation, recorder: Option<&mut SampleRecorder>) -> Estimates {
    let mut all = Estimates::new();
    let mut see = |f: &StepFrame<'_>| {
        if f.sampled {
            all.insert(f.time_ns, f.estimators.iter().map(|e| e.estimate).collect());
        }
    };
    match recorder {
        Some(recorder) => simulation.run(&mut [recorder, &mut see]).unwrap(),
        None => simulation.run(&mut [&mut see]).unwrap(),
    };
    all
}

/// A scenario of the project, run into a folder.
fn run(scenario: &str, changes: &[(&str, &str)], folder: &Path) -> Estimates {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../scenarios")
        .join(scenario);
    let changes: Vec<_> = changes
        .iter()
        .map(|(k, v)| ((*k).to_owned(), (*v).to_owned()))
        .collect();
    let scenario = Scenario::load_with(&file, &Sets::new(&changes)).unwrap();
    let registry = Registry::default();
    let resolved = resolved(&scenario, &registry);
    let mut simulation = Simulation::build(scenario, &registry, 3).unwrap();
    std::fs::create_dir(folder).unwrap();
    let mut recorder = SampleRecorder::new(folder.join(SAMPLES));
    let estimates = watch(&mut simulation, Some(&mut recorder));
    let identity = Identity::of_program(None);
    let mut made = Manifest::new(&identity, "sample", 3, BTreeMap::new(), resolved);
    let metrics = r#"{"scenario": "sample", "seed": 3}"#;
    std::fs::write(folder.join("metrics.json"), metrics).unwrap();
    made.sum_outputs(folder).unwrap();
    std::fs::write(folder.join(manifest::NAME), made.to_json()).unwrap();
    estimates
}

/// The run exported and replayed.
fn again(run: &Path, format: ExportFormat) -> Estimates {
    let out = run.with_extension(format.name());
    let exported = export(run, format, &out, None).unwrap();
    assert!(exported.rows > 1000, "{exported:?}");
    assert_eq!(exported.clipped, 0);
    let map = Map::load(&exported.map).unwrap();
    let mut replay = simulation(&map, &ReplayOptions::default(), &Registry::default()).unwrap();
    watch(&mut replay, None)
}

/// All numbers of an estimate.
fn numbers(e: &Estimate) -> Vec<f64> {
    let values = [
        e.total_mass_kg,
        e.grade_rad,
        e.effective_grade_rad,
        e.speed_mps,
    ];
    let values = values
        .iter()
        .flat_map(|v| [v.value, v.sd, f64::from(u8::from(v.valid))]);
    values.chain([e.innovation, e.nis]).collect()
}

fn same_bits(run: &Estimates, again: &Estimates, what: &str) {
    assert_eq!(run.len(), again.len(), "{what}: steps with a sample");
    for ((t, a), (t_again, b)) in run.iter().zip(again) {
        assert_eq!(t, t_again, "{what}");
        for (k, (a, b)) in a.iter().zip(b).enumerate() {
            let bits = |e: &Estimate| numbers(e).iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            assert!(
                bits(a) == bits(b),
                "{what}: estimator {k} at {t} ns:\n{a:?}\n{b:?}"
            );
        }
    }
}

/// The formats that round nothing.
fn lossless() -> impl Iterator<Item = ExportFormat> {
    ExportFormat::all().filter(|f| !f.is_lossy())
}

/// The train of eight drive units on the point-mass plant, with a load change and faults of its sensors.
#[test]
fn a_train_survives_every_lossless_format_bit_for_bit() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("run");
    let changes = [
        ("physics.plant", "point-mass"),
        ("stop", "{after_s: 40}"),
        ("expect", "[]"),
        (
            "estimators",
            "{dffrls_aekf_robust: {lambda0: 0.98}, rail_fusion: {}, attitude: {}, mine: {is: dffrls_aekf}}",
        ),
        ("in_loop", "dffrls_aekf_robust"),
        (
            "events",
            "[{at_s: 20, load_mass_kg: 1500}, {from_s: 10, to_s: 13, sensor: imu, fault: stuck}, {from_s: 25, to_s: 28, sensor: wheel_speed, fault: \"off\"}]",
        ),
    ];
    let ours = run("minimal.yaml", &changes, &folder);
    assert!(ours.len() > 2000, "{} steps", ours.len());
    for format in lossless() {
        same_bits(&ours, &again(&folder, format), format.name());
    }
}

/// CAN rounds: stamps to 1 µs, specific force to 1e-5 m/s², torque to 1e-3 N·m, speed to 1e-5 m/s. The slope of a
/// filter that is stable is off by the order of 1e-5 / 9.81 rad times its gain, and the mass by that of 1e-3 N·m of
/// some 10; a gate that decides the other way shows as far more.
#[test]
fn can_is_off_by_the_steps_of_its_signals() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("run");
    let changes = [
        ("physics.plant", "point-mass"),
        ("stop", "{after_s: 40}"),
        ("expect", "[]"),
        (
            "estimators",
            "{dffrls_aekf_robust: {}, ekf_v_theta_biases: {}}",
        ),
    ];
    let ours = run("minimal.yaml", &changes, &folder);
    let theirs = again(&folder, ExportFormat::find("can").unwrap());
    assert_eq!(ours.len(), theirs.len());
    let (mut slope, mut mass) = (0.0f64, 0.0f64);
    for (a, b) in ours.values().zip(theirs.values()) {
        for (a, b) in a.iter().zip(b) {
            slope = slope.max((a.grade_rad.value - b.grade_rad.value).abs());
        }
        let kg = |e: &[Estimate]| e[0].total_mass_kg.value;
        mass = mass.max((kg(a) / kg(b) - 1.0).abs());
    }
    assert!(slope > 0.0 && slope < 1e-4, "slope: {slope} rad");
    assert!(mass > 0.0 && mass < 1e-3, "mass: {mass}");
}

#[test]
fn what_cannot_be_exported_says_why() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("run");
    let changes = [
        ("physics.plant", "point-mass"),
        ("stop", "{after_s: 1}"),
        ("expect", "[]"),
    ];
    run("minimal.yaml", &changes, &folder);
    let told = |out: &Path| {
        export(&folder, ExportFormat::find("csv").unwrap(), out, None)
            .unwrap_err()
            .to_string()
    };
    let out = dir.path().join("full");
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("x"), "x").unwrap();
    assert!(
        told(&out).contains("this folder is not empty"),
        "{}",
        told(&out)
    );
    std::fs::write(folder.join(SAMPLES), "x").unwrap();
    let damaged = told(&dir.path().join("new"));
    assert!(damaged.contains("check sum"), "{damaged}");
    std::fs::remove_file(folder.join(SAMPLES)).unwrap();
    let missing = told(&dir.path().join("new"));
    assert!(missing.contains("--keep-samples"), "{missing}");
    assert!(!dir.path().join("new").exists());
}
