//! Tests of [`super`]: start, limits, dead reckoning.

use super::*;
use crate::testing::vehicles::vehicle;

/// Standard deviation of wheel speed, m/s.
const WHEEL_SD: Real = 0.005;

fn filter(params: GradeParams, adaptation: Adaptation) -> ForceBalanceEkf {
    filter_of(params, adaptation, WHEEL_SD)
}

fn filter_of(
    params: GradeParams,
    adaptation: Adaptation,
    wheel_speed_sd_mps: Real,
) -> ForceBalanceEkf {
    let open = Integrity {
        gate_sd: 1e9,
        nis_monitor: false,
        plausibility: false,
        ..Integrity::default()
    };
    ForceBalanceEkf::new(
        ForceBalance::new(&vehicle()),
        params,
        adaptation,
        &open,
        wheel_speed_sd_mps,
    )
}

const DRIVE: Drive = Drive {
    traction_n: 5e3,
    mass_kg: 1e4,
    resistance: 0.02,
};

#[test]
fn it_starts_from_the_grade_told_and_the_first_wheel_speed() {
    let params = GradeParams {
        grade0_deg: 10.0,
        grade0_sd_deg: 3.0,
        ..Default::default()
    };
    let mut filter = filter(params, Adaptation::None);
    let belief = *filter.belief();
    assert!((belief.x.y - 10f64.to_radians() as Real).abs() < 1e-12);
    assert!((belief.P.m22.sqrt() - Real::to_radians(3.0)).abs() < 1e-12);
    assert_eq!(filter.measurement_sd(), 0.005);
    assert_eq!(filter.innovation(), (0.0, 0.0));
    assert!(!filter.started());
    filter.update(0.7, false);
    assert!(filter.started());
    assert_eq!(filter.belief().x.x, 0.7);
    // The second is a measurement.
    let (before, r) = (*filter.belief(), 0.005 * 0.005);
    filter.update(0.72, false);
    let (y, nis) = filter.innovation();
    assert!((y - 0.02).abs() < 1e-12);
    assert!((nis - y * y / (before.P.m11 + r)).abs() < 1e-9);
    assert!(filter.belief().x.x < 0.72);
}

#[test]
fn without_a_force_balance_the_speed_is_open_and_the_slope_stays_as_uncertain() {
    let mut filter = filter(GradeParams::default(), Adaptation::None);
    filter.update(0.5, false);
    for _ in 0..20 {
        filter.predict(Some(DRIVE), 0.01);
    }
    let before = filter.belief().P;
    assert!(before.m12 != 0.0);
    filter.predict(None, 0.01);
    let after = filter.belief().P;
    assert_eq!((after.m12, after.m21, after.m22), (0.0, 0.0, before.m22));
    assert!((after.m11 - before.m11 - 0.01).abs() < 1e-12);
}

#[test]
fn dead_reckoning_widens_the_slope_by_three_degrees_in_a_second_and_at_most_to_the_steepest_grade()
{
    let mut filter = filter(GradeParams::default(), Adaptation::None);
    let before = filter.belief().P.m22;
    for _ in 0..100 {
        filter.drift(0.01);
    }
    assert!((filter.belief().P.m22 - before - 3e-3).abs() < 1e-9);
    for _ in 0..1_000 {
        filter.drift(1.0);
    }
    assert!((filter.belief().P.m22.sqrt() - MAX_GRADE_RAD).abs() < 1e-12);
}

#[test]
fn no_grade_is_steeper_than_the_limit_and_a_limit_is_told() {
    for sign in [1.0, -1.0] {
        let mut filter = filter(GradeParams::default(), Adaptation::None);
        filter.update(1.0, false);
        assert!(!filter.saturated());
        for k in 0..200 {
            filter.predict(Some(DRIVE), 0.01);
            filter.update(1.0 - sign * 0.2 * k as Real, false);
        }
        assert!(filter.saturated() && filter.clamped());
        assert_eq!(filter.belief().x.y, sign * MAX_GRADE_RAD);
    }
}

/// Wheel speeds without any noise: the adapted one goes to its limit, a hundredth of the variance in the parameters.
#[test]
fn the_adapted_noise_learns_only_when_told_to_and_a_limit_of_it_is_told() {
    for (adaptation, adapt, learns) in [
        (Adaptation::sage_husa(0.9), true, true),
        (Adaptation::sage_husa(0.9), false, false),
        (Adaptation::None, true, false),
    ] {
        let mut filter = filter(GradeParams::default(), adaptation);
        let hold = Drive {
            traction_n: 1e4 * 9.81 * 0.02,
            ..DRIVE
        };
        for _ in 0..5_000 {
            filter.predict(Some(hold), 0.01);
            filter.update(1.0, adapt);
        }
        let learnt = filter.measurement_sd() < 0.004;
        assert_eq!(learnt, learns, "{adaptation:?} {}", filter.measurement_sd());
        if let Adaptation::SageHusa { .. } = adaptation {
            assert_eq!(filter.saturated(), learns);
            assert!(!filter.clamped());
        }
    }
}

#[test]
fn the_steady_traction_is_weight_down_the_slope_and_resistance() {
    let params = GradeParams {
        grade0_deg: 30.0,
        ..Default::default()
    };
    let filter = filter(params, Adaptation::None);
    // 1e4 kg · g · (1/2 + 0.02 √3/2)
    let expected = 1e4 * 9.81 * (0.5 + 0.01 * Real::sqrt(3.0));
    let (traction_n, _) = filter.steady_traction_n(&DRIVE);
    assert!((traction_n - expected).abs() < 1e-6);
}

#[test]
fn noise_learnt_is_that_of_the_gate_and_of_a_filter_that_does_not_adapt() {
    let learnt = LearntNoise {
        wheel_speed_mps: Some(0.02),
        ..LearntNoise::default()
    };
    for (adaptation, in_use) in [
        (Adaptation::None, 0.02),
        (Adaptation::sage_husa(0.9), 0.005),
    ] {
        let mut filter = filter(GradeParams::default(), adaptation);
        assert!((filter.adapted_ratio() - 1.0).abs() < 1e-12);
        filter.learn_noise(&learnt);
        assert!((filter.measurement_sd() - in_use).abs() < 1e-12);
        assert!((filter.adapted_ratio() - in_use / 0.02).abs() < 1e-12);
        let before = *filter.belief();
        filter.started = true;
        let (judgement, _) = filter.update(0.1, false);
        assert_eq!(judgement.innovation.0, 0.1 - before.x.x);
        assert!((judgement.innovation.1 - before.P.m11 - 0.02 * 0.02).abs() < 1e-12);
    }
}

/// Five standard deviations; after half a second of nothing else the gate reopens, and the speed is as uncertain as the
/// innovation.
#[test]
fn a_wheel_speed_beyond_the_gate_changes_nothing_until_it_stays() {
    let balance = ForceBalance::new(&vehicle());
    let params = GradeParams::default();
    let integrity = Integrity::default();
    let mut filter = ForceBalanceEkf::new(balance, params, Adaptation::None, &integrity, WHEEL_SD);
    let hold = Drive {
        traction_n: 1e4 * 9.81 * 0.02,
        ..DRIVE
    };
    for _ in 0..200 {
        filter.predict(Some(hold), 0.01);
        filter.update(1.0, false);
    }
    let mut rejected = 0;
    loop {
        filter.predict(Some(hold), 0.01);
        let before = *filter.belief();
        let y = 1.5 - before.x.x;
        let (judgement, correction) = filter.update(1.5, false);
        assert!((filter.innovation().0 - 0.5).abs() < 0.01);
        if judgement.passage != Passage::Reject {
            // The innovation variance has grown by the square of the innovation.
            let S = before.P.m11 + y * y + 0.005 * 0.005;
            assert!((correction.unwrap().S.x / S - 1.0).abs() < 1e-9);
            break;
        }
        assert_eq!((*filter.belief(), correction), (before, None));
        rejected += 1;
    }
    assert!((48..=52).contains(&rejected), "{rejected}");
}
