//! Mass and grade from a recorded drive. The file has a header and one line a step: `time_s, wheel_speed_mps,
//! motor_torque_nm, specific_force_mps2` (the last along the train); an empty cell is no sample.
//!
//!     cargo run --release -p monorig-estimators --example offline_csv -- drive.csv
//!
//! Without a file it makes up a drive of a minute, writes it to `offline_csv.csv` in the temporary folder, and reads
//! that.

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use monorig_estimators::{
    Command, Estimator, Measurements, Real, Sample, Time, Vehicle, VehicleData, registry,
};

fn main() -> Result<(), Box<dyn Error>> {
    let file = match std::env::args().nth(1) {
        Some(file) => PathBuf::from(file),
        None => made_up()?,
    };
    let vehicle = Vehicle::new(VehicleData {
        tare_kg: 4_000.0,
        wheel_radius_m: 0.17,
        gear_ratio: 20.0,
        efficiency: 0.9,
        running_resistance: 0.02,
        mass_range_kg: [4_000.0, 30_000.0],
        ..VehicleData::default()
    })?;
    let settings = [
        ("mass_sd", 0.5.into()),
        ("acceleration", "specific_force".into()),
    ];
    let mut estimator = registry::build("dffrls_aekf_robust", &vehicle, settings)?;

    println!("time_s,mass_kg,mass_sd_kg,grade_deg,grade_sd_deg");
    let mut last: Option<Time> = None;
    let mut printed = 0.0;
    for line in std::fs::read_to_string(file)?.lines().skip(1) {
        let cell = |i: usize| {
            line.split(',')
                .nth(i)
                .and_then(|c| c.trim().parse::<Real>().ok())
        };
        let Some(time_s) = cell(0) else { continue };
        let t = Time::from_s(time_s);
        let sample = |i| cell(i).map(|value| Sample { t, value });
        let mut z = Measurements::at(t);
        z.wheel_speed_mps[0] = sample(1);
        z.motor_torque_nm[0] = sample(2);
        z.specific_force_mps2 = cell(3).map(|f| Sample {
            t,
            value: [f, 0.0, 9.81],
        });
        let dt = last.map_or(0.01, |last| t.since(last).min(1.0));
        last = Some(t);
        let estimate = estimator.step(&z, &Command::default(), dt)?;
        if time_s - printed >= 10.0 {
            printed = time_s;
            let (mass, grade) = (estimate.total_mass_kg, estimate.grade_rad);
            println!(
                "{time_s:.0},{:.0},{:.0},{:.3},{:.3}",
                mass.value,
                mass.sd,
                grade.value.to_degrees(),
                grade.sd.to_degrees()
            );
        }
    }
    Ok(())
}

/// A train of 15 t that speeds up and slows down on a rail whose grade turns between 4° and −4°.
fn made_up() -> Result<PathBuf, Box<dyn Error>> {
    let mut text = String::from("time_s,wheel_speed_mps,motor_torque_nm,specific_force_mps2\n");
    for k in 1..=6_000 {
        let t = 0.01 * f64::from(k);
        let theta = 4.0_f64.to_radians() * (0.1 * t).sin();
        let (speed, acceleration) = (1.0 + 0.5 * (0.5 * t).sin(), 0.25 * (0.5 * t).cos());
        let force_n = 15_000.0 * (acceleration + 9.81 * (theta.sin() + 0.02 * theta.cos()));
        let loss = if force_n > 0.0 { 0.9 } else { 1.0 / 0.9 };
        let torque = force_n * 0.17 / (20.0 * loss);
        writeln!(
            text,
            "{t:.3},{speed:.5},{torque:.4},{:.5}",
            acceleration + 9.81 * theta.sin()
        )?;
    }
    let file = Path::new(&std::env::temp_dir()).join("offline_csv.csv");
    std::fs::write(&file, text)?;
    Ok(file)
}
