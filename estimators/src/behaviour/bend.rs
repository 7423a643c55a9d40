//! The road vehicle of Guo et al. 2024 in a steady turn.

use super::*;

/// Error of the grade, deg, after five seconds straight ahead and a minute of a steady turn up a grade, with the mass
/// given and held.
fn error(name: &str, turn: &Turn) -> Real {
    let hold = [("mass0_kg", 2_170.0.into()), ("mass_sd", 0.01.into())];
    let mut estimator = build(name, &car(), hold).unwrap();
    let straight = Turn::solve(2_170.0, turn.speed, 1e-6, turn.uphill);
    let mut last = Estimate::default();
    for k in 1..=6500 {
        let t_s = 0.01 * k as Real;
        let z = match t_s < 5.0 {
            true => straight.measurements(t_s),
            false => turn.measurements(t_s),
        };
        last = estimator.step(&z, &Command::default(), 0.01).unwrap();
    }
    (last.grade_rad.value - (turn.uphill / 9.81).asin()).to_degrees()
}

#[test]
fn the_single_track_correction_takes_the_bend_out_of_the_slope() {
    // 60 km/h with 2 m/s² across, and a tight bend in town.
    for (speed, yaw_rate) in [(16.7, 0.12), (6.0, 0.5)] {
        let turn = Turn::solve(2_170.0, speed, yaw_rate, 0.5);
        let with = error("dffrls_aekf_robust", &turn).abs();
        let without = error("imm_stf_no_lateral", &turn).abs();
        std::println!("{with:.4}° at {speed} m/s, {without:.4}° without the correction");
        assert!(
            with < 0.05 * without && without > 0.1,
            "{speed} m/s: {with} {without}"
        );
    }
}
