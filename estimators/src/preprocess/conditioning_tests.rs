//! Tests of [`super`] and of the front end with it.

use super::*;
use crate::testing::Random;
use crate::testing::vehicles::vehicle;

fn conditioning(params: ConditioningParams) -> Conditioning {
    Conditioning::new(&vehicle(), params)
}

const PERIOD_S: Real = 0.01;

/// Noise learnt below the double of the parameter does not count: it contains the vehicle's own motion.
#[test]
fn noise_learnt_counts_from_the_double_of_what_is_told_to_thirty_times_that() {
    let at = |learnt| LearntNoise {
        wheel_speed_mps: learnt,
        specific_force_mps2: learnt,
    };
    for (learnt, in_use) in [
        (None, 0.5),
        (Some(0.2), 0.5),
        (Some(0.99), 0.5),
        (Some(1.01), 1.01),
        (Some(99.0), 15.0),
    ] {
        assert_eq!(at(learnt).wheel_speed(0.5), in_use);
        assert_eq!(at(learnt).specific_force(0.5), in_use);
    }
}

#[test]
fn a_jump_of_speed_is_held_out_where_the_hold_is_on() {
    for outlier_hold in [true, false] {
        let mut conditioning = conditioning(ConditioningParams {
            outlier_hold,
            ..ConditioningParams::default()
        });
        assert_eq!(conditioning.last_speed(), None);
        for _ in 0..100 {
            conditioning.speed(1.0, PERIOD_S, false);
        }
        assert_eq!(
            conditioning.last_speed(),
            Some(1.0).filter(|_| outlier_hold)
        );
        let taken = conditioning.speed(9.0, PERIOD_S, false);
        assert_eq!(taken, Some(9.0).filter(|_| !outlier_hold));
    }
}

/// Noise of 0.02 m/s and of 0.3 m/s² over ten seconds; what is learnt of it.
fn learnt(params: ConditioningParams, period_s: Real, standing: bool) -> LearntNoise {
    let mut conditioning = conditioning(params);
    let mut random = Random::new(96);
    for _ in 0..(10.0 / period_s) as usize {
        conditioning.speed(1.0 + 0.02 * random.normal(), period_s, standing);
        conditioning.force(0.3 * random.normal(), period_s, standing);
    }
    conditioning.learnt_noise()
}

#[test]
fn noise_is_learnt_in_motion() {
    let params = ConditioningParams::default();
    let found = learnt(params, PERIOD_S, false);
    let (speed, force) = (
        found.wheel_speed_mps.unwrap(),
        found.specific_force_mps2.unwrap(),
    );
    assert!((speed / 0.02 - 1.0).abs() < 0.1, "{speed}");
    assert!((force / 0.3 - 1.0).abs() < 0.15, "{force}");
    let none = LearntNoise::default();
    assert_eq!(learnt(params, PERIOD_S, true), none);
    assert_eq!(learnt(params, 0.31, false), none);
    let told = ConditioningParams {
        noise: NoiseSource::Told,
        ..params
    };
    assert_eq!(learnt(told, PERIOD_S, false), none);
}
