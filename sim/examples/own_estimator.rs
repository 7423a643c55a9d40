//! An estimator of one's own beside ours: named in the registry, with parameters checked like ours.
//!
//!     cargo run --release -p monorig-sim --example own_estimator

use monorig_estimators::{Command, Error, Estimate, Estimator, Measurements, Value, Vehicle};
use monorig_sim::{Registry, Settings, Simulation};

monorig_estimators::params! {
    /// Parameters of [`ForceRatio`].
    ForceRatioParams { gain ["1/s"] = 0.5, 0.0 => 10.0, "Share of the difference taken over per second."; }
}

/// Mass by traction over specific force, whatever the grade: F = m (a_x + μ g), low-passed.
struct ForceRatio(Vehicle, ForceRatioParams, f64);

impl ForceRatio {
    fn new(vehicle: &Vehicle, params: &ForceRatioParams) -> Self {
        Self(*vehicle, *params, vehicle.first_mass_kg(None))
    }
}

impl Estimator for ForceRatio {
    fn step(&mut self, z: &Measurements, u: &Command, dt: f64) -> Result<Estimate, Error> {
        let Self(v, params, mass_kg) = self;
        let torque: f64 = u.motor_torque_nm.iter().sum();
        let force = torque * v.gear_ratio * v.efficiency / v.wheel_radius_m;
        let specific = z.specific_force_mps2.map_or(0.0, |s| s.value[0]);
        if specific > 0.5 && u.brake == 0.0 {
            let measured = force / (specific + 9.81 * v.running_resistance);
            *mass_kg += (params.gain * dt).min(1.0) * (measured - *mass_kg);
        }
        let mut estimate = Estimate::at(z.t);
        let (value, sd, valid) = (*mass_kg, 0.1 * *mass_kg, true);
        estimate.total_mass_kg = Value { value, sd, valid };
        Ok(estimate)
    }

    fn reset(&mut self) {
        *self = Self::new(&self.0, &self.1);
    }
}

/// Runs the smallest scenario with it, and prints both masses.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut registry = Registry::default();
    registry.estimator("force_ratio", ForceRatio::new)?;
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/minimal.yaml");
    let mut sim = Simulation::from_file(scenario)?
        .registry(&registry)
        .registered_estimator("force_ratio", Settings::default().set("gain", 0.2))
        .build(1)?;
    sim.run(&mut [])?;
    let truth_kg = sim.plant.truth().total_mass_kg;
    for estimator in &sim.estimators {
        let mass_kg = estimator.estimate.total_mass_kg.value;
        println!("{}: {mass_kg:.0} of {truth_kg:.0} kg", estimator.name);
        assert!((mass_kg / truth_kg - 1.0).abs() < 0.15);
    }
    Ok(())
}
