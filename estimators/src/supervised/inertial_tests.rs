//! Tests of [`super`]: the model, what makes a grade valid, and the doubt of the effective grade.

use super::*;
use crate::filters::forgetting::Forgetting;
use crate::fusion::attitude::Attitude;
use crate::models::force_balance::ForceBalance;
use crate::supervised::curvature_rls::CurvatureParams;
use crate::testing::steps;
use crate::testing::vehicles::vehicle;

const DT: Real = 0.01;
const WHEEL_SD: Real = 0.005;

/// Without innovation gate and with the curvature known to be 0.
fn slope(params: InertialParams, fading: Option<Real>) -> CurvatureSlope {
    let open = Integrity {
        gate_sd: 1e9,
        ..Integrity::default()
    };
    let told = CurvatureParams {
        jerk_sd_mps3: 100.0,
        curvature0_sd_per_m: 1e-4,
        ..Default::default()
    };
    let curvature = Curvature::new(&vehicle(), told, Forgetting::None);
    let sigma = SigmaParams::default();
    CurvatureSlope::new(
        &vehicle(),
        params,
        curvature,
        sigma,
        fading,
        &open,
        WHEEL_SD,
    )
}

/// Signals of a steady speed on a grade.
fn steady(speed: Real, sine: Real) -> Reading {
    Reading {
        new_speed_mps: Some(speed),
        speed_mps: Some(speed),
        specific_force_mps2: Some(GRAVITY * sine),
        ..Reading::default()
    }
}

/// Knowledge of the core beside the reading: grade at the IMU less the effective one (as sines) with its standard
/// deviation, bias of the accelerometer with its own.
#[derive(Default)]
struct Known {
    ahead: [Real; 2],
    bias_mps2: [Real; 2],
}

fn run_with(slope: &mut CurvatureSlope, seconds: Real, reading: &Reading, known: &Known) -> Value {
    let ([ahead, ahead_sd], [bias_mps2, bias_sd_mps2]) = (known.ahead, known.bias_mps2);
    let attitude = Attitude {
        bias_mps2,
        ..steps::attitude(reading, 0.3)
    };
    let balance = ForceBalance::new(&vehicle());
    for _ in 0..(seconds / DT).round() as usize {
        let now = steps::step(reading, &attitude, &balance, DT);
        slope.step(&Step {
            effective_rad: [Real::asin(Real::sin(0.3) - ahead), ahead_sd],
            bias_sd_mps2,
            ..now
        });
    }
    slope.effective_grade_rad()
}

fn run(slope: &mut CurvatureSlope, seconds: Real, reading: &Reading) -> Value {
    run_with(slope, seconds, reading, &Known::default())
}

/// v̇ = f − g sin θ, θ̇ = ρ v; without an accelerometer any acceleration up to 1 m/s² or so.
#[test]
fn the_process_noise_is_that_of_what_carries_the_slope() {
    let model = model(&InertialParams::default());
    for (specific_force_mps2, force_noise_mps2, q_v) in [
        (Some(1.0), 0.0, 1e-6),
        (None, 0.0, 1.0),
        // White noise of f moves the speed by its part of the step; never below the parameter.
        (Some(1.0), 0.3, 0.3 * 0.3 * DT),
        (Some(1.0), 0.009, 1e-6),
    ] {
        let motion = Motion {
            specific_force_mps2,
            curvature_per_m: 0.1,
            force_noise_mps2,
        };
        let Q = model.Q(&motion, DT);
        assert!((Q.m11 - q_v * DT).abs() < 1e-15 && (Q.m22 - 5e-6 * DT).abs() < 1e-15);
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
    let belief = prior(&params, WHEEL_SD);
    assert!((belief.x.y - Real::to_radians(10.0)).abs() < 1e-12);
    assert!((belief.P.m22.sqrt() - Real::to_radians(3.0)).abs() < 1e-12);
    assert_eq!(belief.P.m11, WHEEL_SD * WHEEL_SD);
    let mut slope = slope(params, None);
    run(&mut slope, DT, &steady(0.8, 0.0));
    // Uniform between 5 and 27 t.
    let mass = slope.mass_kg();
    assert_eq!((mass.value, mass.valid), (16_000.0, false));
    assert!((mass.sd - 22_000.0 / Real::sqrt(12.0)).abs() < 1e-6);
    // The first wheel speed is the speed at the start, not a surprise.
    assert_eq!(slope.slope.filter.belief().x.x, 0.8);
}

#[test]
fn a_grade_is_valid_with_accelerometer_and_wheels() {
    let mut filter = slope(InertialParams::default(), None);
    let full = steady(0.8, 0.1);
    let held = Reading {
        new_speed_mps: None,
        ..full
    };
    assert!(!run(&mut filter, DT, &held).valid); // not a single wheel speed
    let found = run(&mut filter, 20.0, &full);
    assert!(found.valid && (found.value.sin() - 0.1).abs() < 1e-3);
    assert!(run(&mut { filter }, DT, &held).valid);
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
        assert!(!run(&mut { filter }, DT, &lacking).valid);
    }
}

#[test]
fn a_limit_of_the_slope_is_told_and_is_not_valid() {
    for sign in [1.0, -1.0] {
        let mut slope = slope(InertialParams::default(), None);
        let found = run(&mut slope, 20.0, &steady(0.8, sign * 3.0));
        assert!(slope.is_saturated() && !found.valid);
        assert!((found.value - sign * MAX_GRADE_RAD).abs() < 1e-9);
        let found = run(&mut slope, 60.0, &steady(0.8, 0.1));
        assert!(!slope.is_saturated() && found.valid);
    }
}

/// Signals without noise: the adapted one goes to its limit, which is reported.
#[test]
fn a_limit_of_the_adapted_noise_is_told() {
    for (fading, saturated, expected) in [(None, false, 0.005), (Some(0.9), true, 0.0005)] {
        let mut slope = slope(InertialParams::default(), fading);
        run(&mut slope, 60.0, &steady(0.8, 0.1));
        assert_eq!(slope.is_saturated(), saturated);
        let sd = slope.slope.noise.R().x.sqrt();
        assert!((sd - expected).abs() < 1e-6, "{sd}");
    }
}

/// The bias that the core has found is no slope; what it leaves of it, and the offset of the effective grade from that
/// at the IMU, are in the standard deviation.
#[test]
fn the_grade_is_the_effective_one_less_the_bias_with_the_doubt_of_both() {
    let ride = |known: &Known| {
        let [bias, _] = known.bias_mps2;
        let reading = Reading {
            specific_force_mps2: Some(GRAVITY * 0.5 + bias),
            ..steady(0.8, 0.5)
        };
        run_with(
            &mut slope(InertialParams::default(), None),
            20.0,
            &reading,
            known,
        )
    };
    let alone = ride(&Known::default());
    assert!((alone.value.sin() - 0.5).abs() < 1e-3, "{alone:?}");
    let long = ride(&Known {
        ahead: [0.0767, 0.03],
        bias_mps2: [0.1, 0.2],
    });
    assert!((long.value.sin() - 0.5 + 0.0767).abs() < 1e-3, "{long:?}");
    // g sin θ is off by 0.2 m/s², θ by that over g cos θ.
    let bias = 0.2 / (GRAVITY * Real::cos(0.5f64.asin() as Real));
    let doubt = (long.sd * long.sd - alone.sd * alone.sd).sqrt();
    assert!((doubt / bias.hypot(0.03) - 1.0).abs() < 1e-2, "{doubt}");
}

/// Innovation and its variance before any adaptation; beyond the gate nothing is changed, until it stays.
#[test]
fn a_wheel_speed_beyond_the_gate_changes_nothing_until_it_stays() {
    let curvature = Curvature::new(&vehicle(), CurvatureParams::default(), Forgetting::None);
    let (params, sigma) = (InertialParams::default(), SigmaParams::default());
    let gated = Integrity::default();
    let mut filter =
        CurvatureSlope::new(&vehicle(), params, curvature, sigma, None, &gated, WHEEL_SD);
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
        filter.update(2.0);
        let after = *filter.slope.filter.belief();
        if after != before {
            // Reopened: the innovation is in the variance, so that the speed is the measured one.
            assert!((after.x.x - 2.0).abs() < 1e-3, "{after:?}");
            break;
        }
        rejected += 1;
    }
    assert!((48..=52).contains(&rejected), "{rejected}");
}

#[test]
fn internal_quantities_are_told_in_their_order() {
    let mut slope = slope(InertialParams::default(), None);
    let grade = run(&mut slope, 20.0, &steady(0.8, 0.1));
    let mut values = [9.0; 7];
    slope.internal_values(&mut values);
    let (rho, rho_sd) = slope.curvature.per_m();
    assert_eq!(
        values,
        [rho, rho_sd, 1.0, WHEEL_SD, grade.value, grade.sd, 9.0]
    );
}
