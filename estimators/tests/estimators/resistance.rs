//! Running resistance of a train of known mass: what the identification finds, and the effect of wrong parameters on
//! it.

use crate::common::{Crane, Random, vehicle};
use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::params::{Parameters, Setting};
use monorig_estimators::api::signals::{Command, Measurements, Vehicle, VehicleData};
use monorig_estimators::supervised::resistance as resistance_robust;
use monorig_estimators::supervised::resistance::{SpeedPrediction, Surveyed};
use monorig_estimators::{Real, registry};

const GRAVITY: Real = 9.81;
const DT: Real = 0.01;
const MASS_KG: Real = 50_000.0;
/// True running resistance; no estimator here is given it.
const MU: Real = 0.024;

fn train() -> Vehicle {
    Vehicle::new(VehicleData {
        running_resistance: MU,
        mass_range_kg: [10_000.0, 60_000.0],
        ..vehicle(2).data()
    })
    .unwrap()
}

/// Vehicle that the estimators are built with: everything but the resistance.
fn told() -> Vehicle {
    Vehicle::new(VehicleData {
        running_resistance: 0.0,
        ..train().data()
    })
    .unwrap()
}

/// 1 200 m of a grade between 2° and 8°, rad.
fn climb(chainage_m: Real) -> Real {
    (5.0 + 3.0 * (chainage_m / 60.0).sin()).to_radians()
}

/// Drives the climb at 2 m/s (downwards, if `direction` is −1); `each` sees every step.
fn drive(direction: Real, seed: u64, mut each: impl FnMut(Measurements, Real)) {
    let mut crane = Crane::new(train(), MASS_KG, seed);
    for _ in 0..60_000 {
        let grade = climb(crane.chainage_m);
        crane.grade_rad = grade;
        each(crane.step(2.0 * direction, DT), grade);
    }
}

/// μ and its standard deviation at the end, by the pipeline, with an accelerometer bias.
fn identified(direction: Real, bias: Real, settings: &[(&str, Setting)]) -> (Real, Real) {
    let known = [("known_mass_kg", MASS_KG.into())];
    let settings = known.into_iter().chain(settings.iter().copied());
    let mut estimator = registry::build("resistance_dffrls_robust", &told(), settings).unwrap();
    drive(direction, 3, |mut z, _| {
        for f in z.specific_force_mps2.iter_mut() {
            f.value[0] += bias;
        }
        estimator.step(&z, &Command::default(), DT).unwrap();
    });
    let mut internals = [0.0; 4];
    estimator.internal_values(&mut internals);
    (internals[0], internals[1])
}

/// The same with a survey in place of the accelerometer, off by `error_rad`.
fn surveyed(direction: Real, error_rad: Real) -> (Real, Real) {
    let mut params = resistance_robust::Params::default();
    params.set("known_mass_kg", MASS_KG.into()).unwrap();
    let mut estimator = Surveyed::new(&told(), &params);
    let mut last = (0.0, 0.0);
    drive(direction, 4, |mut z, grade| {
        z.specific_force_mps2 = None;
        last = estimator
            .step(&z, &Command::default(), DT, grade + error_rad)
            .unwrap();
    });
    last
}

#[test]
fn finds_the_coefficient_in_both_directions_without_knowing_anything_of_it() {
    for direction in [1.0, -1.0] {
        for (by, (mu, sd)) in [
            ("accelerometer", identified(direction, 0.0, &[])),
            ("survey", surveyed(direction, 0.0)),
        ] {
            println!("{by}, {direction}: {mu:.5} ± {sd:.5}");
            assert!((mu - MU).abs() < 5e-4, "{by}: {mu}");
            assert!((mu - MU).abs() < sd, "{by}: {mu} ± {sd}");
        }
    }
}

#[test]
fn a_bias_of_the_accelerometer_is_one_of_the_coefficient_with_the_sign_of_the_speed() {
    let bias = 0.05;
    for direction in [1.0, -1.0] {
        let moved = identified(direction, bias, &[]).0 - identified(direction, 0.0, &[]).0;
        let law = -direction * bias / GRAVITY;
        assert!((moved - law).abs() < 0.03 * law.abs(), "{moved} for {law}");
    }
}

#[test]
fn an_error_of_the_survey_is_one_of_the_coefficient() {
    // sin(θ + ε) ≈ sin θ + ε cos θ, and the coefficient stands beside cos θ.
    let error = 0.1f64.to_radians();
    let moved = surveyed(1.0, error).0 - surveyed(1.0, 0.0).0;
    assert!((moved + error).abs() < 0.03 * error, "{moved}");
}

#[test]
fn an_error_of_the_known_mass_counts_by_the_load_and_is_in_the_standard_deviation() {
    let heavier = [("known_mass_kg", (1.02 * MASS_KG).into())];
    let (right, _) = identified(1.0, 0.0, &[]);
    let (wrong, sd) = identified(1.0, 0.0, &heavier);
    // Last sample but the memory of the forgetting: |F|/(M g) = sin θ + μ is between 0.06 and 0.165 on this climb.
    let moved = (right - wrong) / 0.02;
    assert!((0.06..0.165).contains(&moved), "{moved}");
    let legitimate_repeats = identified(1.0, 0.0, &[("known_mass_sd", 0.02.into())]).1;
    assert!(
        legitimate_repeats > sd && legitimate_repeats > (wrong - MU).abs(),
        "{legitimate_repeats} {wrong}"
    );
}

#[test]
fn the_coefficient_predicts_the_speed_of_a_descent_and_a_wrong_one_does_not() {
    let identified = surveyed(1.0, 0.0).0;
    let horizon = 10.0;
    let largest_error = |coefficient: Real| {
        let mut random = Random::new(8);
        let mut crane = Crane::new(train(), MASS_KG, 9);
        crane.chainage_m = 1200.0;
        let mut worst: Real = 0.0;
        let mut prediction = SpeedPrediction::new(&told(), MASS_KG, coefficient, 0.0);
        for k in 1..=30_000 {
            let grade = climb(crane.chainage_m);
            crane.grade_rad = grade;
            let wanted = -1.5 + 0.3 * (0.05 * crane.t_s).sin();
            let z = crane.step(wanted, DT);
            let torque = z.motor_torque_nm.iter().flatten().map(|s| s.value).sum();
            let predicted = prediction.step(torque, grade, DT);
            if k % (horizon / DT) as usize == 0 {
                worst = (predicted - crane.speed_mps).abs().max(worst);
                let measured = crane.speed_mps + 0.005 * random.normal();
                prediction = SpeedPrediction::new(&told(), MASS_KG, coefficient, measured);
            }
        }
        worst
    };
    // An error Δμ of the coefficient is one of Δμ g T/γ of the speed after T.
    let gamma = 1.0 + train().rotating_mass_kg / MASS_KG;
    let bound = 0.02 + 5e-4 * GRAVITY * horizon / gamma;
    let (good, bad) = (largest_error(identified), largest_error(MU + 0.005));
    println!("speed after {horizon} s: off by {good:.4} m/s at most, {bad:.4} with a wrong one");
    assert!(good < bound, "{good}");
    assert!(bad > 0.8 * 0.005 * GRAVITY * horizon / gamma, "{bad}");
}

#[test]
fn a_survey_that_is_not_a_number_is_refused_and_changes_nothing() {
    let mut estimator = Surveyed::new(&told(), &resistance_robust::Params::default());
    let before = estimator;
    let z = Crane::new(train(), MASS_KG, 1).step(1.0, DT);
    assert!(
        estimator
            .step(&z, &Command::default(), DT, Real::NAN)
            .is_err()
    );
    assert_eq!(estimator, before);
}
