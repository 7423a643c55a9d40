//! Tests of [`super`].

use super::*;
use crate::models::sample::ResampledSample;
use crate::models::single_track::Bend;
use crate::testing::Random;
use crate::testing::balance::{Instant, Truth};
use crate::testing::vehicles::{car, vehicle};

const MASS0_KG: Real = 12_000.0;

fn stage(params: DifferencedParams) -> DifferencedMass {
    let params = DifferencedParams {
        mass0_kg: Some(MASS0_KG),
        ..params
    };
    DifferencedMass::new(&vehicle(), params)
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

fn difference(stage: &mut DifferencedMass, before: BalanceSample, now: BalanceSample) -> AidStatus {
    stage.difference(&before, &now)
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
        difference(&mut stage, before, now);
    }
    let found = stage.mass_kg();
    assert!((found.value / 15_000.0 - 1.0).abs() < 1e-6, "{found:?}");
    assert!(found.valid && !stage.saturated());
    assert!(stage.residual_n().abs() < 0.01);
}

/// The noise of the acceleration does not draw the mass towards 0, and stays within three standard deviations.
#[test]
fn noise_of_the_acceleration_does_not_bias_the_mass() {
    let (mut sum, mut squares) = (0.0, 0.0);
    for seed in 0..40 {
        let params = DifferencedParams {
            omega: 1.0,
            mass_sd: 1.0,
            difference_sd_mps2: 0.1 * Real::sqrt(2.0),
            force_gate_mps2: 0.2,
            ..Default::default()
        };
        let (mut stage, mut random) = (stage(params), Random::new(100 + seed));
        for _ in 0..300 {
            // as much noise as motion
            let [before, now] = [0.0; 2].map(|_| {
                let mut sample = truth().sample(&at(0.1 * random.normal()));
                sample.sample.acceleration_mps2 += 0.1 * random.normal();
                sample
            });
            difference(&mut stage, before, now);
        }
        let found = stage.mass_kg();
        let error = (found.value - 15_000.0) / found.sd;
        sum += error;
        squares += error * error;
    }
    // normal and χ² of 40 independent errors, 99.9 %; what is told may be wider
    assert!(sum.abs() < 3.3 * Real::sqrt(40.0), "{sum}");
    assert!((10.0..73.4).contains(&squares), "{squares}");
}

/// The speed of a driven wheel changes with its slip; the specific force does not.
#[test]
fn the_slip_of_the_wheels_is_no_acceleration_where_there_is_an_accelerometer() {
    let mut stage = stage(DifferencedParams {
        difference_sd_mps2: 1e-4,
        ..Default::default()
    });
    let mut random = Random::new(33);
    for _ in 0..100 {
        let [before, now] = [0.0; 2].map(|_| {
            let mut sample = truth().sample(&at(0.5 * random.normal()));
            let [u, _] = sample.u_mps2;
            sample.bend.drift_mps2 = 0.2 * random.normal();
            let f = sample.sample.acceleration_mps2 + u - sample.bend.drift_mps2;
            sample.sample.specific_force_mps2 = Some(f);
            sample.sample.acceleration_mps2 += 0.3 * random.normal();
            sample
        });
        difference(&mut stage, before, now);
    }
    assert!((stage.mass_kg().value / 15_000.0 - 1.0).abs() < 1e-6);
}

/// Where one of two samples has no reading of the accelerometer, both motion and noise are those of the wheels.
#[test]
fn without_an_accelerometer_motion_and_noise_are_those_of_the_wheels() {
    for (readings, by_wheels) in [
        ([Some(9.0), Some(9.5)], false),
        ([None, Some(9.5)], true),
        ([None, None], true),
    ] {
        let mut stage = stage(DifferencedParams {
            mass_sd: 0.001,
            ..Default::default()
        });
        stage.set_noise([1.0, 1.0], 0.01);
        let [mut before, mut now] = [0.0, 0.5].map(|a| truth().sample(&at(a)));
        before.sample.specific_force_mps2 = readings[0];
        now.sample.specific_force_mps2 = readings[1];
        let found = difference(&mut stage, before, now).innovation_variance;
        let [of_accelerometer, of_wheels] = stage.noise;
        let told = if by_wheels {
            of_wheels
        } else {
            of_accelerometer
        };
        assert!((found / told - 1.0).abs() < 1e-3, "{found} {told}");
    }
}

/// The variance of a difference of two filtered samples far apart, by simulation.
#[test]
fn the_noise_of_the_instruments_is_that_behind_the_low_pass() {
    use crate::filters::low_pass::MatchedFilter;
    let (dt, sds) = (0.01, [0.5, 0.02]);
    let mut stage = stage(DifferencedParams::default());
    stage.set_noise(sds, dt);
    let mut filters = [MatchedFilter::new(stage.params.cutoff_hz); 2];
    let (mut random, mut squares, mut count) = (Random::new(34), [0.0; 2], 0.0);
    for k in 0..200_000 {
        for (filter, sd) in filters.iter_mut().zip(sds) {
            filter.step(sd * random.normal(), dt);
        }
        if k > 1_000 {
            let [force, speed] = filters;
            let found = [force.value().unwrap(), speed.rate()];
            for (square, x) in squares.iter_mut().zip(found) {
                *square += x * x;
            }
            count += 1.0;
        }
    }
    for (square, told) in squares.into_iter().zip(stage.noise) {
        let found = 2.0 * square / count;
        assert!((found / told - 1.0).abs() < 0.15, "{found} {told}");
    }
}

/// M (v̇ + b) = F + what the steered traction gains − …
#[test]
fn what_a_bend_takes_and_gains_belongs_to_the_balance() {
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
                ..Bend::default()
            };
            let mut sample = truth().sample(&at(0.5 * random.normal()));
            sample.sample.force_n += 15_000.0 * bend.taken_mps2 - bend.gained_n;
            sample.bend = bend;
            sample
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
    now.u_mps2 = now.u_mps2.map(|u| u + slope_mps2);
    let rls = stage.rls;
    let status = difference(&mut stage, before, now);
    let outcome = status.outcome;
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

/// A difference over a gap may hide another slope.
#[test]
fn samples_before_and_after_a_pause_are_no_difference() {
    for (paused, used) in [(false, true), (true, false)] {
        let mut stage = stage(DifferencedParams::default());
        let [before, now] = [0.0, 0.5].map(|a| truth().sample(&at(a)));
        stage.sample(&before);
        if paused {
            stage.pause();
        }
        let status = stage.sample(&now);
        assert_eq!(status.outcome == AidOutcome::Fused, used);
        assert_eq!(stage.excited(), used);
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
    let status = difference(&mut stage, before, now);
    // the prior is of M₀, and what is found of X₀ = M₀ + J
    let rotating_kg = vehicle().rotating_mass_kg;
    let by_mass = 0.1 * MASS0_KG / (MASS0_KG + rotating_kg);
    let regressor = (15_000.0 + rotating_kg) / (MASS0_KG + rotating_kg) * 0.5;
    let expected = 0.2 * 0.2 + by_mass * regressor * by_mass * regressor;
    assert!((status.innovation_variance / expected - 1.0).abs() < 1e-9);
}

#[test]
fn the_mass_is_a_share_of_the_first_and_beyond_its_range_cut_and_not_valid() {
    let mut stage = stage(DifferencedParams::default());
    stage.rls.belief = Gaussian::independent(vector![0.8], vector![0.02]);
    let found = stage.mass_kg();
    let whole0_kg = MASS0_KG + vehicle().rotating_mass_kg;
    let expected_kg = whole0_kg / 0.8 - vehicle().rotating_mass_kg;
    assert!(found.valid && (found.value - expected_kg).abs() < 1e-9);
    assert!((found.sd - 0.02 * whole0_kg / 0.64).abs() < 1e-6);
    let heavy = Truth {
        mass_kg: 40_000.0,
        ..truth()
    };
    for k in 0..50 {
        let [before, now] = [0.0, 0.5 + 0.01 * k as Real].map(|a| heavy.sample(&at(a)));
        difference(&mut stage, before, now);
    }
    let found = stage.mass_kg();
    assert!(stage.saturated() && !found.valid);
    assert_eq!(found.value, vehicle().mass_range_kg[1]);
}

/// Forces without any acceleration, or against it, are those of a mass beyond all bounds.
#[test]
fn samples_without_a_mass_give_a_number_that_is_not_valid() {
    for acceleration in [0.0, -0.5] {
        let mut stage = stage(DifferencedParams::default());
        for k in 0..200 {
            let before = truth().sample(&at(0.0));
            let mut now = truth().sample(&at(0.4 + 0.001 * k as Real));
            now.sample.acceleration_mps2 = acceleration;
            difference(&mut stage, before, now);
            let found = stage.mass_kg();
            assert!(found.value.is_finite() && found.sd.is_finite(), "{found:?}");
            assert!(stage.residual_n().is_finite());
        }
        let found = stage.mass_kg();
        assert!(stage.saturated() && !found.valid, "{found:?}");
        assert_eq!(found.value, vehicle().mass_range_kg[1]);
    }
}

/// A car on the level that speeds up and slows down: samples in, mass out; the brake parts the differences.
#[test]
fn from_samples_to_mass_with_a_brake_in_between() {
    let (vehicle, mass_kg) = (car(), 2_170.0);
    let params = DifferencedParams {
        mass0_kg: Some(1_900.0),
        ..Default::default()
    };
    let mut stage = DifferencedMass::new(&vehicle, params);
    for k in 0..120 {
        let a = 0.8 * (k as Real).sin();
        let sample = BalanceSample {
            sample: ResampledSample {
                force_n: (mass_kg + vehicle.rotating_mass_kg) * a
                    + mass_kg * 9.81 * vehicle.running_resistance,
                speed_mps: 10.0,
                acceleration_mps2: a,
                ..ResampledSample::default()
            },
            ..BalanceSample::default()
        };
        if k == 60 {
            stage.pause();
            assert_eq!(stage.last, None);
            assert!(!stage.excited());
            let standing = AidOutcome::Rejected(Rejection::NotRunning);
            assert_eq!(stage.sample(&sample).outcome, standing);
        } else {
            stage.sample(&sample);
        }
    }
    assert!(stage.last.is_some());
    let found = stage.mass_kg();
    assert!((found.value / mass_kg - 1.0).abs() < 1e-3, "{found:?}");
}
