//! What holds for every named estimator.

use super::{testing::*, *};
use crate::{signals::Sample, testing::Random};
use std::vec::Vec;

fn all() -> impl Iterator<Item = (&'static str, AnyEstimator)> {
    NAMES
        .iter()
        .map(|name| (*name, build(name, &vehicle(), []).unwrap()))
}

#[test]
fn every_key_has_a_default_in_its_range_and_a_unique_name() {
    for name in NAMES {
        let keys: Vec<&Key> = keys(name).unwrap().collect();
        for key in &keys {
            let [low, high] = key.range;
            assert!((low..=high).contains(&key.default), "{name}.{}", key.name);
            assert!(!key.doc.is_empty() && !key.unit.is_empty());
            assert_eq!(
                keys.iter().filter(|other| other.name == key.name).count(),
                1,
                "{name}.{}",
                key.name
            );
            build(name, &vehicle(), [(key.name, key.default)]).unwrap();
            assert_eq!(
                build(name, &vehicle(), [(key.name, high * 2.0 + 1.0)]),
                Err(ParamError::OutOfRange(key))
            );
            assert_eq!(
                build(name, &vehicle(), [(key.name, Real::NAN)]),
                Err(ParamError::OutOfRange(key))
            );
        }
        assert_eq!(
            build(name, &vehicle(), [("lamda0", 1.0)]),
            Err(ParamError::UnknownKey)
        );
    }
    assert_eq!(
        build("dffrls", &vehicle(), []),
        Err(ParamError::UnknownEstimator)
    );
    assert!(keys("dffrls").is_none());
}

#[test]
fn an_impossible_vehicle_is_refused() {
    let bad = [
        Vehicle {
            wheel_radius_m: 0.0,
            ..vehicle()
        },
        Vehicle {
            drives: 0,
            ..vehicle()
        },
        Vehicle {
            drives: 17,
            ..vehicle()
        },
        Vehicle {
            efficiency: 1.1,
            ..vehicle()
        },
        Vehicle {
            mass_range_kg: [2e4, 1e4],
            ..vehicle()
        },
        Vehicle {
            gear_ratio: Real::NAN,
            ..vehicle()
        },
    ];
    for vehicle in bad {
        assert!(matches!(
            build("dffrls_aekf", &vehicle, []),
            Err(ParamError::Vehicle(_))
        ));
    }
}

#[test]
fn the_same_samples_give_the_same_bits_and_reset_forgets_all() {
    for (name, mut estimator) in all() {
        let world = World {
            seconds: 20.0,
            ..world(1)
        };
        let first: Vec<Estimate> = world
            .run(&mut estimator)
            .iter()
            .map(|row| row.estimate)
            .collect();
        estimator.reset();
        assert_eq!(estimator, build(name, &vehicle(), []).unwrap());
        let again: Vec<Estimate> = world
            .run(&mut estimator)
            .iter()
            .map(|row| row.estimate)
            .collect();
        assert_eq!(first, again, "{name}");
    }
}

/// Pipelines that know the slope only through traction.
const BY_TRACTION: &[&str] = &[
    "dffrls_aekf",
    "rls_ekf",
    "ffrls",
    "joint_ekf",
    "mmrls_sh_stf",
];

#[test]
fn standing_never_changes_mass_or_slope() {
    for (name, mut estimator) in all() {
        let mut random = Random::new(21);
        let mut first = None;
        for k in 1..=20_000 {
            let t_s = k as Real * DT;
            let mut z = Measurements {
                t_s,
                ..Default::default()
            };
            z.specific_force_mps2 = Some(Sample {
                t_s,
                value: [random.normal(), 0.0, -9.81],
            });
            for i in 0..8 {
                z.motor_torque_nm[i] = Some(Sample {
                    t_s,
                    value: 500.0 * random.normal(),
                });
                z.wheel_speed_mps[i] = Some(Sample {
                    t_s,
                    value: 0.005 * random.normal(),
                });
            }
            let estimate = estimator.step(&z, &Command::default(), DT).unwrap();
            assert!(!estimate.flags.moving && !estimate.flags.excited);
            // An accelerometer reads the slope standing too; traction does not.
            let slope = if BY_TRACTION.contains(&name) {
                estimate.grade_rad.value
            } else {
                0.0
            };
            let now = (estimate.total_mass_kg, slope);
            assert_eq!(*first.get_or_insert(now), now, "{name} at {t_s}");
        }
    }
}

/// A step of which some numbers are garbage: huge, tiny, NaN, infinite, stale, or missing.
fn garbage(random: &mut Random, t_s: Real) -> (Measurements, Command, Real) {
    let number = |random: &mut Random| match (random.uniform() * 12.0) as u32 {
        0 => Real::NAN,
        1 => Real::INFINITY,
        2 => -1e300,
        3 => 0.0,
        4..=6 => 50.0 * random.normal(),
        _ => 0.5 * random.normal(),
    };
    let sample = |random: &mut Random| {
        let t_s = if random.uniform() < 0.05 {
            number(random)
        } else {
            t_s
        };
        let value = if random.uniform() < 0.02 {
            number(random)
        } else {
            0.8 + 0.3 * random.normal()
        };
        (random.uniform() < 0.8).then_some(Sample { t_s, value })
    };
    let mut z = Measurements {
        t_s,
        ..Default::default()
    };
    for i in 0..8 {
        z.motor_torque_nm[i] = sample(random).map(|s| Sample {
            value: 100.0 * s.value,
            ..s
        });
        z.wheel_speed_mps[i] = sample(random);
    }
    z.specific_force_mps2 = sample(random).map(|s| Sample {
        t_s: s.t_s,
        value: [s.value, s.value, 0.0],
    });
    z.angular_rate_radps = sample(random).map(|s| Sample {
        t_s: s.t_s,
        value: [0.0, s.value, 0.0],
    });
    let u = Command {
        brake: if random.uniform() < 0.02 {
            Real::NAN
        } else {
            0.0
        },
        ..Default::default()
    };
    let dt = if random.uniform() < 0.05 { -DT } else { DT };
    (z, u, dt)
}

#[test]
fn a_hundred_thousand_steps_of_garbage_leave_it_finite_and_a_refused_step_leaves_it_as_it_was() {
    for (name, mut estimator) in all() {
        let mut random = Random::new(22);
        let (mut refused, mut taken) = (0, 0);
        for k in 1..=100_000 {
            let mut t_s = k as Real * DT;
            if random.uniform() < 0.01 {
                t_s = -t_s;
            }
            let (z, u, dt) = garbage(&mut random, t_s);
            let before = estimator;
            match estimator.step(&z, &u, dt) {
                Ok(estimate) => {
                    taken += 1;
                    assert!(estimate.is_finite(), "{name}: {estimate:?}");
                    let [low, high] = vehicle().mass_range_kg;
                    assert!(
                        (low..=high).contains(&estimate.total_mass_kg.value),
                        "{name}: {estimate:?}"
                    );
                    assert!(
                        estimate.total_mass_kg.sd >= 0.0
                            && estimate.grade_rad.sd >= 0.0
                            && estimate.speed_mps.sd >= 0.0
                    );
                    assert!(estimate.grade_rad.value.abs() < 1.1);
                    assert!(estimate.nis >= 0.0);
                }
                Err(error) => {
                    refused += 1;
                    assert_ne!(error, Error::Diverged, "{name} at step {k}");
                    assert_eq!(
                        estimator, before,
                        "{name}: refused with {error} and changed"
                    );
                }
            }
        }
        assert!(
            refused > 10_000 && taken > 10_000,
            "{refused} refused, {taken} taken"
        );
        // and it still works afterwards: a new run, from the garbage, as time goes on
        let mut values = [0.0; 64];
        estimator.internal_values(&mut values);
        assert!(values.iter().all(|v| v.is_finite()), "{name}");
        assert!(estimator.internals().len() <= values.len());
    }
}

#[test]
fn liu_2023_finds_mass_within_a_percent_and_slope_within_three_tenths_of_a_degree() {
    for seed in 1..=10 {
        let mut estimator = build("dffrls_aekf", &vehicle(), [("mass0_kg", 12_000.0)]).unwrap();
        let rows = world(seed).run(&mut estimator);
        let (mass, slope) = (mass_error(&rows, 50.0), grade_error_deg(&rows, 10.0));
        std::println!("seed {seed}: mass {:.3} %, slope {slope:.3}°", 100.0 * mass);
        assert!(mass < 0.01, "seed {seed}: {mass}");
        assert!(slope < 0.3, "seed {seed}: {slope}");
        assert!(rows.last().unwrap().estimate.total_mass_kg.valid);
    }
}

/// Errors of the recommended mass regression at the end of a run, over seeds: (bias, root mean square, mean of (error/sd)²).
fn mass_statistics(name: &str, worlds: impl Fn(u64) -> World) -> (Real, Real, Real) {
    let count = 40;
    let (mut bias, mut square, mut normalised) = (0.0, 0.0, 0.0);
    for seed in 1..=count {
        let mut estimator = build(name, &vehicle(), [("mass0_kg", 12_000.0)]).unwrap();
        let rows = worlds(seed).run(&mut estimator);
        let last = rows.last().unwrap();
        let error = last.estimate.total_mass_kg.value / last.mass - 1.0;
        bias += error / count as Real;
        square += error * error / count as Real;
        normalised += (error * last.mass / last.estimate.total_mass_kg.sd).powi(2) / count as Real;
    }
    (bias, square.sqrt(), normalised)
}

#[test]
fn mass_needs_neither_the_running_resistance_nor_the_accelerometer_bias() {
    let (bias, rms, normalised) = mass_statistics("dffrls_aekf", |seed| {
        let mut random = Random::new(900 + seed);
        World {
            mu: 0.02 * (1.0 + 0.25 * random.normal()),
            accel_bias: 0.02 * random.normal(),
            ..world(seed)
        }
    });
    std::println!(
        "bias {:.3} %, rms {:.3} %, (error/sd)² {normalised:.2}",
        100.0 * bias,
        100.0 * rms
    );
    assert!(bias.abs() < 0.002 && rms < 0.005, "{bias} {rms}");
    // Its own standard deviation is honest to a factor of 1.5 (the disturbance is correlated, the regression takes it for white).
    assert!((0.4..2.25).contains(&normalised), "{normalised}");
}

#[test]
fn a_torque_gain_error_is_a_mass_error_and_hardly_a_slope_error() {
    let (mut slope, mut slope_gain, mut ratio) = (0.0, 0.0, 0.0);
    for seed in 1..=10 {
        let run = |torque_gain| {
            let mut estimator = build("dffrls_aekf", &vehicle(), []).unwrap();
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
    // Rolling at constant speed on the level: the force tells M only as well as the running resistance is known.
    let (_, rms, normalised) = mass_statistics("dffrls_aekf", |seed| {
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
    assert!(normalised < 2.25, "{normalised}");
    assert!(rms < 0.4, "{rms}");
}

#[test]
fn a_steady_grade_tells_the_mass_as_well_as_the_prior_of_resistance_and_bias_allows() {
    let (_, rms, normalised) = mass_statistics("dffrls_aekf", |seed| {
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
    assert!(normalised < 2.25, "{normalised}");
}

#[test]
fn another_load_is_noticed_and_learnt() {
    for seed in 1..=5 {
        let mut estimator = build("dffrls_aekf", &vehicle(), []).unwrap();
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

#[test]
fn plain_least_squares_is_as_good_while_the_load_stays_and_the_coupled_baselines_are_worse() {
    let rms = |name: &str, worlds: &dyn Fn(u64) -> World| {
        let (mut mass, mut slope) = (0.0, 0.0);
        for seed in 1..=10 {
            let rows =
                worlds(seed).run(&mut build(name, &vehicle(), [("mass0_kg", 12_000.0)]).unwrap());
            mass += mass_error(&rows, 50.0) / 10.0;
            slope += grade_error_deg(&rows, 10.0) / 10.0;
        }
        std::println!("{name}: mass {:.2} %, slope {slope:.2}°", 100.0 * mass);
        (mass, slope)
    };
    let (dynamic, plain) = (rms("dffrls_aekf", &world), rms("rls_ekf", &world));
    let (coupled, joint) = (rms("ffrls", &world), rms("joint_ekf", &world));
    assert!(plain.0 < 0.01 && plain.1 < 0.3);
    assert!(plain.0 < 1.2 * dynamic.0);
    // What the structure forbids: a slope that changes at steady speed ruins the coupled regression, and speed alone cannot tell
    // mass from slope.
    assert!(coupled.0 > 10.0 * dynamic.0, "{coupled:?}");
    assert!(joint.0 > 10.0 * dynamic.0, "{joint:?}");
    assert!(joint.1 > plain.1);
    // What it can do: a start and speed changes on the level.
    let level = |seed| World {
        grade: |_| 0.0,
        speed: |t| 0.7 + 0.3 * (0.7 * t).sin(),
        ..world(seed)
    };
    let coupled = rms("ffrls", &level);
    assert!(coupled.0 < 0.1, "{coupled:?}");
}

/// Root-mean-square grade error, deg, over ten seeds.
fn grade_rms(name: &str, settings: &[(&str, Real)], worlds: impl Fn(u64) -> World) -> Real {
    let errors: Vec<Real> = (1..=10)
        .map(|seed| {
            let mut estimator = build(name, &vehicle(), settings.iter().copied()).unwrap();
            grade_error_deg(&worlds(seed).run(&mut estimator), 5.0)
        })
        .collect();
    let rms = crate::testing::rms(&errors);
    std::println!("{name} {settings:?}: {rms:.4}°");
    rms
}

#[test]
fn the_inertial_slope_needs_no_mass_and_gains_by_gyro_and_by_adaptation_when_mistuned() {
    let right = grade_rms("dffrls_ukf", &[], world);
    assert!(right < 0.25, "{right}");
    let gyro = grade_rms("dffrls_ukf", &[("gyro", 1.0)], world);
    assert!(2.0 * gyro < right, "{gyro} {right}");
    // Noise told ten times too large: adaptation takes most of the loss back.
    let wrong = [("wheel_speed_sd_mps", 0.05)];
    let (fixed, adaptive) = (
        grade_rms("dffrls_ukf", &wrong, world),
        grade_rms("dffrls_aukf", &wrong, world),
    );
    assert!(adaptive < 0.85 * fixed, "{adaptive} {fixed}");
    // The curvature feed-forward is worth its trouble where the slope keeps changing.
    let wavy = |seed| World {
        grade: |s| 10f64.to_radians() * (0.15 * s).sin(),
        ..world(seed)
    };
    let (with, without) = (
        grade_rms("dffrls_ukf", &[], wavy),
        grade_rms("dffrls_ukf", &[("curvature_sd_per_m", 1e-4)], wavy),
    );
    assert!(with < 0.7 * without, "{with} {without}");
    // An accelerometer bias is a slope error, b/g, and nothing here can see it.
    let biased = grade_rms("dffrls_ukf", &[], |seed| World {
        accel_bias: 0.05,
        ..world(seed)
    });
    let expected = (right.powi(2) + (0.05f64 / 9.81).to_degrees().powi(2)).sqrt();
    assert!((biased / expected - 1.0).abs() < 0.1, "{biased} {expected}");
}

#[test]
fn interacting_models_survive_a_wrong_mass_and_differences_teach_the_mass_when_driven_jerkily() {
    let slope = grade_rms("imm_stf", &[("mass0_kg", 15_000.0)], world);
    assert!(slope < 0.25, "{slope}");
    // A mass told wrongly misleads the dynamic model; the kinematic one keeps the slope.
    let misled = grade_rms(
        "imm_stf",
        &[
            ("mass0_kg", 10_000.0),
            ("mass_sd", 0.05),
            ("force_gate_mps2", 10.0),
        ],
        world,
    );
    assert!(misled < 0.5, "{misled}");
    // Jerky driving on the level teaches the mass.
    let jerky = |seed| World {
        grade: |_| 0.0,
        speed: |t| if (t / 10.0).fract() < 0.5 { 0.3 } else { 1.2 },
        seconds: 120.0,
        ..world(seed)
    };
    for seed in 1..=5 {
        let mut estimator = build("imm_stf", &vehicle(), [("mass0_kg", 12_000.0)]).unwrap();
        let rows = jerky(seed).run(&mut estimator);
        let error = mass_error(&rows, 100.0);
        std::println!("imm_stf mass, seed {seed}: {:.1} %", 100.0 * error);
        assert!(error < 0.02, "seed {seed}: {error}");
    }
}

#[test]
fn the_patent_finds_mass_and_slope_when_the_resistance_is_right_and_pays_when_it_is_not() {
    let run = |mu: Real, seed: u64| {
        let mut estimator = build("mmrls_sh_stf", &vehicle(), [("mass0_kg", 12_000.0)]).unwrap();
        let rows = World { mu, ..world(seed) }.run(&mut estimator);
        let last = rows.last().unwrap().estimate.total_mass_kg;
        (
            mass_error(&rows, 50.0),
            grade_error_deg(&rows, 10.0),
            (last.value - 15_000.0).abs() / last.sd,
        )
    };
    for seed in 1..=10 {
        let (mass, slope, normalised) = run(0.02, seed);
        std::println!(
            "patent, seed {seed}: mass {:.2} %, slope {slope:.3}°",
            100.0 * mass
        );
        assert!(
            mass < 0.02 && slope < 0.35 && normalised < 3.0,
            "{mass} {slope} {normalised}"
        );
        let (wrong, _, normalised) = run(0.026, seed);
        assert!(
            wrong > mass && normalised < 3.0,
            "{wrong} {mass} {normalised}"
        );
    }
}

#[test]
fn a_load_set_down_is_noticed_by_the_patent_too() {
    for seed in 1..=5 {
        let mut estimator = build("mmrls_sh_stf", &vehicle(), []).unwrap();
        let world = World {
            mass_change: Some((60.0, 10_000.0)),
            grade: |s| 4f64.to_radians() * (0.3 * s).sin(),
            speed: |t| 0.7 + 0.3 * (0.5 * t).sin(),
            seconds: 120.0,
            ..world(seed)
        };
        let after = mass_error(&world.run(&mut estimator), 100.0);
        std::println!(
            "patent, seed {seed}: {:.2} % after the change",
            100.0 * after
        );
        assert!(after < 0.03, "seed {seed}: {after}");
    }
}
