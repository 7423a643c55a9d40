//! Estimators outside of the program, by CAN frames: the same estimates, and what goes wrong on the way.

mod can;
mod firmware;
mod processes;
mod real_time;
mod same;
mod scenarios;
mod speed;
mod udp;

use crate::common;
use monorig_estimators::api::signals::Estimate;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::run::{self, StepFrame};
use monorig_sim::closed_loop::{Outcome, Simulation};
use monorig_sim::config::scenario::Scenario;
use std::path::PathBuf;

const OURS: &str = env!("CARGO_BIN_EXE_monorig");

/// A scenario of the project with other estimators, `after_s` long.
fn scenario(name: &str, estimators: &str, after_s: &str) -> Scenario {
    let changes = [
        ("estimators", estimators),
        ("stop", &format!("{{after_s: {after_s}}}")),
        ("expect", "[]"),
        ("published", "[]"),
        ("known_failures", "[]"),
        ("in_loop", "null"),
        ("drive.controller", "{feedforward: none}"),
        // an estimator outside of the program is built for the data sheet, not for a run
        ("vehicle.exact.all", "a test"),
    ];
    let changes = changes.map(|(key, value)| (key.to_owned(), value.to_owned()));
    Scenario::load(&file(name), &changes).unwrap()
}

fn file(name: &str) -> PathBuf {
    common::project()
        .join("scenarios")
        .join(name)
        .canonicalize()
        .unwrap()
}

/// The estimator as an external one, started by ours.
fn ecu(name: &str, scenario: &str, signals: &str) -> String {
    let at = file(scenario);
    let at = at.display();
    let program = format!("[{OURS}, ecu, {name}, --scenario, {at}, --signals, {signals}]");
    format!("{{external: {{process: {program}, signals: {signals}}}}}")
}

fn registry() -> Registry {
    monorig_plugin::guards_libraries(Registry::default(), vec![OURS.into(), "serve-part".into()])
}

/// All numbers of an estimate.
fn numbers(e: &Estimate) -> Vec<f64> {
    let flag = |flag: bool| f64::from(u8::from(flag));
    let values = [
        e.total_mass_kg,
        e.grade_rad,
        e.effective_grade_rad,
        e.speed_mps,
    ];
    let mut all = vec![e.t.ns() as f64, e.innovation, e.nis];
    all.extend(values.iter().flat_map(|v| [v.value, v.sd, flag(v.valid)]));
    let levels = &e.protection;
    all.extend([
        levels.total_mass_kg,
        levels.grade_rad,
        levels.effective_grade_rad,
    ]);
    all.extend([e.flags.moving, e.flags.excited, e.flags.saturated].map(flag));
    all
}

/// The bits of all numbers of an estimate.
fn bits(e: &Estimate) -> Vec<u64> {
    numbers(e).iter().map(|x| x.to_bits()).collect()
}

/// The estimate of this name after a step.
fn estimate_of(frame: &StepFrame<'_>, name: &str) -> Estimate {
    let mut all = frame.estimators.iter();
    all.find(|e| e.name == name).unwrap().estimate
}

/// Steps that the estimator of this name refused.
fn refused(outcome: &Outcome, name: &str) -> Option<u64> {
    let mut all = outcome.refusals.iter();
    all.find(|r| r.0 == name).map(|r| r.1)
}

/// Runs the scenario; hands over the name and the estimate of each estimator after each step with samples.
fn watch(
    scenario: Scenario,
    registry: &Registry,
    see: &mut dyn FnMut(&StepFrame<'_>),
) -> Result<Outcome, monorig_sim::Error> {
    let mut simulation = Simulation::build(scenario, registry, 3)?;
    let mut watched = |frame: &StepFrame<'_>| {
        if frame.sampled {
            see(frame);
        }
    };
    run::run(&mut simulation, &mut [&mut watched], &mut |_| true)
}
