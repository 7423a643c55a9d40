use super::*;
use crate::api::real::PI;
use crate::api::vehicle::VehicleData;
use crate::testing::vehicles::vehicle;

const DT: Real = 0.01;

/// The filter of a train whose IMU is this far ahead of the middle of its unit.
fn filter(imu_arm_m: Real) -> AttitudeFilter {
    let train = Vehicle::new(VehicleData {
        imu_arm_m,
        ..vehicle().data()
    })
    .unwrap();
    let (params, supervision) = (Default::default(), Default::default());
    AttitudeFilter::new(&train, params, supervision, &Integrity::default())
}

/// What all instruments read on a pitch at a speed and a pitch rate, without noise.
fn channels(pitch: Real, speed: Real, pitch_rate: Real) -> Channels {
    let mut z = Channels {
        specific_force_mps2: Some([GRAVITY * pitch.sin(), 0.0, GRAVITY * pitch.cos()]),
        angular_rate_radps: Some([0.0, -pitch_rate, 0.0]),
        new: [true; 2],
        since_s: DT,
        ..Channels::default()
    };
    z.new_wheel_speed_mps[..8].fill(Some(speed));
    z
}

/// A sample that differs from the others by a noise that no detector of stuck instruments takes for a repetition.
fn jitter(mut z: Channels, k: u32) -> Channels {
    let by = 1e-4 * Real::from(k % 7);
    for vector in [&mut z.specific_force_mps2, &mut z.angular_rate_radps] {
        vector.iter_mut().for_each(|[x, ..]| *x += by);
    }
    z
}

/// In the first three seconds after a start in motion wheels may slip unseen, by which the pitch is uncertain by 0.06
/// rad for each √s. A vehicle that has stood at the start knows its pitch.
#[test]
fn the_pitch_of_a_start_in_motion_is_open_for_three_seconds() {
    for (speed, opens) in [(0.5, true), (-0.5, true), (0.0, false)] {
        let mut open = filter(0.0);
        open.start(&channels(0.1, speed, 0.0), DT).unwrap();
        let mut shut = AttitudeFilter {
            opening_s: 0.0,
            ..open
        };
        let imu = SoundImu {
            force_mps2: Some([0.0, 0.0, GRAVITY]),
            rate_radps: Some([0.0; 3]),
            ..SoundImu::default()
        };
        let before = [THETA, PHI].map(|i| open.belief.P[(i, i)]);
        for k in 1..=400 {
            for of in [&mut open, &mut shut] {
                of.predict(&imu, DT);
            }
            let [pitch, roll] = [THETA, PHI].map(|i| open.belief.P[(i, i)] - shut.belief.P[(i, i)]);
            let grown = if opens {
                0.06 * 0.06 * (DT * Real::from(k)).min(3.0)
            } else {
                0.0
            };
            assert!(
                (pitch - grown).abs() < 0.06 * 0.06 * 1.1 * DT,
                "{k}: {pitch} {grown}"
            );
            assert_eq!(roll, 0.0);
        }
        assert!(before.iter().all(|variance| *variance > 0.0));
    }
}

/// The angle random walk is that of the sheet, or that seen in the samples as far as the instrument is doubted: of a
/// calibrated gyro a body that rocks would pass for noise.
#[test]
fn the_noise_seen_of_a_gyro_counts_as_far_as_it_is_doubted() {
    let mut rocked = filter(0.0);
    rocked.start(&channels(0.0, 0.0, 0.0), DT).unwrap();
    for k in 0..4_000_u32 {
        let rate = [
            0.0,
            if (k / 5).is_multiple_of(2) {
                0.02
            } else {
                -0.02
            },
            0.0,
        ];
        let (x, lever) = (rocked.belief.x, rocked.model.lever);
        let sin_cos = rocked.angles.of(&x);
        let force = [0.0, 0.0, GRAVITY];
        let _ = rocked.window.step((&x, sin_cos), force, rate, lever, DT);
    }
    let seen = rocked.window.seen_turn_walk();
    let params = AttitudeParams::default();
    assert!(0.4 * seen > params.angle_random_walk, "{seen}");
    for (bias_sd, doubt) in [(0.03, 0.0), (0.042, 0.4), (0.045, 0.5), (0.06, 1.0)] {
        let mut filter = AttitudeFilter {
            calibration: Calibration::new([0.0, bias_sd]),
            belief: Gaussian::independent(SVector::zeros(), SVector::zeros()),
            ..rocked
        };
        let imu = SoundImu {
            force_mps2: Some([0.0, 0.0, GRAVITY]),
            rate_radps: Some([0.0; 3]),
            ..SoundImu::default()
        };
        filter.predict(&imu, DT);
        let walk = (filter.belief.P[(THETA, THETA)] / DT).sqrt();
        let expected = (doubt * seen).max(params.angle_random_walk);
        assert!(
            (walk / expected - 1.0).abs() < 1e-6,
            "{doubt}: {walk} {expected}"
        );
    }
}

/// A gyro that turns while the accelerometer and the wheels say that nothing does makes the wheels contradict the
/// pitch. The test that is published is small before and far beyond the monitor's threshold then.
#[test]
fn a_gyro_that_turns_by_itself_shows_in_the_test_of_the_monitor() {
    let mut filter = filter(0.0);
    for k in 0..1_500 {
        filter.step(&jitter(channels(0.0, 0.5, 0.0), k), DT);
        assert!(filter.monitor() < 10.0, "{}", filter.monitor());
    }
    let mut most: Real = 0.0;
    for k in 0..200 {
        filter.step(&jitter(channels(0.0, 0.5, 0.05), k), DT);
        most = most.max(filter.monitor());
    }
    assert!(most > 100.0, "{most}");
}

/// Errors that do not depend on each other add by squares: of the pitch, of the mount, of the running gear (0.3 mrad),
/// and of the arm: all of it where the grade is carried ahead, a third of it in the chord at the middle.
#[test]
fn errors_of_the_grades_add_by_squares() {
    let mut filter = filter(0.4);
    filter.start(&channels(0.02, 0.5, 0.0), DT).unwrap();
    for k in 0..200 {
        let way_m = 0.05 * Real::from(k);
        filter
            .arm
            .step(0.05, Some(0.05 * way_m.sin()), 0.05 * way_m.cos());
    }
    filter.found = Attitude {
        pitch_rad: 0.02,
        pitch_sd_rad: 0.002,
        curvature_per_m: 0.03,
        moved_on_rad: 0.001,
        sum_sd: 0.004,
        ..Attitude::default()
    };
    let (arm, mount) = (filter.arm.sd_rad(0.0), 0.2 * PI / 180.0);
    assert!(arm > 5e-4, "{arm}");
    let lagged = filter.lagged_grade();
    let squares = |sds: &[Real]| sds.iter().map(|sd| sd * sd).sum::<Real>().sqrt();
    let expected = squares(&[0.002, mount, 3e-4, arm / 3.0]);
    assert!((lagged.sd_rad / expected - 1.0).abs() < 1e-9);
    assert_eq!((lagged.grade_rad, lagged.lag_m), (0.02, 0.4));
    let expected = squares(&[0.002, mount, 3e-4, arm, 0.05 * 0.03, 0.001]);
    assert!((filter.grade_at_imu_sd_rad() / expected - 1.0).abs() < 1e-9);
    assert!((filter.grade_at_imu_rad() - (0.02 + 0.4 * 0.03)).abs() < 1e-12);
    let [bias, read, scale, arm_m] = filter.reading();
    let of = |i: usize| filter.belief.P[(i, i)].sqrt();
    assert_eq!((bias, scale, arm_m), (of(BIAS_X), of(SCALE), 0.4));
    assert!((read / squares(&[0.004, 3e-4]) - 1.0).abs() < 1e-9);
}
