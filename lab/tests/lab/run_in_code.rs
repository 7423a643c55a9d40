//! A run in code leaves a folder that commands take like that of `monorig run`.

#[path = "../../examples/scenario_in_code.rs"]
mod scenario_in_code;

use monorig_lab::reports::run::page;
use monorig_lab::verdicts::run_files::record;
use monorig_sim::record::manifest::Manifest;
use monorig_sim::{Registry, Simulation, StepFrame};
use std::path::Path;

#[test]
fn the_example_runs() {
    scenario_in_code::main().unwrap();
}

#[test]
fn a_report_is_made_of_a_run_in_code() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/minimal.yaml");
    let builder = Simulation::from_file(file).unwrap().stop_after_s(5.0);
    let mut simulation = builder.name("in_code").build(7).unwrap();
    let out = tempfile::tempdir().unwrap();
    let mut steps = 0;
    let mut count = |_: &StepFrame<'_>| steps += 1;
    let registry = Registry::default();
    let (summary, folder) =
        record(&mut simulation, &registry, out.path(), &mut [&mut count]).unwrap();
    assert_eq!(folder, out.path().join("in_code/7"));
    assert_eq!(summary.steps, steps);
    let manifest = Manifest::of_run(&folder).unwrap();
    for name in ["channels.parquet", "metrics.json"] {
        manifest.verify(&folder, name).unwrap();
    }
    let html = page(&folder, "").unwrap().to_html();
    assert!(html.contains("in_code, seed 7"));
}
