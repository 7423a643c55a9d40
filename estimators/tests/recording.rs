//! A real recording: 50 s of a robot on a level indoor floor (`tests/data/real/husky`, norlab-ulaval/BorealTC, CC0 1.0). Nobody measured its slope, but
//! the floor is level within what a floor is.
#![allow(clippy::unwrap_used)] // a test's panic is its verdict

use std::fs;
use std::path::Path;

use monorig_estimators::api::signals::{Command, Measurements, Sample, Vehicle, VehicleData};
use monorig_estimators::registry::build;
use monorig_estimators::{Estimate, Estimator, Time};

/// What goes by accelerometer, gyro and wheels: the recording has no torque in N·m.
const NAMES: [&str; 6] = [
    "ekf_v_theta_biases",
    "complementary_filter",
    "dffrls_aukf_robust",
    "dffrls_aekf_inclination_robust",
    "imm_ekf_robust",
    "kinematic_stf_robust",
];

/// The robot as a vehicle of two drives, with an accelerometer that nobody calibrated.
fn robot() -> Vehicle {
    Vehicle::new(VehicleData {
        tare_kg: 50.0,
        drives: 2,
        wheel_radius_m: 0.165,
        mass_range_kg: [50.0, 130.0],
        accel_bias_sd_mps2: Some(0.2),
        gyro_bias_sd_radps: Some(0.03),
        ..VehicleData::default()
    })
    .unwrap()
}

fn table<const WIDTH: usize>(name: &str) -> Vec<[f64; WIDTH]> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/real/husky");
    let text = fs::read_to_string(folder.join(name)).unwrap();
    let row = |line: &str| -> [f64; WIDTH] {
        let numbers: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
        numbers.try_into().unwrap()
    };
    text.lines().skip(1).map(row).collect()
}

/// The estimates of every step at 100 Hz; `fault` may change what an estimator gets.
fn replay(name: &str, fault: impl Fn(&mut Measurements)) -> Vec<Estimate> {
    let mut estimator = build(name, &robot(), []).unwrap();
    let wheels = table::<5>("wheels_flooring_03.csv");
    let (mut next, mut estimates) = (0, Vec::new());
    for [time, wx, wy, wz, ax, ay, az] in table::<7>("imu_flooring_03.csv") {
        let t = Time::from_s(time + 1.0);
        let mut z = Measurements::at(t);
        z.specific_force_mps2 = Some(Sample {
            t,
            value: [ax, ay, az],
        });
        z.angular_rate_radps = Some(Sample {
            t,
            value: [wx, wy, wz],
        });
        while let Some([wheel_time, _, _, left, right]) = wheels.get(next)
            && *wheel_time <= time
        {
            for (place, speed) in z.wheel_speed_mps.iter_mut().zip([left, right]) {
                *place = Some(Sample { t, value: *speed });
            }
            next += 1;
        }
        fault(&mut z);
        let Ok(estimate) = estimator.step(&z, &Command::default(), 0.01) else {
            continue;
        };
        estimates.push(estimate);
    }
    assert!(estimates.len() > 4_500);
    estimates
}

fn valid(estimates: &[Estimate]) -> impl Iterator<Item = &Estimate> {
    estimates.iter().skip(1_000).filter(|e| e.grade_rad.valid)
}

#[test]
fn a_level_floor_is_level_within_three_standard_deviations() {
    for name in NAMES {
        let estimates = replay(name, |_| ());
        let count = valid(&estimates).count();
        let share = count as f64 / (estimates.len() - 1_000) as f64;
        let misleading = valid(&estimates)
            .filter(|e| e.grade_rad.value.abs() > (3.0 * e.grade_rad.sd).max(1f64.to_radians()))
            .count();
        let square: f64 = valid(&estimates).map(|e| e.grade_rad.value.powi(2)).sum();
        let rms = (square / count.max(1) as f64).sqrt().to_degrees();
        println!(
            "{name}: rms {rms:.2}° of valid samples, {share:.2} valid, {misleading} misleading"
        );
        // The textbook filter has no noise of vibration: it is shown, not judged.
        let judged = name != "ekf_v_theta_biases";
        assert!(
            !judged || misleading * 1000 <= count,
            "{name}: {misleading} of {count}"
        );
    }
}

#[test]
fn wrong_units_of_the_imu_end_validity_within_ten_seconds() {
    let faults: [(&str, fn(&mut Measurements)); 3] = [
        ("accelerometer in g", |z| {
            let sample = z.specific_force_mps2.as_mut().unwrap();
            sample.value = sample.value.map(|f| f / 9.81);
        }),
        ("vertical and forward axis swapped", |z| {
            z.specific_force_mps2.as_mut().unwrap().value.swap(0, 2);
        }),
        ("all signs of the accelerometer wrong", |z| {
            let sample = z.specific_force_mps2.as_mut().unwrap();
            sample.value = sample.value.map(|f| -f);
        }),
    ];
    for name in NAMES {
        for (what, fault) in faults {
            let estimates = replay(name, fault);
            assert_eq!(valid(&estimates).count(), 0, "{name}: {what}");
        }
    }
}
