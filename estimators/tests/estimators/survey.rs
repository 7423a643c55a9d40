//! Laws of the attitude filter's results for the rail behind the IMU: the grade with a fixed lag, and the heading, each
//! with its standard deviation.

use crate::common::Random;
use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::params::Setting;
use monorig_estimators::api::signals::{Command, Measurements, Sample};
use monorig_estimators::registry::{self, AnyEstimator};
use monorig_estimators::{Real, Time, Vehicle, VehicleData};

const DT: Real = 0.005;
const G: Real = 9.81;
/// Distance of the IMU ahead of the middle of its unit, m.
const ARM_M: Real = 0.3;
const SECONDS: usize = 90;

fn vehicle() -> Vehicle {
    Vehicle::new(VehicleData {
        tare_kg: 9_000.0,
        drives: 8,
        wheel_radius_m: 0.17,
        gear_ratio: 19.0,
        running_resistance: 0.02,
        mass_range_kg: [4_500.0, 40_000.0],
        imu_arm_m: ARM_M,
        ..VehicleData::default()
    })
    .unwrap()
}

/// Crests and sags of 12 m radius and more, whose curvature changes its sign within a metre: grade by chainage, rad.
fn grade(s: Real) -> Real {
    let x = (s - 8.0).max(0.0);
    0.15 * (x / 2.0).sin() * (x / 9.0).cos()
}

/// Curvature of the plan by chainage, 1/m: bends of 5 m radius to both sides.
fn bend(s: Real) -> Real {
    0.2 * ((s - 10.0).max(0.0) / 6.0).sin()
}

/// Motion of a rigid unit on a line: the middle at `s` with speed `v`, and where it points.
#[derive(Clone, Copy)]
struct Unit {
    s: Real,
    v: Real,
    pitch: Real,
    /// About x, y, z of the body.
    rates: [Real; 3],
    heading: Real,
}

impl Unit {
    fn on(s: Real, v: Real, heading: Real, before: Real) -> Self {
        let (pitch, yaw) = (grade(s), v * bend(s));
        Self {
            s,
            v,
            pitch,
            rates: [yaw * pitch.sin(), -(pitch - before) / DT, yaw * pitch.cos()],
            heading,
        }
    }
}

/// An estimator's errors after each step: those of the grade at the IMU, of the lagged grade and of the heading, each
/// over its standard deviation and in rad.
fn drive(seed: u64, estimator: &mut AnyEstimator) -> Vec<[[Real; 2]; 3]> {
    let mut random = Random::new(seed);
    let bias = [0.00978 * random.normal(), 0.00978 * random.normal()];
    let noise = [6.94e-4 / DT.sqrt(), 4.072e-5 / DT.sqrt()];
    let place = |name: &str| {
        let mut all = estimator.internals().iter();
        all.position(|i| i.name == name).unwrap()
    };
    let [lagged, lagged_sd, heading, heading_sd] = [
        "lagged_grade_rad",
        "lagged_grade_sd_rad",
        "heading_rad",
        "heading_sd_rad",
    ]
    .map(place);
    let mut last = Unit::on(0.0, 0.0, 0.0, grade(0.0));
    let mut errors = Vec::new();
    for k in 1..=(SECONDS * 200) {
        let t_s = k as Real * DT;
        let v = (0.3 * (t_s - 2.0)).clamp(0.0, 1.0);
        let s = last.s + v * DT;
        let turned = last.heading + v * bend(s) * DT;
        let now = Unit::on(s, v, turned, last.pitch);
        let [p, q, r] = now.rates;
        let [_, q0, r0] = last.rates;
        let (a, turn, nod) = ((v - last.v) / DT, (r - r0) / DT, (q - q0) / DT);
        let mut noisy = |x: Real, sd: Real| x + sd * random.normal();
        let t = Time::from_s(t_s);
        let mut z = Measurements::at(t);
        let force = [
            a + G * now.pitch.sin() - ARM_M * (q * q + r * r) + bias[0],
            v * r + ARM_M * turn,
            -v * q + G * now.pitch.cos() - ARM_M * nod + bias[1],
        ];
        z.specific_force_mps2 = Some(Sample {
            t,
            value: force.map(|f| noisy(f, noise[0])),
        });
        z.angular_rate_radps = Some(Sample {
            t,
            value: [p, q, r].map(|rate| noisy(rate, noise[1])),
        });
        for wheel in z.wheel_speed_mps.iter_mut().take(8) {
            let value = noisy(v, 0.005);
            *wheel = Some(Sample { t, value });
        }
        last = now;
        let estimate = estimator.step(&z, &Command::default(), DT).unwrap();
        let mut values = vec![0.0; estimator.internals().len()];
        estimator.internal_values(&mut values);
        let turn = 2.0 * core::f64::consts::PI;
        let off = values[heading] - turned;
        let off = off - turn * (off / turn).round();
        let row = [
            [
                estimate.grade_rad.value - grade(s + ARM_M),
                estimate.grade_rad.sd,
            ],
            [values[lagged] - grade(s), values[lagged_sd]],
            [off, values[heading_sd]],
        ];
        if t_s > 5.0 {
            errors.push(row.map(|[error, sd]| [error / sd, error]));
        }
    }
    errors
}

fn rms(errors: &[[[Real; 2]; 3]], of: usize, unit: usize) -> Real {
    let squares = errors.iter().map(|row| row[of][unit] * row[of][unit]);
    (squares.sum::<Real>() / errors.len() as Real).sqrt()
}

/// One arm later the grade of a place needs no guess: on a rail that bends its error is a fraction of that of the grade
/// at the IMU, and its standard deviation is that of the error.
#[test]
fn with_a_lag_of_the_arm_nothing_is_guessed() {
    for name in ["attitude", "rail_fusion"] {
        let mut all = Vec::new();
        for seed in 1..=5 {
            // the IMU of this world is mounted exactly
            let settings = [("mount_sd_deg", Setting::Number(0.0))];
            let mut estimator = registry::build(name, &vehicle(), settings).unwrap();
            all.extend(drive(seed, &mut estimator));
        }
        let [at_imu, lagged] = [0, 1].map(|of| rms(&all, of, 1).to_degrees());
        println!(
            "{name}: at the IMU {at_imu:.4}°, lagged {lagged:.4}°, over sd {:.2} {:.2}",
            rms(&all, 0, 0),
            rms(&all, 1, 0)
        );
        assert!(lagged < 0.5 * at_imu, "{name}: {lagged}° of {at_imu}°");
        let normalised = rms(&all, 1, 0);
        assert!((0.3..1.4).contains(&normalised), "{name}: {normalised}");
    }
}

/// The heading of bends to both sides is known within its standard deviation, which is cautious: it lets errors of
/// scale add up.
#[test]
fn the_heading_is_within_its_standard_deviation() {
    let mut estimator = registry::build("attitude", &vehicle(), None).unwrap();
    let errors = drive(7, &mut estimator);
    let (normalised, off) = (rms(&errors, 2, 0), rms(&errors, 2, 1).to_degrees());
    println!("heading {off:.3}° off, over sd {normalised:.2}");
    assert!(off < 0.2 && normalised < 1.5, "{off}° {normalised}");
}
