//! Tests of [`super`].

use super::*;
use crate::models::sample::ResampledSample;
use crate::models::single_track::Bends;
use crate::testing::balance::{Instant, Truth, steady_grade};
use crate::testing::vehicles::{Turn, car, vehicle};
use crate::testing::{Random, chi_square_band};

/// The car of 2 170 kg in a steady turn up a tenth, with 2 500 kg assumed.
fn turning(vehicle: &Vehicle) -> MultiModelMass {
    let params = MultiModelParams {
        mass0_kg: Some(2_500.0),
        ..Default::default()
    };
    let mut stage = MultiModelMass::new(vehicle, params, None);
    let balance = ForceBalance::new(vehicle);
    let turn = Turn::solve(2_170.0, 8.0, 0.5, 1.0);
    let reading = turn.reading();
    let sample = BalanceSample {
        sample: ResampledSample {
            force_n: balance.net_traction(reading.motor_torque_nm.unwrap(), turn.speed),
            speed_mps: turn.speed,
            period_s: 0.5,
            ..ResampledSample::default()
        },
        u_mps2: [turn.uphill; 2],
        ..BalanceSample::default()
    };
    let mut bends = Bends::new(vehicle, 1.0);
    for _ in 0..120 {
        for _ in 0..50 {
            bends.step(&reading, &balance, stage.mass_kg().value, 0.01);
        }
        let bend = bends.filtered();
        stage.sample(&BalanceSample { bend, ..sample }, &balance);
    }
    stage
}

#[test]
fn the_straight_model_is_too_heavy_in_a_turn_and_the_turning_model_is_not() {
    let kg = |rls: &Rls<1>, stage: &MultiModelMass| stage.found(rls) * stage.mass0_kg;
    let stage = turning(&car());
    let (straight, right) = (kg(&stage.straight, &stage), kg(&stage.turning, &stage));
    // It takes the side force for mass: F = M (g sin θ + μ g cos θ).
    let (turn, uphill) = (Turn::solve(2_170.0, 8.0, 0.5, 1.0), 1.0);
    let cosine = (1.0 - (uphill / 9.81 as Real).powi(2)).sqrt();
    let level = uphill + car().running_resistance * 9.81 * cosine;
    let torque = turn.reading().motor_torque_nm.unwrap();
    let expected = ForceBalance::new(&car()).net_traction(torque, turn.speed) / level;
    assert!(
        expected > 2_400.0 && (straight / expected - 1.0).abs() < 0.03,
        "{straight}"
    );
    assert!((right / 2_170.0 - 1.0).abs() < 0.03, "{right}");
    let value = stage.mass_kg().value;
    assert!(value < straight && value > right, "{value}");
    // On a rail there is only the straight model.
    let rail = turning(&car().without_road());
    assert_eq!(rail.straight_weight, 1.0);
    assert_eq!(rail.mass_kg().value, kg(&rail.straight, &rail));
}

#[test]
fn the_smaller_residual_is_the_likelier_whatever_its_sign() {
    let rls = Rls::new(
        Gaussian::<1>::independent(vector![1.0], vector![0.1]),
        Forgetting::None,
    );
    let at = |residual: Real| {
        log_likelihood(
            &rls,
            &Outcome {
                residual,
                ..Outcome::default()
            },
            1.0,
            0.01,
        )
    };
    assert!(at(0.0) > at(0.1) && at(0.1) > at(0.3));
    assert_eq!(at(-0.2), at(0.2));
}

const MASS0_KG: Real = 12_000.0;

fn truth() -> Truth {
    Truth {
        mass_kg: 15_000.0,
        tare_kg: vehicle().tare_kg,
        rotating_mass_kg: vehicle().rotating_mass_kg,
        mu: vehicle().running_resistance,
        curve_m: 0.0,
        accel_bias: 0.0,
    }
}

/// A stage on a rail with what it is lent.
struct Stage {
    mass: MultiModelMass,
    balance: ForceBalance,
}

impl Stage {
    fn new(params: MultiModelParams) -> Self {
        let params = MultiModelParams {
            mass0_kg: Some(MASS0_KG),
            ..params
        };
        Self {
            mass: MultiModelMass::new(&vehicle(), params, None),
            balance: ForceBalance::new(&vehicle()),
        }
    }

    fn take(&mut self, sample: &BalanceSample) -> AidStatus {
        self.mass.sample(sample, &self.balance)
    }

    fn internal(&self, name: &str) -> Real {
        let place = MultiModelMass::INTERNALS
            .iter()
            .position(|i| i.name == name);
        self.mass.internals(0.0)[place.unwrap()]
    }
}

/// Tare and load on grades of their own, both directions. With the sign of the tare term turned round the mass would be
/// another.
#[test]
fn without_noise_the_mass_of_a_long_train_is_found_exactly() {
    let mut stage = Stage::new(MultiModelParams {
        residual_sd_mps2: 1e-4,
        load_change_detector: false,
        ..Default::default()
    });
    let mut random = Random::new(21);
    for _ in 0..200 {
        stage.take(&truth().sample(&Instant::draw(&mut random)));
    }
    // At the start the cosine is that of a lighter train: some 1e-3 of the resistance in the first samples.
    let found = stage.mass.mass_kg();
    assert!((found.value / 15_000.0 - 1.0).abs() < 1e-5, "{found:?}");
    assert!(stage.internal("mass_residual_n").abs() < 0.5);
    assert!((stage.internal("straight_mass_kg") / found.value - 1.0).abs() < 1e-12);
    assert_eq!(stage.internal("turning_mass_kg"), MASS0_KG);
    assert!(!stage.mass.saturated());
    // The time law settles at remembering all.
    assert!(stage.internal("lambda") > 0.99);
}

/// Least squares with a prior: an error δ of the level makes χ wrong by δ Σa/(Σa² + r/P₀).
#[test]
fn an_error_of_the_level_is_reckoned_as_least_squares_has_it() {
    let params = MultiModelParams {
        loss: 0.0,
        load_change_detector: false,
        ..Default::default()
    };
    let level_sd = (0.3 * 0.02 * GRAVITY).hypot(0.02);
    let mut stage = Stage::new(params);
    assert_eq!(stage.mass.level_error(), 0.0);
    let right = Truth {
        mass_kg: MASS0_KG,
        ..truth()
    };
    for k in 0..30 {
        let mut sample = right.sample(&Instant {
            speed_mps: 1.0,
            acceleration_mps2: 0.3 * (k as Real).sin(),
            sine: [0.04; 2],
            curvature_per_m: 0.0,
        });
        sample.sample.force_n += MASS0_KG * level_sd;
        stage.take(&sample);
        let share = stage.mass.straight.belief.x.x - 1.0;
        assert!(
            (stage.mass.level_error() / share - 1.0).abs() < 1e-6,
            "{share}"
        );
    }
    // The standard deviation reported for the mass is at least that large.
    assert!(stage.mass.sums[0] > 1.0 && stage.mass.sums[1] > 1.0);
    let found = stage.mass.mass_kg();
    assert!(found.sd >= found.value * stage.mass.level_error());
    let variance = stage.mass.straight.widened().x * MASS0_KG * MASS0_KG;
    let level = found.value * stage.mass.level_error();
    assert!((found.sd / (variance + level * level).sqrt() - 1.0).abs() < 1e-9);
}

/// A mixture of two normal laws: mean and variance by total expectation.
#[test]
fn the_mass_of_two_models_has_the_variance_of_their_mixture() {
    let mut stage = Stage::new(MultiModelParams::default());
    let (weight, means, sds) = (0.3, [1.1, 1.6], [0.05, 0.02]);
    stage.mass.straight_weight = weight;
    for (rls, (mean, sd)) in [&mut stage.mass.straight, &mut stage.mass.turning]
        .into_iter()
        .zip(means.into_iter().zip(sds))
    {
        rls.belief = Gaussian::independent(vector![mean], vector![sd]);
    }
    let mean = weight * means[0] + 0.7 * means[1];
    let second = weight * (means[0] * means[0] + sds[0] * sds[0])
        + 0.7 * (means[1] * means[1] + sds[1] * sds[1]);
    let found = stage.mass.mass_kg();
    assert!((found.value / (mean * MASS0_KG) - 1.0).abs() < 1e-12);
    let sd = (second - mean * mean).sqrt() * MASS0_KG;
    assert!((found.sd / sd - 1.0).abs() < 1e-9, "{} {sd}", found.sd);
}

#[test]
fn beyond_its_range_the_mass_is_cut_and_not_valid() {
    let mut stage = Stage::new(MultiModelParams {
        load_change_detector: false,
        ..Default::default()
    });
    let heavy = Truth {
        mass_kg: 40_000.0,
        ..truth()
    };
    let mut random = Random::new(22);
    for _ in 0..200 {
        stage.take(&heavy.sample(&Instant::draw(&mut random)));
    }
    let found = stage.mass.mass_kg();
    assert!(stage.mass.saturated() && !found.valid);
    assert_eq!(found.value, vehicle().mass_range_kg[1]);
}

#[test]
fn another_load_starts_both_models_again_from_the_mass_they_have() {
    let mut stage = Stage::new(MultiModelParams::default());
    let mut random = Random::new(23);
    let light = Truth {
        mass_kg: 9_000.0,
        ..truth()
    };
    for _ in 0..100 {
        stage.take(&light.sample(&Instant::draw(&mut random)));
    }
    assert_eq!(stage.internal("load_changes"), 0.0);
    assert!((stage.mass.mass_kg().value / 9_000.0 - 1.0).abs() < 1e-3);
    let sums = stage.mass.sums;
    let mut restarted = stage.mass;
    restarted.restart();
    assert!(sums[1] > 1.0 && restarted.sums == [0.0; 2]);
    assert_eq!(restarted.straight.belief.x, stage.mass.straight.belief.x);
    assert_eq!(restarted.straight.belief.P, stage.mass.start.belief.P);
    for _ in 0..100 {
        stage.take(&truth().sample(&Instant::draw(&mut random)));
    }
    assert!(stage.internal("load_changes") >= 1.0);
    let found = stage.mass.mass_kg().value;
    assert!((found / 15_000.0 - 1.0).abs() < 1e-3, "{found}");
}

/// Errors of mass and of resistance drawn and put through the balance.
#[test]
fn what_mass_and_resistance_do_to_the_slope_is_the_scatter_of_slopes_drawn() {
    let count = 4000;
    let (low, high) = chi_square_band(count);
    for (theta, direction, mass_sd, mu_sd) in [
        (0.5, 1.0, 0.03, 0.01),
        (-0.4, 1.0, 0.01, 0.5),
        (0.3, -1.0, 0.01, 0.5),
    ] {
        let mut stage = Stage::new(MultiModelParams {
            mu_sd,
            ..Default::default()
        });
        stage.mass.straight.belief = Gaussian::independent(vector![1.2], vector![1.2 * mass_sd]);
        let (mass_kg, mu) = (1.2 * MASS0_KG, 0.02);
        let traction_n = mass_kg * 9.81 * (Real::sin(theta) + direction * mu * Real::cos(theta));
        let steady = SteadyTraction {
            traction_n,
            sin_cos: [Real::sin(theta), Real::cos(theta)],
            direction,
            mu,
        };
        let sd = stage.mass.slope_sd_rad(&steady, 0.0);
        let mut random = Random::new(24);
        let square = (0..count).map(|_| {
            let kg = mass_kg * (1.0 + mass_sd * random.normal());
            let resistance = direction * mu * (1.0 + mu_sd * random.normal());
            ((steady_grade(traction_n, kg, resistance) - theta) / sd).powi(2)
        });
        let ratio = square.sum::<Real>() / count as Real;
        assert!((low..high).contains(&ratio), "{theta} {direction}: {ratio}");
    }
}

/// Gaussian in tanh of the residual over twice its standard deviation, of variance S = 1 + a² P/r.
#[test]
fn the_likelihood_is_a_normal_density() {
    let (a, p, r, residual): (Real, Real, Real, Real) = (2.0, 0.04, 0.01, 0.15);
    let rls = Rls::new(
        Gaussian::<1>::independent(vector![1.0], vector![p.sqrt()]),
        Forgetting::None,
    );
    let outcome = Outcome {
        residual,
        ..Outcome::default()
    };
    let variance = 1.0 + a * a * p / r;
    let size = (residual / (2.0 * r.sqrt())).tanh();
    let density = (-size * size / (2.0 * variance)).exp() / (2.0 * PI * variance).sqrt();
    assert!((log_likelihood(&rls, &outcome, a, r) - density.ln()).abs() < 1e-12);
}

/// Each has the mass that explains a steady turn.
#[test]
fn models_that_explain_the_traction_alike_weigh_alike() {
    let stage = turning(&car());
    assert!(
        (stage.straight_weight - 0.5).abs() < 1e-3,
        "{}",
        stage.straight_weight
    );
}

/// On the level, at the start: (M − M₀)(f + μ g) is not explained, and the innovation variance is that of the sample
/// and of the prior.
#[test]
fn the_first_residual_and_its_variance() {
    for doubt in [0.0, 0.1] {
        let mut stage = Stage::new(MultiModelParams::default());
        let mut sample = truth().sample(&Instant {
            speed_mps: 1.0,
            acceleration_mps2: 0.3,
            sine: [0.0; 2],
            curvature_per_m: 0.0,
        });
        sample.doubt_mps2 = [doubt; 2];
        let status = stage.take(&sample);
        let a = 0.3 + 0.02 * 9.81;
        assert!((stage.internal("mass_residual_n") - 3_000.0 * a).abs() < 1e-6);
        let expected = 0.02 * 0.02 + doubt * doubt + 0.4 * 0.4 * a * a;
        assert!((status.innovation_variance / expected - 1.0).abs() < 1e-9);
    }
}

/// Sums forget as the regression does: by λ = 1 − loss · decayᵏ.
#[test]
fn an_error_of_the_level_is_forgotten_with_its_samples() {
    let mut stage = Stage::new(MultiModelParams::default());
    let mut sums = [0.0; 2];
    for k in 0..50 {
        let acceleration_mps2 = 0.3 * (k as Real).cos();
        stage.take(&truth().sample(&Instant {
            speed_mps: 1.0,
            acceleration_mps2,
            sine: [0.0; 2],
            curvature_per_m: 0.0,
        }));
        let a = acceleration_mps2 + 0.02 * 9.81;
        let lambda = stage.internal("lambda");
        sums = [lambda * sums[0] + a, lambda * sums[1] + a * a];
        let [first, second] = stage.mass.sums;
        assert!((first - sums[0]).abs() < 1e-9 && (second - sums[1]).abs() < 1e-9);
    }
}

/// Residuals four times as large as expected come from a wrong noise parameter, and not from another load.
#[test]
fn a_noise_told_wrongly_is_no_change_of_load() {
    let mut stage = Stage::new(MultiModelParams::default());
    let mut random = Random::new(25);
    for k in 0..400 {
        let mut sample = truth().sample(&Instant::draw(&mut random));
        let scale = 1.0 + 3.0 * (k as Real / 40.0).min(1.0);
        sample.sample.force_n += scale * 0.02 * MASS0_KG * random.normal();
        stage.take(&sample);
    }
    assert_eq!(stage.internal("load_changes"), 0.0);
}
