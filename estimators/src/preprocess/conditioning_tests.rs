//! Tests of [`super`] and of the front end with it.

use super::*;
use crate::Time;
use crate::api::aid::Rejection;
use crate::api::signals::{Command, Measurements, Sample, VehicleData};
use crate::preprocess::front_end::{FrontEnd, Reading};
use crate::testing::Random;
use crate::testing::vehicles::{car, vehicle};

fn conditioning(params: ConditioningParams) -> Conditioning {
    Conditioning::new(&vehicle(), params)
}

const PERIOD_S: Real = 0.01;

#[test]
fn noise_in_use_is_never_below_what_is_told_nor_beyond_thirty_times_that() {
    let at = |learnt| LearntNoise {
        wheel_speed_mps: learnt,
        specific_force_mps2: learnt,
    };
    for (learnt, in_use) in [
        (None, 0.5),
        (Some(0.2), 0.5),
        (Some(2.0), 2.0),
        (Some(99.0), 15.0),
    ] {
        assert_eq!(at(learnt).wheel_speed(0.5), in_use);
        assert_eq!(at(learnt).specific_force(0.5), in_use);
    }
}

/// 0.05 m/s beyond what an acceleration of 3 m/s², on a road 12 m/s², makes of the time since the sample before.
#[test]
fn a_speed_that_no_wheel_can_jump_to_is_held_out_for_two_samples() {
    for (vehicle, most) in [(vehicle(), 3.0), (car(), 12.0)] {
        for period_s in [PERIOD_S, 0.25] {
            let possible = 0.05 + most * period_s;
            for (jump, passes) in [(0.98 * possible, true), (1.02 * possible, false)] {
                let mut conditioning = Conditioning::new(&vehicle, ConditioningParams::default());
                assert_eq!(conditioning.last_speed(), None);
                conditioning.speed(1.0, PERIOD_S, false);
                let speed = 1.0 - jump;
                let taken = conditioning.speed(speed, period_s, false);
                assert_eq!(taken, Some(speed).filter(|_| passes), "{most} {jump}");
                let last = if passes { speed } else { 1.0 };
                assert_eq!(conditioning.last_speed(), Some(last));
            }
        }
    }
    let mut conditioning = conditioning(ConditioningParams::default());
    conditioning.speed(1.0, PERIOD_S, false);
    let taken = [(); 3].map(|()| conditioning.speed(9.0, PERIOD_S, false));
    assert_eq!(taken, [None, None, Some(9.0)]);
}

#[test]
fn after_a_pause_or_without_the_hold_any_value_passes() {
    let off = ConditioningParams {
        outlier_hold: false,
        ..ConditioningParams::default()
    };
    for (params, period_s) in [(ConditioningParams::default(), 0.31), (off, PERIOD_S)] {
        let mut conditioning = conditioning(params);
        conditioning.speed(1.0, PERIOD_S, false);
        assert_eq!(conditioning.speed(9.0, period_s, false), Some(9.0));
        conditioning.axis(Axis::Pitch, 0.0, PERIOD_S, false);
        assert_eq!(conditioning.axis(Axis::Pitch, 5.0, period_s, false), 5.0);
    }
    // Not yet a pause: 0.05 + 3 · 0.29 m/s.
    let mut conditioning = conditioning(ConditioningParams::default());
    conditioning.speed(1.0, PERIOD_S, false);
    assert_eq!(conditioning.speed(9.0, 0.29, false), None);
}

#[test]
fn a_jump_of_an_axis_is_bridged_by_its_last_value() {
    for (axis, floor) in [
        (Axis::Forward, 1.0),
        (Axis::Left, 1.0),
        (Axis::Pitch, 0.2),
        (Axis::Yaw, 0.2),
    ] {
        for period_s in [PERIOD_S, 0.29] {
            let mut conditioning = conditioning(ConditioningParams::default());
            assert_eq!(conditioning.axis(axis, 0.5, PERIOD_S, false), 0.5);
            let small = 0.5 + 0.98 * floor;
            let mut other = conditioning;
            assert_eq!(other.axis(axis, small, period_s, false), small);
            assert_eq!(
                { conditioning }.axis(axis, 0.5 + 1.02 * floor, period_s, false),
                0.5
            );
            let large = 0.5 + 2.0 * floor;
            let passed = [(); 3].map(|()| conditioning.axis(axis, large, period_s, false));
            assert_eq!(passed, [0.5, 0.5, large], "{axis:?}");
        }
    }
}

/// Noise of 0.02 m/s and of 0.3 m/s² over ten seconds; what is learnt of it.
fn learnt(params: ConditioningParams, period_s: Real, standing: bool, axis: Axis) -> LearntNoise {
    let mut conditioning = conditioning(params);
    let mut random = Random::new(96);
    for _ in 0..(10.0 / period_s) as usize {
        conditioning.speed(1.0 + 0.02 * random.normal(), period_s, standing);
        conditioning.axis(axis, 0.3 * random.normal(), period_s, standing);
    }
    conditioning.learnt_noise()
}

#[test]
fn noise_is_learnt_in_motion_from_the_wheels_and_the_forward_axis() {
    let params = ConditioningParams::default();
    let found = learnt(params, PERIOD_S, false, Axis::Forward);
    let (speed, force) = (
        found.wheel_speed_mps.unwrap(),
        found.specific_force_mps2.unwrap(),
    );
    assert!((speed / 0.02 - 1.0).abs() < 0.1, "{speed}");
    assert!((force / 0.3 - 1.0).abs() < 0.15, "{force}");
    let none = LearntNoise::default();
    assert_eq!(learnt(params, PERIOD_S, true, Axis::Forward), none);
    assert_eq!(learnt(params, 0.31, false, Axis::Forward), none);
    let of_left = learnt(params, PERIOD_S, false, Axis::Left);
    assert_eq!(
        (
            of_left.wheel_speed_mps.is_some(),
            of_left.specific_force_mps2
        ),
        (true, None)
    );
    let told = ConditioningParams {
        noise: NoiseSource::Told,
        ..params
    };
    assert_eq!(learnt(told, PERIOD_S, false, Axis::Forward), none);
}

#[test]
fn the_biases_of_the_gyro_are_learnt_at_standstill() {
    let sheet = Vehicle::new(VehicleData {
        gyro_bias_sd_radps: Some(0.05),
        ..vehicle().data()
    })
    .unwrap();
    let own = ConditioningParams {
        gyro_bias_sd_radps: Some(0.03),
        ..ConditioningParams::default()
    };
    let off = ConditioningParams {
        gyro_calibration: false,
        ..ConditioningParams::default()
    };
    for (vehicle, params, prior_sd, learns) in [
        (&vehicle(), ConditioningParams::default(), 0.01, true),
        (&sheet, ConditioningParams::default(), 0.05, true),
        (&sheet, own, 0.03, true),
        (&vehicle(), off, 0.01, false),
    ] {
        let mut conditioning = Conditioning::new(vehicle, params);
        assert!((conditioning.gyro_bias_sd_radps() - prior_sd).abs() < 1e-12);
        assert_eq!(conditioning.gyro_bias_radps(), [0.0; 2]);
        for _ in 0..500 {
            conditioning.calibrate(true, Some([0.004, -0.007]), PERIOD_S, PERIOD_S);
        }
        let [pitch, yaw] = conditioning.gyro_bias_radps();
        let expected = if learns { [0.004, -0.007] } else { [0.0; 2] };
        assert!((pitch - expected[0]).abs() < 1e-4 && (yaw - expected[1]).abs() < 1e-4);
        assert_eq!(conditioning.gyro_bias_sd_radps() < 0.1 * prior_sd, learns);
    }
}

/// A vehicle that stands for two seconds and then drives, with gyro biases; bumps of wheel and accelerometer at 6 s.
fn drive(front: &mut FrontEnd) -> std::vec::Vec<Reading> {
    let mut random = Random::new(97);
    let mut all = std::vec::Vec::new();
    for k in 1..=800 {
        let t = Time::from_ns(10_000_000 * k);
        let mut z = Measurements::at(t);
        let bump = if k == 600 || k == 601 { 1.0 } else { 0.0 };
        let moving = if k > 300 {
            0.03 * (k - 300).min(100) as Real
        } else {
            0.0
        };
        for place in z.wheel_speed_mps.iter_mut() {
            let noise = if k > 300 {
                0.004 * random.normal()
            } else {
                0.0
            };
            let value = moving + noise + bump;
            *place = Some(Sample { t, value });
        }
        let noise = 0.1 * random.normal();
        z.specific_force_mps2 = Some(Sample {
            t,
            value: [9.0 * bump + noise, 9.0 * bump, 9.81],
        });
        z.angular_rate_radps = Some(Sample {
            t,
            value: [0.0, 0.006 + 2.0 * bump, 0.003 - 2.0 * bump],
        });
        all.push(front.read(&z, &Command::default(), 0.01).unwrap());
    }
    all
}

#[test]
fn the_front_end_holds_out_bumps_and_takes_the_biases_off() {
    let params = ConditioningParams::default();
    let with = drive(&mut FrontEnd::conditioned(&vehicle(), params));
    let without = drive(&mut FrontEnd::new(&vehicle()));
    let (bump, plain) = (&with[599], &without[599]);
    assert_eq!(bump.wheel_speed_fault, Some(Rejection::Gate));
    assert_eq!(
        (bump.new_speed_mps, bump.speed_mps),
        (None, with[598].speed_mps)
    );
    assert_eq!(
        (plain.wheel_speed_fault, plain.new_speed_mps),
        (None, plain.speed_mps)
    );
    assert!(plain.speed_mps.unwrap() > 3.8 && plain.specific_force_mps2.unwrap() > 8.0);
    assert!(bump.specific_force_mps2.unwrap() < 1.0);
    assert_eq!(bump.lateral_force_mps2, Some(0.0));
    // + when the grade grows: the axis of the instrument is to the left.
    for (reading, pitch, yaw, sd) in [
        (&with[700], 0.0, 0.0, 0.001),
        (&without[700], -0.006, 0.003, 0.0),
    ] {
        assert!((reading.pitch_rate_radps.unwrap() - pitch).abs() < 1e-4);
        assert!((reading.yaw_rate_radps.unwrap() - yaw).abs() < 1e-4);
        assert!(reading.gyro_bias_sd_radps <= sd);
    }
    assert!((bump.pitch_rate_radps.unwrap()).abs() < 1e-4);
    assert_eq!(without[799].noise, LearntNoise::default());
    let noise = with[799].noise;
    // The median of eight has 0.43 of the noise of one; the mean of the middle two 0.41.
    assert!(
        (noise.wheel_speed_mps.unwrap() / (0.004 * 0.42) - 1.0).abs() < 0.2,
        "{noise:?}"
    );
    assert!(
        (noise.specific_force_mps2.unwrap() / 0.1 - 1.0).abs() < 0.2,
        "{noise:?}"
    );
    // Learnt in the two seconds after the first of standing, and kept in motion.
    assert!(with[290].gyro_bias_sd_radps < 0.2 * with[90].gyro_bias_sd_radps);
    assert!(with[799].gyro_bias_sd_radps >= with[310].gyro_bias_sd_radps);
}
