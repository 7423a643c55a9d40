//! Tests of [`super`].

use super::*;
use crate::testing::Random;
use nalgebra::{Matrix2, Vector2, vector};
use std::vec::Vec;

const PRIOR_SD: [Real; 2] = [10.0, 20.0];

fn samples(count: usize) -> Vec<(Real, Vector2<Real>)> {
    let mut random = Random::new(7);
    (0..count)
        .map(|_| {
            let h = vector![1.0 + random.normal(), random.normal()];
            (3.0 * h.x - 2.0 * h.y + 0.1 * random.normal(), h)
        })
        .collect()
}

fn prior() -> Gaussian<2> {
    Gaussian::independent(vector![1.0, 1.0], PRIOR_SD.into())
}

/// Batch weighted least squares with the prior as a first, equally forgotten, measurement.
fn batch(samples: &[(Real, Vector2<Real>)], lambdas: &[Real], r: Real) -> Vector2<Real> {
    let mut information: Matrix2<Real> = prior().P.try_inverse().unwrap();
    let mut vector = information * prior().x;
    for ((y, h), lambda) in samples.iter().zip(lambdas) {
        information = information * *lambda + h * h.transpose() / r;
        vector = vector * *lambda + h * *y / r;
    }
    information.try_inverse().unwrap() * vector
}

#[test]
fn equals_batch_weighted_least_squares() {
    let samples = samples(200);
    let constant: Vec<Real> = samples.iter().map(|_| 0.98).collect();
    let time: Vec<Real> = (1..=200).map(|k| 1.0 - 0.05 * 0.98f64.powi(k)).collect();
    let ones: Vec<Real> = samples.iter().map(|_| 1.0).collect();
    for (policy, lambdas) in [
        (Forgetting::None, ones),
        (Forgetting::Constant(0.98), constant),
        (
            Forgetting::TimeLaw {
                loss: 0.05,
                decay: 0.98,
            },
            time,
        ),
    ] {
        let mut rls = Rls::new(prior(), policy);
        rls.prior *= 100.0; // no wind-up limit: the batch has none
        for (y, h) in &samples {
            let outcome = rls.update(*y, h, 0.01, false).unwrap();
            assert!(!outcome.limited);
        }
        let oracle = batch(&samples, &lambdas, 0.01);
        assert!(
            (rls.belief.x - oracle).norm() < 1e-9,
            "{policy:?}: {} against {oracle}",
            rls.belief.x
        );
    }
}

#[test]
fn dynamic_forgetting_equals_batch_with_the_factors_it_chose() {
    let samples = samples(200);
    let mut rls = Rls::new(
        prior(),
        Forgetting::Dynamic {
            floor: 0.95,
            sharpness: 1.0,
            first: 0.98,
        },
    );
    rls.prior *= 100.0; // no wind-up limit: the batch has none
    let lambdas: Vec<Real> = samples
        .iter()
        .map(|(y, h)| rls.update(*y, h, 0.01, false).unwrap().lambda)
        .collect();
    assert!(lambdas.iter().all(|l| (0.95..=1.0).contains(l)));
    assert!(
        lambdas.iter().skip(20).any(|l| *l < 0.97) && lambdas.iter().skip(20).any(|l| *l > 0.99)
    );
    assert!((rls.belief.x - batch(&samples, &lambdas, 0.01)).norm() < 1e-9);
}

#[test]
fn multiple_forgetting_with_one_parameter_is_constant_forgetting() {
    let prior = Gaussian::<1>::independent(vector![1.0], vector![10.0]);
    let mut multiple = Rls::new(prior, Forgetting::Multiple([0.97]));
    let mut constant = Rls::new(prior, Forgetting::Constant(0.97));
    for (y, h) in samples(100) {
        multiple.update(y, &vector![h.x], 0.01, false).unwrap();
        constant.update(y, &vector![h.x], 0.01, false).unwrap();
        assert!((multiple.belief.x - constant.belief.x).norm() < 1e-10);
        assert!((multiple.belief.P - constant.belief.P).norm() < 1e-10);
    }
}

#[test]
fn multiple_forgetting_follows_the_parameter_that_moves() {
    let mut random = Random::new(8);
    let mut rls = Rls::new(prior(), Forgetting::Multiple([1.0, 0.9]));
    for k in 0..2000 {
        let drift = (k as Real * 0.005).sin() * 5.0;
        let h = vector![1.0 + random.normal(), 1.0];
        rls.update(3.0 * h.x + drift, &h, 0.01, false).unwrap();
        if k > 500 {
            assert!(
                (rls.belief.x.y - drift).abs() < 0.6,
                "{k}: {} {drift}",
                rls.belief.x
            );
            assert!((rls.belief.x.x - 3.0).abs() < 0.4, "{k}: {}", rls.belief.x);
        }
    }
}

#[test]
fn an_unexcited_regressor_cannot_wind_up_the_covariance() {
    let mut rls = Rls::new(prior(), Forgetting::Constant(0.9));
    for _ in 0..10_000 {
        rls.update(1.0, &vector![1.0, 0.0], 0.01, false).unwrap();
    }
    let allowed = Vector2::from(PRIOR_SD).component_mul(&Vector2::from(PRIOR_SD));
    assert!(
        rls.belief
            .P
            .diagonal()
            .zip_map(&allowed, |p, most| p <= most * 1.000_001)
            .iter()
            .all(|ok| *ok)
    );
}

#[test]
fn dynamic_forgetting_catches_up_with_a_jump_before_plain_least_squares() {
    let mut dynamic = Rls::new(
        prior(),
        Forgetting::Dynamic {
            floor: 0.9,
            sharpness: 0.3,
            first: 0.98,
        },
    );
    let mut plain = Rls::new(prior(), Forgetting::None);
    for (k, (y, h)) in samples(400).iter().enumerate() {
        let y = if k < 300 { *y } else { y + h.x };
        dynamic.update(y, h, 0.01, false).unwrap();
        plain.update(y, h, 0.01, false).unwrap();
    }
    assert!((dynamic.belief.x.x - 4.0).abs() < 0.1);
    assert!((plain.belief.x.x - 4.0).abs() > 0.4);
}

#[test]
fn refuses_numbers_it_cannot_use_and_keeps_its_state() {
    let mut rls = Rls::new(prior(), Forgetting::None);
    let before = rls;
    assert!(
        rls.update(Real::NAN, &vector![1.0, 0.0], 1.0, false)
            .is_none()
    );
    assert!(
        rls.update(1.0, &vector![Real::INFINITY, 0.0], 1.0, false)
            .is_none()
    );
    assert!(
        rls.update(1.0, &vector![1.0, 0.0], Real::NAN, false)
            .is_none()
    );
    assert_eq!(rls, before);
}

#[test]
fn residuals_that_hang_together_are_noticed() {
    // Residuals of an AR(1) process with ρ = 0.5 make the mean three times as uncertain as white ones.
    let mut random = Random::new(9);
    let factor = |rho: Real, random: &mut Random| {
        let mut rls = Rls::new(
            Gaussian::<1>::independent(vector![0.0], vector![10.0]),
            Forgetting::None,
        );
        let (mut noise, mut sum) = (0.0, 0.0);
        for k in 0..5000 {
            noise = rho * noise + (1.0 - rho * rho).sqrt() * random.normal();
            rls.update(noise, &vector![1.0], 1.0, false).unwrap();
            sum += if k >= 1000 {
                rls.correlation_factor() / 4000.0
            } else {
                0.0
            };
        }
        sum
    };
    assert!(factor(0.0, &mut random) < 1.3);
    let tied = factor(0.5, &mut random);
    assert!((2.4..3.6).contains(&tied), "{tied}");
}

#[test]
fn reopening_touches_only_the_named_parameter() {
    let mut rls = Rls::new(prior(), Forgetting::None);
    for (y, h) in samples(50) {
        rls.update(y, &h, 0.01, false).unwrap();
    }
    let kept = rls.belief.P.m22;
    rls.reset_to_prior(&vector![1.0, 0.0]);
    assert_eq!(rls.belief.P.m11, 100.0);
    assert_eq!(rls.belief.P.m12, 0.0);
    assert_eq!(rls.belief.P.m22, kept);
}
