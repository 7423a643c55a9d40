//! A real recording: 50 s of a robot on a level indoor floor (`tests/data/real/husky`, norlab-ulaval/BorealTC, CC0
//! 1.0). Nobody measured its slope; by gravity and gyro the robot pitched by 4.5° for some ten seconds of it.

use std::fs;
use std::path::Path;

use monorig_estimators::api::signals::{Command, Measurements, Sample, Vehicle, VehicleData};
use monorig_estimators::registry::build;
use monorig_estimators::{Estimate, Estimator, Time};

/// Estimators that use only accelerometer, gyro and wheels: the recording has no torque in N·m.
const NAMES: [&str; 4] = [
    "ekf_v_theta_biases",
    "complementary_filter",
    "attitude",
    "dffrls_aekf_robust",
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

/// Mean grade over five seconds that gravity shows, rad: from the mean specific force less the change of speed, of
/// which a robot at 0.2 m/s has none worth mentioning over so long a time.
fn by_gravity() -> Vec<f64> {
    let forces: Vec<f64> = table::<7>("imu_flooring_03.csv")
        .iter()
        .map(|row| row[4])
        .collect();
    let mean = |window: &[f64]| window.iter().sum::<f64>() / window.len() as f64;
    forces
        .chunks_exact(500)
        .map(|window| (mean(window) / 9.81).asin())
        .collect()
}

#[test]
fn slopes_are_those_that_gravity_shows_over_five_seconds() {
    for name in NAMES {
        let estimates = replay(name, |_| ());
        let (mut worst, mut count): (f64, usize) = (0.0, 0);
        for (window, expected) in estimates.chunks_exact(500).zip(by_gravity()).skip(1) {
            let marked: Vec<_> = window.iter().filter(|e| e.grade_rad.valid).collect();
            if marked.len() < 400 {
                continue;
            }
            count += 1;
            let of = |f: fn(&Estimate) -> f64| {
                marked.iter().map(|e| f(e)).sum::<f64>() / marked.len() as f64
            };
            let (mean, sd) = (of(|e| e.grade_rad.value), of(|e| e.grade_rad.sd));
            let off = (mean - expected).abs();
            worst = worst.max(off);
            assert!(
                off < 3.0 * sd,
                "{name}: {mean} rad, gravity {expected}, sd {sd}"
            );
        }
        println!(
            "{name}: {count} windows, at most {:.2}° off",
            worst.to_degrees()
        );
    }
}

#[test]
fn wrong_units_of_the_imu_end_validity_within_ten_seconds() {
    type Fault = fn(&mut Measurements);
    let faults: [(&str, Fault); 3] = [
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
