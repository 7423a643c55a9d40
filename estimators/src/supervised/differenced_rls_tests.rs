//! Tests of [`super`].

use super::*;
use crate::testing::Random;
use crate::testing::balance::{Instant, Truth};
use crate::testing::vehicles::{car, vehicle};

const MASS0_KG: Real = 12_000.0;

fn stage(params: DifferencedParams) -> DifferencedMass {
    let params = DifferencedParams {
        mass0_kg: Some(MASS0_KG),
        ..params
    };
    DifferencedMass::new(&vehicle(), params, true)
}

fn truth() -> Truth {
    Truth {
        mass_kg: 15_000.0,
        tare_kg: vehicle().tare_kg,
        rotating_mass_kg: vehicle().rotating_mass_kg,
        mu: 0.026,
        curve_m: 0.0,
        accel_bias: 0.05,
    }
}

/// One direction and one slope; speed changes.
fn at(acceleration_mps2: Real) -> Instant {
    Instant {
        speed_mps: 1.0,
        acceleration_mps2,
        sine: [0.1, 0.05],
        curvature_per_m: 0.0,
    }
}

fn difference(
    stage: &mut DifferencedMass,
    before: (AlignedSample, Bend),
    now: (AlignedSample, Bend),
) {
    stage.difference(&before, &now, &ForceBalance::new(&vehicle()));
}

const REJECTED: AidOutcome = AidOutcome::Rejected(Rejection::NotExcited);

/// Resistance, slope and bias are the same before and after, and drop out.
#[test]
fn without_noise_the_mass_is_found_exactly() {
    let mut stage = stage(DifferencedParams {
        difference_sd_mps2: 1e-4,
        ..Default::default()
    });
    let mut random = Random::new(31);
    for _ in 0..100 {
        let [before, now] = [0.0; 2].map(|_| truth().sample(&at(0.5 * random.normal())));
        difference(
            &mut stage,
            (before, Bend::default()),
            (now, Bend::default()),
        );
    }
    let found = stage.mass_kg();
    assert!((found.value / 15_000.0 - 1.0).abs() < 1e-6, "{found:?}");
    assert!(found.valid && !stage.saturated());
    assert!(stage.residual_n().abs() < 0.01);
}

/// M (v̇ + b) = F + what the steered traction gains − …; the accelerometer reads v_y r too little, which is no change
/// of slope.
#[test]
fn what_a_bend_takes_and_gains_belongs_to_the_balance_and_its_drift_is_no_slope() {
    let mut stage = stage(DifferencedParams {
        difference_sd_mps2: 1e-4,
        ..Default::default()
    });
    let mut random = Random::new(32);
    let mut used = 0;
    for _ in 0..100 {
        let [before, now] = [0.0; 2].map(|_| {
            let bend = Bend {
                gained_n: 500.0 * random.normal(),
                taken_mps2: 0.3 * random.normal(),
                drift_mps2: 0.5 * random.normal(),
                ..Bend::default()
            };
            let mut sample = truth().sample(&at(0.5 * random.normal()));
            sample.sample.force_n += 15_000.0 * bend.taken_mps2 - bend.gained_n;
            let mut felt = sample.felt.unwrap();
            for mean in [&mut felt.tare, &mut felt.load] {
                mean.value[0] -= bend.drift_mps2;
            }
            sample.felt = Some(felt);
            (sample, bend)
        });
        difference(&mut stage, before, now);
        used += usize::from(stage.excited());
    }
    assert!(used > 90, "{used}");
    assert!((stage.mass_kg().value / 15_000.0 - 1.0).abs() < 1e-6);
}

/// Outcome of one difference.
fn outcome(params: DifferencedParams, force_n: Real, slope_mps2: Real) -> AidOutcome {
    let mut stage = stage(params);
    let before = truth().sample(&at(0.0));
    let mut now = before;
    now.sample.force_n += force_n;
    let mut felt = now.felt.unwrap();
    for mean in [&mut felt.tare, &mut felt.load] {
        mean.value[0] += slope_mps2;
    }
    now.felt = Some(felt);
    let rls = stage.rls;
    difference(
        &mut stage,
        (before, Bend::default()),
        (now, Bend::default()),
    );
    let outcome = stage.status().outcome;
    assert_eq!(stage.excited(), outcome == AidOutcome::Fused);
    assert_eq!(stage.rls == rls, outcome == REJECTED);
    outcome
}

#[test]
fn a_change_of_slope_or_a_small_change_of_force_is_not_used() {
    let gates = DifferencedParams::default();
    // The thresholds: 0.05 m/s² of slope, 0.05 m/s² · 12 t = 600 N of force, either way.
    for sign in [1.0, -1.0] {
        assert_eq!(outcome(gates, sign * 610.0, 0.0), AidOutcome::Fused);
        assert_eq!(outcome(gates, sign * 590.0, 0.0), REJECTED);
        assert_eq!(outcome(gates, 900.0, sign * 0.049), AidOutcome::Fused);
        assert_eq!(outcome(gates, 900.0, sign * 0.051), REJECTED);
    }
    let open = DifferencedParams {
        excitation_gate: false,
        ..gates
    };
    assert_eq!(outcome(open, 10.0, 0.0), AidOutcome::Fused);
    assert_eq!(outcome(open, 10.0, 0.051), REJECTED);
}

#[test]
fn without_the_accelerometer_no_slope_is_known_to_be_steady() {
    let mut stage = stage(DifferencedParams::default());
    let [before, now] = [0.0, 0.5].map(|a| truth().sample(&at(a)));
    for (before_felt, now_felt) in [(None, now.felt), (before.felt, None)] {
        let blind = |sample, felt| (AlignedSample { felt, ..sample }, Bend::default());
        difference(&mut stage, blind(before, before_felt), blind(now, now_felt));
        assert_eq!(stage.status().outcome, REJECTED);
    }
}

/// The innovation variance of a difference is its noise and what the mass is uncertain by.
#[test]
fn the_noise_of_a_difference_is_as_told() {
    let mut stage = stage(DifferencedParams {
        difference_sd_mps2: 0.2,
        mass_sd: 0.1,
        ..Default::default()
    });
    let [before, now] = [0.0, 0.5].map(|a| truth().sample(&at(a)));
    difference(
        &mut stage,
        (before, Bend::default()),
        (now, Bend::default()),
    );
    let expected = 0.2 * 0.2 + 0.1 * 0.5 * 0.1 * 0.5;
    assert!((stage.status().innovation_variance / expected - 1.0).abs() < 1e-9);
    // y − h = (15 t/12 t − 1) · 0.5 m/s²
    assert!((stage.residual_n() - 3_000.0 * 0.5).abs() < 1e-6);
}

#[test]
fn the_mass_is_a_share_of_the_first_and_beyond_its_range_cut_and_not_valid() {
    let mut stage = stage(DifferencedParams::default());
    stage.rls.belief = Gaussian::independent(vector![1.5], vector![0.06]);
    let found = stage.mass_kg();
    assert!(found.valid && (found.value - 18_000.0).abs() < 1e-9);
    assert!((found.sd - 0.06 * MASS0_KG).abs() < 1e-6);
    let heavy = Truth {
        mass_kg: 40_000.0,
        ..truth()
    };
    for k in 0..50 {
        let [before, now] = [0.0, 0.5 + 0.01 * k as Real].map(|a| heavy.sample(&at(a)));
        difference(
            &mut stage,
            (before, Bend::default()),
            (now, Bend::default()),
        );
    }
    let found = stage.mass_kg();
    assert!(stage.saturated() && !found.valid);
    assert_eq!(found.value, vehicle().mass_range_kg[1]);
}

/// A car on the level that speeds up and slows down: signals in, mass out; the brake and standing part the differences.
#[test]
fn from_signals_to_mass_with_a_brake_in_between() {
    let (vehicle, mass_kg, dt) = (car().without_road(), 2_170.0, 0.01);
    let balance = ForceBalance::new(&vehicle);
    let params = DifferencedParams {
        mass0_kg: Some(1_900.0),
        ..Default::default()
    };
    let mut stage = DifferencedMass::new(&vehicle, params, true);
    let mut v: Real = 10.0;
    for k in 0..6000 {
        let a = 0.8 * (0.02 * k as Real).sin();
        v += a * dt;
        let force =
            (mass_kg + vehicle.rotating_mass_kg) * a + mass_kg * 9.81 * vehicle.running_resistance;
        let efficiency = if force >= 0.0 {
            vehicle.efficiency
        } else {
            1.0 / vehicle.efficiency
        };
        let torque = force * vehicle.wheel_radius_m / vehicle.gear_ratio / efficiency;
        let reading = Reading {
            new_speed_mps: Some(v),
            speed_mps: Some(v),
            motor_torque_nm: Some(torque),
            specific_force_mps2: Some(a),
            ..Reading::default()
        };
        let running = k != 3000;
        stage.step(&reading, &balance, running, dt);
        if !running {
            assert_eq!(stage.last, None);
            assert!(!stage.excited());
            let standing = AidOutcome::Rejected(Rejection::NotRunning);
            assert_eq!(stage.status().outcome, standing);
        }
    }
    assert!(stage.last.is_some() && stage.bend() == Bend::default());
    let found = stage.mass_kg();
    assert!((found.value / mass_kg - 1.0).abs() < 0.01, "{found:?}");
    // A point: no grade is ahead of another.
    assert_eq!(stage.ahead().imu, 0.0);
}
