//! Tests of [`super`]: what stands behind the grade of a two-stage method.

use super::*;
use crate::api::reading::Reading;
use crate::detect::validity::Integrity;
use crate::filters::forgetting::Forgetting;
use crate::models::single_track::{Bend, Bends};
use crate::supervised::force_balance_ekf::{Adaptation, GradeParams};
use crate::supervised::force_balance_rls::{ForceBalanceRls, MassParams};
use crate::testing::Random;
use crate::testing::balance::{Instant, Truth};
use crate::testing::steps;
use crate::testing::vehicles::{Turn, car, vehicle};

const DT: Real = 0.01;
const MASS_KG: Real = 15_000.0;

fn slope(vehicle: &Vehicle, adaptation: Adaptation) -> ForceBalanceEkf {
    let open = Integrity {
        gate_sd: 1e9,
        ..Integrity::default()
    };
    let (balance, params) = (ForceBalance::new(vehicle), GradeParams::default());
    ForceBalanceEkf::new(balance, params, adaptation, &open, 0.005)
}

fn two_stage(vehicle: &Vehicle) -> TwoStage<ForceBalanceRls> {
    let params = MassParams {
        mass0_kg: Some(MASS_KG),
        mass_sd: 0.02,
        ..Default::default()
    };
    let mass = ForceBalanceRls::new(vehicle, params, Forgetting::None, None);
    let slope = slope(vehicle, Adaptation::sage_husa(0.98));
    TwoStage::new(vehicle, mass, slope, true)
}

/// Level rail at 1 m/s, F keeps the speed; the wheels' noise alternates.
fn level(k: usize) -> Reading {
    let speed = 1.0 + if k.is_multiple_of(2) { 0.005 } else { -0.005 };
    Reading {
        new_speed_mps: Some(speed),
        speed_mps: Some(speed),
        motor_torque_nm: Some(MASS_KG * 9.81 * 0.02 * 0.17 / 20.0 / 0.9),
        specific_force_mps2: Some(0.0),
        ..Reading::default()
    }
}

/// The method's effective grade after that time.
fn run<M: MassEstimator + State + core::fmt::Debug>(
    method: &mut TwoStage<M>,
    seconds: Real,
    read: impl Fn(usize) -> Reading,
) -> Value {
    run_in(method, seconds, Bend::default(), read)
}

/// The same in a bend of a road.
fn run_in<M: MassEstimator + State + core::fmt::Debug>(
    method: &mut TwoStage<M>,
    seconds: Real,
    bend: Bend,
    read: impl Fn(usize) -> Reading,
) -> Value {
    for k in 0..(seconds / DT).round() as usize {
        let reading = read(k);
        let attitude = steps::attitude(&reading, 0.0);
        let balance = method.balance;
        let now = steps::step(&reading, &attitude, &balance, DT);
        method.step(&Step { bend, ..now });
    }
    method.effective_grade_rad()
}

#[test]
fn a_grade_is_valid_while_all_that_it_rests_on_is_there() {
    let mut found = two_stage(&vehicle());
    let held = |k: usize| Reading {
        new_speed_mps: None,
        ..level(k)
    };
    assert!(!run(&mut found, DT, held).valid); // not a single wheel speed
    let grade = run(&mut found, 20.0, level);
    assert!(grade.valid && grade.value.abs() < 0.01, "{grade:?}");
    let valid = |read: &dyn Fn(usize) -> Reading| run(&mut { found }, DT, read).valid;
    assert!(valid(&level));
    // Braking, standing, torques or wheels unknown: no force balance.
    assert!(!valid(&|k| Reading {
        brake: 1.0,
        ..level(k)
    }));
    assert!(!valid(&|k| Reading {
        speed_mps: Some(0.0),
        ..level(k)
    }));
    assert!(!valid(&|k| Reading {
        motor_torque_nm: None,
        ..level(k)
    }));
    assert!(!valid(&|k| Reading {
        speed_mps: None,
        new_speed_mps: None,
        ..level(k)
    }));
    // The accelerometer is none of its instruments.
    assert!(valid(&|k| Reading {
        specific_force_mps2: None,
        ..level(k)
    }));
}

/// Noise of wheel speed that alternates, two or four times as large as the parameter: slip from three times on.
#[test]
fn wheels_whose_noise_is_three_times_what_it_should_be_slip() {
    for (noise, detector, valid) in [(0.01, true, true), (0.02, true, false), (0.02, false, true)] {
        let mut method = two_stage(&vehicle());
        method.slip = SlipDetector::new(detector);
        let read = |k: usize| {
            let speed = Some(1.0 + if k.is_multiple_of(2) { noise } else { -noise });
            Reading {
                new_speed_mps: speed,
                speed_mps: speed,
                ..level(k)
            }
        };
        let found = run(&mut method, 20.0, read);
        let ratio = method.slope.adapted_ratio();
        assert_eq!(found.valid, valid, "{noise} {ratio}");
    }
}

/// Dead reckoning: after a second without torque the grade has to be found again, to 0.01 rad.
#[test]
fn after_dead_reckoning_a_grade_is_valid_once_it_is_found_again() {
    let mut method = two_stage(&vehicle());
    run(&mut method, 20.0, level);
    run(&mut method, 1.0, |k| Reading {
        motor_torque_nm: None,
        ..level(k)
    });
    assert!(!method.observability.grade_observable());
    let (mut lost, mut again) = (0, 0);
    for k in 0..2_000 {
        let valid = run(&mut method, DT, |_| level(k)).valid;
        let filter_sd = method.slope.belief().P.m22.sqrt();
        if again == 0 {
            assert_eq!(valid, filter_sd <= 0.01, "{k}: {filter_sd}");
        }
        lost += usize::from(!valid);
        again += usize::from(valid);
    }
    assert!(lost > 3 && again > 1_000, "{lost} {again}");
}

#[test]
fn excited_is_told_of_samples_that_vary_and_not_after_a_pause() {
    let truth = Truth {
        mass_kg: MASS_KG,
        tare_kg: vehicle().tare_kg,
        rotating_mass_kg: vehicle().rotating_mass_kg,
        mu: 0.02,
        curve_m: 0.0,
        accel_bias: 0.0,
    };
    let mut method = two_stage(&vehicle());
    let steady = Instant {
        speed_mps: 1.0,
        acceleration_mps2: 0.0,
        sine: [0.0; 2],
        curvature_per_m: 0.0,
    };
    for _ in 0..20 {
        method.sample(&truth.sample(&steady));
    }
    assert!(!method.is_excited());
    let mut random = Random::new(41);
    for _ in 0..20 {
        method.sample(&truth.sample(&Instant::draw(&mut random)));
    }
    assert!(method.is_excited() && !method.is_saturated());
    method.pause();
    assert!(!method.is_excited());
}

/// Either limit, that of the mass or that of the slope.
#[test]
fn a_limit_of_either_stage_is_told_and_gives_no_grade() {
    let mut steep = two_stage(&vehicle());
    run(&mut steep, 5.0, level);
    assert!(!steep.is_saturated());
    let pushed = |k| Reading {
        motor_torque_nm: Some(5_000.0),
        ..level(k)
    };
    let grade = run(&mut steep, 1.0, pushed);
    assert!(steep.is_saturated() && !steep.mass.saturated() && !grade.valid);
    let mut heavy = two_stage(&vehicle());
    let truth = Truth {
        mass_kg: 60_000.0,
        tare_kg: vehicle().tare_kg,
        rotating_mass_kg: vehicle().rotating_mass_kg,
        mu: 0.02,
        curve_m: 0.0,
        accel_bias: 0.0,
    };
    let mut random = Random::new(42);
    for _ in 0..100 {
        heavy.sample(&truth.sample(&Instant::draw(&mut random)));
    }
    assert!(heavy.mass.saturated() && heavy.is_saturated());
    assert!(!run(&mut heavy, 5.0, level).valid);
}

/// The resistance is against the motion: backwards the same force that holds on the level is the other way round.
#[test]
fn the_resistance_turns_with_the_speed() {
    for sign in [1.0, -1.0] {
        let mut method = two_stage(&vehicle());
        let read = |k: usize| {
            let forward = level(k);
            Reading {
                new_speed_mps: forward.new_speed_mps.map(|v| sign * v),
                speed_mps: forward.speed_mps.map(|v| sign * v),
                motor_torque_nm: forward.motor_torque_nm.map(|torque| sign * torque),
                ..forward
            }
        };
        let grade = run(&mut method, 20.0, read);
        assert!(grade.value.abs() < 2e-3, "{sign} {grade:?}");
    }
}

/// A car that turns steadily on the level: what the bend takes from the traction is no slope.
#[test]
fn what_a_bend_takes_from_the_traction_is_no_slope() {
    let params = MassParams {
        mass0_kg: Some(2_170.0),
        mass_sd: 0.001,
        ..Default::default()
    };
    let vehicle = car();
    let mass = ForceBalanceRls::new(&vehicle, params, Forgetting::None, None);
    let mut method = TwoStage::new(&vehicle, mass, slope(&vehicle, Adaptation::None), true);
    let turn = Turn::solve(2_170.0, 8.0, 0.4, 0.0).reading();
    let mut bends = Bends::new(&vehicle);
    bends.step(&turn, &method.balance, 2_170.0);
    let grade = run_in(&mut method, 30.0, bends.now(), |_| turn);
    let taken = bends.now().force_n(2_170.0) / (2_170.0 * 9.81);
    assert!(taken > 5e-3, "{taken}");
    assert!(grade.value.abs() < 0.1 * taken, "{grade:?} {taken}");
}

/// The variance of the slope filter, that of the mass and of the resistance, and what the balance leaves out.
#[test]
fn the_standard_deviation_is_that_of_filter_and_parameters() {
    let mut method = two_stage(&vehicle());
    let grade = run(&mut method, 20.0, level);
    let filter = method.slope.belief().P.m22;
    assert!((grade.sd * grade.sd - filter).sqrt() > 1e-3, "{grade:?}");
    let mu_sd = 0.3 * 0.02;
    let by_mass = 0.02 * 0.02;
    let mut random = Random::new(43);
    // F/(M g) = μ: a share of the mass is that share of μ.
    let expected = filter + mu_sd * mu_sd + by_mass * by_mass;
    assert!(
        (grade.sd * grade.sd / expected - 1.0).abs() < 0.05,
        "{grade:?} {expected:e}"
    );
    // Residuals of the regression beyond its noise are errors of the balance.
    let truth = Truth {
        mass_kg: MASS_KG,
        tare_kg: vehicle().tare_kg,
        rotating_mass_kg: vehicle().rotating_mass_kg,
        mu: 0.02,
        curve_m: 0.0,
        accel_bias: 0.0,
    };
    for _ in 0..200 {
        let mut sample = truth.sample(&Instant::draw(&mut random));
        sample.sample.force_n += 0.5 * MASS_KG * random.normal();
        method.sample(&sample);
    }
    let unmodelled = method.mass.unmodelled_mps2() / GRAVITY;
    assert!(unmodelled > 0.01);
    assert!(run(&mut method, DT, level).sd > unmodelled);
}

#[test]
fn internal_quantities_are_told_in_their_order() {
    let mut method = two_stage(&vehicle());
    let grade = run(&mut method, 20.0, level);
    let mut values = [9.0; 10];
    method.internal_values(&mut values);
    let slope = &method.slope;
    let expected = [slope.measurement_sd(), grade.value, grade.sd, 9.0];
    assert_eq!(values[6..], expected);
    assert_eq!(values[..6], method.mass.internals(0.0));
}
