//! Noise through the whole suite: levels, slopes, independence.

use super::*;
use crate::checked::Positive;
use monorig_estimators::api::signals::MAX_DRIVES;

/// Density, bandwidth and rate together: whatever the rate, the Allan deviation is N/√τ with N = density/√2, and the
/// variance of a sample density²·f/2.
#[test]
fn a_density_is_the_same_noise_at_every_rate() {
    let train = train(1);
    for rate in [200.0, 100.0, 50.0] {
        let mut sheet = asset("huainan.yaml");
        spec(&mut sheet, "accelerometer").sampling.rate_hz = Positive::new(rate);
        let seen = forces(&look(
            &mut suite(&sheet, &train, 7),
            |t| standing(&train, t),
            DT,
            300_000,
        ));
        for axis in 0..3 {
            let x: Vec<f64> = seen.iter().map(|s| s.value[axis]).collect();
            let n = x.len() as f64;
            let mean = x.iter().sum::<f64>() / n;
            let variance = x.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0);
            let expected = 9.81e-4_f64.powi(2) * rate / 2.0;
            assert!(
                (variance / expected - 1.0).abs() < 5.0 * f64::sqrt(2.0 / n),
                "{rate} Hz: {variance}"
            );
            let coefficient = 9.81e-4 / f64::sqrt(2.0);
            let points: Vec<_> = (0..7)
                .map(|p| allan_deviation(&x, 1.0 / rate, 1 << p))
                .collect();
            for (p, (tau, deviation)) in points.iter().enumerate() {
                let clusters = n / f64::from(1 << p);
                let ratio = deviation / (coefficient / tau.sqrt());
                assert!(
                    (ratio - 1.0).abs() < 5.0 * (0.75 / clusters).sqrt(),
                    "{rate} Hz, τ = {tau}: {ratio}"
                );
            }
            assert!((slope(&points) + 0.5).abs() < 0.03);
        }
    }
}

/// 0.14 °/√h and 0.5 °/h after 300 s: an angle off by 0.0404° (walk) and 0.0417° (bias), root of the squares 0.058°.
#[test]
fn the_angle_of_the_gyro_wanders_as_the_sheet_prints() {
    let train = train(1);
    let mut sheet = asset("huainan.yaml");
    sheet.retain(|name, _| *name == "gyro");
    let truth = standing(&train, 0.0);
    let mut squares = 0.0;
    let runs = 60;
    for seed in 0..runs {
        let mut suite = suite(&sheet, &train, seed);
        let mut angle = [0.0; 3];
        let mut truth = truth.clone();
        for k in 0..=30_000 {
            truth.t_s = f64::from(k) * 0.01;
            let mut z = Measurements::default();
            suite.measure(&truth, &mut z).unwrap();
            if let Some(s) = z.angular_rate_radps {
                (0..3).for_each(|i| angle[i] += s.value[i].to_degrees() * 0.01);
            }
        }
        squares += angle.iter().map(|a| a * a).sum::<f64>();
    }
    let count = 3.0 * runs as f64;
    let expected = (0.14 * f64::sqrt(300.0 / 3600.0)).powi(2) + (0.5 * 300.0 / 3600.0_f64).powi(2);
    let ratio = squares / count / expected;
    assert!(
        (ratio - 1.0).abs() < 5.0 * f64::sqrt(2.0 / count),
        "{ratio}"
    );
}

#[test]
fn noise_of_different_axes_and_units_is_independent() {
    let train = train(2);
    let mut suite = suite(&asset("huainan.yaml"), &train, 3);
    let seen = look(&mut suite, |t| rolling(&train, t), DT, 100_000);
    let column = |f: &dyn Fn(&Measurements) -> Option<f64>| -> Vec<f64> {
        let x: Vec<f64> = seen.iter().filter_map(f).collect();
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        let sd = (x.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / x.len() as f64).sqrt();
        x.iter().map(|v| (v - mean) / sd).collect()
    };
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for i in 0..3 {
        columns.push(column(&|z| z.specific_force_mps2.map(|s| s.value[i])));
        columns.push(column(&|z| z.angular_rate_radps.map(|s| s.value[i])));
    }
    for i in 0..2 {
        columns.push(column(&|z| z.motor_torque_nm[i].map(|s| s.value)));
        columns.push(column(&|z| z.wheel_speed_mps[i].map(|s| s.value)));
    }
    for (i, a) in columns.iter().enumerate() {
        for b in &columns[..i] {
            let n = a.len().min(b.len());
            let r: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>() / n as f64;
            assert!(r.abs() < 5.0 / f64::sqrt(n as f64), "column {i}: {r}");
        }
    }
}

/// At rest the only difference to the ideal is the error model's; ideal values carry the same stamps.
#[test]
fn ideal_values_have_the_stamps_of_the_measured_ones() {
    let train = train(2);
    let mut suite = suite(&asset("huainan.yaml"), &train, 3);
    let mut compared = 0;
    for k in 0..2000 {
        let mut z = Measurements::default();
        suite
            .measure(&rolling(&train, k as f64 * DT), &mut z)
            .unwrap();
        let ideal = suite.ideal();
        assert_eq!(
            z.specific_force_mps2.map(|s| s.t.s()),
            ideal.specific_force_mps2.map(|s| s.t.s())
        );
        assert_eq!(
            z.angular_rate_radps.map(|s| s.t.s()),
            ideal.angular_rate_radps.map(|s| s.t.s())
        );
        for i in 0..MAX_DRIVES {
            assert_eq!(
                z.wheel_speed_mps[i].map(|s| s.t.s()),
                ideal.wheel_speed_mps[i].map(|s| s.t.s())
            );
        }
        if let Some(s) = ideal.specific_force_mps2 {
            assert!((Vector3::from(s.value) - Vector3::new(0.0, 0.0, G)).norm() < 1e-12);
            compared += 1;
        }
        if let Some(s) = ideal.wheel_speed_mps[1] {
            assert!((s.value - 1.0).abs() < 1e-12);
        }
    }
    assert_eq!(compared, 399);
}
