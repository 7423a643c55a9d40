//! Tests of [`super`]: what stands behind the marks of a two-stage estimator.

use super::*;
use crate::api::aid::AidOutcome;
use crate::api::signals::VehicleData;
use crate::detect::validity::Integrity;
use crate::filters::forgetting::Forgetting;
use crate::supervised::force_balance_ekf::{Adaptation, GradeParams};
use crate::supervised::force_balance_rls::{ForceBalanceRls, MassParams};
use crate::supervised::multi_model_rls::{MultiModelMass, MultiModelParams};
use crate::testing::vehicles::{Turn, car, vehicle};

const DT: Real = 0.01;
const MASS_KG: Real = 15_000.0;

/// Supervisors without innovation gates.
fn open(slip_detector: bool) -> Supervisors {
    Supervisors {
        grade_map: true,
        slip_detector,
        integrity: Integrity {
            innovation_gate: false,
            nis_monitor: false,
            plausibility: false,
            ..Integrity::default()
        },
        ..Supervisors::default()
    }
}

fn slope(vehicle: &Vehicle, adaptation: Adaptation) -> ForceBalanceEkf {
    let balance = ForceBalance::new(vehicle);
    ForceBalanceEkf::new(
        balance,
        GradeParams::default(),
        adaptation,
        &open(true).integrity,
    )
}

fn two_stage(vehicle: &Vehicle) -> TwoStage<ForceBalanceRls> {
    let params = MassParams {
        mass0_kg: Some(MASS_KG),
        mass_sd: 0.02,
        ..Default::default()
    };
    TwoStage::new(
        vehicle,
        ForceBalanceRls::resampler(&params),
        ForceBalanceRls::new(vehicle, params, Forgetting::None),
        slope(vehicle, Adaptation::sage_husa(0.98)),
        &open(true),
        None,
    )
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

fn run<M: MassEstimator + State>(
    estimator: &mut TwoStage<M>,
    seconds: Real,
    read: impl Fn(usize) -> Reading,
) -> Estimate {
    let steps = (seconds / DT).round() as usize;
    (0..steps)
        .map(|k| estimator.advance(&read(k), Time::default(), DT))
        .last()
        .unwrap()
}

#[test]
fn a_grade_is_valid_while_all_that_it_rests_on_is_there() {
    let mut found = two_stage(&vehicle());
    assert!(!run(&mut found, DT, level).grade_rad.valid); // 5° at the start
    let estimate = run(&mut found, 20.0, level);
    assert!(estimate.grade_rad.valid && estimate.effective_grade_rad.valid);
    assert!(estimate.effective_grade_rad.value.abs() < 0.01);
    let valid = |estimator: &TwoStage<ForceBalanceRls>, read: &dyn Fn(usize) -> Reading| {
        let mut estimator = *estimator;
        run(&mut estimator, DT, read).grade_rad.valid
    };
    assert!(valid(&found, &level));
    // Braking, standing, or the wheels unknown: no force balance.
    assert!(!valid(&found, &|k| Reading {
        brake: 1.0,
        ..level(k)
    }));
    assert!(!valid(&found, &|k| Reading {
        speed_mps: Some(0.0),
        ..level(k)
    }));
    assert!(!valid(&found, &|k| Reading {
        speed_mps: None,
        new_speed_mps: None,
        ..level(k)
    }));
    // A mass that is not valid.
    let mut heavy = found;
    heavy.mass = ForceBalanceRls::new(&vehicle(), MassParams::default(), Forgetting::None);
    assert!(!valid(&heavy, &level));
    // A limit of the standard deviation.
    let mut uncertain = found;
    uncertain.slope.drift(1.0);
    assert!(!valid(&uncertain, &|k| Reading {
        new_speed_mps: None,
        ..level(k)
    }));
}

/// Noise of wheel speed that alternates, two or four times as large as the parameter: slip from three times on.
#[test]
fn wheels_whose_noise_is_three_times_what_it_should_be_slip() {
    for (noise, detector, valid) in [(0.01, true, true), (0.02, true, false), (0.02, false, true)] {
        let mut estimator = two_stage(&vehicle());
        estimator.slip = SlipDetector::new(detector);
        let read = |k: usize| {
            let speed = Some(1.0 + if k.is_multiple_of(2) { noise } else { -noise });
            Reading {
                new_speed_mps: speed,
                speed_mps: speed,
                ..level(k)
            }
        };
        let found = run(&mut estimator, 20.0, read).grade_rad;
        assert_eq!(
            found.valid,
            valid,
            "{noise} {}",
            estimator.slope.adapted_ratio()
        );
    }
}

/// Dead reckoning: after a second without torque the grade has to be found again, to 0.01 rad, and the train to have
/// settled.
#[test]
fn after_dead_reckoning_a_grade_is_valid_once_it_is_found_again() {
    let mut estimator = two_stage(&vehicle());
    run(&mut estimator, 20.0, level);
    run(&mut estimator, 1.0, |k| Reading {
        motor_torque_nm: None,
        ..level(k)
    });
    assert!(!estimator.observability.grade_observable());
    let mut again = 0;
    for k in 0..2_000 {
        let estimate = estimator.advance(&level(k), Time::default(), DT);
        let filter_sd = estimator.slope.belief().P.m22.sqrt();
        let valid = estimate.effective_grade_rad.valid;
        if again == 0 {
            let found = filter_sd <= 0.01 && estimator.signals.settled();
            assert_eq!(valid, found, "{k}: {filter_sd}");
        }
        again += usize::from(valid);
    }
    assert!(again > 1_000, "{again}");
}

#[test]
fn excited_is_told_of_a_train_that_has_settled_on_samples_that_vary() {
    let wave = |k: usize| {
        let a = 0.3 * Real::sin(0.02 * k as Real);
        Reading {
            specific_force_mps2: Some(a),
            motor_torque_nm: Some((MASS_KG * (a + 9.81 * 0.02)) * 0.17 / 20.0 / 0.9),
            ..level(k)
        }
    };
    let mut estimator = two_stage(&vehicle());
    assert!(!run(&mut estimator, 10.0, level).flags.excited);
    assert!(run(&mut estimator, 10.0, wave).flags.excited);
    let brake = |k| Reading {
        brake: 1.0,
        ..wave(k)
    };
    assert!(!run(&mut estimator, DT, brake).flags.excited);
    assert!(!estimator.mass.excited());
    // Back in motion it has to settle first.
    assert!(!run(&mut estimator, 1.0, wave).flags.excited);
    assert!(run(&mut estimator, 2.0, wave).flags.excited);
}

/// Either limit, that of the mass or that of the slope.
#[test]
fn a_limit_of_either_stage_is_told() {
    let mut slope = two_stage(&vehicle());
    run(&mut slope, 5.0, level);
    assert!(!run(&mut slope, 1.0, level).flags.saturated);
    let pushed = |k| Reading {
        motor_torque_nm: Some(5_000.0),
        ..level(k)
    };
    let estimate = run(&mut slope, 1.0, pushed);
    assert!(estimate.flags.saturated && !slope.mass.saturated());
    let narrow = Vehicle::new(VehicleData {
        mass_range_kg: [14_999.0, 15_001.0],
        ..vehicle().data()
    })
    .unwrap();
    let mut mass = two_stage(&narrow);
    let lighter = |k| Reading {
        motor_torque_nm: Some(13_000.0 * 9.81 * (0.02 + 0.05) * 0.17 / 20.0 / 0.9),
        specific_force_mps2: Some(9.81 * 0.05),
        ..level(k)
    };
    let estimate = run(&mut mass, 30.0, lighter);
    assert!(mass.mass.saturated() && estimate.flags.saturated);
}

/// Before the rail is read the grade at the IMU may be anything: 50 m at 0.02 rad/m. In quadrature with that of the
/// effective grade.
#[test]
fn the_grade_at_the_imu_has_the_uncertainty_of_its_offset_on_top() {
    let long = Vehicle::new(VehicleData {
        tare_span_m: [0.0, 18.0],
        load_span_m: [5.0, 13.0],
        ..vehicle().data()
    })
    .unwrap();
    let mut estimator = two_stage(&long);
    let blind = |k| Reading {
        specific_force_mps2: None,
        ..level(k)
    };
    let estimate = run(&mut estimator, 20.0, blind);
    let [imu, effective] = [estimate.grade_rad.sd, estimate.effective_grade_rad.sd];
    assert!(((imu * imu - effective * effective).sqrt() - 1.0).abs() < 1e-6);
    // Once it is read only the rail behind the train is left.
    let estimate = run(&mut estimator, 0.5, level);
    let [imu, effective] = [estimate.grade_rad.sd, estimate.effective_grade_rad.sd];
    let (_, offset_sd) = estimator.train.imu_offset(MASS_KG, 0.0);
    assert!(imu > effective && (imu / effective.hypot(offset_sd) - 1.0).abs() < 1e-3);
}

/// The resistance is against the motion: backwards the same force that holds on the level is the other way round.
#[test]
fn the_resistance_turns_with_the_speed() {
    for sign in [1.0, -1.0] {
        let mut estimator = two_stage(&vehicle());
        let read = |k: usize| {
            let forward = level(k);
            Reading {
                new_speed_mps: forward.new_speed_mps.map(|v| sign * v),
                speed_mps: forward.speed_mps.map(|v| sign * v),
                motor_torque_nm: forward.motor_torque_nm.map(|torque| sign * torque),
                ..forward
            }
        };
        let estimate = run(&mut estimator, 20.0, read);
        assert!(
            estimate.effective_grade_rad.value.abs() < 2e-3,
            "{sign} {estimate:?}"
        );
    }
}

/// A car that turns steadily on the level: what the bend takes from the traction is no slope.
#[test]
fn what_a_bend_takes_from_the_traction_is_no_slope() {
    let params = MultiModelParams {
        mass0_kg: Some(2_170.0),
        mass_sd: 0.001,
        ..Default::default()
    };
    let vehicle = car();
    let mut estimator = TwoStage::new(
        &vehicle,
        MultiModelMass::resampler(&params),
        MultiModelMass::new(&vehicle, params),
        slope(&vehicle, Adaptation::None),
        &open(true),
        None,
    );
    let turn = Turn::solve(2_170.0, 8.0, 0.4, 0.0).reading();
    let estimate = run(&mut estimator, 30.0, |_| turn);
    let bend_n = estimator.mass.bend_n();
    let taken = bend_n / (2_170.0 * 9.81);
    assert!(taken > 5e-3, "{taken}");
    let found = estimate.effective_grade_rad.value;
    assert!(found.abs() < 0.1 * taken, "{found} {taken}");
}

#[test]
fn a_train_at_the_standstill_speed_stands_and_a_brake_at_its_threshold_is_released() {
    let at = |speed_mps, brake| Reading {
        speed_mps: Some(speed_mps),
        brake,
        ..Reading::default()
    };
    assert_eq!(motion(&at(0.05, 0.0), 0.05), (false, false));
    assert_eq!(motion(&at(-0.051, 0.001), 0.05), (true, true));
    assert_eq!(motion(&at(0.051, 0.0011), 0.05), (true, false));
    assert_eq!(motion(&Reading::default(), 0.05), (false, false));
}

#[test]
fn what_became_of_both_sources_and_the_internal_quantities_are_told() {
    let mut estimator = two_stage(&vehicle());
    run(&mut estimator, 20.0, level);
    let mut status = [AidStatus::default(); 2];
    estimator.aid_status(&mut status);
    assert_eq!(status[WHEEL_SPEED].outcome, AidOutcome::Fused);
    assert_eq!(status[FORCE_BALANCE].outcome, AidOutcome::Deweighted);
    let mut values = [0.0; 9];
    estimator.internal_values(&mut values);
    let slope = &estimator.slope;
    let sd = slope.belief().P.m22.sqrt();
    assert_eq!(&values[6..], &[slope.measurement_sd(), sd, slope.fading()]);
    assert_eq!(values[..6], estimator.mass.internals(&estimator.train));
}
