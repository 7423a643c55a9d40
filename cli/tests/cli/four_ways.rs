//! One filter written in Rust and in C, and the one in C as an FMU: the same estimates, runs, verdicts and tuning. (The
//! one in Python: `interfaces/python/tests/test_own.py`.)

use crate::common;
use crate::common::{TestFolder, two_state, words};
use monorig_estimators::api::signals::Estimate;
use monorig_estimators::{Command, Error, Estimator, Measurements, Value, Vehicle};
use monorig_fmu::Fmi;
use monorig_lab::verdicts::measure::SummaryObserver;
use monorig_plugin::loads_libraries;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::{Simulation, StepFrame, run};
use monorig_sim::config::scenario::{Scenario, Settings};
use std::path::Path;

monorig_estimators::params! {
    /// Parameters of the filter.
    TwoStateParams {
        grade_noise ["rad/s^0.5"] = 0.02, 1e-6 => 1.0, "How fast the grade may change.";
    }
}

/// The filter of `examples/own_estimator_c/two_state.c`, line by line.
struct TwoState {
    vehicle: Vehicle,
    grade_noise: f64,
    v: f64,
    theta: f64,
    p00: f64,
    p01: f64,
    p11: f64,
    mass: f64,
    mass_variance: f64,
    accel: f64,
    slow_accel: f64,
    slow_force: f64,
    steady_theta: f64,
    steady_m: f64,
    seen: bool,
}

const G: f64 = 9.81;

impl TwoState {
    fn new(vehicle: &Vehicle, params: &TwoStateParams) -> Self {
        let [low, high] = vehicle.mass_range_kg;
        Self {
            vehicle: *vehicle,
            grade_noise: params.grade_noise,
            v: 0.0,
            theta: 0.0,
            p00: 0.01,
            p01: 0.0,
            p11: 0.03,
            mass: vehicle.mass_guess_kg.unwrap_or(0.5 * (low + high)),
            mass_variance: 1e8,
            accel: 0.0,
            slow_accel: 0.0,
            slow_force: 0.0,
            steady_theta: 0.0,
            steady_m: 0.0,
            seen: false,
        }
    }
}

impl Estimator for TwoState {
    fn step(&mut self, z: &Measurements, _: &Command, dt: f64) -> Result<Estimate, Error> {
        if !(dt > 0.0 && dt < 1.0) {
            return Err(Error::own("the time step is not in 0 to 1 s"));
        }
        let c = self.vehicle;
        let torques = z.motor_torque_nm.iter().take(c.drives).flatten();
        let force = torques.clone().fold(0.0, |sum, torque| {
            sum + torque.value * c.gear_ratio * c.efficiency / c.wheel_radius_m
        });
        let speeds = z.wheel_speed_mps.iter().take(c.drives).flatten();
        let count = speeds.clone().count() as f64;
        let wheels = speeds.fold(0.0, |sum, speed| sum + speed.value);
        if let Some(f) = z.specific_force_mps2 {
            self.accel = f.value[0];
        }

        let a = self.accel - G * self.theta.sin();
        let f = -dt * G * self.theta.cos();
        self.v += dt * a;
        self.p00 += 2.0 * f * self.p01 + f * f * self.p11 + 1e-4 * dt;
        self.p01 += f * self.p11;
        self.p11 += self.grade_noise * self.grade_noise * dt;
        let mut e = Estimate::at(z.t);
        if count > 0.0 {
            let y = wheels / count - self.v;
            let variance = self.p00 + 4e-4 / count;
            let (k0, k1) = (self.p00 / variance, self.p01 / variance);
            self.v += k0 * y;
            self.theta += k1 * y;
            self.p11 -= k1 * self.p01;
            self.p01 *= 1.0 - k0;
            self.p00 *= 1.0 - k0;
            (e.innovation, e.nis) = (y, y * y / variance);
            self.seen = true;
        }

        let (tare, load) = (c.tare_span_m, c.load_span_m);
        let length = tare[1].max(load[1]) - tare[0].min(load[0]);
        self.steady_m += self.v.abs() * dt;
        if (self.theta - self.steady_theta).abs() > 0.015 {
            (self.steady_theta, self.steady_m) = (self.theta, 0.0);
        }
        let steady = self.steady_m > length + 1.0;

        let moving = self.v.abs() > 0.05;
        let share = dt / (0.5 + dt);
        self.slow_accel += share * (self.accel - self.slow_accel);
        if torques.count() == c.drives {
            self.slow_force += share * (force - self.slow_force);
        }
        let h = self.slow_accel + G * c.running_resistance;
        let excited = moving && steady && h.abs() > 0.8;
        if excited {
            let (forget, noise) = (0.9995, 300.0 + 0.03 * self.slow_force.abs());
            let p = self.mass_variance;
            let k = p * h / (forget * noise * noise + h * p * h);
            let turning = c.rotating_mass_kg * (self.slow_accel - G * self.theta.sin());
            self.mass += k * (self.slow_force - turning - h * self.mass);
            self.mass_variance = ((p - k * h * p) / forget).min(1e8);
        }

        let value = |value, variance: f64, valid| Value {
            value,
            sd: variance.max(0.0).sqrt(),
            valid,
        };
        let valid = self.mass_variance.sqrt() < 0.05 * self.mass;
        e.total_mass_kg = value(self.mass, self.mass_variance, valid);
        e.grade_rad = value(self.theta, self.p11, self.seen);
        e.effective_grade_rad = value(self.theta, self.p11, self.seen && steady);
        e.speed_mps = value(self.v, self.p00, self.seen);
        (e.flags.moving, e.flags.excited) = (moving, excited);
        Ok(e)
    }

    fn reset(&mut self) {
        let grade_noise = self.grade_noise;
        *self = Self::new(&self.vehicle, &TwoStateParams { grade_noise });
    }
}

/// Bits of all estimates of a run, of the commands and of the speed; its summary and its verdict.
fn outcome(mine: &str, seed: u64, registry: &Registry) -> (Vec<u64>, String, bool) {
    let file = common::project().join("examples/own_estimator_c/climb.yaml");
    let changes = [("estimators.mine".to_owned(), mine.to_owned())];
    let scenario = Scenario::load(&file, &changes).unwrap();
    let mut simulation = Simulation::build(scenario, registry, seed).unwrap();
    let mut bits: Vec<u64> = Vec::new();
    let mut keep = |f: &StepFrame<'_>| {
        let e = &f.estimators[0].estimate;
        let all = [
            e.total_mass_kg,
            e.grade_rad,
            e.effective_grade_rad,
            e.speed_mps,
        ];
        let all = all.iter().flat_map(|v| [v.value, v.sd, v.valid.into()]);
        let torque = f.command.motor_torque_nm[0];
        let flags = [e.flags.moving, e.flags.excited].map(f64::from);
        let more = [e.innovation, e.nis, torque, f.truth.speed_mps];
        let all = all.chain(more).chain(flags);
        bits.extend(all.map(f64::to_bits));
    };
    let mut metrics = SummaryObserver::default();
    let done = run(&mut simulation, &mut [&mut keep, &mut metrics], &mut |_| {
        true
    })
    .unwrap();
    let summary = metrics.summary(&simulation.scenario, seed, &done);
    (bits, summary.to_json(), summary.verdict().held)
}

/// In the loop, over three seeds: every estimate and what follows from it.
#[test]
fn one_filter_is_the_same_in_rust_in_c_and_as_an_fmu() {
    let dir = TestFolder::new();
    if !two_state(&dir) {
        return;
    }
    let mut registry = loads_libraries(Registry::default());
    let new = |vehicle: &Vehicle, params: &TwoStateParams| TwoState::new(vehicle, params);
    registry.estimator("two_state_in_rust", new).unwrap();
    let library = dir.path("two_state.so");
    let mut ways = vec![("C", format!("library: {}", library.display()))];
    for (name, fmi) in [("FMI 2", Fmi::Two), ("FMI 3", Fmi::Three)] {
        let file = dir.path(&format!("{fmi:?}.fmu"));
        std::fs::write(&file, as_fmu(&library, fmi, &registry)).unwrap();
        ways.push((name, format!("fmu: {}", file.display())));
    }
    for seed in 1..=3 {
        let of = |way: &str| outcome(&format!("{{{way}, grade_noise: 0.03}}"), seed, &registry);
        let rust = of("is: two_state_in_rust");
        assert!(rust.2, "seed {seed}: {}", rust.1);
        for (name, way) in &ways {
            let other = of(way);
            assert!(other.0 == rust.0, "{name}, seed {seed}: the estimates");
            assert_eq!(
                (&other.1, other.2),
                (&rust.1, rust.2),
                "{name}, seed {seed}"
            );
        }
    }
}

/// The library as an FMU, for the vehicle of the example.
fn as_fmu(library: &Path, fmi: Fmi, registry: &Registry) -> Vec<u8> {
    let at = library.display().to_string();
    let settings = Settings::of_type("two_state").in_library(&at, library.to_owned());
    let scenario = common::project().join("scenarios/minimal.yaml");
    let package = monorig_fmu::estimator("two_state", &settings, registry, &scenario);
    let binary = monorig_fmu::library().unwrap();
    package.unwrap().bytes(fmi, &binary, &[]).unwrap()
}

/// A study tunes an FMU as it tunes a library: the same trials and the same winner, which a scenario takes over. A
/// range beyond that of the FMU, and a parameter that it has not, are errors.
#[test]
fn an_fmu_is_tuned_as_a_library_is() {
    let dir = TestFolder::new();
    if !two_state(&dir) {
        return;
    }
    let registry = loads_libraries(Registry::default());
    let fmu = as_fmu(&dir.path("two_state.so"), Fmi::Two, &registry);
    dir.write("two_state.fmu", &fmu);
    let climb = |part: &str| {
        let text = common::climb_in_c();
        let text = text.replace("library: ./two_state.so, grade_noise: 0.03", part);
        dir.write("climb.yaml", text.as_bytes());
    };
    climb("library: ./two_state.so");
    let study = |part: &str, range: &str| {
        let text = format!(
            "version: 1
why: The parameter of a filter.
estimator: mine
{part}
parameters: {{{range}}}
tuning: [{{scenario: climb.yaml, set: &beside {{drive.controller.feedforward: none, stop.after_s: 30}}, seeds: 1..2}}]
validation: [{{scenario: climb.yaml, set: *beside, seeds: 101..102}}]
objective: {{metrics: [{{metric: slope_rmse_deg, after_s: 10}}]}}
budget: 6
sensitivity: {{curve: 0}}
"
        );
        dir.write("study.yaml", text.as_bytes());
    };
    let range = "grade_noise: {from: 0.0005, to: 0.1, scale: log}";
    let tuned = ["library: ./two_state.so", "fmu: ./two_state.fmu"].map(|part| {
        study(part, range);
        let out = part.get(..3).unwrap();
        let (code, told, err) = dir.monorig(&["tune", "study.yaml", "--out", out]);
        assert_eq!(code, Some(0), "{told}{err}");
        let trials = dir.read(&format!("{out}/tune/study/trials.jsonl"));
        // without the line that says what they were made from
        let trials: Vec<String> = trials.lines().skip(1).map(str::to_owned).collect();
        let winner = dir.read(&format!("{out}/tune/study/winner.yaml"));
        let found = winner.lines().find(|l| l.contains("grade_noise:"));
        (trials, found.map(str::to_owned))
    });
    assert_eq!(tuned[0], tuned[1]);
    assert!(tuned[0].0.len() == 6 && tuned[0].1.is_some(), "{tuned:?}");
    climb("fmu: ./two_state.fmu, from: fmu/tune/study/winner.yaml");
    let (code, told, err) = dir.monorig(&["check", "climb.yaml"]);
    assert_eq!(code, Some(0), "{told}{err}");

    for (part, range, told) in [
        (
            "fmu: ./two_state.fmu",
            "grade_noise: {from: 0.1, to: 2}",
            ["study.yaml:5:", "2 is not a number in 0.000001…1"],
        ),
        (
            "fmu: ./two_state.fmu",
            "grade_nose: {from: 0.1, to: 0.2}",
            ["study.yaml:5:", "did you mean `grade_noise`"],
        ),
        ("fmu: ./none.fmu", range, ["study.yaml:4:", "none.fmu"]),
        (
            "fmu: ./two_state.fmu\nlibrary: ./two_state.so",
            range,
            ["study.yaml:4:", "not in both"],
        ),
        (
            "map: {grade: theta}",
            range,
            ["study.yaml:4:", "`map` needs `fmu`"],
        ),
        (
            "fmu: ./two_state.fmu\nmap: {grade: theta}",
            range,
            [
                "study.yaml:4:",
                "`theta` for grade, but the FMU has no such variable",
            ],
        ),
    ] {
        study(part, range);
        let refused = words(&dir.refused(&["tune", "study.yaml", "--out", "none"]));
        for part in told {
            assert!(refused.contains(part), "{part} is not in {refused}");
        }
    }
}
