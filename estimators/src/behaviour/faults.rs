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
    let (mass, grade) = (mass_error(&rows, 50.0), grade_error_deg(&rows, 10.0));
    assert!(mass < 0.01 && grade < 0.3, "{mass} {grade}");
}

#[test]
fn a_dead_accelerometer_or_tachometer_stops_the_mass_from_learning() {
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
    let without: Vec<&Row> = no_tachometer.iter().filter(|row| row.t > 20.5).collect();
    let mass = without[0].estimate.total_mass_kg.value;
    let (mut valid, mut worst): (usize, Real) = (0, 0.0);
    for row in &without {
        assert_eq!(row.estimate.total_mass_kg.value, mass);
        if row.estimate.grade_rad.valid {
            valid += 1;
            let e = row.estimate;
            let off = (e.grade_rad.value - row.theta).abs() / e.grade_rad.sd;
            worst = worst.max(off);
        }
    }
    let speed = without.iter().filter(|row| row.estimate.speed_mps.valid);
    std::println!(
        "without wheels: grade valid in {valid} steps, {worst:.1} sd off, speed in {}",
        speed.count()
    );
    assert!(worst < 3.5, "{worst}");
}

#[test]
fn under_the_brake_the_mass_does_not_learn_and_the_grade_is_known() {
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
    // The block that the brake has cut short is the last.
    let first = braking[100].estimate;
    for row in braking.iter().skip(100) {
        let e = row.estimate;
        assert_eq!(e.total_mass_kg, first.total_mass_kg);
        assert!(e.flags.moving && !e.flags.excited);
        // The IMU goes on reading the slope.
        assert!(e.grade_rad.valid && e.effective_grade_rad.valid);
        assert!((e.grade_rad.value - row.theta).abs() < 0.01, "{e:?}");
    }
    assert!(mass_error(&rows, 50.0) < 0.01);
}
