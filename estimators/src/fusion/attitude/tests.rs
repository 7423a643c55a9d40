use super::*;
use crate::api::real::PI;
use crate::api::vehicle::VehicleData;
use crate::models::attitude::GYRO_Z;
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

/// Readings of all instruments on a pitch at a speed and a pitch rate, without noise.
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

/// A specific force that is not as long as g, or upside down, starts nothing: the filter begins half a second after it
/// last was so, on the pitch by then. A train in which it never is g has no estimate.
#[test]
fn a_start_waits_for_an_accelerometer_that_reads_g() {
    let force = |size: Real, forward: Real| [forward, 0.0, size];
    for wrong in [
        force(1.0, 0.0),
        force(0.0, GRAVITY * GRAVITY),
        force(GRAVITY, 32.767),
        force(-GRAVITY - 1.0, 1.0),
    ] {
        let mut starts = filter(0.0);
        let mut never = starts;
        let mut began = None;
        for k in 0..1000u32 {
            let mut z = jitter(channels(0.1, 0.5, 0.0), k);
            let right = z;
            z.specific_force_mps2 = Some(wrong);
            z = jitter(z, k);
            assert!(never.step(&z, DT).is_none(), "{wrong:?}");
            let found = starts.step(if k == 0 { &z } else { &right }, DT);
            if let (None, Some(_)) = (began, found) {
                began = Some(k);
            }
        }
        // e^(−t/0.4 s) of the first error is left in the low-passes of length and f_z
        let [x, _, z] = wrong;
        let long = (x.hypot(z) - GRAVITY).abs() / 0.35;
        let low = (GRAVITY - z) / (0.5 * GRAVITY);
        let expected = 0.4 * long.max(low).ln() + 0.5;
        let began_s = DT * Real::from(began.unwrap());
        assert!(
            (began_s - expected).abs() < 0.05,
            "{wrong:?}: {began_s} {expected}"
        );
        assert!((starts.found.pitch_rad - 0.1).abs() < 1e-3, "{wrong:?}");
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

/// A gyro that turns while accelerometer and wheels say that nothing does separates the pitches: not before, and within
/// two seconds by half of what it has turned, of which a third is a standard deviation.
#[test]
fn a_gyro_that_turns_by_itself_separates_the_pitches() {
    let mut filter = filter(0.0);
    for k in 0..1_500 {
        filter.step(&jitter(channels(0.0, 0.5, 0.0), k), DT);
        assert_eq!(filter.separation_sd_rad(), 0.0);
    }
    let mut most: Real = 0.0;
    for k in 0..200 {
        filter.step(&jitter(channels(0.0, 0.5, 0.05), k), DT);
        most = most.max(filter.separation_sd_rad());
    }
    assert!((0.05 / 3.0..0.1 / 3.0).contains(&most), "{most}");
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
    assert_eq!(lagged.grade_rad, 0.02);
    let expected = squares(&[0.002, mount, 3e-4, arm, 0.05 * 0.03, 0.001]);
    assert!((filter.grade_at_imu_sd_rad() / expected - 1.0).abs() < 1e-9);
    assert!((filter.grade_at_imu_rad() - (0.02 + 0.4 * 0.03)).abs() < 1e-12);
    let [bias, read, scale, arm_m] = filter.reading();
    let of = |i: usize| filter.belief.P[(i, i)].sqrt();
    assert_eq!((bias, scale, arm_m), (of(BIAS_X), of(SCALE), 0.4));
    assert!((read / squares(&[0.004, 3e-4]) - 1.0).abs() < 1e-9);
}

/// A filter that has started at this speed.
fn started(speed: Real) -> AttitudeFilter {
    let mut filter = filter(0.0);
    filter.start(&channels(0.0, speed, 0.0), DT).unwrap();
    filter
}

/// Without a wheel the speed is that of the accelerometer: from the eighth second on its variance grows by 1 m²/s² a
/// second, which lets any wheel in.
#[test]
fn without_a_wheel_the_speed_is_less_and_less_certain() {
    let mut filter = started(1.0);
    let first = filter.belief.P[(V, V)];
    for k in 1..=1_000 {
        filter.coast(DT);
        let t = DT * Real::from(k);
        let expected = (t - 8.0).max(0.0);
        let grown = filter.belief.P[(V, V)] - first;
        assert!((grown - expected).abs() < 1.01 * DT);
    }
}

/// Wheels that come back after eight seconds give the speed that had been given up: the way in between is not known, as
/// before a start.
#[test]
fn wheels_after_a_long_loss_are_a_start() {
    let full = channels(0.0, 1.0, 0.0);
    let mut blind = full;
    blind.new_wheel_speed_mps.fill(None);
    for (lost_s, starts) in [(0.1, false), (7.9, false), (8.1, true)] {
        let mut filter = started(1.0);
        let lost = (lost_s / DT + 0.5) as u32;
        for k in 0..lost {
            filter.step(&jitter(blind, k), DT);
        }
        for (k, expected) in [(lost, starts), (lost + 1, false)] {
            filter.step(&jitter(full, k), DT);
            assert_eq!(filter.has_just_started(), expected, "{lost_s}");
        }
    }
}

/// Half a second without any sample, of accelerometer or wheels, and the output is nobody's; two seconds, by steps or
/// by the clock, and with the next sample the filter starts anew. A sample of either is enough to go on.
#[test]
fn after_a_pause_it_starts_anew() {
    let full = jitter(channels(0.0, 0.5, 0.0), 1);
    let mut wheels = full;
    wheels.specific_force_mps2 = None;
    let mut force = full;
    force.new_wheel_speed_mps.fill(None);
    for (silent_s, awake, anew) in [
        (0.45, true, false),
        (0.55, false, false),
        (1.9, false, false),
        (2.1, false, true),
    ] {
        for (first, since_s) in [(wheels, DT), (force, DT), (full, DT)] {
            let mut filter = started(0.5);
            filter.step(&full, DT);
            for _ in 0..(silent_s / DT + 0.5) as usize {
                filter.step(&Channels::default(), DT);
            }
            assert_eq!(filter.is_awake(), awake, "{silent_s}");
            filter.listen(&Channels { since_s, ..first }, DT);
            assert_eq!(filter.started, !anew, "{silent_s}");
            assert_eq!(filter.silent_s, 0.0);
        }
    }
    for (since_s, goes_on) in [(1.99, true), (2.01, false)] {
        let mut filter = started(0.5);
        filter.listen(&Channels { since_s, ..full }, DT);
        assert_eq!(filter.started, goes_on);
    }
}

/// A gyro that has been silent for five seconds is none; until then it is missing.
#[test]
fn a_gyro_that_is_silent_for_long_is_none() {
    let mut filter = started(0.0);
    assert!(!filter.has_gyro());
    let with = channels(0.0, 0.0, 0.0);
    let without = Channels {
        angular_rate_radps: None,
        ..with
    };
    filter.listen(&with, DT);
    assert!(filter.has_gyro());
    (0..495).for_each(|_| filter.listen(&without, DT));
    assert!(filter.has_gyro());
    (0..10).for_each(|_| filter.listen(&without, DT));
    assert!(!filter.has_gyro());
    filter.listen(&with, DT);
    filter.leave_gyro_out();
    assert!(!filter.has_gyro() && !filter.uses_gyro() && !filter.started);
    filter.started = true;
    filter.leave_gyro_out();
    assert!(filter.started);
}

/// With a gyro the curvature is no state. Lost, it goes on from the last one, known to 0.005 1/m, and depends on
/// nothing; while it stays lost the state is left alone.
#[test]
fn a_lost_gyro_leaves_its_curvature() {
    let mut filter = started(0.5);
    filter.curvature.set(0.03);
    filter.carry_curvature(true);
    assert_eq!(
        (filter.belief.x[KAPPA], filter.belief.P[(KAPPA, KAPPA)]),
        (0.0, 0.0)
    );
    filter.carry_curvature(false);
    assert_eq!(filter.belief.x[KAPPA], 0.03);
    assert!((filter.belief.P[(KAPPA, KAPPA)].sqrt() / 0.005 - 1.0).abs() < 1e-9);
    filter.belief.x[KAPPA] = 0.01;
    filter.carry_curvature(false);
    assert_eq!(filter.belief.x[KAPPA], 0.01);
    filter.carry_curvature(true);
    assert_eq!(
        (filter.belief.x[KAPPA], filter.belief.P[(KAPPA, KAPPA)]),
        (0.0, 0.0)
    );
}

/// A vehicle stands once it has been slow for 0.3 s by its wheels; without a wheel the time stays as it is, and it ends
/// with the first step that is not slow. From then on the gyro reads its biases.
#[test]
fn a_stand_is_told_by_wheels_that_rest() {
    let imu = SoundImu {
        rate_radps: Some([0.0, 1e-4, 0.0]),
        ..SoundImu::default()
    };
    let still = 0.4 * vehicle().standstill_mps(None);
    for (speed, wheels, steps, reads) in [
        (0.9 * still, true, 29, false),
        (0.9 * still, true, 32, true),
        (-0.9 * still, true, 32, true),
        (1.1 * still, true, 100, false),
        (-1.1 * still, true, 100, false),
        (0.0, false, 100, false),
    ] {
        let mut filter = started(0.0);
        filter.belief.x[V] = speed;
        (0..steps).for_each(|_| filter.aid_by_standstill(&imu, wheels, DT));
        assert_eq!(
            filter.belief.x[crate::models::attitude::GYRO_Y] != 0.0,
            reads,
            "{speed}"
        );
    }
    let mut filter = started(0.0);
    (0..40).for_each(|_| filter.aid_by_standstill(&imu, true, DT));
    let quiet_s = filter.quiet_s;
    filter.aid_by_standstill(&imu, false, DT);
    assert_eq!(filter.quiet_s, quiet_s);
    filter.belief.x[V] = 1.0;
    filter.aid_by_standstill(&imu, true, DT);
    assert_eq!(
        (filter.quiet_s, filter.standing_bias),
        (0.0, StandingBias::default())
    );
}

/// The state stays within what a vehicle can do, to both sides. What is not finite, a variance below 0, or a second of
/// wheels that contradict a start, begin it anew.
#[test]
fn a_state_that_cannot_be_is_limited_or_begun_anew() {
    let z = channels(0.1, 0.5, 0.0);
    for sign in [1.0, -1.0] {
        let mut filter = started(0.5);
        for place in [V, THETA, PHI, KAPPA] {
            filter.belief.x[place] = 1e3 * sign;
        }
        filter.limit(&z, DT).unwrap();
        let most = [100.0, MAX_GRADE_RAD, MAX_GRADE_RAD, RAIL.max_turn_radpm];
        for (place, most) in [V, THETA, PHI, KAPPA].into_iter().zip(most) {
            assert_eq!(filter.belief.x[place], sign * most);
        }
    }
    let anew = |change: fn(&mut AttitudeFilter)| {
        let mut filter = started(0.5);
        filter.belief.x[BIAS_X] = 0.01;
        change(&mut filter);
        filter.limit(&z, DT).unwrap();
        filter.started && filter.belief.x[BIAS_X] == 0.0
    };
    assert!(!anew(|_| ()));
    assert!(anew(|filter| filter.belief.x[SCALE] = Real::NAN));
    assert!(anew(|filter| filter.belief.P[(SCALE, SCALE)] = -1e-9));
    assert!(!anew(|filter| filter.contradicted_s = 0.99));
    assert!(anew(|filter| filter.contradicted_s = 1.01));
    // without a wheel there is nothing to begin with
    let mut filter = started(0.5);
    filter.contradicted_s = 1.01;
    assert_eq!(filter.limit(&Channels::default(), DT), None);
    assert!(!filter.started && filter.contradicted_s == 0.0);
}

/// The heading turns by what the body turns about the vertical; the unit's middle is slower than the IMU below it while
/// the pitch grows; the grade has moved on since the last sample of the accelerometer.
#[test]
fn the_output_is_that_of_the_unit() {
    let mut filter = started(1.0);
    filter.model.lever.below_m = 0.5;
    let (pitch, roll) = (0.3, -0.2);
    (filter.belief.x[THETA], filter.belief.x[PHI]) = (pitch, roll);
    filter.belief.x[V] = 2.0;
    // a heading rate of 0.4 and a pitch rate of 0.1 in body axes: x forward, y left, z up, pitch nose up
    let (turn, nod) = (0.4, 0.1);
    let rate = [
        turn * pitch.sin(),
        turn * pitch.cos() * roll.sin() - nod * roll.cos(),
        turn * pitch.cos() * roll.cos() + nod * roll.sin(),
    ] as [Real; 3];
    let imu = SoundImu {
        force_mps2: Some([1.0, 0.0, GRAVITY]),
        rate_radps: Some(rate),
        ..SoundImu::default()
    };
    let x = filter.belief.x;
    let input = AttitudeInput {
        force_mps2: imu.force_mps2,
        rate_radps: imu.rate_radps,
        ..AttitudeInput::default()
    };
    let rates = filter.model.rates(&x, &input);
    for (age_s, counts_s) in [(0.2, 0.2), (-0.2, 0.0), (3.0, 1.0)] {
        let z = Channels {
            age_s: [0.5, age_s, 0.7],
            ..channels(0.0, 2.0, 0.0)
        };
        let ballot = Ballot {
            used: 5,
            slipping: 2,
            ..Ballot::default()
        };
        filter.find((&z, &imu), &rates, &ballot, DT);
        let found = filter.found();
        assert!(
            (found.yaw_rate_radps - turn).abs() < 1e-9,
            "{}",
            found.yaw_rate_radps
        );
        assert!((found.pitch_rate_radps - nod).abs() < 1e-9);
        assert!((found.speed_mps - (2.0 - 0.5 * nod)).abs() < 1e-9);
        assert!((found.moved_on_rad - counts_s * nod).abs() < 1e-9);
        assert_eq!((found.wheels, found.imu), ([5, 2], true));
        assert!((filter.pitch_sine() - pitch.sin()).abs() < 1e-9);
        // sin θ + b/g, and the speed given the scale of the wheels, by the covariance
        let P = &filter.belief.P;
        let (c, g) = (pitch.cos(), 9.81);
        let sum = c * c * P[(THETA, THETA)]
            + 2.0 * c / g * P[(THETA, BIAS_X)]
            + P[(BIAS_X, BIAS_X)] / g / g;
        assert!((found.sum_sd / sum.sqrt() - 1.0).abs() < 1e-3);
        let given = P[(V, V)] - P[(V, SCALE)].powi(2) / P[(SCALE, SCALE)];
        assert!((found.speed_noise_mps / given.sqrt() - 1.0).abs() < 1e-9);
        assert!((found.speed_sd_mps / P[(V, V)].sqrt() - 1.0).abs() < 1e-9);
    }
}

/// The vertical force rests on |f| = g: it is a measurement as far as the instrument is calibrated. Half doubted its
/// noise has four times the variance, and doubted wholly there is none. The one across the body does not rest on it.
#[test]
fn the_vertical_force_is_trusted_as_far_as_it_is_calibrated() {
    let status = |bias_sd: Real| {
        let mut filter = AttitudeFilter {
            calibration: Calibration::new([bias_sd, 0.0]),
            belief: Gaussian::independent(SVector::zeros(), SVector::zeros()),
            ..started(0.5)
        };
        let imu = SoundImu {
            force_mps2: Some([0.0, 0.0, GRAVITY]),
            rate_radps: Some([0.0; 3]),
            ..SoundImu::default()
        };
        (0..5).for_each(|_| filter.aid_by_force(&imu, DT));
        let [_, lateral, vertical] = filter.aid_status();
        assert_eq!(lateral.outcome, AidOutcome::Fused);
        (lateral.innovation_variance, vertical)
    };
    let ((across, whole), (same, half), (_, none)) = (status(0.03), status(0.045), status(0.06));
    assert_eq!(across, same);
    assert!((half.innovation_variance / whole.innovation_variance - 4.0).abs() < 1e-6);
    assert_eq!(
        (half.outcome, none.outcome),
        (AidOutcome::Fused, AidOutcome::Stale)
    );
}

/// A roll that is not known couples the turn of a bend into the pitch, on a road: by the square of the rate, less the
/// bias of the gyro. On a rail there is none.
#[test]
fn a_bend_of_a_road_makes_the_pitch_uncertain() {
    for (turn_walk, yaw_rate) in [(1e-4, 0.5), (1e-4, -0.25), (4e-4, 0.5), (0.0, 0.5)] {
        let mut filter = AttitudeFilter {
            turn_walk,
            belief: Gaussian::independent(SVector::zeros(), SVector::zeros()),
            ..started(0.0)
        };
        filter.belief.x[GYRO_Z] = 0.1;
        let imu = SoundImu {
            force_mps2: Some([0.0, 0.0, GRAVITY]),
            rate_radps: Some([0.0, 0.0, yaw_rate + 0.1]),
            ..SoundImu::default()
        };
        let mut rail = AttitudeFilter {
            turn_walk: 0.0,
            ..filter
        };
        filter.predict(&imu, DT);
        rail.predict(&imu, DT);
        let grown = filter.belief.P[(THETA, THETA)] - rail.belief.P[(THETA, THETA)];
        let expected = turn_walk * yaw_rate * yaw_rate * DT;
        assert!((grown - expected).abs() < 1e-6 * expected + 1e-20);
    }
}

/// The heading is as uncertain as the gyro's bias about z has turned it by.
#[test]
fn the_heading_drifts_by_the_bias_of_the_gyro() {
    let mut filter = started(0.0);
    filter.belief.set_independent(GYRO_Z, 0.0, 0.01 * 0.01);
    filter.params.angle_random_walk = 1e-9;
    let imu = SoundImu {
        rate_radps: Some([0.0; 3]),
        ..SoundImu::default()
    };
    let z = channels(0.0, 0.0, 0.0);
    let input = AttitudeInput {
        rate_radps: imu.rate_radps,
        ..AttitudeInput::default()
    };
    let rates = filter.model.rates(&SVector::zeros(), &input);
    (0..200).for_each(|_| filter.find((&z, &imu), &rates, &Ballot::default(), DT));
    let [angle, sd] = filter.heading();
    assert!(angle == 0.0 && (sd / 0.02 - 1.0).abs() < 1e-6, "{sd}");
}
