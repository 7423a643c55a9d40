//! Wrong units, signs and axes: nothing that rests on such an instrument is valid ten seconds after the vehicle first
//! moved, and nothing is marked without a fault.

use super::*;
use crate::api::signals::{Sample, Value};

type Fault = fn(&mut Measurements);

fn force(z: &mut Measurements, change: fn([Real; 3]) -> [Real; 3]) {
    if let Some(Sample { value, .. }) = &mut z.specific_force_mps2 {
        *value = change(*value);
    }
}

fn rate(z: &mut Measurements, change: fn([Real; 3]) -> [Real; 3]) {
    if let Some(Sample { value, .. }) = &mut z.angular_rate_radps {
        *value = change(*value);
    }
}

fn wheels(z: &mut Measurements, factor: Real) {
    for sample in z.wheel_speed_mps.iter_mut().flatten() {
        sample.value *= factor;
    }
}

const WHEELS: [(&str, Fault); 2] = [
    ("wheel speed in km/h", |z| wheels(z, 3.6)),
    ("wheels backwards", |z| wheels(z, -1.0)),
];

const ACCELEROMETER: [(&str, Fault); 4] = [
    ("accelerometer in g", |z| force(z, |f| f.map(|x| x / 9.81))),
    ("forward axis of the wrong sign", |z| {
        force(z, |[x, y, up]| [-x, y, up])
    }),
    ("forward and left swapped", |z| {
        force(z, |[x, y, up]| [y, x, up])
    }),
    ("forward and up swapped", |z| {
        force(z, |[x, y, up]| [up, y, x])
    }),
];

const GYRO: [(&str, Fault); 2] = [
    ("gyro in °/s", |z| rate(z, |w| w.map(|x| x.to_degrees()))),
    ("gyro of the wrong sign", |z| rate(z, |w| w.map(|x| -x))),
];

/// Starts from rest, then a ramp.
fn drive(name: &str, fault: Fault) -> Vec<Row> {
    let estimator = build(name, &vehicle(), []).unwrap();
    let tamper = |z: &mut Measurements, _: &mut Command| fault(z);
    World {
        grade: |s| 8f64.to_radians() * smooth((s - 2.0) / 6.0),
        seconds: 30.0,
        ..world(1)
    }
    .run(&mut Tampered { estimator, tamper })
}

/// Marks of mass and grade from ten seconds after the first motion on.
fn marks(name: &str, fault: Fault) -> usize {
    let rows = drive(name, fault);
    let late = rows.iter().filter(|row| row.t > 11.0);
    late.filter(|row| row.estimate.total_mass_kg.valid || row.estimate.grade_rad.valid)
        .count()
}

fn supervised() -> impl Iterator<Item = &'static str> {
    let has_rule = |name: &&str| kind(name).is_some_and(Kind::has_validity_rule);
    NAMES.iter().copied().filter(has_rule)
}

#[test]
fn wrong_wheels_and_accelerometers_end_validity_in_every_supervised_estimator() {
    for name in supervised() {
        for (what, fault) in WHEELS.into_iter().chain(ACCELEROMETER) {
            let count = marks(name, fault);
            assert_eq!(count, 0, "{name}, {what}");
        }
    }
}

/// The baselines are not valid with a wrong gyro. The others go on without it, and what they mark is right: within
/// three standard deviations, once they have had a second or two of a changing grade.
#[test]
fn what_is_marked_with_a_wrong_gyro_is_right() {
    for name in supervised() {
        for (what, fault) in GYRO {
            if kind(name) == Some(Kind::Baseline) {
                assert_eq!(marks(name, fault), 0, "{name}, {what}");
                continue;
            }
            let rows = drive(name, fault);
            let late = rows.iter().filter(|row| row.t > 12.5);
            let off = |value: &Value, truth: Real| {
                value.valid && (value.value - truth).abs() > 3.0 * value.sd
            };
            let wrong = late.filter(|row| {
                off(&row.estimate.grade_rad, row.theta)
                    || off(&row.estimate.total_mass_kg, row.mass)
            });
            assert_eq!(wrong.count(), 0, "{name}, {what}");
        }
    }
}

#[test]
fn right_units_keep_their_validity() {
    for name in supervised() {
        let count = marks(name, |_| ());
        assert!(count > 2_000, "{name}: {count}");
    }
}
