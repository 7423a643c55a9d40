//! A scenario built in code: run, watched, recorded and judged without a scenario file.
//!
//!     cargo run --release -p monorig-lab --example scenario_in_code

use monorig_lab::verdicts::run_files::record;
use monorig_sim::config::checked::{Fraction, NonNegative};
use monorig_sim::{
    DriveCycle, Event, Rail, Registry, Settings, Sheet, Simulation, StepFrame, Train,
};
use std::path::Path;

/// Builds the scenario, runs it, and prints how good the estimate was.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let assets = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../assets"));
    let rail = Rail::load(&assets.join("tracks/liu2023_section1.yaml"))?;
    let train = Train::load(&assets.join("trains/dx80_176y.yaml"))?;
    let mut sim = Simulation::builder(rail, train)
        .name("scenario_in_code")
        .sensors(Sheet::load(&assets.join("sensors/liu2023.yaml"))?)
        .load_mass_kg(10e3)
        .drive_cycle(DriveCycle::by_time(&[(0.0, 0.0), (5.0, 1.0)])?)
        .registered_estimator("dffrls_aekf_robust", Settings::default())
        .registered_estimator(
            "slow",
            Settings::of_type("dffrls_aekf_robust").set("lambda0", 0.995),
        )
        .in_loop("dffrls_aekf_robust")
        .event(Event::Brake {
            name: None,
            at_s: NonNegative::new(55.0),
            every_s: None,
            brake: Fraction::new(1.0),
        })
        .stop_after_s(60.0)
        .build(1)?;

    // An observer is a type of one's own, or a closure.
    let (mut squares, mut count) = (0.0, 0.0);
    let mut watch = |frame: &StepFrame<'_>| {
        let grade = frame.estimators[0].estimate.grade_rad;
        if grade.valid && frame.truth.t_s > 10.0 {
            squares += (grade.value - frame.truth.grade_at_imu_rad).powi(2);
            count += 1.0;
        }
    };
    let out = std::env::temp_dir().join("monorig-scenario-in-code");
    let (summary, folder) = record(&mut sim, &Registry::default(), &out, &mut [&mut watch])?;

    println!("{} steps", summary.steps);
    println!("report: monorig report {}", folder.display());
    let rmse_deg = f64::sqrt(squares / count).to_degrees();
    println!("root mean square error of the grade: {rmse_deg:.3}°");
    assert!(summary.finished && sim.plant.truth().speed_mps.abs() < 0.05);
    assert!(rmse_deg < 1.0);
    Ok(())
}
