//! Building a suite, its checks, the assets.

use super::super::fault::{Fault, FaultWindow};
use super::super::noise::white_sd;
use super::super::{Instrument, SensorChannel, StepInterval};
use super::*;
use crate::error::Error;

#[test]
fn a_step_longer_than_the_period_of_a_sensor_is_refused() {
    let suite = suite(&asset("ideal.yaml"), &train(1), 1);
    suite.check_step(0.005).unwrap();
    let e = suite.check_step(0.006).unwrap_err();
    assert_eq!(e.key, "accelerometer.sampling.rate_hz");
    assert!(e.help.contains("166."), "{}", e.help);
}

#[test]
fn the_mount_decides_what_the_imu_reads() {
    let train = train(3);
    let mut sheet = asset("ideal.yaml");
    spec(&mut sheet, "gyro").mount = "drive_3/imu_link".into();
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
    assert_eq!(suite.mounts(), [1, 5], "the plant moves both");
    for s in rates(&look(&mut suite, truth, DT, 100)) {
        assert!((Vector3::from(s.value) - Vector3::new(0.1, 0.2, 0.3)).norm() < 1e-12);
    }
    spec(&mut sheet, "gyro").mount = "drive_9/imu_link".into();
    let e = Suite::new(&sheet, &Fitting::new(&train, G, 1))
        .err()
        .unwrap();
    assert_eq!(e.key, "gyro.mount");
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
    let mut specs = asset("huainan.yaml");
    let accelerometer = spec(&mut specs, "accelerometer").clone();
    let gyro = spec(&mut specs, "gyro").clone();
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

/// Time of one step at the full train, printed: `cargo test --release -p monorig-sim -- --ignored --nocapture
/// time_of_a_step`.
#[test]
#[ignore = "a measurement, not a law"]
fn time_of_a_step() {
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

/// An instrument as another crate would write it: speed over ground of the front by radar, into a reading of its own.
struct Radar;

impl Instrument for Radar {
    fn name(&self) -> &str {
        "radar"
    }
    fn rate_hz(&self) -> f64 {
        500.0
    }
    fn measure(
        &mut self,
        step: StepInterval,
        truth: &Truth,
        z: &mut Measurements,
    ) -> Result<(), Error> {
        z.auxiliary[0] = Some(Sample {
            t: monorig_estimators::Time::from_ns(step.to_ns),
            value: truth.speed_mps,
        });
        Ok(())
    }
    fn add_fault(&mut self, _unit: Option<usize>, _fault: FaultWindow) {}
    fn channels(&self) -> Vec<SensorChannel> {
        vec![SensorChannel::new("auxiliary_1", "m/s", |z| {
            z.auxiliary[0].map(|s| s.value)
        })]
    }
}

#[test]
fn an_instrument_of_another_crate_is_read_recorded_and_named() {
    let train = train(2);
    let mut suite = suite(&asset("ideal.yaml"), &train, 1);
    suite.fit(Box::new(Radar)).unwrap();
    assert_eq!(suite.fit(Box::new(Radar)).unwrap_err().key, "radar");
    assert!(suite.check_step(0.005).is_err(), "500 Hz, 5 ms");
    let off = FaultWindow {
        from_s: 0.0,
        to_s: 1.0,
        fault: Fault::Off,
        axis: None,
    };
    suite.add_fault("radar", off).unwrap();
    let mut z = Measurements::default();
    let truth = Truth {
        speed_mps: 1.5,
        ..standing(&train, 0.0)
    };
    suite.measure(&truth, &mut z).unwrap();
    let channels = suite.channels();
    let channel = channels.last().unwrap();
    assert_eq!(
        (channel.path.as_str(), (channel.value)(&z)),
        ("sensors/auxiliary_1", Some(1.5))
    );
}

/// IMU first, then unit by unit; every fitted instrument and no other.
#[test]
fn channels_are_those_of_the_fitted_instruments_place_by_place() {
    let train = train(2);
    let mut sheet = asset("ideal.yaml");
    sheet.remove("clamp_pressure");
    sheet.remove("gyro");
    let suite = suite(&sheet, &train, 1);
    let paths: Vec<String> = suite.channels().into_iter().map(|c| c.path).collect();
    assert_eq!(
        paths,
        [
            "sensors/imu/specific_force_x",
            "sensors/imu/specific_force_y",
            "sensors/imu/specific_force_z",
            "sensors/drive_1/motor_torque",
            "sensors/drive_1/wheel_speed",
            "sensors/drive_2/motor_torque",
            "sensors/drive_2/wheel_speed",
        ]
    );
}
