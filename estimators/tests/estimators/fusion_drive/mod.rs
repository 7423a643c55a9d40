//! The drive of `tests/reference/fusion.py` on a rail: its train, the samples, and an estimator over them.

use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::mass_layout::{CarriedMass, MassLayout, SuspendedLoad};
use monorig_estimators::api::signals::{Command, Estimate, Measurements, Sample};
use monorig_estimators::registry;
use monorig_estimators::{Setting, Time, Vehicle, VehicleData};

use crate::reference::Table;

const DT: f64 = 0.01;

/// A recorded drive.
pub struct Drive {
    /// Its file of samples.
    pub input: &'static str,
}

/// The drive on a rail.
pub const RAIL: Drive = Drive {
    input: "fusion_input.csv",
};

/// The train of the oracles.
fn vehicle() -> Vehicle {
    let mut layout = MassLayout {
        load: SuspendedLoad {
            places_m: [4.0, 6.0],
            swinging_tare_kg: 1_000.0,
            hook_depth_m: 0.4,
            below_chains_m: 0.6,
            chain_m: 0.6,
            longitudinal_stiffness_npm: Some(3e6),
        },
        imu_depth_m: 0.5,
        load_share_of_resistance: 0.4,
        ..MassLayout::default()
    };
    let masses = [
        ([-0.4, 0.4], 2_000.0, 0.3),
        ([3.0, 7.0], 3_000.0, 0.5),
        ([9.0, 10.0], 3_000.0, 0.2),
    ];
    for (place, (places_m, mass_kg, depth_m)) in layout.masses.iter_mut().zip(masses) {
        *place = CarriedMass {
            places_m,
            mass_kg,
            depth_m,
        };
    }
    Vehicle::new(VehicleData {
        tare_kg: 9_000.0,
        drives: 2,
        wheel_radius_m: 0.17,
        gear_ratio: 19.0,
        efficiency: 0.95,
        rotating_mass_kg: 1_000.0,
        running_resistance: 0.02,
        mass_range_kg: [4_500.0, 29_000.0],
        tare_span_m: [-0.4, 10.0],
        load_span_m: [4.0, 6.0],
        imu_arm_m: 0.3,
        layout: Some(layout),
        ..VehicleData::default()
    })
    .unwrap()
}

/// Measurements and command of a row of a drive.
fn samples(row: &[f64]) -> (Measurements, Command) {
    let &[
        t,
        fx,
        fy,
        fz,
        p,
        q,
        r,
        torque1,
        torque2,
        speed1,
        speed2,
        brake,
    ] = row
    else {
        panic!("{row:?}");
    };
    let t = Time::from_s(t);
    let mut z = Measurements::at(t);
    z.specific_force_mps2 = Some(Sample {
        t,
        value: [fx, fy, fz],
    });
    z.angular_rate_radps = Some(Sample {
        t,
        value: [p, q, r],
    });
    let drives = [(torque1, speed1), (torque2, speed2)];
    for (k, (torque, speed)) in drives.into_iter().enumerate() {
        z.motor_torque_nm[k] = Some(Sample { t, value: torque });
        z.wheel_speed_mps[k] = Some(Sample { t, value: speed });
    }
    let u = Command {
        brake,
        ..Command::default()
    };
    (z, u)
}

/// Every tenth step of an estimator with these settings, as `row` has it, and its internals of these names.
pub fn drive(
    over: &Drive,
    name: &str,
    settings: &[(&'static str, Setting<'static>)],
    internals: &[&str],
    row: impl Fn(&Estimate) -> Vec<f64>,
) -> Vec<Vec<f64>> {
    // The validity rule widens standard deviations; it has laws of its own.
    let validity = ["nis_monitor", "plausibility"];
    let off = validity.map(|key| (key, Setting::Flag(false)));
    let settings = settings.iter().copied().chain(off);
    let settings = settings.chain([("lag_share", Setting::Number(0.0))]);
    let mut estimator = registry::build(name, &vehicle(), settings).unwrap();
    let place = |wanted: &&str| {
        let mut all = estimator.internals().iter();
        all.position(|i| i.name == *wanted).unwrap()
    };
    let places: Vec<usize> = internals.iter().map(place).collect();
    let mut rows = Vec::new();
    for (k, line) in Table::read(over.input).rows.iter().enumerate() {
        let (z, u) = samples(line);
        let estimate = estimator.step(&z, &u, DT).unwrap();
        if k % 10 == 9 {
            let mut values = [0.0; 32];
            estimator.internal_values(&mut values);
            let own = places.iter().map(|place| values[*place]);
            rows.push(row(&estimate).into_iter().chain(own).collect());
        }
    }
    rows
}
