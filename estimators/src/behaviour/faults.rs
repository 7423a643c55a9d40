//! Sensors that fail, wheels that slip, brakes.

use super::*;

#[test]
fn one_slipping_wheel_and_three_drives_without_samples_do_no_harm() {
    let rows = tampered("dffrls_aekf_robust", |z, _| {
        if z.t.s() > 20.0 {
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
    let no_accelerometer = tampered("dffrls_aekf_robust", |z, _| z.specific_force_mps2 = None);
    for row in &no_accelerometer {
        assert_eq!(row.estimate.total_mass_kg.value, 12_000.0);
        assert!(!row.estimate.total_mass_kg.valid && !row.estimate.grade_rad.valid);
    }
    let no_tachometer = tampered("dffrls_aekf_robust", |z, _| {
        if z.t.s() > 20.0 {
            z.wheel_speed_mps = Default::default();
        }
    });
    let held: Vec<Real> = no_tachometer
        .iter()
        .filter(|row| row.t > 20.5)
        .map(|row| row.estimate.grade_rad.value)
        .collect();
    assert!(held.windows(2).all(|pair| pair[0] == pair[1]));
    assert!(
        no_tachometer
            .iter()
            .filter(|row| row.t > 20.5)
            .all(|row| !row.estimate.grade_rad.valid && !row.estimate.speed_mps.valid)
    );
}

#[test]
fn under_the_brake_neither_mass_nor_slope_learn_from_traction() {
    let rows = tampered("dffrls_aekf_robust", |z, u| {
        u.brake = if (30.0..40.0).contains(&z.t.s()) {
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
