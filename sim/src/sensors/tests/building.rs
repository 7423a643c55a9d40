//! Building a suite, its checks, the assets.

use super::super::noise::white_sd;
use super::*;

#[test]
fn a_step_longer_than_the_period_of_a_sensor_is_refused() {
    let suite = suite(&asset("ideal.yaml"), &train(1), 1);
    suite.check_step(0.005).unwrap();
    let (key, help) = key_and_help(suite.check_step(0.006).unwrap_err());
    assert_eq!(key, "accelerometer.sampling.rate_hz");
    assert!(help.contains("166."), "{help}");
}

#[test]
fn the_mount_decides_what_the_imu_feels() {
    let train = train(3);
    let mut sheet = asset("ideal.yaml");
    sheet.data.gyro.as_mut().unwrap().mount = "drive_3/imu_link".into();
    let truth = |t: f64| {
        let mut truth = standing(&train, t);
        let wanted = train
            .mounts
            .iter()
            .position(|m| m.name == "drive_3/imu_link")
            .unwrap();
        truth.mounts[wanted].w_w = Vector3::new(0.1, 0.2, 0.3);
        truth
    };
    let mut suite = suite(&sheet, &train, 1);
    assert_eq!(
        suite.imu_mount(),
        Some(1),
        "the accelerometer's: drive_1/imu_link"
    );
    for s in rates(&look(&mut suite, truth, DT, 100)) {
        assert!((Vector3::from(s.value) - Vector3::new(0.1, 0.2, 0.3)).norm() < 1e-12);
    }
    sheet.data.gyro.as_mut().unwrap().mount = "drive_9/imu_link".into();
    let (key, _) = key_and_help(Suite::new(&sheet, &train, G, 1).unwrap_err());
    assert_eq!(key, "gyro.mount");
}

#[test]
fn time_running_backwards_and_a_strange_train_are_reported() {
    let (one, two) = (train(1), train(2));
    let mut suite = suite(&asset("ideal.yaml"), &one, 1);
    let mut z = Measurements::default();
    suite.measure(&standing(&one, 1.0), &mut z).unwrap();
    assert!(matches!(
        suite.measure(&standing(&one, 0.9), &mut z),
        Err(Error::Broken { .. })
    ));
    assert!(matches!(
        suite.measure(&standing(&two, 2.0), &mut z),
        Err(Error::Broken { .. })
    ));
    assert!(matches!(
        suite.measure(&standing(&one, f64::NAN), &mut z),
        Err(Error::Broken { .. })
    ));
}

/// A run looked at first after its first step, not at 0: no sample of before, then every period.
#[test]
fn a_first_look_after_the_first_step_is_fine() {
    let train = train(1);
    let mut suite = suite(&asset("ideal.yaml"), &train, 1);
    let seen = look(&mut suite, |t| rolling(&train, t + DT), DT, 1000);
    assert!((speeds(&seen, 0)[0].t.s() - 0.005).abs() < 1e-12);
    assert!((forces(&seen)[0].t.s() - 0.010).abs() < 1e-12);
    assert!(
        forces(&seen)
            .iter()
            .all(|s| (Vector3::from(s.value) - Vector3::new(0.0, 0.0, G)).norm() < 1e-9)
    );
}

/// The assets against the figures in print, converted here.
#[test]
fn the_huainan_sheet_says_what_the_print_says() {
    let data = asset("huainan.yaml").data;
    let accelerometer = data.accelerometer.unwrap();
    let gyro = data.gyro.unwrap();
    let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 5e-4, "{a} is not {b}");
    close(accelerometer.errors.range.unwrap()[1].get(), 6.0 * G);
    close(accelerometer.errors.noise_density.get(), 0.1e-3 * G);
    close(accelerometer.errors.bias_sd.get(), 0.00978);
    close(gyro.errors.bias_sd.get(), 0.5_f64.to_radians() / 3600.0);
    close(
        gyro.errors.random_walk_of_integral.get(),
        0.14_f64.to_radians() / 3600.0_f64.sqrt(),
    );
    // The velocity random walk of the print, its √ put back, is the density of the line above, within 2 %.
    assert!(
        (0.058 / 3600.0_f64.sqrt() / accelerometer.errors.noise_density.get() - 1.0).abs() < 0.02
    );
    let sigma = white_sd(0.0, accelerometer.errors.noise_density.get(), 0.0, 100.0);
    assert!((sigma - 6.9e-3).abs() < 0.05e-3, "{sigma}");
    assert_eq!(accelerometer.sampling.rate_hz.get(), 100.0);
    assert_eq!(gyro.sampling.rate_hz.get(), 100.0);
}

/// Time of one look at the full train, printed: `cargo test --release -p monorig-sim -- --ignored --nocapture time_of_a_look`.
#[test]
#[ignore = "a measurement, not a law"]
fn time_of_a_look() {
    let train = train(8);
    for name in ["ideal.yaml", "huainan.yaml", "liu2023.yaml"] {
        let mut suite = suite(&asset(name), &train, 1);
        let mut truth = rolling(&train, 0.0);
        let steps = 1_000_000;
        let mut sum = 0.0;
        let mut best = f64::INFINITY;
        let mut k = 0;
        for _ in 0..5 {
            let begin = std::time::Instant::now();
            for _ in 0..steps / 5 {
                k += 1;
                truth.t_s = f64::from(k) * DT;
                let mut z = Measurements::default();
                suite.measure(&truth, &mut z).unwrap();
                sum += z.specific_force_mps2.map_or(0.0, |s| s.value[2]);
            }
            best = best.min(begin.elapsed().as_secs_f64() / f64::from(steps / 5));
        }
        println!(
            "{name}: {:.3} µs a step (best of 5; checksum {sum:e})",
            best * 1e6
        );
    }
}
