//! Tests of [`super`].

use super::*;
use crate::testing::balance::{Instant, Truth, steady_grade};
use crate::testing::vehicles::vehicle;
use crate::testing::{Random, chi_square_band};

const MASS0_KG: Real = 12_000.0;

fn params() -> MassParams {
    MassParams {
        mass0_kg: Some(MASS0_KG),
        ..MassParams::default()
    }
}

fn truth() -> Truth {
    Truth {
        mass_kg: 15_000.0,
        tare_kg: vehicle().tare_kg,
        rotating_mass_kg: vehicle().rotating_mass_kg,
        mu: 0.026,
        curve_m: 0.04,
        accel_bias: 0.0,
    }
}

/// A stage with what it is lent.
struct Stage {
    mass: ForceBalanceRls,
    balance: ForceBalance,
}

impl Stage {
    fn new(params: MassParams, policy: Forgetting<4>) -> Self {
        Self {
            mass: ForceBalanceRls::new(&vehicle(), params, policy, None),
            balance: ForceBalance::new(&vehicle()),
        }
    }

    /// With another standard deviation of the accelerometer's bias, m/s².
    fn with_bias_sd(params: MassParams, policy: Forgetting<4>, bias_sd_mps2: Real) -> Self {
        Self {
            mass: ForceBalanceRls::new(&vehicle(), params, policy, Some(bias_sd_mps2)),
            ..Self::new(params, policy)
        }
    }

    fn take(&mut self, sample: &BalanceSample) -> AidStatus {
        self.mass.sample(sample, &self.balance)
    }

    fn internal(&self, name: &str) -> Real {
        let internals = self.mass.internals(0.0);
        let place = ForceBalanceRls::INTERNALS
            .iter()
            .position(|i| i.name == name);
        internals[place.unwrap()]
    }
}

/// Tare and load on grades of their own, both directions, curves: the balance is linear in what is found, so without
/// noise it is found exactly. With the sign of the tare term turned round it would not be.
#[test]
fn without_noise_mass_resistance_and_what_curves_add_are_found_exactly() {
    let wide = MassParams {
        residual_sd_mps2: 1e-4,
        mu_sd: 1.0,
        curve_sd_m: 1.0,
        sway_share: 0.0,
        ..params()
    };
    let mut stage = Stage::new(wide, Forgetting::None);
    let mut random = Random::new(11);
    for _ in 0..300 {
        stage.take(&truth().sample(&Instant::draw(&mut random)));
    }
    let found = stage.mass.mass_kg();
    assert!((found.value / 15_000.0 - 1.0).abs() < 1e-6, "{found:?}");
    assert!(found.valid && !stage.mass.saturated());
    assert!((stage.internal("running_resistance") - 0.026).abs() < 1e-6);
    assert!(stage.internal("accel_bias_mps2").abs() < 1e-5);
    assert!(stage.internal("mass_residual_n").abs() < 0.01);
    assert_eq!(stage.internal("load_changes"), 0.0);
    // In a curve of 10 m: 0.026 + 0.04/10.
    assert!((stage.mass.running_resistance(0.1) - 0.030).abs() < 1e-6);
}

#[test]
fn the_bias_of_the_accelerometer_is_told_from_resistance_by_reversals() {
    let sure = MassParams {
        residual_sd_mps2: 1e-4,
        mu_sd: 1.0,
        sway_share: 0.0,
        ..params()
    };
    let biased = Truth {
        accel_bias: 0.03,
        curve_m: 0.0,
        ..truth()
    };
    let mut stage = Stage::with_bias_sd(sure, Forgetting::None, 0.5);
    let mut random = Random::new(12);
    for _ in 0..300 {
        stage.take(&biased.sample(&Instant::draw(&mut random)));
    }
    // The cosine is read with the bias: some 1e-4 of the resistance.
    assert!((stage.internal("accel_bias_mps2") - 0.03).abs() < 1e-4);
    assert!((stage.mass.mass_kg().value / 15_000.0 - 1.0).abs() < 1e-4);
    assert!((stage.internal("running_resistance") - 0.026).abs() < 1e-4);
}

/// Errors of mass, resistance and curve resistance drawn from the covariance, each put through the balance: their
/// scatter is the standard deviation reported, on steep grades, in both directions, in a curve, with correlated
/// parameters.
#[test]
fn what_mass_and_resistance_do_to_the_slope_is_the_scatter_of_slopes_drawn() {
    let mut stage = Stage::new(params(), Forgetting::None);
    let curvature = 0.15;
    let x = vector![1.2, 0.05, 0.01, 0.2];
    #[rustfmt::skip]
    let L = Matrix4::new(
        0.03, 0.0, 0.0, 0.0,
        -0.002, 0.003, 0.0, 0.0,
        0.004, 0.001, 0.005, 0.0,
        0.005, -0.004, 0.002, 0.01,
    );
    stage.mass.rls.belief = Gaussian {
        x,
        P: L * L.transpose(),
    };
    stage.mass.covariance = stage.mass.rls.widened();
    let count = 4000;
    let (low, high) = chi_square_band(count);
    for (theta, direction) in [(0.5, 1.0), (-0.5, 1.0), (0.3, -1.0), (0.0, -1.0)] {
        let mu_at = |x: &Vector4<Real>| 0.02 + (x.y + x.w * curvature) / x.x;
        let mass_kg = MASS0_KG * x.x;
        let mu = mu_at(&x);
        let traction_n = mass_kg * 9.81 * (Real::sin(theta) + direction * mu * Real::cos(theta));
        let steady = SteadyTraction {
            traction_n,
            sin_cos: [Real::sin(theta), Real::cos(theta)],
            direction,
            mu,
        };
        let sd = stage.mass.slope_sd_rad(&steady, curvature);
        let mut random = Random::new(14);
        let square = (0..count).map(|_| {
            let drawn = x + L * Vector4::from_fn(|_, _| random.normal());
            let found = steady_grade(traction_n, MASS0_KG * drawn.x, direction * mu_at(&drawn));
            ((found - theta) / sd).powi(2)
        });
        let ratio = square.sum::<Real>() / count as Real;
        assert!((low..high).contains(&ratio), "{theta} {direction}: {ratio}");
    }
}

/// (error/sd)² of the mass over draws of mass, resistance, bias and noise from the prior of the stage.
#[test]
fn the_error_of_the_mass_is_chi_square() {
    let told = MassParams {
        mass_sd: 0.1,
        excitation_gate: false,
        load_change_detector: false,
        sway_share: 0.0,
        ..params()
    };
    let runs = 300;
    let mut nees = 0.0;
    for run in 0..runs {
        let mut random = Random::new(900 + run as u64);
        let mass_kg = MASS0_KG * (1.0 + 0.1 * random.normal());
        let drawn = Truth {
            mass_kg,
            mu: 0.02 + 0.3 * 0.02 * MASS0_KG / mass_kg * random.normal(),
            curve_m: 0.05 * MASS0_KG / mass_kg * random.normal(),
            accel_bias: 0.02 * MASS0_KG / mass_kg * random.normal(),
            ..truth()
        };
        let mut stage = Stage::new(told, Forgetting::None);
        for _ in 0..10 {
            let mut sample = drawn.sample(&Instant {
                speed_mps: 1.0,
                sine: [0.05, 0.05],
                acceleration_mps2: 0.05 * random.normal(),
                curvature_per_m: 0.0,
            });
            sample.sample.force_n += told.residual_sd_mps2 * MASS0_KG * random.normal();
            stage.take(&sample);
        }
        let (x, P) = (stage.mass.rls.belief.x, stage.mass.rls.belief.P);
        nees += (x.x - mass_kg / MASS0_KG).powi(2) / P.m11 / runs as Real;
        // The standard deviation reported is never less: residuals larger than expected widen it.
        assert!(stage.mass.mass_kg().sd >= 0.999 * P.m11.sqrt() * MASS0_KG);
    }
    let (low, high) = chi_square_band(runs);
    assert!((low..high).contains(&nees), "{nees}");
}

/// Innovation variance of a sample for a stage that is sure of its parameters: that of the sample alone.
fn variance(stage: &mut Stage, acceleration: Real, doubt_mps2: Real) -> (AidOutcome, Real) {
    let mut sample = truth().sample(&Instant {
        speed_mps: 1.0,
        acceleration_mps2: acceleration,
        sine: [0.0; 2],
        curvature_per_m: 0.0,
    });
    sample.doubt_mps2 = [doubt_mps2; 2];
    let status = stage.take(&sample);
    (status.outcome, status.innovation_variance)
}

fn sure() -> MassParams {
    MassParams {
        mass_sd: 0.001,
        mu_sd: 0.0,
        curve_sd_m: 0.0,
        load_change_detector: false,
        ..params()
    }
}

#[test]
fn without_excitation_a_sample_has_its_small_weight_and_with_weight_zero_none() {
    let policy = Forgetting::Constant(0.9);
    let mut stage = Stage::with_bias_sd(sure(), policy, 0.0);
    for _ in 0..5 {
        let (outcome, found) = variance(&mut stage, 0.0, 0.0);
        assert_eq!(outcome, AidOutcome::Deweighted);
        assert!((found / (0.02 * 0.02 / 0.02) - 1.0).abs() < 1e-3, "{found}");
        assert!(!stage.mass.excited());
        assert_eq!(stage.internal("lambda"), 1.0);
    }
    let (_, found) = variance(&mut stage, 0.0, 0.05);
    assert!((found / ((0.02 * 0.02 + 0.05 * 0.05) / 0.02) - 1.0).abs() < 1e-3);

    let mut swinging = Stage::with_bias_sd(sure(), policy, 0.0);
    let mut jolts = EwmaVariance::default();
    for k in 0..20 {
        let a = if k % 2 == 0 { 0.5 } else { -0.5 };
        jolts.add(a, 1.0 - Real::exp(-0.5 / 3.0));
        let (outcome, found) = variance(&mut swinging, a, 0.0);
        if k > 0 {
            assert_eq!(outcome, AidOutcome::Fused);
            assert!(swinging.mass.excited());
            assert_eq!(swinging.internal("lambda"), 0.9);
            let expected = 0.02 * 0.02 + 0.3 * 0.3 * jolts.variance();
            assert!((found / expected - 1.0).abs() < 1e-2, "{found} {expected}");
        }
    }
    swinging.mass.pause();
    assert!(!swinging.mass.excited());

    let none = MassParams {
        unexcited_weight: 0.0,
        ..params()
    };
    let mut stage = Stage::new(none, policy);
    let before = stage.mass.rls;
    let (outcome, _) = variance(&mut stage, 0.0, 0.0);
    assert_eq!(outcome, AidOutcome::Rejected(Rejection::NotExcited));
    assert_eq!(stage.mass.rls, before);
}

#[test]
fn another_load_reopens_the_mass_and_keeps_the_rest() {
    let mut stage = Stage::new(params(), Forgetting::None);
    let mut random = Random::new(16);
    let straight = |random: &mut Random| Instant {
        curvature_per_m: 0.0,
        ..Instant::draw(random)
    };
    let light = Truth {
        mass_kg: 9_000.0,
        ..truth()
    };
    for _ in 0..100 {
        stage.take(&light.sample(&straight(&mut random)));
    }
    assert_eq!(stage.mass.before, stage.mass.rls);
    assert!((stage.mass.mass_kg().value / 9_000.0 - 1.0).abs() < 1e-3);
    for _ in 0..100 {
        stage.take(&truth().sample(&straight(&mut random)));
    }
    assert!(stage.internal("load_changes") >= 1.0);
    let found = stage.mass.mass_kg().value;
    assert!((found / 15_000.0 - 1.0).abs() < 2e-3, "{found}");
    assert!((stage.internal("running_resistance") - 0.026).abs() < 2e-3);
}

#[test]
fn beyond_its_range_the_mass_is_cut_and_not_valid() {
    let mut stage = Stage::new(params(), Forgetting::None);
    let heavy = Truth {
        mass_kg: 40_000.0,
        ..truth()
    };
    let mut random = Random::new(17);
    for _ in 0..200 {
        stage.take(&heavy.sample(&Instant::draw(&mut random)));
    }
    let found = stage.mass.mass_kg();
    assert!(stage.mass.saturated() && !found.valid);
    assert_eq!(found.value, vehicle().mass_range_kg[1]);
}

#[test]
fn mass_and_standard_deviation_are_shares_of_the_first_mass() {
    let mut stage = Stage::new(params(), Forgetting::None);
    stage.mass.rls.belief.x.x = 1.5;
    stage.mass.rls.belief.P.m11 = 0.06 * 0.06;
    stage.mass.covariance = stage.mass.rls.widened();
    let found = stage.mass.mass_kg();
    assert!((found.sd - 0.06 * MASS0_KG).abs() < 1e-6 && found.valid);
    assert!((found.value - 18_000.0).abs() < 1e-6);
}

#[test]
fn what_was_known_at_the_start_is_the_most_that_is_forgotten() {
    let mut stage = Stage::new(params(), Forgetting::Constant(0.5));
    assert_eq!(stage.internal("lambda"), 1.0);
    assert_eq!(stage.internal("windup_limit"), 0.0);
    for k in 0..40 {
        variance(&mut stage, if k % 2 == 0 { 0.2 } else { -0.2 }, 0.0);
    }
    assert_eq!(stage.internal("windup_limit"), 1.0);
}

/// The prior: a share of the mass, of the nominal resistance, and the bias of the instrument.
#[test]
fn the_prior_is_what_the_parameters_tell() {
    let mass = Stage::new(params(), Forgetting::None).mass;
    let sd = mass.covariance.diagonal().map(Real::sqrt);
    assert!((sd - vector![0.4, 0.3 * 0.02, 0.02, 0.05]).norm() < 1e-12);
}

/// The first residual on the level is (M − M₀)(f + μ₀ g) + (μ − μ₀) M g: the part that the prior does not explain.
#[test]
fn the_first_residual_is_what_the_prior_leaves_of_the_force() {
    let mut stage = Stage::new(params(), Forgetting::None);
    let (_, _) = variance(&mut stage, 0.3, 0.0);
    let expected = 3_000.0 * (0.3 + 0.02 * 9.81) + 0.006 * 15_000.0 * 9.81;
    assert!((stage.internal("mass_residual_n") - expected).abs() < 1e-6);
}

/// Residuals four times as large as expected come from a wrong noise parameter, and not from another load.
#[test]
fn a_noise_told_wrongly_is_no_change_of_load() {
    let mut stage = Stage::new(params(), Forgetting::None);
    let mut random = Random::new(18);
    for k in 0..400 {
        let mut sample = truth().sample(&Instant::draw(&mut random));
        let scale = 1.0 + 3.0 * (k as Real / 40.0).min(1.0);
        sample.sample.force_n += scale * 0.1 * MASS0_KG * random.normal();
        stage.take(&sample);
    }
    assert_eq!(stage.internal("load_changes"), 0.0);
}
