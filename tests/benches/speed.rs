//! How fast the rig is, as multiples of real time, and where a step's time goes. `cargo bench -p monorig-tests --bench speed`
//!
//! Every figure is the best of several rounds in one process: compare figures of one run with each other, not across
//! machines.

use monorig_estimators::api::signals::{Command, Measurements};
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::run::run;
use monorig_sim::config::scenario::Scenario;
use monorig_sim::plant::Plant;
use monorig_sim::plant::train::body_state::Wrench;
use monorig_sim::rail::Cursor;
use monorig_sim::record::Recorder;
use monorig_sim::record::Sink;
use monorig_sim::record::parquet::ParquetSink;
use monorig_tests::*;
use std::time::Instant;

const ROUNDS: usize = 5;

/// A scenario with one estimator, whatever others it compares.
fn one_estimator(name: &str, set: &[(&str, &str)]) -> Scenario {
    let alone = [("expect", "[]"), ("estimators", "{dffrls_aekf_robust: {}}")];
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

/// The same with everything recorded.
fn recorded(name: &str) -> f64 {
    let folder = std::env::temp_dir().join(format!("monorig-bench-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("folder");
    let mut best: f64 = 0.0;
    for _ in 0..ROUNDS {
        let mut rig =
            Simulation::build(one_estimator(name, &[]), &Registry::default(), 1).expect("rig");
        let mut parquet = ParquetSink::create(folder.join("channels.parquet")).expect("parquet");
        let mut rerun = monorig_viz::RerunSink::file(folder.join("run.rrd"));
        let start = Instant::now();
        let sinks: Vec<Box<dyn Sink>> = vec![Box::new(&mut parquet), Box::new(&mut rerun)];
        let mut recorder = Recorder::new(sinks).every_s(monorig_viz::sink::CHUNK_S);
        let done = run(&mut rig, &mut [&mut recorder], &mut |_| true).expect("run");
        best = best.max(done.simulated_s / start.elapsed().as_secs_f64());
    }
    let _ = std::fs::remove_dir_all(&folder);
    best
}

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

fn parts() {
    let train = train("dx80_176y");
    let rail = asset_track("winding");
    let mut world = world(&train, &rail, 60.0, 0.0);
    let mut cruise = Cruise::new(&train, 1.0);
    for _ in 0..10_000 {
        let c = cruise.command(&train, &world, 2e-3);
        world.step(&c, 2e-3).expect("step");
    }
    let c: Command = cruise.command(&train, &world, 2e-3);
    let mut dynamics = world.dynamics().clone();
    let states = world.bodies().to_vec();
    let mut out = vec![Wrench::ZERO; states.len()];
    let forces = micros(20_000, || {
        std::hint::black_box(dynamics.forces(&rail, &states, &c, 2e-3, &mut out));
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
            std::hint::black_box(rail.track(p, cursor));
        }
    });
    let step = micros(10_000, || {
        world.step(&c, 2e-3).expect("step");
    });
    let s = scenario("winding", &[]);
    let mut rig = Simulation::build(s, &Registry::default(), 1).expect("rig");
    let mut z = Measurements::default();
    let mut truth = world.truth().clone();
    let sensors = micros(20_000, || {
        truth.t_s += 2e-3;
        z = Measurements::default();
        rig.sensors.measure(&truth, &mut z).expect("measure");
    });
    println!("where a step of the loaded train goes, µs:");
    println!("  whole step of the plant                 {step:6.2}");
    println!(
        "  of it forces between rail and train     {forces:6.2}   (projection onto the rail {projection:.2})"
    );
    println!(
        "  of it rapier and reading its bodies     {:6.2}",
        step - forces
    );
    println!("  sensors                                 {sensors:6.2}");
}

fn main() {
    println!("multiples of real time, one core:");
    let at2 = factor("liu2023_vehicle_test", &[]);
    println!("  whole train, sensors, estimator, dt 2 ms   {at2:9.0}");
    println!(
        "  the same on the winding track              {:9.0}",
        factor("winding", &[])
    );
    println!(
        "  the same, dt 1 ms                          {:9.0}",
        factor("liu2023_vehicle_test", &[("physics.dt_ms", "1")])
    );
    println!(
        "  one drive unit, dt 2 ms                    {:9.0}",
        factor("liu2023_section1", &[])
    );
    let point = [("physics.plant", "point-mass"), ("physics.dt_ms", "2")];
    println!(
        "  point mass with sensors and estimator      {:9.0}",
        factor("liu2023_vehicle_test", &point)
    );
    println!(
        "  point mass alone, dt 10 ms                 {:9.0}",
        point_mass_alone(10e-3)
    );
    println!(
        "  point mass alone, dt 2 ms                  {:9.0}",
        point_mass_alone(2e-3)
    );
    let on = recorded("liu2023_vehicle_test");
    println!(
        "  whole train, recorded to Parquet and Rerun {on:9.0}   ({:.0} % more time)",
        (at2 / on - 1.0) * 100.0
    );
    parts();
}

fn point_mass_alone(dt: f64) -> f64 {
    let train = train("dx80_176y");
    let rail = asset_track("winding");
    let o = options(&train, 20.0, 0.5);
    let c = torque(&train, 10.0);
    let us = micros(20, || {
        let mut p = monorig_sim::plant::point_mass::PointMass::new(train.clone(), rail.clone(), &o);
        for _ in 0..20_000 {
            p.step(&c, dt).expect("step");
        }
    }) / 20_000.0;
    dt / (us * 1e-6)
}
