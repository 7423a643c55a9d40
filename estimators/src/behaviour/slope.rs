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

/// The core's slope follows the gyro, which the method does not have.
#[test]
fn the_slope_of_the_core_gains_by_the_gyro() {
    let name = "dffrls_aekf_robust";
    let with = grade_rms(name, &[], world);
    let without = grade_rms(name, &[("gyro", Setting::Flag(false))], world);
    assert!(2.0 * with < without, "{with} {without}");
    assert!(without < 0.5, "{without}");
}
