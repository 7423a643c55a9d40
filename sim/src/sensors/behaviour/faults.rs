//! Faults by event through the whole suite.

use super::super::fault::{Fault, FaultWindow};
use super::*;
use crate::error::DataError;

/// From this instant to the end.
fn from(from_s: f64, fault: Fault) -> FaultWindow {
    FaultWindow {
        from_s,
        to_s: f64::INFINITY,
        fault,
        axis: None,
    }
}

/// Names of the channels that differ between a sound run and one with the fault.
fn touched(sensor: &str, fault: Fault) -> Vec<String> {
    let (sheet, train) = (asset("huainan.yaml"), train(2));
    let sound = look(
        &mut suite(&sheet, &train, 5),
        |t| rolling(&train, t),
        DT,
        1000,
    );
    let mut faulty = suite(&sheet, &train, 5);
    faulty.add_fault(sensor, from(1.0, fault)).unwrap();
    let seen = look(&mut faulty, |t| rolling(&train, t), DT, 1000);
    let mut names = Vec::new();
    let mut note = |name: String, differs: bool| {
        if differs && !names.contains(&name) {
            names.push(name);
        }
    };
    for (a, b) in sound.iter().zip(&seen) {
        note(
            "accelerometer".into(),
            a.specific_force_mps2 != b.specific_force_mps2,
        );
        note("gyro".into(), a.angular_rate_radps != b.angular_rate_radps);
        for i in 0..2 {
            note(
                format!("motor_torque[{i}]"),
                a.motor_torque_nm[i] != b.motor_torque_nm[i],
            );
            note(
                format!("wheel_speed[{i}]"),
                a.wheel_speed_mps[i] != b.wheel_speed_mps[i],
            );
            note(
                format!("clamp_pressure[{i}]"),
                a.clamp_pressure_mpa[i] != b.clamp_pressure_mpa[i],
            );
        }
    }
    names.sort();
    names
}

#[test]
fn a_fault_reaches_the_sensor_it_names_and_no_other() {
    let off = |name| touched(name, Fault::Off);
    assert_eq!(off("accelerometer"), ["accelerometer"]);
    assert_eq!(off("gyro"), ["gyro"]);
    assert_eq!(off("imu"), ["accelerometer", "gyro"]);
    assert_eq!(off("wheel_speed[1]"), ["wheel_speed[1]"]);
    assert_eq!(off("motor_torque"), ["motor_torque[0]", "motor_torque[1]"]);
    assert_eq!(
        off("clamp_pressure"),
        ["clamp_pressure[0]", "clamp_pressure[1]"]
    );
    assert_eq!(touched("gyro", Fault::Spikes(1.0)), ["gyro"]);
}

#[test]
fn a_drift_adds_to_the_noise_of_the_run_and_leaves_it_as_it_was() {
    let (sheet, train) = (asset("huainan.yaml"), train(1));
    let sound = look(
        &mut suite(&sheet, &train, 5),
        |t| rolling(&train, t),
        DT,
        2000,
    );
    let mut faulty = suite(&sheet, &train, 5);
    let drift = from(1.0, Fault::Drift(0.1));
    faulty.add_fault("wheel_speed", drift).unwrap();
    let seen = look(&mut faulty, |t| rolling(&train, t), DT, 2000);
    let pairs: Vec<_> = speeds(&sound, 0)
        .into_iter()
        .zip(speeds(&seen, 0))
        .collect();
    assert_eq!(pairs.len(), 401);
    for (a, b) in pairs {
        assert!((b.value - a.value - 0.1 * (a.t.s() - 1.0).max(0.0)).abs() < 1e-12);
    }
}

/// Faults with draws of their own leave the rest of the run to the last bit: only their sensor and axis differ.
#[test]
fn an_axis_is_one_of_a_sensor_of_three() {
    let (sheet, train) = (asset("huainan.yaml"), train(2));
    let up = |fault| FaultWindow {
        axis: Some(2),
        ..from(1.0, fault)
    };
    for (name, good) in [
        ("gyro", true),
        ("imu", true),
        ("wheel_speed", false),
        ("motor_torque[1]", false),
    ] {
        let added = suite(&sheet, &train, 1).add_fault(name, up(Fault::Noise(0.1)));
        match added {
            Ok(()) => assert!(good, "{name}"),
            Err(e) => assert!(!good && e.key == "axis" && e.help.contains("gyro")),
        }
    }
    assert_eq!(touched("gyro", Fault::Noise(0.1)), ["gyro"]);
    assert_eq!(touched("gyro", Fault::Dropouts(0.1)), ["gyro"]);
    let look = |faulty: bool| {
        let mut suite = suite(&sheet, &train, 5);
        if faulty {
            suite.add_fault("gyro", up(Fault::Noise(0.1))).unwrap();
        }
        look(&mut suite, |t| rolling(&train, t), DT, 1000)
    };
    let mut noisy = 0;
    for (sound, seen) in look(false).iter().zip(look(true)) {
        let rates = sound.angular_rate_radps.zip(seen.angular_rate_radps);
        let Some((sound, seen)) = rates else { continue };
        assert_eq!(sound.value[..2], seen.value[..2]);
        noisy += usize::from(sound.value[2] != seen.value[2]);
    }
    assert!(noisy > 50);
}

#[test]
fn unknown_sensors_are_refused_and_the_known_ones_listed() {
    let (sheet, train) = (asset("huainan.yaml"), train(2));
    let refuse = |sheet: &InstrumentSpecs, name: &str| {
        let mut suite = suite(sheet, &train, 1);
        suite.add_fault(name, from(1.0, Fault::Off)).unwrap_err()
    };
    for name in [
        "",
        "sonar",
        "wheel_speed[2]",
        "wheel_speed[",
        "wheel_speed[-1]",
        "gyro[0]",
        "wheel_speed[01]",
        "imu[0]",
    ] {
        let DataError { key, help, .. } = refuse(&sheet, name);
        assert_eq!(key, "sensor", "{name}");
        for known in [
            "imu",
            "accelerometer",
            "gyro",
            "motor_torque[1]",
            "wheel_speed[0]",
            "clamp_pressure",
        ] {
            assert!(help.contains(known), "{help}");
        }
    }
    let mut fewer = sheet.clone();
    fewer.remove("wheel_speed");
    let help = refuse(&fewer, "wheel_speed").help;
    assert!(
        !help.contains("wheel_speed"),
        "a sensor that is not fitted is not known: {help}"
    );
}
