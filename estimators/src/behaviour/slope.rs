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

/// The method's own slope, beside that of the core.
#[test]
fn the_inertial_slope_needs_no_mass_and_gains_by_adaptation_when_mistuned() {
    let method = |settings: &[(&str, Setting)], worlds: fn(u64) -> World| {
        internal_grade_rms("dffrls_aukf_robust", "method_grade_rad", settings, worlds)
    };
    let right = method(&[], world);
    assert!(right < 0.25, "{right}");
    // Noise set ten times too large: adaptation takes most of the loss back.
    let wrong = [("wheel_speed_sd_mps", 0.05.into())];
    let fixed = [
        wrong[0],
        ("b", 0.99999.into()),
        ("noise", Setting::Choice("told")),
    ];
    let (fixed, adaptive) = (method(&fixed, world), method(&wrong, world));
    assert!(adaptive < 0.85 * fixed, "{adaptive} {fixed}");
    // The curvature feed-forward is worth its trouble where the slope keeps changing.
    let wavy = |seed| World {
        grade: |s| 10f64.to_radians() * (0.15 * s).sin(),
        ..world(seed)
    };
    let (with, without) = (
        method(&[], wavy),
        method(&[("curvature0_sd_per_m", 1e-4.into())], wavy),
    );
    assert!(with < 0.7 * without, "{with} {without}");
}

/// The core's slope follows the gyro, which the method does not have.
#[test]
fn the_slope_of_the_core_gains_by_the_gyro() {
    for name in ["dffrls_aukf_robust", "dffrls_aekf_robust"] {
        let with = grade_rms(name, &[], world);
        let without = grade_rms(name, &[("gyro", Setting::Flag(false))], world);
        assert!(2.0 * with < without, "{name}: {with} {without}");
        assert!(without < 0.5, "{name}: {without}");
    }
}

#[test]
fn interacting_models_survive_a_wrong_mass_and_differences_teach_the_mass_when_driven_jerkily() {
    let kinematic = |settings: &[(&str, Setting)]| {
        internal_grade_rms("imm_stf_robust", "kinematic_grade_rad", settings, world)
    };
    let slope = kinematic(&[("mass0_kg", 15_000.0.into())]);
    assert!(slope < 0.25, "{slope}");
    // A wrong mass misleads the dynamic model; the kinematic one keeps the slope.
    let misled = kinematic(&[
        ("mass0_kg", 10_000.0.into()),
        ("mass_sd", 0.05.into()),
        ("force_gate_mps2", 10.0.into()),
    ]);
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
    let stepped = World {
        grade: |s| if s < 20.0 { 0.0 } else { 5f64.to_radians() },
        ..world(1)
    };
    let (fading, _) = watch(stepped, "fading");
    let active = fading.iter().filter(|l| **l > 1.0).count();
    // Steps in which the method's own grade is a degree and more behind.
    let late = |name: &str| {
        let estimator = build(name, &vehicle(), settings).unwrap();
        let mut watched = Watched::new(estimator, "method_grade_rad");
        let rows = stepped.run(&mut watched);
        let pairs = rows.iter().zip(&watched.values);
        pairs
            .filter(|(row, found)| row.theta > 0.0 && (**found - row.theta).abs() > 0.02)
            .count()
    };
    let (strong, plain) = (late("mmrls_sh_stf_robust"), late("dffrls_aekf_robust"));
    std::println!("strong tracking in {active} steps, late {strong} against {plain}");
    assert!(active > 0 && active < fading.len() / 10, "{active}");
    assert!(2 * strong < plain, "{strong} {plain}");
    // A tachometer four times as noisy as the parameter, on the level: the noise is learnt and the slope does not fade.
    let noisy = World {
        grade: |_| 0.0,
        speed_sd: 0.04,
        disturbance: 0.0,
        ..world(1)
    };
    // The core gates wheels that are as noisy as that, and would leave the force balance alone.
    let estimator = build(
        "mmrls_sh_stf_robust",
        &vehicle(),
        settings.into_iter().chain([("slip_gate", false.into())]),
    );
    let mut watched = Watched::new(estimator.unwrap(), "wheel_speed_sd_mps");
    noisy.run(&mut watched);
    let sd = watched.values;
    let sd = *sd.last().unwrap();
    // The median of eight has 0.43 of the noise of one (Monte Carlo of eight normal numbers).
    assert!((0.014..0.021).contains(&sd), "{sd}");
}
