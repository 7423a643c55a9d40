//! What the named estimators can and cannot do, on a simulated crane of one degree of freedom.

use super::{testing::*, *};
use crate::testing::Random;
use std::vec::Vec;

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
    // Its own standard deviation is honest, within the scatter of forty draws and the disturbance not being white.
    assert!((0.5..1.6).contains(&normalised), "{normalised}");
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
    assert!(normalised < 1.6, "{normalised}");
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
    assert!(normalised < 1.6, "{normalised}");
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

#[test]
fn a_reversal_tells_running_resistance_and_accelerometer_bias_apart() {
    for (seed, mu, accel_bias) in [(1, 0.026, 0.02), (2, 0.014, -0.02), (3, 0.026, -0.02)] {
        let mut estimator = build("rls_ekf", &vehicle(), []).unwrap();
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
                .position(|n| *n == name)
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

/// Hides samples from an estimator, or changes the command it sees.
struct Tampered<E, F> {
    estimator: E,
    tamper: F,
}

impl<E: Estimator, F: Fn(&mut Measurements, &mut Command)> Estimator for Tampered<E, F> {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        let (mut z, mut u) = (*z, *u);
        (self.tamper)(&mut z, &mut u);
        self.estimator.step(&z, &u, dt)
    }

    fn reset(&mut self) {
        self.estimator.reset();
    }

    fn internals(&self) -> &'static [&'static str] {
        self.estimator.internals()
    }

    fn internal_values(&self, values: &mut [Real]) {
        self.estimator.internal_values(values);
    }
}

fn tampered(name: &str, tamper: impl Fn(&mut Measurements, &mut Command)) -> Vec<Row> {
    let estimator = build(name, &vehicle(), [("mass0_kg", 12_000.0)]).unwrap();
    world(1).run(&mut Tampered { estimator, tamper })
}

#[test]
fn one_slipping_wheel_and_three_silent_drives_do_no_harm() {
    let rows = tampered("dffrls_aekf", |z, _| {
        if z.t_s > 20.0 {
            for i in 0..3 {
                z.wheel_speed_mps[i] = None;
                z.motor_torque_nm[i] = None;
            }
            if let Some(speed) = z.wheel_speed_mps[4].as_mut() {
                speed.value *= 2.0;
            }
        }
    });
    assert!(mass_error(&rows, 50.0) < 0.01 && grade_error_deg(&rows, 10.0) < 0.3);
}

#[test]
fn a_dead_accelerometer_stops_the_mass_from_learning_and_a_dead_tachometer_the_slope() {
    let blind = tampered("dffrls_aekf", |z, _| z.specific_force_mps2 = None);
    for row in &blind {
        assert_eq!(row.estimate.total_mass_kg.value, 12_000.0);
        assert!(!row.estimate.total_mass_kg.valid && !row.estimate.grade_rad.valid);
    }
    let deaf = tampered("dffrls_aekf", |z, _| {
        if z.t_s > 20.0 {
            z.wheel_speed_mps = Default::default();
        }
    });
    let held: Vec<Real> = deaf
        .iter()
        .filter(|row| row.t > 20.5)
        .map(|row| row.estimate.grade_rad.value)
        .collect();
    assert!(held.windows(2).all(|pair| pair[0] == pair[1]));
    assert!(
        deaf.iter()
            .filter(|row| row.t > 20.5)
            .all(|row| !row.estimate.grade_rad.valid && !row.estimate.speed_mps.valid)
    );
}

#[test]
fn under_the_brake_neither_mass_nor_slope_learn_from_traction() {
    let rows = tampered("dffrls_aekf", |z, u| {
        u.brake = if (30.0..40.0).contains(&z.t_s) {
            1.0
        } else {
            0.0
        }
    });
    let braking: Vec<&Row> = rows
        .iter()
        .filter(|row| (30.1..39.9).contains(&row.t))
        .collect();
    let first = braking[0].estimate;
    for row in &braking {
        assert_eq!(row.estimate.total_mass_kg, first.total_mass_kg);
        assert_eq!(row.estimate.grade_rad.value, first.grade_rad.value);
        assert!(
            row.estimate.flags.moving
                && !row.estimate.flags.excited
                && !row.estimate.grade_rad.valid
        );
    }
    assert!(mass_error(&rows, 50.0) < 0.01);
}

/// Keeps an internal quantity of every step.
struct Watched {
    estimator: AnyEstimator,
    place: usize,
    values: Vec<Real>,
}

impl Watched {
    fn new(estimator: AnyEstimator, name: &str) -> Self {
        let place = estimator
            .internals()
            .iter()
            .position(|n| *n == name)
            .unwrap();
        Self {
            estimator,
            place,
            values: Vec::new(),
        }
    }
}

impl Estimator for Watched {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        let estimate = self.estimator.step(z, u, dt)?;
        let mut values = [0.0; 16];
        self.estimator.internal_values(&mut values);
        self.values.push(values[self.place]);
        Ok(estimate)
    }

    fn reset(&mut self) {
        self.estimator.reset();
    }

    fn internals(&self) -> &'static [&'static str] {
        self.estimator.internals()
    }

    fn internal_values(&self, values: &mut [Real]) {
        self.estimator.internal_values(values);
    }
}

#[test]
fn a_slope_that_jumps_calls_strong_tracking_and_a_noisy_tachometer_calls_sage_husa() {
    let settings = [("mass0_kg", 15_000.0), ("mass_sd", 0.01), ("q_theta", 1e-7)];
    let watch = |world: World, name: &str| {
        let mut watched = Watched::new(build("mmrls_sh_stf", &vehicle(), settings).unwrap(), name);
        let rows = world.run(&mut watched);
        (watched.values, rows)
    };
    // A step of the slope, for a filter told that it hardly moves.
    let step = |s: Real| if s < 20.0 { 0.0 } else { 5f64.to_radians() };
    let (fading, rows) = watch(
        World {
            grade: step,
            ..world(1)
        },
        "fading",
    );
    let active = fading.iter().filter(|l| **l > 1.0).count();
    let late = |rows: &[Row]| {
        rows.iter()
            .filter(|r| r.theta > 0.0 && (r.estimate.grade_rad.value - r.theta).abs() > 0.02)
            .count()
    };
    let mut plain = build("rls_ekf", &vehicle(), settings).unwrap();
    let plain_rows = World {
        grade: step,
        ..world(1)
    }
    .run(&mut plain);
    std::println!(
        "strong tracking in {active} steps, late {} against {}",
        late(&rows),
        late(&plain_rows)
    );
    assert!(active > 0 && active < fading.len() / 10, "{active}");
    assert!(2 * late(&rows) < late(&plain_rows));
    // A tachometer four times as noisy as told, on the level: the noise is learnt and the slope does not fade.
    let noisy = World {
        grade: |_| 0.0,
        speed_sd: 0.04,
        disturbance: 0.0,
        ..world(1)
    };
    let (sd, _) = watch(noisy, "wheel_speed_sd_mps");
    let sd = *sd.last().unwrap();
    // The median of eight has 0.43 of the noise of one (Monte Carlo of eight normal numbers).
    assert!((0.014..0.021).contains(&sd), "{sd}");
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
    let mean = |settings: &[(&str, Real)]| {
        let (mut mass, mut slope) = (0.0, 0.0);
        for seed in 1..=10 {
            let settings = settings.iter().copied();
            let rows = curves(seed).run(&mut build("dffrls_aekf", &vehicle(), settings).unwrap());
            mass += mass_error(&rows, 60.0) / 10.0;
            slope += grade_error_deg(&rows, 30.0) / 10.0;
        }
        std::println!(
            "curves {settings:?}: mass {:.2} %, slope {slope:.3}°",
            100.0 * mass
        );
        (mass, slope)
    };
    let (knows, ignores) = (mean(&[]), mean(&[("curve_sd_m", 0.0)]));
    assert!(knows.0 < 0.02 && knows.1 < 0.3, "{knows:?}");
    assert!(3.0 * knows.0 < ignores.0, "{knows:?} {ignores:?}");
}
