//! The road vehicle of Guo et al. 2024 in a steady turn.

use super::*;

/// Errors of the grade and of an internal one, deg, after a minute of a steady turn up a grade, with the mass given and
/// held.
fn errors(name: &str, internal: &str, turn: &Turn) -> [Real; 2] {
    let hold = [("mass0_kg", 2_170.0.into()), ("mass_sd", 0.01.into())];
    let mut watched = Watched::new(build(name, &car(), hold).unwrap(), internal);
    let mut last = Estimate::default();
    for k in 1..=6000 {
        let t_s = 0.01 * k as Real;
        let z = turn.measurements(t_s);
        last = watched.step(&z, &Command::default(), 0.01).unwrap();
    }
    let own = *watched.values.last().unwrap();
    [last.grade_rad.value, own].map(|found| (found - (turn.uphill / 9.81).asin()).to_degrees())
}

#[test]
fn the_single_track_correction_takes_the_bend_out_of_the_slope() {
    // 60 km/h with 2 m/s² across, and a tight bend in town.
    for (speed, yaw_rate) in [(16.7, 0.12), (6.0, 0.5)] {
        let turn = Turn::solve(2_170.0, speed, yaw_rate, 0.5);
        let [core, with] = errors("imm_stf_robust", "kinematic_grade_rad", &turn);
        let [_, without] = errors("imm_stf_no_lateral", "kinematic_grade_rad", &turn);
        std::println!("{with:.4}° at {speed} m/s, {without:.4}° without the correction, core {core:.4}°");
        assert!(
            with.abs() < 0.02 && without.abs() > 0.1,
            "{speed} m/s: {with} {without}"
        );
    }
}
