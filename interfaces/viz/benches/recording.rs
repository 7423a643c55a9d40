//! Cost of recording as `monorig run` does it, on top of a run, and size of a recording. `cargo bench --workspace
//! --bench recording`
//!
//! Best of several rounds, with and without recording in turns.

use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::run::{Observer, run};
use monorig_sim::record::parquet::ParquetSink;
use monorig_sim::record::{BackgroundSink, Recorder, Sink};
use monorig_sim::testing::scenario;
use std::time::Instant;

const ROUNDS: usize = 5;

/// Seconds that a run takes with these observers.
fn seconds(name: &str, observers: &mut [&mut dyn Observer]) -> f64 {
    let set = [
        ("expect", "[]"),
        ("published", "[]"),
        ("known_failures", "[]"),
        ("estimators", "{dffrls_aekf_robust: {}}"),
    ];
    let mut rig =
        Simulation::build(scenario(name, &set), &Registry::default(), 1).expect("simulation");
    let start = Instant::now();
    run(&mut rig, observers, &mut |_| true).expect("run");
    start.elapsed().as_secs_f64()
}

fn main() {
    let folder = std::env::temp_dir().join(format!("monorig-bench-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("folder");
    let rrd = folder.join("run.rrd");
    for name in ["liu2023_vehicle_test", "winding"] {
        let (mut without, mut with): (f64, f64) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..ROUNDS {
            without = without.min(seconds(name, &mut []));
            let parquet = ParquetSink::create(folder.join("channels.parquet")).expect("parquet");
            let rerun = monorig_viz::RerunSink::file(rrd.clone()).thinned();
            let sinks: Vec<Box<dyn Sink>> = vec![
                Box::new(BackgroundSink::new(rerun)),
                Box::new(BackgroundSink::new(parquet)),
            ];
            let mut recorder = Recorder::new(sinks);
            with = with.min(seconds(name, &mut [&mut recorder]));
        }
        let bytes = std::fs::metadata(&rrd).map_or(0, |m| m.len());
        println!(
            "{name}: {without:.3} s, recorded {with:.3} s ({:.0} % more); run.rrd {:.1} MB",
            100.0 * (with / without - 1.0),
            bytes as f64 * 1e-6
        );
    }
    let _ = std::fs::remove_dir_all(&folder);
}
