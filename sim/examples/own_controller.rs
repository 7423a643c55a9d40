//! A controller of one's own: a proportional law with the torque that carries the estimated grade.
//!
//!     cargo run --release -p monorig-sim --example own_controller

use monorig_estimators::{Command, Vehicle};
use monorig_sim::config::scenario::ControllerSettings;
use monorig_sim::{Controller, ControllerSetup, Perception, Reference, Registry, Simulation};

monorig_estimators::params! {
    /// Parameters of [`Proportional`].
    ProportionalParams { gain ["1/s"] = 2.0, 0.0 => 100.0, "Acceleration asked per m/s of speed error."; }
}

/// a = gain (v_ref − v) + dv_ref/dt; force of all wheels F = m (a + g sin θ + μ g).
struct Proportional(Vehicle, ControllerSetup, ProportionalParams);

impl Controller for Proportional {
    fn control(&mut self, r: &Reference, p: &Perception, _dt_s: f64) -> Command {
        let Self(v, setup, params) = self;
        let accel = params.gain * (r.speed_mps - p.speed_mps) + r.accel_mps2;
        let slope = p.grade_rad.sin() + v.running_resistance * r.speed_mps.signum();
        let force = p.total_mass_kg * (accel + setup.gravity_mps2 * slope);
        let torque = force * v.wheel_radius_m / (v.gear_ratio * v.efficiency * v.drives as f64);
        let max = setup.motor_torque_max_nm;
        let mut command = r.command(); // clamp pressure and emergency brake as asked
        if r.emergency_brake == 0.0 {
            command.motor_torque_nm[..v.drives].fill(torque.clamp(-max, max));
        }
        command
    }
}

/// Runs the smallest scenario with it, and prints the speed at the end.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut registry = Registry::default();
    let new = |v: &Vehicle, setup: &ControllerSetup, p: &_| Proportional(*v, *setup, *p);
    registry.controller("proportional", new)?;
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/minimal.yaml");
    let mut sim = Simulation::from_file(scenario)?
        .registry(&registry)
        .registered_controller(ControllerSettings::of_kind("proportional").set("gain", 4.0))
        .in_loop("dffrls_aekf_robust")
        .build(1)?;
    sim.run(&mut [])?;
    let speed_mps = sim.plant.truth().speed_mps;
    println!("speed at the end: {speed_mps:.3} of 1 m/s");
    assert!((speed_mps - 1.0).abs() < 0.05);
    Ok(())
}
