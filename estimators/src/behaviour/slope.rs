//! Slope, and pipelines compared.

use super::*;

#[test]
fn plain_least_squares_is_as_good_while_the_load_stays_and_the_coupled_baselines_are_worse() {
    let rms = |name: &str,
               settings: &[(&'static str, Setting<'static>)],
               worlds: &dyn Fn(u64) -> World| {
        let first = [("mass0_kg", 12_000.0.into())];
        let (mut mass, mut slope) = (0.0, 0.0);
        for seed in 1..=10 {
            let rows = worlds(seed).run(
                &mut build(
                    name,
                    &vehicle(),
                    first.into_iter().chain(settings.iter().copied()),
                )
                .unwrap(),
            );
            mass += mass_error(&rows, 50.0) / 10.0;
            slope += grade_error_deg(&rows, 10.0) / 10.0;
        }
        std::println!("{name}: mass {:.2} %, slope {slope:.2}°", 100.0 * mass);
        (mass, slope)
    };
    let (dynamic, plain) = (
        rms("dffrls_aekf_robust", &[], &world),
        rms("dffrls_aekf_robust", &[("delta", 1.0.into())], &world),
    );
    let (coupled, joint) = (rms("ffrls", &[], &world), rms("joint_ekf", &[], &world));
    assert!(plain.0 < 0.01 && plain.1 < 0.3);
    assert!(plain.0 < 1.2 * dynamic.0);
    // A limit of the structure: a slope that changes at steady speed ruins the coupled regression, and speed alone
    // cannot separate mass and slope.
    assert!(coupled.0 > 10.0 * dynamic.0, "{coupled:?}");
    assert!(joint.0 > 10.0 * dynamic.0, "{joint:?}");
    assert!(joint.1 > plain.1);
}

#[test]
fn the_inertial_slope_needs_no_mass_and_gains_by_gyro_and_by_adaptation_when_mistuned() {
    let right = grade_rms("dffrls_aukf_robust", &[], world);
    assert!(right < 0.25, "{right}");
    let gyro = grade_rms(
        "dffrls_aukf_robust",
        &[("gyro", Setting::Flag(true))],
        world,
    );
    assert!(2.0 * gyro < right, "{gyro} {right}");
    // Noise set ten times too large: adaptation takes most of the loss back.
    let wrong = [("wheel_speed_sd_mps", 0.05.into())];
    let fixed = [
        wrong[0],
        ("b", 0.99999.into()),
        ("noise", Setting::Choice("told")),
    ];
    let (fixed, adaptive) = (
        grade_rms("dffrls_aukf_robust", &fixed, world),
        grade_rms("dffrls_aukf_robust", &wrong, world),
    );
    assert!(adaptive < 0.85 * fixed, "{adaptive} {fixed}");
    // The curvature feed-forward is worth its trouble where the slope keeps changing.
    let wavy = |seed| World {
        grade: |s| 10f64.to_radians() * (0.15 * s).sin(),
        ..world(seed)
    };
    let (with, without) = (
        grade_rms("dffrls_aukf_robust", &[], wavy),
        grade_rms(
            "dffrls_aukf_robust",
            &[("curvature_sd_per_m", 1e-4.into())],
            wavy,
        ),
    );
    assert!(with < 0.7 * without, "{with} {without}");
    // An accelerometer bias is a slope error, b/g, and nothing here can see it.
    let biased = grade_rms("dffrls_aukf_robust", &[], |seed| World {
        accel_bias: 0.05,
        ..world(seed)
    });
    let expected = (right.powi(2) + (0.05f64 / 9.81).to_degrees().powi(2)).sqrt();
    assert!((biased / expected - 1.0).abs() < 0.1, "{biased} {expected}");
}

#[test]
fn interacting_models_survive_a_wrong_mass_and_differences_teach_the_mass_when_driven_jerkily() {
    let slope = grade_rms("imm_stf_robust", &[("mass0_kg", 15_000.0.into())], world);
    assert!(slope < 0.25, "{slope}");
    // A wrong mass misleads the dynamic model; the kinematic one keeps the slope.
    let misled = grade_rms(
        "imm_stf_robust",
        &[
            ("mass0_kg", 10_000.0.into()),
            ("mass_sd", 0.05.into()),
            ("force_gate_mps2", 10.0.into()),
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
        let mut estimator = build(
            "imm_stf_robust",
            &vehicle(),
            [("mass0_kg", 12_000.0.into())],
        )
        .unwrap();
        let rows = jerky(seed).run(&mut estimator);
        let error = mass_error(&rows, 100.0);
        std::println!("imm_stf_robust mass, seed {seed}: {:.1} %", 100.0 * error);
        assert!(error < 0.02, "seed {seed}: {error}");
    }
}

#[test]
fn a_slope_that_jumps_calls_strong_tracking_and_a_noisy_tachometer_calls_sage_husa() {
    let settings = [
        ("mass0_kg", 15_000.0.into()),
        ("mass_sd", 0.01.into()),
        ("q_theta", 1e-7.into()),
    ];
    let watch = |world: World, name: &str| {
        let mut watched = Watched::new(
            build("mmrls_sh_stf_robust", &vehicle(), settings).unwrap(),
            name,
        );
        let rows = world.run(&mut watched);
        (watched.values, rows)
    };
    // A step of the slope, for a filter whose process noise allows hardly any change.
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
    let mut plain = build("dffrls_aekf_robust", &vehicle(), settings).unwrap();
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
    // A tachometer four times as noisy as the parameter, on the level: the noise is learnt and the slope does not fade.
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
