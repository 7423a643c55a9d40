//! Limits of what torque, wheel speed and accelerometer can identify: laws and orders, on a crane of one degree of
//! freedom that is written from the physics (`common/world.rs`).

use crate::common::{
    regression::{
        Regression, Row,
        Row::{Coupled, Differenced, FreeResistance, KnownResistance, Straight},
    },
    vehicle,
    world::{G, MASS_KG, MU, World, hills, level, ramp, start, steady, steep, steps, world},
};
use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::signals::Estimate;
use monorig_estimators::{Real, registry};

const SEEDS: u64 = 8;

const LIGHT_KG: Real = 12_000.0;

/// A regression on the specific force, from a mass that is a fifth too light.
fn felt(row: Row) -> Regression {
    Regression::new(row, false, LIGHT_KG)
}

/// The same on the acceleration of the wheels.
fn on_wheels(row: Row) -> Regression {
    Regression::new(row, true, LIGHT_KG)
}

/// M̂/M − 1 at the end.
fn mass_error(world: &World, mut estimator: impl Estimator) -> Real {
    let rows = world.run(&mut estimator);
    rows.last().unwrap().0.total_mass_kg.value / MASS_KG - 1.0
}

/// The same, root mean square over seeds.
fn mass_rms(world: World, estimator: impl Fn() -> Regression) -> Real {
    let square = |seed| mass_error(&World { seed, ..world }, estimator()).powi(2);
    let rms = ((1..=SEEDS).map(square).sum::<Real>() / SEEDS as Real).sqrt();
    println!("{:.2} %", 100.0 * rms);
    rms
}

/// Mean and root mean square of the grade error from 5 s on, deg.
fn grade_errors(world: &World, estimator: &mut impl Estimator) -> (Real, Real) {
    let rows = world.run(estimator);
    let late = &rows[500..];
    let error = |(e, theta): &(Estimate, Real)| (e.grade_rad.value - theta).to_degrees();
    let mean = late.iter().map(error).sum::<Real>() / late.len() as Real;
    let square = late.iter().map(|row| error(row).powi(2)).sum::<Real>() / late.len() as Real;
    (mean, square.sqrt())
}

/// I1. F = M μ g is one number: with μ known M is as good as μ g − b, with μ free it stays where it started.
#[test]
fn constant_speed_on_the_level_does_not_tell_the_mass() {
    let world = world(level, steady);
    for bias_mps2 in [-0.03, 0.0, 0.05] {
        let biased = World { bias_mps2, ..world };
        let law = MU * G / (MU * G + bias_mps2) - 1.0;
        let error = mass_error(&biased, Regression::new(KnownResistance, false, 16_000.0));
        println!("R-G, bias {bias_mps2}: {error:.4}, by the law {law:.4}");
        assert!((error - law).abs() < 0.02, "{error} {law}");
    }
    let (free, coupled) = (
        mass_rms(world, || felt(FreeResistance)),
        mass_rms(world, || on_wheels(Coupled)),
    );
    assert!(free > 0.1 && coupled > 0.1, "{free} {coupled}");
    let rows = world.run(&mut registry::build("dffrls_aekf_robust", &vehicle(2), []).unwrap());
    assert!(
        rows.iter()
            .all(|(estimate, _)| !estimate.total_mass_kg.valid)
    );
}

/// I2, I3. Every regression finds it from a start, or from steps of speed.
#[test]
fn a_start_or_steps_of_speed_on_the_level_tell_the_mass_to_all() {
    for speed in [start, steps] {
        for (row, wheels) in [
            (Coupled, true),
            (KnownResistance, false),
            (FreeResistance, false),
        ] {
            let error = mass_rms(world(level, speed), || {
                Regression::new(row, wheels, LIGHT_KG)
            });
            assert!(error < 0.08, "{row:?}: {error}");
        }
    }
}

/// I4. On the specific force a change of slope is the best there is; to R-A on wheel acceleration it is the worst: the
/// force varies without acceleration, so that the mass must be infinite.
#[test]
fn a_change_of_slope_at_constant_speed_is_the_best_for_one_and_the_worst_for_the_other() {
    let world = world(ramp, steady);
    let (known, free) = (
        mass_rms(world, || felt(KnownResistance)),
        mass_rms(world, || felt(FreeResistance)),
    );
    assert!(known < 0.02 && free < 0.02, "{known} {free}");
    let mut coupled = on_wheels(Coupled);
    let (last, _) = *world.run(&mut coupled).last().unwrap();
    let most = vehicle(2).mass_range_kg[1];
    assert!(last.total_mass_kg.value > 0.999 * most, "{last:?}");
    // The same regression, fed what an accelerometer reads, is as good as the others.
    let by_force = mass_rms(world, || felt(Coupled));
    assert!(by_force < 0.02, "{by_force}");
}

/// I5. A slope that stays is one number again, but a large one: μ and b count for less.
#[test]
fn a_steady_slope_tells_the_mass_only_where_the_resistance_is_known() {
    let world = world(steep, steady);
    for bias_mps2 in [-0.03, 0.05] {
        let biased = World { bias_mps2, ..world };
        let level_force = G * (steep(0.0).sin() + MU * steep(0.0).cos());
        let law = level_force / (level_force + bias_mps2) - 1.0;
        let error = mass_error(&biased, Regression::new(KnownResistance, false, 16_000.0));
        assert!((error - law).abs() < 0.01, "{error} {law}");
    }
    let (known, free) = (
        mass_rms(world, || felt(KnownResistance)),
        mass_rms(world, || felt(FreeResistance)),
    );
    assert!(known < 0.01 && free > 5.0 * known, "{known} {free}");
}

/// I6. A torque that reads e too much is a mass e too large, whatever the regression; a slope that needs no torque does
/// not change.
#[test]
fn a_torque_gain_is_a_mass_gain() {
    let (e, right) = (0.03, world(hills, steps));
    let wrong = World {
        torque_gain: 1.0 + e,
        ..right
    };
    for row in [Coupled, Straight, KnownResistance, FreeResistance] {
        let gain = (1.0 + mass_error(&wrong, felt(row))) / (1.0 + mass_error(&right, felt(row)));
        // J v̇ and the prior have no part in the gain.
        assert!((gain - 1.0 - e).abs() < 0.1 * e, "{row:?}: {gain}");
    }
    let inertial = |world: &World| {
        let mut estimator = registry::build("dffrls_aukf", &vehicle(2), []).unwrap();
        grade_errors(world, &mut estimator)
    };
    assert_eq!(inertial(&right), inertial(&wrong));
    let dynamic = |world: &World| grade_errors(world, &mut felt(KnownResistance)).1;
    let (right, wrong) = (dynamic(&right), dynamic(&wrong));
    assert!((right - wrong).abs() < 0.02, "{right}° {wrong}°");
}

/// I7, I8. A wrong μ or a bias costs the mass and the slope of the regression that takes them for known; the free one
/// does not care.
#[test]
fn what_is_left_free_does_not_matter_and_what_is_taken_for_known_does() {
    let right = world(hills, steps);
    let more = World {
        mu: 1.25 * MU,
        ..right
    };
    let biased = World {
        bias_mps2: 0.049,
        ..right
    };
    let free = mass_error(&right, felt(FreeResistance));
    let known = mass_rms(right, || felt(KnownResistance));
    for (name, wrong) in [("mu", more), ("bias", biased)] {
        let moved = mass_error(&wrong, felt(FreeResistance)) - free;
        assert!(moved.abs() < 0.003, "{name}: {moved}");
        let paid = mass_rms(wrong, || felt(KnownResistance));
        assert!(paid > 2.0 * known, "{name}: {known} {paid}");
        let slope = |world: &World| grade_errors(world, &mut felt(KnownResistance)).0.abs();
        let (before, after) = (slope(&right), slope(&wrong));
        assert!(after > before + 0.05, "{name}: {before}° {after}°");
    }
}

/// I9. Where it started is forgotten once there was excitation.
#[test]
fn a_first_mass_far_off_is_forgotten() {
    let world = world(hills, steps);
    for row in [Coupled, Straight, KnownResistance, FreeResistance] {
        let from = |kg: Real| mass_error(&world, Regression::new(row, false, kg));
        let (low, right) = (from(0.4 * MASS_KG), from(MASS_KG));
        assert!((low - right).abs() < 0.01, "{row:?}: {low} {right}");
    }
}

/// I10. One direction gives s μ g − b as one number; a second one parts them. A slope from the accelerometer is off by
/// b/g, for ever.
#[test]
fn bias_parts_from_resistance_by_reversal_and_never_from_the_slope() {
    let (bias_mps2, mu) = (0.06, 0.03);
    let free_term = |speed: fn(Real) -> Real| {
        let world = World {
            bias_mps2,
            mu,
            ..world(hills, speed)
        };
        let mut estimator = felt(FreeResistance);
        world.run(&mut estimator);
        let [mass, free] = estimator.found();
        free / mass
    };
    let (forward, back) = (free_term(steps), free_term(|t| -steps(t)));
    let cosine = 0.9975; // mean over the hills
    assert!(
        (forward - (mu * G * cosine - bias_mps2)).abs() < 0.01,
        "{forward}"
    );
    assert!(
        (back - (-mu * G * cosine - bias_mps2)).abs() < 0.01,
        "{back}"
    );
    assert!(((forward - back) / 2.0 - mu * G).abs() < 0.01);
    assert!(((forward + back) / 2.0 + bias_mps2).abs() < 0.01);

    for seconds in [60.0, 300.0] {
        let world = World {
            bias_mps2,
            seconds,
            ..world(hills, steps)
        };
        let mut estimator = registry::build("dffrls_ukf", &vehicle(2), []).unwrap();
        let offset = grade_errors(&world, &mut estimator).0;
        let law = (bias_mps2 / G).to_degrees();
        assert!(
            (offset - law).abs() < 0.02,
            "{offset}° after {seconds} s, {law}°"
        );
    }
}

/// I11. Wheel speed as the only measurement of a joint filter leaves mass and slope tied together: it must be poor.
#[test]
fn a_joint_filter_on_wheel_speed_alone_is_poor() {
    let world = world(ramp, steady);
    let mut square = 0.0;
    for seed in 1..=SEEDS {
        let mut joint =
            registry::build("joint_ekf", &vehicle(2), [("mass0_kg", LIGHT_KG.into())]).unwrap();
        let (last, _) = *World { seed, ..world }.run(&mut joint).last().unwrap();
        square += (last.total_mass_kg.value / MASS_KG - 1.0).powi(2) / SEEDS as Real;
    }
    let (joint, free) = (square.sqrt(), mass_rms(world, || felt(FreeResistance)));
    println!("joint {joint:.3}, R-H {free:.4}");
    assert!(joint > 0.1 && joint > 5.0 * free, "{joint} {free}");
}

/// R-D with the slope of a filter that inverts the same balance: any mass has a slope to go with it, and the one it
/// started from stays. With the accelerometer in its place the start is forgotten.
#[test]
fn mass_and_slope_from_one_force_balance_chase_each_other() {
    let world = world(ramp, steady);
    let ends = |wheels| {
        [10_000.0, 22_000.0].map(|kg| mass_error(&world, Regression::new(Straight, wheels, kg)))
    };
    let ([low, high], [felt_low, felt_high]) = (ends(true), ends(false));
    println!(
        "by its own slope {low:.3} {high:.3}, by the accelerometer {felt_low:.4} {felt_high:.4}"
    );
    assert!(high - low > 0.3, "{low} {high}");
    assert!(
        (felt_high - felt_low).abs() < 0.02,
        "{felt_low} {felt_high}"
    );
}

/// Differences rid the balance of μ, b and a slope that stays; one that changes passes for acceleration, unless the
/// accelerometer is used.
#[test]
fn differences_need_a_slope_that_stays_or_an_accelerometer() {
    let differenced =
        |world: World, wheels| mass_rms(world, || Regression::new(Differenced, wheels, LIGHT_KG));
    let jerky = world(level, steps);
    let unlike = World {
        mu: 1.5 * MU,
        bias_mps2: 0.05,
        ..jerky
    };
    let (right, wrong) = (differenced(jerky, true), differenced(unlike, true));
    assert!(right < 0.1 && wrong < 0.1, "{right} {wrong}");
    let hilly = world(hills, steady);
    let (wheels, felt) = (differenced(hilly, true), differenced(hilly, false));
    assert!(felt < 0.1 && wheels > 3.0 * felt, "{wheels} {felt}");
}
