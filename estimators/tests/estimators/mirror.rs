//! Laws of symmetry: left is as right, and a vehicle that looks the other way goes the other way.

use crate::common::{Random, vehicle};
use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::signals::{Command, Estimate, Measurements, Sample};
use monorig_estimators::registry::{self, Kind, NAMES};
use monorig_estimators::{Real, Time};

const DT: Real = 0.01;
const G: Real = 9.81;

/// A minute of starts and stops, to both directions, on a rail with slopes, bends to both sides and a roll in them; one
/// wheel slips for a second, the gyro is silent for another, and there are blows. `change` sees what the instruments
/// read.
fn drive(name: &str, change: impl Fn(&mut Measurements)) -> Vec<Estimate> {
    let train = vehicle(4);
    let mut estimator = registry::build(name, &train, []).unwrap();
    let mut random = Random::new(23);
    let (mut v, mut s, mut pitch, mut roll): (Real, Real, Real, Real) = (0.0, 0.0, 0.0, 0.0);
    let mut seen = Vec::new();
    for k in 1..=6_000 {
        let t = DT * k as Real;
        let wanted = [0.0, 1.0, 0.0, -0.8][(t / 7.0) as usize % 4];
        let a = ((wanted - v) / 0.3).clamp(-0.3, 0.3);
        (v, s) = (v + a * DT, s + v * DT);
        let (bend, last) = (0.1 * (s / 3.0).sin(), [pitch, roll]);
        (pitch, roll) = (0.08 * (s / 4.0).sin(), 0.3 * bend);
        let (turn, nod, lean) = (bend * v, (pitch - last[0]) / DT, (roll - last[1]) / DT);
        let now = Time::from_s(t);
        let mut noisy = |value: Real, sd: Real| value + sd * random.normal();
        let blow = if k % 700 == 0 { 3.0 } else { 0.0 };
        let mut z = Measurements::at(now);
        z.specific_force_mps2 = Some(Sample {
            t: now,
            value: [
                noisy(a + G * pitch.sin() + blow, 0.007),
                noisy(v * turn + G * roll.sin() * pitch.cos() + blow, 0.007),
                noisy(G * roll.cos() * pitch.cos(), 0.007),
            ],
        });
        let silent = (30.0..31.0).contains(&t);
        z.angular_rate_radps = (!silent).then_some(Sample {
            t: now,
            value: [
                noisy(lean + turn * pitch.sin(), 4e-4),
                noisy(turn * roll.sin() - nod * roll.cos(), 4e-4),
                noisy(turn * roll.cos() + nod * roll.sin(), 4e-4),
            ],
        });
        let mass_kg = 15_000.0;
        let force = (mass_kg + train.rotating_mass_kg) * a
            + mass_kg * G * (pitch.sin() + v.signum() * train.running_resistance);
        let loss = if force * v >= 0.0 { 1.0 / 0.9 } else { 0.9 };
        for i in 0..4 {
            let slip = if i == 1 && (10.0..11.0).contains(&t) {
                0.3
            } else {
                0.0
            };
            let torque = force * loss * 0.17 / 20.0 / 4.0;
            let sample = |value| Some(Sample { t: now, value });
            z.wheel_speed_mps[i] = sample(noisy(v + slip, 0.005));
            z.motor_torque_nm[i] = sample(noisy(torque, 0.5));
        }
        change(&mut z);
        seen.push(estimator.step(&z, &Command::default(), DT).unwrap());
    }
    seen
}

fn negate(sample: &mut Option<Sample<[Real; 3]>>, axes: &[usize]) {
    for sample in sample.iter_mut() {
        axes.iter().for_each(|axis| sample.value[*axis] *= -1.0);
    }
}

/// In a mirror along the rail forces to the left, and rates of roll and yaw, have the other sign.
/// Every estimator that says what it is worth says the same, to the last bit.
#[test]
fn left_is_as_right() {
    for name in NAMES {
        if !registry::kind(name).is_some_and(Kind::has_validity_rule) {
            continue;
        }
        let mirrored = drive(name, |z| {
            negate(&mut z.specific_force_mps2, &[1]);
            negate(&mut z.angular_rate_radps, &[0, 2]);
        });
        assert_eq!(drive(name, |_| ()), mirrored, "{name}");
    }
}

/// An IMU that is turned by 180° on a vehicle whose wheels count backwards: the vehicle goes to the other side, down
/// where it went up. Speed and grade have the other sign, and the same standard deviations and marks.
#[test]
fn a_vehicle_that_looks_the_other_way_goes_the_other_way() {
    let turned = drive("attitude", |z| {
        negate(&mut z.specific_force_mps2, &[0, 1]);
        negate(&mut z.angular_rate_radps, &[0, 1]);
        let [wheels, torques] = [&mut z.wheel_speed_mps, &mut z.motor_torque_nm];
        for sample in wheels.iter_mut().chain(torques).flatten() {
            sample.value *= -1.0;
        }
    });
    for (e, turned) in drive("attitude", |_| ()).iter().zip(&turned) {
        for (value, turned) in [
            (e.grade_rad, turned.grade_rad),
            (e.effective_grade_rad, turned.effective_grade_rad),
            (e.speed_mps, turned.speed_mps),
        ] {
            assert_eq!(value.value, -turned.value, "{}", e.t.s());
            assert_eq!((value.sd, value.valid), (turned.sd, turned.valid));
        }
    }
}
