//! The loop of a controller: one pipeline named in code, samples as they come, a snapshot now and then. Nothing here
//! needs a heap or a file; on a board `main` is the entry point and `sensors` reads registers.
//!
//!     cargo run --release -p monorig-estimators --example bare_metal

use monorig_estimators::api::snapshot::MAX_SNAPSHOT_BYTES;
use monorig_estimators::supervised::liu_2023::dffrls_aekf_robust::{self, Params};
use monorig_estimators::{
    Command, Error, Estimator, Measurements, ParamError, Real, Runner, Sample, Time, Vehicle,
    VehicleData,
};

const STEP_NS: i64 = 5_000_000;
const DT: Real = 0.005;

/// Measurements of the board at step `k`: a train of 12 t starts and stops on a level rail.
fn sensors(k: i64) -> Measurements {
    let t = Time::from_ns(k * STEP_NS);
    let phase = 0.5 * k as Real * DT;
    let (speed, acceleration) = (1.0 + 0.5 * libm::sin(phase), 0.25 * libm::cos(phase));
    let force_n = 12_000.0 * (acceleration + 0.02 * 9.81);
    let mut z = Measurements::at(t);
    z.wheel_speed_mps[0] = Some(Sample { t, value: speed });
    z.motor_torque_nm[0] = Some(Sample {
        t,
        value: force_n * 0.17 / (20.0 * 0.9),
    });
    z.specific_force_mps2 = Some(Sample {
        t,
        value: [acceleration, 0.0, 9.81],
    });
    z
}

fn vehicle() -> Result<Vehicle, ParamError> {
    Vehicle::new(VehicleData {
        tare_kg: 4_000.0,
        wheel_radius_m: 0.17,
        gear_ratio: 20.0,
        efficiency: 0.9,
        running_resistance: 0.02,
        mass_range_kg: [4_000.0, 30_000.0],
        ..VehicleData::default()
    })
}

fn main() -> Result<(), Error> {
    let vehicle = vehicle().expect("the data sheet is right");
    let new = || {
        Runner::new(
            "dffrls_aekf_robust",
            dffrls_aekf_robust::new,
            &vehicle,
            &Params::default(),
        )
    };
    let mut estimator = new();
    let mut flash = [0; MAX_SNAPSHOT_BYTES];
    let mut used = 0;
    for k in 1..=12_000 {
        let estimate = estimator.step(&sensors(k), &Command::default(), DT)?;
        if k % 2_000 == 0 {
            used = estimator.snapshot(&mut flash).expect("there is room");
            let (mass, grade) = (estimate.total_mass_kg, estimate.grade_rad);
            println!(
                "{:4.0} s  mass {:6.0} kg ± {:4.0}  grade {:+.3}° ± {:.3}",
                estimate.t.s(),
                mass.value,
                mass.sd,
                grade.value.to_degrees(),
                grade.sd.to_degrees()
            );
        }
    }
    // After a power cycle: the same estimator, and on it goes.
    let mut restored = new();
    restored
        .restore(&flash[..used])
        .expect("same vehicle, same parameters");
    assert_eq!(
        restored.step(&sensors(12_001), &Command::default(), DT)?,
        estimator.step(&sensors(12_001), &Command::default(), DT)?
    );
    println!(
        "a snapshot takes {used} bytes, the estimator {}",
        size_of_val(&estimator)
    );
    Ok(())
}
