//! Mass: what it needs, what it does not, and what their standard deviations are worth.

use super::*;
use crate::api::signals::VehicleData;

#[test]
fn liu_2023_finds_mass_within_a_percent_and_slope_within_three_tenths_of_a_degree() {
    for seed in 1..=10 {
        let mut estimator = build(
            "dffrls_aekf_robust",
            &vehicle(),
            [("mass0_kg", 12_000.0.into())],
        )
        .unwrap();
        let rows = world(seed).run(&mut estimator);
        let (mass, slope) = (mass_error(&rows, 50.0), grade_error_deg(&rows, 10.0));
        std::println!("seed {seed}: mass {:.3} %, slope {slope:.3}°", 100.0 * mass);
        assert!(mass < 0.01, "seed {seed}: {mass}");
        assert!(slope < 0.3, "seed {seed}: {slope}");
        assert!(rows.last().unwrap().estimate.total_mass_kg.valid);
    }
}

#[test]
fn mass_needs_neither_the_running_resistance_nor_the_accelerometer_bias() {
    let drawn = |seed| {
        let mut random = Random::new(900 + seed);
        World {
            mu: 0.02 * (1.0 + 0.25 * random.normal()),
            accel_bias: 0.00978 * random.normal(),
            ..world(seed)
        }
    };
    let (bias, rms, _) = mass_statistics("dffrls_aekf_robust", drawn);
    // The gain of the torques, which nothing sees: 0.5 % of each sensor, 3.5 % of the efficiency, 1 % of the radius.
    let gain_sd = (0.005f64.powi(2) / 8.0 + 0.035f64.powi(2) + 0.01f64.powi(2)).sqrt() as Real;
    let (_, _, normalised) = mass_statistics("dffrls_aekf_robust", |seed| World {
        torque_gain: 1.0 + gain_sd * Random::new(950 + seed).normal(),
        ..drawn(seed)
    });
    std::println!(
        "bias {:.3} %, rms {:.3} %, (error/sd)² {normalised:.2}",
        100.0 * bias,
        100.0 * rms
    );
    assert!(bias.abs() < 0.002 && rms < 0.005, "{bias} {rms}");
    // Its own standard deviation is right, within the scatter of forty draws and the disturbance not being white.
    assert!((0.5..1.6).contains(&normalised), "{normalised}");
}

#[test]
fn a_torque_gain_error_is_a_mass_error_and_hardly_a_slope_error() {
    let (mut slope, mut slope_gain, mut ratio) = (0.0, 0.0, 0.0);
    for seed in 1..=10 {
        let run = |torque_gain| {
            let mut estimator = build("dffrls_aekf_robust", &vehicle(), []).unwrap();
            World {
                torque_gain,
                ..world(seed)
            }
            .run(&mut estimator)
        };
        let (right, wrong) = (run(1.0), run(1.02));
        let mass = |rows: &[Row]| rows.last().unwrap().estimate.total_mass_kg.value;
        ratio += mass(&wrong) / mass(&right) / 10.0;
        slope += grade_error_deg(&right, 20.0) / 10.0;
        slope_gain += grade_error_deg(&wrong, 20.0) / 10.0;
    }
    assert!((ratio - 1.02).abs() < 0.002, "{ratio}");
    assert!((slope_gain - slope).abs() < 0.02, "{slope} {slope_gain}");
}

#[test]
fn without_excitation_the_mass_stays_near_its_prior_and_says_so() {
    // Rolling at constant speed on the level: the force measures M only as well as the running resistance is known.
    let (_, rms, normalised) = mass_statistics("dffrls_aekf_robust", |seed| {
        let mut random = Random::new(700 + seed);
        World {
            mu: 0.02 * (1.0 + 0.3 * random.normal()),
            grade: |_| 0.0,
            speed: |_| 0.6,
            start_mps: 0.6,
            ..world(seed)
        }
    });
    std::println!("rms {:.1} %, (error/sd)² {normalised:.2}", 100.0 * rms);
    assert!(normalised < 1.6, "{normalised}");
    assert!(rms < 0.4, "{rms}");
}

#[test]
fn a_steady_grade_tells_the_mass_as_well_as_the_prior_of_resistance_and_bias_allows() {
    let (_, rms, normalised) = mass_statistics("dffrls_aekf_robust", |seed| {
        let mut random = Random::new(800 + seed);
        World {
            mu: 0.02 * (1.0 + 0.3 * random.normal()),
            grade: |_| 8f64.to_radians(),
            speed: |_| 0.6,
            start_mps: 0.6,
            ..world(seed)
        }
    });
    // sd of the intercept over the level of f + μ g: 0.059/1.56
    std::println!("rms {:.1} %, (error/sd)² {normalised:.2}", 100.0 * rms);
    assert!(rms < 0.06, "{rms}");
    assert!(normalised < 1.6, "{normalised}");
}

#[test]
fn another_load_is_noticed_and_learnt() {
    for seed in 1..=5 {
        let mut estimator = build("dffrls_aekf_robust", &vehicle(), []).unwrap();
        let waves = |s: Real| 4f64.to_radians() * (0.3 * s).sin();
        let start_stop = |t: Real| 0.7 + 0.3 * (0.5 * t).sin();
        let change = Some((60.0, 10_000.0));
        let world = World {
            mass_change: change,
            grade: waves,
            speed: start_stop,
            seconds: 120.0,
            ..world(seed)
        };
        let rows = world.run(&mut estimator);
        let before = rows.iter().rfind(|row| row.t < 60.0).unwrap();
        assert!((before.estimate.total_mass_kg.value / 15_000.0 - 1.0).abs() < 0.01);
        let after = mass_error(&rows, 100.0);
        std::println!("seed {seed}: {:.2} % after the change", 100.0 * after);
        assert!(after < 0.02, "seed {seed}: {after}");
    }
}

/// Drives for a minute, stands, and drives again.
fn stay(t: Real) -> Real {
    let start = |at: Real| (0.25 * (t - at)).clamp(0.0, 1.0);
    start(1.0) - start(60.0) + start(90.0)
}

/// The same with 2 s of motion in the stay, too short to weigh anything.
fn shunting(t: Real) -> Real {
    let start = |at: Real| (0.5 * (t - at)).clamp(0.0, 0.5);
    stay(t) + start(70.0) - start(72.0)
}

/// Nothing shows a load that is hung on at a standstill: no mass is marked valid with it that is not right.
#[test]
fn a_load_changed_at_a_standstill_is_weighed_before_the_mass_is_valid_again() {
    let loads = [10_000.0, 15_000.0, 21_000.0];
    let drives: [fn(Real) -> Real; 2] = [stay, shunting];
    for name in ["rail_fusion", "dffrls_aekf_robust"] {
        for (speed, mass_kg) in drives.into_iter().flat_map(|d| loads.map(|kg| (d, kg))) {
            let mut estimator = build(name, &vehicle(), []).unwrap();
            let world = World {
                mass_change: Some((82.0, mass_kg)),
                grade: |s| 4f64.to_radians() * (0.3 * s).sin(),
                speed,
                seconds: 140.0,
                ..world(3)
            };
            let rows = world.run(&mut estimator);
            let mass = |row: &Row| row.estimate.total_mass_kg;
            let at = |s: Real| rows.iter().rfind(|row| row.t < s).map(mass).unwrap();
            assert!(!at(81.0).valid, "{name}: valid where it may be changed");
            let valid = rows.iter().filter(|row| row.t > 82.0 && mass(row).valid);
            let worst = valid.map(|row| (mass(row).value - mass_kg).abs() / mass(row).sd);
            let worst = worst.fold(0.0, Real::max);
            std::println!("{name}, then {mass_kg} kg: {worst:.2} standard deviations");
            assert!(worst < 3.0, "{name}, then {mass_kg} kg: {worst}");
            assert!(at(140.0).valid, "{name}: never valid again");
        }
    }
}

/// Once a mass weighed after a stay is that from before it, what the first drive told counts again: the mass is nearer
/// to that of the first drive than a mass weighed without it is.
#[test]
fn a_mass_that_a_stay_has_not_changed_is_that_from_before() {
    let after_it: fn(Real) -> Real = |t| stay(t.max(75.0));
    for name in ["rail_fusion", "dffrls_aekf_robust"] {
        let mut squares = [0.0; 2];
        for seed in 1..=10 {
            let masses = |speed: fn(Real) -> Real| {
                let mut estimator = build(name, &vehicle(), []).unwrap();
                let world = World {
                    grade: |s| 4f64.to_radians() * (0.3 * s).sin(),
                    speed,
                    seconds: 140.0,
                    ..world(seed)
                };
                let rows = world.run(&mut estimator);
                [55.0, 125.0].map(|s| {
                    let row = rows.iter().rfind(|row| row.t < s).unwrap();
                    row.estimate.total_mass_kg.value
                })
            };
            let ([before, both], [_, second]) = (masses(stay), masses(after_it));
            std::println!(
                "{name}: {before:.0}, then {both:.0} kg; without the first drive {second:.0} kg"
            );
            for (sum, mass) in squares.iter_mut().zip([both, second]) {
                *sum += (mass - before) * (mass - before);
            }
        }
        let [both, second] = squares;
        assert!(both < second, "{name}: {both} is not less than {second}");
    }
}

/// Bearings and clamped wheels resist alike whatever the load: the running-resistance coefficient of a heavier train is
/// smaller, and what the bias of the accelerometer passes for is larger.
#[test]
fn another_load_is_another_running_resistance() {
    let mut worst: Real = 0.0;
    for seed in 1..=5 {
        let mut estimator = build("dffrls_aekf_robust", &vehicle(), []).unwrap();
        let world = World {
            mass_kg: 9_000.0,
            mass_change: Some((90.0, 21_000.0)),
            mu: 0.012,
            drag_n: 1_500.0,
            accel_bias: 0.01,
            grade: |s| 5f64.to_radians() * (smooth((s - 20.0) / 8.0) - smooth((s - 90.0) / 8.0)),
            speed: |t| {
                let start = |at: Real| (0.25 * (t - at)).clamp(0.0, 1.0);
                start(1.0) - start(80.0) + start(100.0) * (1.0 - 0.2 * smooth((t - 120.0) / 4.0))
            },
            seconds: 160.0,
            ..world(seed)
        };
        let rows = world.run(&mut estimator);
        let error = |from, until| {
            let rows: Vec<Row> = rows.iter().filter(|row| row.t < until).copied().collect();
            mass_error(&rows, from)
        };
        std::println!(
            "seed {seed}: {:.2} % before, {:.2} % after",
            100.0 * error(70.0, 79.0),
            100.0 * error(135.0, 160.0)
        );
        assert!(error(70.0, 79.0) < 0.02);
        worst = worst.max(error(135.0, 160.0));
    }
    assert!(worst < 0.02, "{worst}");
}

#[test]
fn a_reversal_tells_running_resistance_and_accelerometer_bias_apart() {
    for (seed, mu, accel_bias) in [(1, 0.026, 0.02), (2, 0.014, -0.02), (3, 0.026, -0.02)] {
        let mut estimator =
            build("dffrls_aekf_robust", &vehicle(), [("delta", 1.0.into())]).unwrap();
        let world = World {
            mu,
            accel_bias,
            grade: |s| 4f64.to_radians() * (0.3 * s).sin(),
            speed: |t| 1.2 * (0.15 * t).sin(),
            seconds: 240.0,
            ..world(seed)
        };
        let rows = world.run(&mut estimator);
        let mut values = [0.0; 16];
        estimator.internal_values(&mut values);
        let at = |name: &str| {
            values[estimator
                .internals()
                .iter()
                .position(|i| i.name == name)
                .unwrap()]
        };
        let (found_mu, found_bias) = (at("running_resistance"), at("accel_bias_mps2"));
        std::println!("mu {found_mu:.4} for {mu}, bias {found_bias:.4} for {accel_bias}");
        assert!((found_mu - mu).abs() < 0.001, "{found_mu} for {mu}");
        assert!(
            (found_bias - accel_bias).abs() < 0.005,
            "{found_bias} for {accel_bias}"
        );
        assert!(mass_error(&rows, 200.0) < 0.01);
    }
}

#[test]
fn resistance_in_curves_is_learnt_and_does_not_pass_for_mass() {
    let curves = |seed| World {
        curve: |s| {
            if (s / 10.0) as i64 % 3 == 2 {
                0.25
            } else {
                0.0
            }
        },
        curve_resistance_m: 0.04,
        grade: |s| 4f64.to_radians() * (0.2 * s).sin(),
        seconds: 180.0,
        ..world(seed)
    };
    let mean = |settings: &[(&str, Setting)]| {
        let (mut mass, mut slope) = (0.0, 0.0);
        for seed in 1..=10 {
            let settings = settings.iter().copied();
            let rows =
                curves(seed).run(&mut build("dffrls_aekf_robust", &vehicle(), settings).unwrap());
            mass += mass_error(&rows, 60.0) / 10.0;
            slope += grade_error_deg(&rows, 30.0) / 10.0;
        }
        std::println!(
            "curves {settings:?}: mass {:.2} %, slope {slope:.3}°",
            100.0 * mass
        );
        (mass, slope)
    };
    let (knows, ignores) = (mean(&[]), mean(&[("curve_sd_m", 0.0.into())]));
    assert!(knows.0 < 0.02 && knows.1 < 0.3, "{knows:?}");
    assert!(3.0 * knows.0 < ignores.0, "{knows:?} {ignores:?}");
}

/// The range of the mass limits what is published, not what is learnt: wherever the range does not act, the mass is
/// that of an estimator with a range of everything.
#[test]
fn the_range_of_the_mass_leaves_what_is_learnt_alone() {
    let name = "dffrls_aekf_robust";
    let range_kg = [14_800.0, 15_200.0];
    let run = |mass_range_kg| {
        let told = Vehicle::new(VehicleData {
            mass_range_kg,
            ..vehicle().data()
        })
        .unwrap();
        let mut estimator = build(name, &told, [("mass0_kg", 15_000.0.into())]).unwrap();
        let speed = |t: Real| 1.0 + 0.4 * (0.7 * t).sin();
        World { speed, ..world(3) }.run(&mut estimator)
    };
    let (narrow, wide) = (run(range_kg), run([1e3, 1e6]));
    let (mut limited, mut free) = (0, 0);
    for (narrow, wide) in narrow.iter().zip(&wide) {
        let (narrow, wide) = (narrow.estimate, wide.estimate);
        if narrow.flags.saturated {
            limited += 1;
        } else {
            free += usize::from(limited > 0);
            let (narrow, wide) = (narrow.total_mass_kg.value, wide.total_mass_kg.value);
            assert!(
                (narrow / wide - 1.0).abs() < 1e-9,
                "{name}: {narrow} {wide}"
            );
        }
    }
    std::println!("{name}: {limited} steps limited, {free} free after one");
    assert!(limited > 100 && free > 100, "{name}: {limited} {free}");
}
