//! Steps of a run, for tests that give them to estimators in two ways.

use monorig_estimators::api::signals::{Command, Estimate, Measurements};
use monorig_estimators::{Vehicle, registry};
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::{Simulation, StepFrame};
use monorig_sim::config::scenario::Scenario;
use std::path::{Path, PathBuf};

pub fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

pub fn scenario(name: &str) -> PathBuf {
    project().join("scenarios").join(name)
}

/// A scenario of so many seconds, ready to run.
pub fn simulation(name: &str, seconds: f64, seed: u64) -> Simulation {
    let seconds = seconds.to_string();
    let changes = [
        ("stop.after_s", &seconds[..]),
        ("expect", "[]"),
        ("known_failures", "[]"),
        // an exported estimator knows the data sheet, not what a run draws about it
        ("vehicle.exact.all", "a test"),
    ];
    let changes = changes.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let scenario = Scenario::load(&scenario(name), &changes).unwrap();
    Simulation::build(scenario, &Registry::default(), seed).unwrap()
}

/// Samples, command and time step of each step of a run, and its vehicle.
pub fn steps(name: &str, seconds: f64) -> (Vehicle, Vec<(Measurements, Command, f64)>) {
    let mut simulation = simulation(name, seconds, 1);
    let (mut steps, mut last) = (Vec::new(), 0.0);
    let mut keep = |f: &StepFrame<'_>| {
        if f.sampled {
            steps.push((*f.measurements, *f.command, f.truth.t_s - last));
            last = f.truth.t_s;
        }
    };
    monorig_sim::closed_loop::run(&mut simulation, &mut [&mut keep], &mut |_| true).unwrap();
    (simulation.vehicle, steps)
}

pub fn names() -> impl Iterator<Item = &'static str> {
    let all = registry::NAMES.iter().chain(registry::PRINTED_NAMES);
    all.copied()
}

pub fn bits(e: &Estimate) -> Vec<u64> {
    let values = [
        e.total_mass_kg,
        e.grade_rad,
        e.effective_grade_rad,
        e.speed_mps,
    ];
    let values = values
        .iter()
        .flat_map(|v| [v.value.to_bits(), v.sd.to_bits(), v.valid.into()]);
    let flags = [e.flags.moving, e.flags.excited, e.flags.saturated].map(u64::from);
    let rest = [e.innovation.to_bits(), e.nis.to_bits(), e.t.ns() as u64];
    let levels = &e.protection;
    let levels = [
        levels.total_mass_kg,
        levels.grade_rad,
        levels.effective_grade_rad,
    ];
    let levels = levels.map(f64::to_bits);
    values.chain(rest).chain(flags).chain(levels).collect()
}
