//! Natural modes of the DX80/176Y, braked and driving at 1 m/s, for loads from the empty hook to 20 t: the table in
//! `docs/src/physics.md`.
//!
//!     cargo run --release -p monorig-sim --example natural_modes

use monorig_estimators::Command;
use monorig_estimators::api::signals::MAX_DRIVES;
use monorig_sim::plant::{Plant, PlantOptions, rapier::World};
use monorig_sim::testing::modes::{Mode, natural_modes};
use monorig_sim::{Rail, Train};
use std::error::Error;
use std::path::Path;
use std::sync::Arc;

const DT: f64 = 1e-3;

fn main() -> Result<(), Box<dyn Error>> {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets");
    let rail = Arc::new(Rail::load(&assets.join("tracks/level_200m.yaml"))?);
    let train = Train::load(&assets.join("trains/dx80_176y.yaml"))?;
    println!(
        "load kg   state     period s   damping   load against beam: along, across, up; turn about the upright"
    );
    for load_kg in [0.0, 2e3, 5e3, 10e3, 15e3, 20e3] {
        let train = train.clone().with_load_mass(load_kg)?;
        for (state, brake, speed) in [("braked", 1.0, 0.0), ("driving", 0.0, 1.0)] {
            for mode in modes(&train, &rail, brake, speed)? {
                let Some(load) = train.load else { continue };
                let beam = train.supports(load)[0];
                let d = mode.shape[load] - mode.shape[beam];
                let turn = mode.turns[load].z;
                if d.norm().max(turn.abs()) > 0.1 {
                    println!(
                        "{load_kg:7}   {state:8} {:9.3} {:9.4}   {:6.2} {:6.2} {:6.2} {turn:6.2}",
                        mode.period_s, mode.damping_ratio, d.x, d.y, d.z
                    );
                }
            }
        }
    }
    Ok(())
}

/// The modes after two seconds under a torque that about holds the speed.
fn modes(
    train: &Train,
    rail: &Arc<Rail>,
    brake: f64,
    speed_mps: f64,
) -> Result<Vec<Mode>, Box<dyn Error>> {
    let options = PlantOptions {
        front_m: 40.0,
        speed_mps,
        gravity_mps2: 9.81,
        ..PlantOptions::default()
    };
    let mut world = World::new(train.clone(), rail.clone(), &options)?;
    let drive = train.drives[0];
    let gain = drive.gear_ratio * drive.efficiency_drive / drive.wheel_radius_m;
    let rolling = train.nominal_running_resistance(train.total_mass_kg(), 9.81)
        * train.total_mass_kg()
        * 9.81;
    let torque = if speed_mps > 0.0 {
        rolling / gain / train.drives.len() as f64
    } else {
        0.0
    };
    let command = Command {
        motor_torque_nm: [torque; MAX_DRIVES],
        clamp_pressure_mpa: drive.clamp_mpa,
        brake,
    };
    for _ in 0..2000 {
        world.step(&command, DT)?;
    }
    Ok(natural_modes(
        world.dynamics(),
        rail,
        world.bodies(),
        &command,
        DT,
    ))
}
