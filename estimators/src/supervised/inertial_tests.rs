//! Tests of [`super`]: the model, what makes a grade valid, and a long train on a ramp.

use super::*;
use crate::api::signals::VehicleData;
use crate::detect::validity::Integrity;
use crate::filters::forgetting::Forgetting;
use crate::supervised::curvature_rls::CurvatureParams;
use crate::testing::vehicles::vehicle;

const DT: Real = 0.01;

/// Supervisors without innovation gates.
fn open() -> Supervisors {
    Supervisors {
        grade_map: true,
        integrity: Integrity {
            innovation_gate: false,
            nis_monitor: false,
            plausibility: false,
            lag_share: 0.0,
            ..Integrity::default()
        },
        ..Supervisors::default()
    }
}

fn slope(vehicle: &Vehicle, params: InertialParams, fading: Option<Real>) -> CurvatureSlope {
    let told = CurvatureParams {
        jerk_sd_mps3: 100.0,
        curvature_sd_per_m: 1e-4,
        ..Default::default()
    };
    let curvature = Curvature::new(vehicle, told, Forgetting::None);
    CurvatureSlope::new(
        vehicle,
        params,
        curvature,
        SigmaParams::default(),
        fading,
        &open(),
    )
}

/// Signals of a steady speed on a grade.
fn steady(speed: Real, sine: Real) -> Reading {
    Reading {
        new_speed_mps: Some(speed),
        speed_mps: Some(speed),
        specific_force_mps2: Some(GRAVITY * sine),
        pitch_rate_radps: Some(0.0),
        yaw_rate_radps: Some(0.0),
        ..Reading::default()
    }
}

fn run(slope: &mut CurvatureSlope, seconds: Real, reading: &Reading) -> Estimate {
    let steps = (seconds / DT).round() as usize;
    (0..steps)
        .map(|_| slope.advance(reading, Time::default(), DT))
        .last()
        .unwrap()
}

/// v̇ = f − g sin θ, θ̇ = ρ v or the rate of the gyro; without an accelerometer any acceleration up to 1 m/s² or so.
#[test]
fn the_process_noise_is_that_of_what_carries_the_slope() {
    let params = InertialParams::default();
    let model = model(&params);
    let motion = |specific_force_mps2, turn, force_noise_mps2| Motion {
        specific_force_mps2,
        turn,
        force_noise_mps2,
    };
    for (u, q_v, q_theta) in [
        (
            motion(Some(1.0), SlopeRate::Curvature(0.1), 0.0),
            1e-6,
            5e-6,
        ),
        (motion(Some(1.0), SlopeRate::Gyro(0.1), 0.0), 1e-6, 1e-8),
        (motion(None, SlopeRate::Curvature(0.1), 0.0), 1.0, 5e-6),
        // White noise of f moves the speed by its part of the step; never below the parameter.
        (
            motion(Some(1.0), SlopeRate::Curvature(0.1), 0.3),
            0.3 * 0.3 * DT,
            5e-6,
        ),
        (
            motion(Some(1.0), SlopeRate::Curvature(0.1), 0.009),
            1e-6,
            5e-6,
        ),
    ] {
        let Q = model.Q(&u, DT);
        assert!((Q.m11 - q_v * DT).abs() < 1e-15 && (Q.m22 - q_theta * DT).abs() < 1e-15);
        assert_eq!(Q.m12, 0.0);
    }
}

#[test]
fn it_starts_from_the_grade_told_and_knows_no_mass_but_the_range() {
    let params = InertialParams {
        grade0_deg: 10.0,
        grade0_sd_deg: 3.0,
        ..Default::default()
    };
    let belief = prior(&params);
    assert!((belief.x.y - Real::to_radians(10.0)).abs() < 1e-12);
    assert!((belief.P.m22.sqrt() - Real::to_radians(3.0)).abs() < 1e-12);
    assert_eq!(belief.P.m11, 0.005 * 0.005);
    let mut slope = slope(&vehicle(), params, None);
    let first = run(&mut slope, DT, &steady(0.8, 0.0));
    // Uniform between 5 and 27 t.
    assert_eq!(first.total_mass_kg.value, 16_000.0);
    assert!((first.total_mass_kg.sd - 22_000.0 / Real::sqrt(12.0)).abs() < 1e-6);
    assert!(!first.total_mass_kg.valid);
    // The first wheel speed is the speed at the start, not a surprise.
    assert_eq!(first.innovation, 0.0);
}

#[test]
fn a_grade_is_valid_with_accelerometer_and_wheels_once_it_is_found() {
    let mut filter = slope(&vehicle(), InertialParams::default(), None);
    assert!(!run(&mut filter, DT, &steady(0.8, 0.1)).grade_rad.valid); // 5° at the start
    let found = run(&mut filter, 20.0, &steady(0.8, 0.1));
    assert!(found.grade_rad.valid && found.effective_grade_rad.valid && found.speed_mps.valid);
    assert!((found.grade_rad.value.sin() - 0.1).abs() < 1e-3);
    let full = steady(0.8, 0.1);
    let blind = Reading {
        specific_force_mps2: None,
        ..full
    };
    let slipping = Reading {
        speed_mps: None,
        new_speed_mps: None,
        ..full
    };
    for lacking in [blind, slipping] {
        let mut filter = filter;
        assert!(!run(&mut filter, DT, &lacking).grade_rad.valid);
    }
    for (speed, moving) in [(0.04, false), (0.06, true), (-0.06, true)] {
        let mut filter = filter;
        assert_eq!(
            run(&mut filter, DT, &steady(speed, 0.1)).flags.moving,
            moving
        );
    }
}

#[test]
fn a_limit_of_the_slope_is_told_and_is_not_valid() {
    for sign in [1.0, -1.0] {
        let mut slope = slope(&vehicle(), InertialParams::default(), None);
        let impossible = steady(0.8, sign * 3.0);
        let found = run(&mut slope, 20.0, &impossible);
        assert!(found.flags.saturated && !found.grade_rad.valid);
        assert_eq!(found.effective_grade_rad.value, sign * MAX_GRADE_RAD);
        let found = run(&mut slope, 60.0, &steady(0.8, 0.1));
        assert!(!found.flags.saturated && found.grade_rad.valid);
    }
}

/// Signals without noise: the adapted one goes to its limit, which is reported.
#[test]
fn a_limit_of_the_adapted_noise_is_told() {
    for (fading, saturated) in [(None, false), (Some(0.9), true)] {
        let mut slope = slope(&vehicle(), InertialParams::default(), fading);
        let found = run(&mut slope, 60.0, &steady(0.8, 0.1));
        assert_eq!(found.flags.saturated, saturated);
        let sd = slope.slope.noise.R().x.sqrt();
        assert!(
            (sd - if saturated { 0.0005 } else { 0.005 }).abs() < 1e-6,
            "{sd}"
        );
    }
}

#[test]
fn the_bias_is_in_the_standard_deviation() {
    let sd = |accel_bias_sd_mps2| {
        let params = InertialParams {
            accel_bias_sd_mps2: Some(accel_bias_sd_mps2),
            ..Default::default()
        };
        run(
            &mut slope(&vehicle(), params, None),
            20.0,
            &steady(0.8, 0.5),
        )
        .grade_rad
        .sd
    };
    let (none, some) = (sd(0.0), sd(0.2));
    // g sin θ is off by 0.2 m/s², θ by that over g cos θ.
    let bias = 0.2 / (GRAVITY * Real::cos(0.5f64.asin() as Real));
    assert!(((some * some - none * none).sqrt() / bias - 1.0).abs() < 1e-3);
}

/// sin θ grows by 1 % a metre. The unit of the IMU is ahead of the middle of all masses by 7.67 m at 15 t, 9 m at 5 t,
/// 7.37 m at 27 t.
#[test]
fn a_long_train_on_a_ramp() {
    let long = Vehicle::new(VehicleData {
        tare_span_m: [0.0, 18.0],
        load_span_m: [5.0, 9.0],
        imu_arm_m: 1.0,
        ..vehicle().data()
    })
    .unwrap();
    let per_m = 0.01;
    let params = InertialParams {
        gyro: true,
        ..Default::default()
    };
    let mut slope = slope(&long, params, None);
    let mut found = Estimate::default();
    let mut place_m = 0.0;
    for _ in 0..4_000 {
        place_m += DT;
        let sine: Real = per_m * place_m;
        let reading = Reading {
            pitch_rate_radps: Some(per_m / sine.asin().cos()),
            ..steady(1.0, sine)
        };
        found = slope.advance(&reading, Time::default(), DT);
    }
    let middle_m = |kg: Real| (5_000.0 * 9.0 + (kg - 5_000.0) * 7.0) / kg;
    let sine = per_m * place_m;
    let [imu, effective] = [found.grade_rad, found.effective_grade_rad];
    assert!(
        (imu.value.sin() - sine - per_m * 1.0).abs() < 3e-3,
        "{imu:?}"
    );
    let expected = sine - per_m * middle_m(16_000.0);
    assert!(
        (effective.value.sin() - expected).abs() < 3e-3,
        "{effective:?} {expected}"
    );
    // It has no mass: uniform between the effective grades of the lightest and the heaviest train.
    let spread = per_m * (middle_m(5_000.0) - middle_m(27_000.0)) / Real::sqrt(12.0);
    let doubt = (effective.sd * effective.sd - imu.sd * imu.sd).sqrt();
    assert!((doubt / spread - 1.0).abs() < 0.1, "{doubt} {spread}");
    // Where the accelerometer has left a gap the effective grade is less certain by what it may hide: 0.02 rad/m.
    let blind = Reading {
        specific_force_mps2: None,
        ..steady(1.0, sine)
    };
    let found = run(&mut slope, 3.0, &blind);
    let [imu, effective] = [found.grade_rad.sd, found.effective_grade_rad.sd];
    let doubt = (effective * effective - imu * imu).sqrt();
    assert!(
        (doubt / Real::hypot(0.06, spread) - 1.0).abs() < 0.1,
        "{doubt}"
    );
}

#[test]
fn what_became_of_wheel_speed_is_told() {
    let mut slope = slope(&vehicle(), InertialParams::default(), None);
    let mut status = [AidStatus::default()];
    run(&mut slope, 1.0, &steady(0.8, 0.1));
    slope.aid_status(&mut status);
    assert_eq!(status[0].outcome, crate::api::aid::AidOutcome::Fused);
    assert!(status[0].innovation_variance > 0.005 * 0.005);
    let P = slope.slope.filter.belief().P;
    let mut values = [0.0; 5];
    slope.internal_values(&mut values);
    assert_eq!(&values[3..], &[0.005, sqrt(P.m22)]);
    let stale = Reading {
        speed_mps: None,
        new_speed_mps: None,
        ..steady(0.8, 0.1)
    };
    run(&mut slope, DT, &stale);
    slope.aid_status(&mut status);
    assert_eq!(status[0].outcome, crate::api::aid::AidOutcome::Stale);
}

/// Innovation and its variance before any adaptation; beyond the gate nothing is changed, until it stays.
#[test]
fn a_wheel_speed_beyond_the_gate_changes_nothing_until_it_stays() {
    let told = CurvatureParams::default();
    let curvature = Curvature::new(&vehicle(), told, Forgetting::None);
    let supervision = Supervisors::default();
    let params = InertialParams::default();
    let mut filter = CurvatureSlope::new(
        &vehicle(),
        params,
        curvature,
        SigmaParams::default(),
        None,
        &supervision,
    );
    let learnt = LearntNoise {
        wheel_speed_mps: Some(0.02),
        ..LearntNoise::default()
    };
    let level = Reading {
        noise: learnt,
        ..steady(1.0, 0.0)
    };
    run(&mut filter, 5.0, &level);
    assert_eq!(
        (filter.unadapted_sd, filter.slope.noise.R().x.sqrt()),
        (0.02, 0.02)
    );
    let mut rejected = 0;
    loop {
        filter.predict(&level, DT);
        let before = *filter.slope.filter.belief();
        let y = 2.0 - before.x.x;
        filter.update(2.0);
        let (innovation, nis) = filter.last.unwrap();
        assert_eq!(innovation, y);
        let variance = before.P.m11 + 0.02 * 0.02;
        let status = filter.wheel_speed;
        if status.outcome == crate::api::aid::AidOutcome::Fused {
            assert!((status.innovation_variance / (variance + y * y) - 1.0).abs() < 1e-9);
            break;
        }
        assert!((nis * variance / (y * y) - 1.0).abs() < 1e-9);
        assert_eq!(*filter.slope.filter.belief(), before);
        rejected += 1;
    }
    assert!((48..=52).contains(&rejected), "{rejected}");
    assert_eq!(filter.conditioning(), Some(supervision.conditioning));
}
