//! Speed of a run, as multiples of real time, and the parts of a step's time. `cargo bench -p monorig-sim --bench
//! speed`
//!
//! Every figure is the best of several rounds in one process. Words after `--` choose the rows whose names hold one of
//! them, so that two builds can be run in turns: compare figures of such runs with each other, not across machines.

use monorig_estimators::api::signals::{Command, Measurements};
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::run::run;
use monorig_sim::config::scenario::Scenario;
use monorig_sim::plant::Plant;
use monorig_sim::plant::point_mass::PointMass;
use monorig_sim::plant::train::body_state::Wrench;
use monorig_sim::rail::Cursor;
use monorig_sim::testing::{Cruise, asset_track, options, scenario, torque, train, world};
use std::hint::black_box;
use std::time::Instant;

const ROUNDS: usize = 5;
const DT_S: f64 = 4e-3;

/// A scenario with one estimator, whatever others it compares.
fn one_estimator(name: &str, set: &[(&str, &str)]) -> Scenario {
    let alone = [
        ("expect", "[]"),
        ("published", "[]"),
        ("known_failures", "[]"),
        ("estimators", "{dffrls_aekf_robust: {}}"),
    ];
    scenario(name, &[&alone, set].concat())
}

/// Best real-time factor of a scenario without recording.
fn factor(name: &str, set: &[(&str, &str)]) -> f64 {
    let mut best: f64 = 0.0;
    for _ in 0..ROUNDS {
        let mut rig =
            Simulation::build(one_estimator(name, set), &Registry::default(), 1).expect("rig");
        let start = Instant::now();
        let done = run(&mut rig, &mut [], &mut |_| true).expect("run");
        best = best.max(done.simulated_s / start.elapsed().as_secs_f64());
    }
    best
}

/// Least time of a call, µs.
fn micros(n: usize, mut f: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        for _ in 0..n {
            f();
        }
        best = best.min(start.elapsed().as_secs_f64() / n as f64 * 1e6);
    }
    best
}

/// Prints the parts of a step's time, µs: the loaded train on the winding track.
fn parts() {
    let train = train("dx80_176y");
    let rail = asset_track("winding");
    let mut world = world(&train, &rail, 60.0, 0.0);
    let mut cruise = Cruise::new(&train, 1.0);
    for _ in 0..10_000 {
        let c = cruise.command(&train, &world, DT_S);
        world.step(&c, DT_S).expect("step");
    }
    let c: Command = cruise.command(&train, &world, DT_S);
    let mut dynamics = world.dynamics().clone();
    let states = world.bodies().to_vec();
    let mut out = vec![Wrench::ZERO; states.len()];
    let forces = micros(20_000, || {
        black_box(dynamics.forces(&rail, &states, &c, DT_S, &mut out));
    });
    let stations: Vec<_> = train
        .bodies
        .iter()
        .zip(&states)
        .flat_map(|(b, s)| b.stations.iter().map(|st| s.p + s.r.column(0) * st.x_m))
        .map(|p| (p, rail.nearest(&p)))
        .collect();
    let mut cursors: Vec<Cursor> = stations.iter().map(|s| s.1).collect();
    let projection = micros(20_000, || {
        for ((p, _), cursor) in stations.iter().zip(&mut cursors) {
            black_box(rail.track(p, cursor));
        }
    });
    let step = micros(10_000, || {
        world.step(&c, DT_S).expect("step");
    });
    let s = scenario("winding", &[]);
    let mut rig = Simulation::build(s, &Registry::default(), 1).expect("rig");
    let mut z = Measurements::default();
    let mut truth = world.truth().clone();
    let sensors = micros(20_000, || {
        truth.t_s += DT_S;
        z = Measurements::default();
        rig.sensors.measure(&truth, &mut z).expect("measure");
    });
    println!("where a step of the loaded train goes, µs:");
    println!("  whole step of the plant                 {step:6.2}");
    println!("  of it forces between rail and train     {forces:6.2}");
    println!("  of that projection onto the rail        {projection:6.2}");
    println!(
        "  of it motion of the bodies and truth    {:6.2}",
        step - forces
    );
    println!("  sensors                                 {sensors:6.2}");
}

fn point_mass_alone(dt: f64) -> f64 {
    let train = train("dx80_176y");
    let rail = asset_track("winding");
    let o = options(&train, 20.0, 0.5);
    let c = torque(&train, 10.0);
    let us = micros(20, || {
        let mut p = PointMass::new(train.clone(), rail.clone(), &o);
        for _ in 0..20_000 {
            p.step(&c, dt).expect("step");
        }
    }) / 20_000.0;
    dt / (us * 1e-6)
}

type Row = (&'static str, fn() -> f64);

const ROWS: [Row; 7] = [
    ("whole train, sensors, estimator, dt 4 ms", || {
        factor("liu2023_vehicle_test", &[])
    }),
    ("the same on the winding track", || factor("winding", &[])),
    ("the same as the first, dt 1 ms", || {
        factor("liu2023_vehicle_test", &[("physics.dt_ms", "1")])
    }),
    ("one drive unit, dt 4 ms", || {
        factor("liu2023_section1", &[])
    }),
    ("point mass with sensors and estimator", || {
        let point = [("physics.plant", "point-mass"), ("physics.dt_ms", "2")];
        factor("liu2023_vehicle_test", &point)
    }),
    ("point mass alone, dt 10 ms", || point_mass_alone(10e-3)),
    ("point mass alone, dt 2 ms", || point_mass_alone(2e-3)),
];

fn main() {
    let words: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with('-'))
        .collect();
    let chosen = |name: &str| words.is_empty() || words.iter().any(|w| name.contains(w.as_str()));
    println!("multiples of real time, one core:");
    for (name, row) in ROWS {
        if chosen(name) {
            println!("  {name:42} {:9.0}", row());
        }
    }
    if chosen("parts") {
        parts();
    }
}
