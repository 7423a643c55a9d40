//! `attitude` and `rail_fusion` against an oracle of their own (`tests/reference/fusion.py`, from the equations of the
//! book): from the samples to the estimate, every tenth step of a recorded drive.

use crate::fusion_drive::{RAIL, drive};
use crate::reference::assert_agrees;
use monorig_estimators::Setting;
use monorig_estimators::api::signals::Estimate;

#[test]
fn every_number_is_that_of_the_oracle() {
    let attitude = [
        "pitch_rad",
        "roll_rad",
        "accel_bias_mps2",
        "gyro_bias_radps",
        "wheel_scale",
        "accel_bias_sd_mps2",
        "wheel_scale_sd",
    ];
    let balance = [
        "resistance_constant_n",
        "swing_rad",
        "unmodelled_force_n",
        "grade_behind_rad",
        "pendulum_length_ln",
        "load_filter_sd_kg",
        "read_sd",
    ];
    // Supervisors that the oracle leaves out: they have laws of their own.
    let outside = ["torque_monitor", "force_fusion"].map(|key| (key, Setting::Flag(false)));
    let no_gyro = [("gyro", Setting::Flag(false))];
    let motion = |e: &Estimate| {
        let (v, grade) = (e.speed_mps, e.grade_rad);
        vec![v.value, v.sd, grade.value, grade.sd]
    };
    let alone = |e: &Estimate| {
        let found = vec![e.protection.grade_rad, e.innovation, e.nis];
        [motion(e), found].concat()
    };
    let train = |e: &Estimate| {
        let (mass, grade) = (e.total_mass_kg.value, e.effective_grade_rad.value);
        [motion(e), vec![e.protection.total_mass_kg, mass, grade]].concat()
    };
    let runs = [
        drive(&RAIL, "attitude", &[], &attitude, alone),
        drive(&RAIL, "attitude", &no_gyro, &attitude, alone),
        drive(&RAIL, "rail_fusion", &outside, &balance, train),
    ];
    let rows: Vec<Vec<f64>> = runs
        .into_iter()
        .enumerate()
        .flat_map(|(run, rows)| {
            rows.into_iter()
                .map(move |row| [vec![run as f64], row].concat())
        })
        .collect();
    assert_agrees("fusion", &rows);
}
