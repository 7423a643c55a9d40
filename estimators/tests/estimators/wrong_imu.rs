//! Laws of an IMU that is not what was told: a gyro with a wrong sign, axis, unit or bias, samples that
//! come late, a speed that the accelerometer has carried away.

use std::collections::VecDeque;

use crate::common::{Crane, vehicle};
use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::signals::{Command, Estimate, Measurements};
use monorig_estimators::registry;

const DT: f64 = 0.01;

/// Rates about x, y and z, rad/s, and what a wrong gyro makes of them.
type Rates = [f64; 3];
type Fault = fn(Rates) -> Rates;
type Tamper = fn(&mut Measurements);

/// Estimators whose slope is that of the attitude filter on a rail.
const NAMES: [&str; 3] = ["attitude", "rail_fusion", "dffrls_aekf_robust"];

/// Stands for 4 s, then drives over hills of 0.1 rad; `change` sees time and samples, `see` the crane and the estimate.
fn drive(
    name: &str,
    seconds: f64,
    mut change: impl FnMut(f64, &mut Measurements),
    mut see: impl FnMut(&Crane, &Estimate),
) {
    let mut estimator = registry::build(name, &vehicle(4), []).unwrap();
    let mut crane = Crane::new(vehicle(4), 15_000.0, 7);
    for k in 0..(seconds / DT) as usize {
        let t = DT * k as f64;
        crane.grade_rad = 0.1 * (crane.chainage_m / 4.0).sin();
        let wanted = if t % 40.0 < 4.0 { 0.0 } else { 1.0 };
        let mut z = crane.step(wanted, DT);
        change(t, &mut z);
        let estimate = estimator.step(&z, &Command::default(), DT).unwrap();
        see(&crane, &estimate);
    }
}

/// Share of the valid slopes from `from_s` on that are more than three standard deviations off, and the share valid.
fn marks(
    name: &str,
    seconds: f64,
    from_s: f64,
    change: impl FnMut(f64, &mut Measurements),
) -> [f64; 2] {
    let (mut steps, mut valid, mut beyond) = (0.0, 0.0, 0.0);
    drive(name, seconds, change, |crane, estimate| {
        let grade = estimate.grade_rad;
        if crane.t_s < from_s {
            return;
        }
        steps += 1.0;
        if grade.valid {
            valid += 1.0;
            beyond += f64::from((grade.value - crane.grade_rad).abs() > 3.0 * grade.sd);
        }
    });
    [beyond / f64::max(valid, 1.0), valid / steps]
}

fn force(z: &mut Measurements, change: fn(Rates) -> Rates) {
    let sample = z.specific_force_mps2.as_mut().unwrap();
    sample.value = change(sample.value);
}

fn rates(z: &mut Measurements, change: impl Fn(Rates) -> Rates) {
    let sample = z.angular_rate_radps.as_mut().unwrap();
    sample.value = change(sample.value);
}

/// Once the hills have shown it, the slope is found without the gyro, and the marks are worth what they say.
#[test]
fn a_gyro_of_a_wrong_sign_axis_or_unit_is_left_out() {
    let faults: [(&str, Fault); 4] = [
        ("sign", |[p, q, r]| [-p, -q, -r]),
        ("axes", |[p, q, r]| [q, p, r]),
        ("unit", |rates| rates.map(|w| 57.3 * w)),
        ("dead", |[p, _, r]| [p, 0.0, r]),
    ];
    for name in NAMES {
        for (fault, change) in faults {
            let [beyond, valid] = marks(name, 100.0, 30.0, |_, z| rates(z, change));
            assert!(
                beyond < 0.01 && valid > 0.9,
                "{name}, {fault}: {beyond} of {valid}"
            );
        }
    }
}

/// A gyro that is right is never left out: the slope stays better than any without a gyro is.
#[test]
fn a_gyro_that_is_right_is_kept() {
    for name in NAMES {
        let mut worst: f64 = 0.0;
        drive(
            name,
            100.0,
            |_, _| (),
            |crane, estimate| {
                let off = (estimate.grade_rad.value - crane.grade_rad).abs();
                worst = worst.max(if crane.t_s > 10.0 { off } else { 0.0 });
            },
        );
        assert!(worst < 0.0015, "{name}: {worst}");
    }
}

/// An accelerometer that is wrong for a quarter of a minute, or wheels that are, do not cost the gyro: half a minute
/// later the slope is as good as with a gyro that nobody doubted.
#[test]
fn a_wrong_accelerometer_or_wrong_wheels_do_not_cost_the_gyro() {
    let faults: [(&str, Tamper); 3] = [
        ("accelerometer of the wrong sign", |z| {
            force(z, |[x, y, up]| [-x, -y, -up])
        }),
        ("accelerometer in g", |z| force(z, |f| f.map(|f| f / 9.81))),
        ("wheels in km/h", |z| {
            let wheels = z.wheel_speed_mps.iter_mut().flatten();
            wheels.for_each(|sample| sample.value *= 3.6);
        }),
    ];
    for name in NAMES {
        for (fault, change) in faults {
            let mut worst: f64 = 0.0;
            drive(
                name,
                120.0,
                |t, z| {
                    if (20.0..35.0).contains(&t) {
                        change(z);
                    }
                },
                |crane, estimate| {
                    let off = (estimate.grade_rad.value - crane.grade_rad).abs();
                    worst = worst.max(if crane.t_s > 65.0 { off } else { 0.0 });
                },
            );
            assert!(worst < 0.0015, "{name}, {fault}: {worst}");
        }
    }
}

/// 0.3 °/s where the sheet promises 0.5 °/h: the first standstill shows it, and the slope is as good as without a bias.
#[test]
fn a_standstill_shows_a_bias_that_the_sheet_does_not_allow() {
    let bias = [0.005, -0.005, 0.003];
    for name in NAMES {
        let mut worst: f64 = 0.0;
        drive(
            name,
            60.0,
            |_, z| rates(z, |[p, q, r]| [p + bias[0], q + bias[1], r + bias[2]]),
            |crane, estimate| {
                let off = (estimate.grade_rad.value - crane.grade_rad).abs();
                worst = worst.max(if crane.t_s > 10.0 { off } else { 0.0 });
            },
        );
        assert!(worst < 0.003, "{name}: {worst}");
    }
}

/// A body that rocks while it stands reads rates of both signs, and none of them is a bias.
#[test]
fn a_body_that_rocks_at_a_standstill_shows_no_bias() {
    for name in NAMES {
        for hz in [0.3, 0.7, 1.5] {
            let rock = |t: f64, z: &mut Measurements| {
                if t % 40.0 < 4.0 {
                    let rate = 0.02 * (std::f64::consts::TAU * hz * t).cos();
                    rates(z, |[p, q, r]| [p, q + rate, r]);
                }
            };
            let [beyond, valid] = marks(name, 100.0, 5.0, rock);
            assert!(
                beyond < 0.01 && valid > 0.95,
                "{name}, {hz} Hz: {beyond} of {valid}"
            );
        }
    }
}

/// Samples that are half a second old by their stamps: the grade of now is another where the rail bends.
#[test]
fn what_the_grade_moves_by_while_samples_are_under_way_is_in_the_standard_deviation() {
    let mut under_way = VecDeque::new();
    let late = |_: f64, z: &mut Measurements| {
        under_way.push_back(*z);
        let old = match under_way.len() > 50 {
            true => under_way.pop_front().unwrap(),
            false => Measurements::at(z.t),
        };
        *z = Measurements { t: z.t, ..old };
    };
    let [beyond, valid] = marks("attitude", 100.0, 10.0, late);
    assert!(beyond < 0.01 && valid > 0.9, "{beyond} of {valid}");
}

/// Switched on in motion on a climb, with an accelerometer that is wrong for its first seconds and carries the speed
/// away beyond the gate of every wheel. They agree and are slower than it while they drive, so it is the filter that is
/// wrong: two seconds later its speed is theirs.
#[test]
fn wheels_that_agree_bring_back_a_speed_that_was_carried_away() {
    for name in NAMES {
        let push = |t: f64, z: &mut Measurements| {
            if t < 29.0 {
                *z = Measurements::at(z.t);
            } else if t < 31.5 {
                z.specific_force_mps2.as_mut().unwrap().value[0] += 2.0 * f64::from(t > 30.0);
            }
        };
        let mut worst: f64 = 0.0;
        drive(name, 39.0, push, |crane, estimate| {
            let off = (estimate.speed_mps.value - crane.speed_mps).abs();
            worst = worst.max(if crane.t_s > 34.0 { off } else { 0.0 });
        });
        assert!(worst < 0.05, "{name}: {worst}");
    }
}
