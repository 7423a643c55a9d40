//! Ideal physics through the whole suite.

use super::*;
use crate::checked::{Finite, Positive};

/// A mount that moves at constant speed v on a vertical circle of radius r, nose up ever more: θ = v t / r.
fn on_an_arc(train: &Train, t_s: f64, v: f64, radius: f64) -> Truth {
    let theta = v * t_s / radius;
    moving(train, t_s, |mount| {
        mount.v_w = Vector3::new(v * theta.cos(), 0.0, v * theta.sin());
        mount.q_wm = UnitQuaternion::from_euler_angles(0.0, -theta, 0.0);
        mount.w_w = Vector3::new(0.0, -v / radius, 0.0);
    })
}

/// On a vertical arc at constant speed: f = (g sin θ, 0, g cos θ + v²/r), averaged over the period; rate (0, −v/r, 0).
#[test]
fn on_a_vertical_arc_the_ideal_imu_reads_the_closed_form() {
    let (train, v, radius) = (train(2), 2.0, 10.0);
    let seen = look(
        &mut suite(&asset("ideal.yaml"), &train, 1),
        |t| on_an_arc(&train, t, v, radius),
        DT,
        1000,
    );
    let omega = v / radius;
    for s in forces(&seen) {
        let (a, b) = (omega * (s.t.s() - 0.005), omega * s.t.s());
        let mean_sin = (a.cos() - b.cos()) / (b - a);
        let mean_cos = (b.sin() - a.sin()) / (b - a);
        let expected = Vector3::new(G * mean_sin, 0.0, G * mean_cos + v * v / radius);
        // Steps of 2 ms turn by 4e-4 rad: chord against arc is (4e-4)²/24 relative.
        assert!(
            (Vector3::from(s.value) - expected).norm() < 1e-6,
            "{s:?} not {expected}"
        );
    }
    for s in rates(&seen) {
        assert!((Vector3::from(s.value) - Vector3::new(0.0, -omega, 0.0)).norm() < 1e-12);
    }
}

/// Summed over time, specific force along a level track is the change of speed, whatever happened between steps.
#[test]
fn the_sum_of_specific_force_is_the_change_of_speed() {
    let train = train(1);
    let speed = |t: f64| 0.3 * (7.0 * t).sin() + 0.05 * (91.0 * t).sin();
    let level = |t: f64| moving(&train, t, |m| m.v_w = Vector3::new(speed(t), 0.0, 0.0));
    for rate in [500.0, 200.0, 100.0, 50.0] {
        let mut sheet = asset("ideal.yaml");
        spec(&mut sheet, "accelerometer").sampling.rate_hz = Positive::new(rate);
        let seen = forces(&look(&mut suite(&sheet, &train, 1), level, DT, 5000));
        assert_eq!(seen.len(), (10.0 * rate) as usize);
        let sum: f64 = seen.iter().map(|s| s.value[0] / rate).sum();
        assert!(
            (sum - (speed(10.0) - speed(0.0))).abs() < 1e-9,
            "{rate} Hz: {sum}"
        );
    }
}

#[test]
fn the_ideal_sheet_hands_over_the_truth_of_every_drive_unit() {
    let train = train(3);
    let truth = |t: f64| {
        let mut truth = standing(&train, t);
        for (i, drive) in truth.drives.iter_mut().enumerate() {
            drive.motor_torque_nm = 10.0 * i as f64 + t;
            drive.wheel_rate_radps = [i as f64, i as f64 + 2.0 * t];
            drive.clamp_mpa = 8.0 - i as f64;
        }
        truth
    };
    let mut suite = suite(&asset("ideal.yaml"), &train, 1);
    let seen = look(&mut suite, truth, DT, 500);
    for i in 0..3 {
        let x = i as f64;
        let torque: Vec<_> = seen.iter().filter_map(|z| z.motor_torque_nm[i]).collect();
        assert_eq!(torque.len(), 201);
        for s in torque {
            assert!((s.value - (10.0 * x + s.t.s())).abs() < 1e-9);
        }
        for s in speeds(&seen, i) {
            assert!((s.value - 0.17 * (x + s.t.s())).abs() < 1e-9);
        }
        for s in seen.iter().filter_map(|z| z.clamp_pressure_mpa[i]) {
            assert!((s.value - (8.0 - x)).abs() < 1e-12);
        }
    }
    assert!(
        seen.iter().all(|z| z.motor_torque_nm[3].is_none()),
        "there is no fourth unit"
    );
    assert_eq!(
        seen.last(),
        Some(&suite.ideal()),
        "without errors the ideal values are the measured ones"
    );
}

/// Turned nose up by 2° at rest, a sensor reads g sin 2° forward; a known bias adds in the sensor's axes.
#[test]
fn misalignment_and_axis_bias_reach_the_reading() {
    let train = train(1);
    let mut sheet = asset("ideal.yaml");
    let accelerometer = spec(&mut sheet, "accelerometer");
    accelerometer.misalignment_deg = Some([0.0, -2.0, 0.0].map(Finite::new));
    accelerometer.axis_bias = Some([0.1, 0.2, 0.3].map(Finite::new));
    let seen = forces(&look(
        &mut suite(&sheet, &train, 1),
        |t| standing(&train, t),
        DT,
        100,
    ));
    let two = 2.0_f64.to_radians();
    let expected = Vector3::new(G * two.sin() + 0.1, 0.2, G * two.cos() + 0.3);
    assert!(!seen.is_empty());
    for s in seen {
        assert!((Vector3::from(s.value) - expected).norm() < 1e-12, "{s:?}");
    }
}

/// A clamp pressure that jumps from 0 to 8 MPa within one step at 1 s shows as 8 (1 − e^(−t/τ)), τ = 1/(2π·20 Hz).
#[test]
fn bandwidth_shows_as_a_lag_of_the_reading() {
    let train = train(1);
    let mut sheet = asset("ideal.yaml");
    spec(&mut sheet, "clamp_pressure").errors.bandwidth_hz = Some(Positive::new(20.0));
    let jumping = |t: f64| {
        let mut truth = standing(&train, t);
        truth.drives[0].clamp_mpa = if t > 0.999 { 8.0 } else { 0.0 };
        truth
    };
    let seen = look(&mut suite(&sheet, &train, 1), jumping, DT, 600);
    let tau = 1.0 / (2.0 * std::f64::consts::PI * 20.0);
    let mut compared = 0;
    for s in seen
        .iter()
        .filter_map(|z| z.clamp_pressure_mpa[0])
        .filter(|s| s.t.s() > 1.001)
    {
        // The jump is a ramp from 0.998 s to 1.000 s: behind it, a step at 0.999 s up to (dt/τ)²/24 = 0.3 % of what is
        // left.
        let left = 8.0 * f64::exp(-(s.t.s() - 0.999) / tau);
        // A stamp between two steps is read on the chord of the exponential: off by at most (dt/τ)²/8 of what is left.
        assert!(
            (s.value - (8.0 - left)).abs() < 0.012 * left + 1e-12,
            "{s:?}: {left} left"
        );
        compared += 1;
    }
    assert_eq!(compared, 40, "1.005 s to 1.200 s at 200 Hz");
}
