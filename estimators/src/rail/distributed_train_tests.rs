//! Tests of [`super`]: a train of 18 m on a rail on which sin θ grows by 1 % a metre, where all means are known in
//! closed form.

use super::*;
use crate::api::signals::VehicleData;
use crate::testing::vehicles::vehicle;

const PER_M: Real = 0.01;
const BIAS_MPS2: Real = 0.2;
const ARM_M: Real = 1.0;
const STEP_S: Real = 0.01;

/// 5 t of tare over 18 m, the load over four metres of it.
fn long_vehicle() -> Vehicle {
    Vehicle::new(VehicleData {
        tare_span_m: [0.0, 18.0],
        load_span_m: [5.0, 9.0],
        imu_arm_m: ARM_M,
        ..vehicle().data()
    })
    .unwrap()
}

/// Distance of the middle of all masses behind the unit of the IMU, m.
fn middle_m(mass_kg: Real) -> Real {
    (5_000.0 * 9.0 + (mass_kg - 5_000.0) * 7.0) / mass_kg
}

struct Ride {
    train: DistributedTrain,
    place_m: Real,
}

impl Ride {
    fn new(vehicle: &Vehicle) -> Self {
        Self {
            train: DistributedTrain::new(vehicle, None),
            place_m: 0.0,
        }
    }

    /// Runs on for `way_m` at a speed; with `read` the accelerometer reads.
    fn run(&mut self, way_m: Real, speed_mps: Real, read: bool) {
        for _ in 0..(way_m / (speed_mps.abs() * STEP_S)).round() as usize {
            self.place_m += speed_mps * STEP_S;
            let u = GRAVITY * PER_M * self.place_m + BIAS_MPS2;
            let place = read.then_some([u, 0.1]);
            self.train.roll(place, speed_mps, speed_mps, STEP_S);
        }
    }

    /// The effective grade, rad.
    fn effective(&self, mass_kg: Real) -> Real {
        (PER_M * (self.place_m - middle_m(mass_kg))).asin()
    }
}

/// A cell of the map is 0.18 m long: as much of the gradient.
const CELL: Real = 0.2 * PER_M;

#[test]
fn on_a_ramp_grades_are_ahead_by_the_way_to_the_middle_of_the_masses() {
    let mut ride = Ride::new(&long_vehicle());
    ride.run(40.0, 1.0, true);
    for mass_kg in [5_000.0, 9_000.0, 25_000.0] {
        let ahead = ride.train.ahead(mass_kg);
        let middle = PER_M * middle_m(mass_kg);
        assert!((ahead.unit - middle).abs() < CELL, "{ahead:?} {middle}");
        assert!(
            (ahead.imu - middle - PER_M * ARM_M).abs() < 2.0 * CELL,
            "{ahead:?}"
        );
        // The IMU is a metre ahead of rail that has been read, which goes on by whole cells.
        assert!(ahead.sd < 1e-9, "{ahead:?}");
    }
    assert!((ride.train.curvature_per_m() - 0.1).abs() < 1e-9);
    assert_eq!(ride.train.tare_kg(), 5_000.0);
    // Standing, nothing is learnt of the place.
    let before = ride.train.ahead(9_000.0);
    ride.train.roll(Some([5.0, 0.0]), 0.04, 0.04, STEP_S);
    assert_eq!(ride.train.ahead(9_000.0), before);
    ride.train.roll(Some([5.0, 0.0]), 0.06, 0.06, STEP_S);
    assert_ne!(ride.train.ahead(9_000.0), before);
}

#[test]
fn before_the_rail_is_read_the_offset_is_uncertain() {
    let mut ride = Ride::new(&long_vehicle());
    let nothing = ride.train.ahead(9_000.0);
    assert_eq!((nothing.imu, nothing.unit), (0.0, 0.0));
    assert!((nothing.sd - 1.0).abs() < 1e-9); // 50 m that nothing has read, 0.02 rad/m
    ride.run(2.0, 1.0, true);
    let start = ride.train.ahead(9_000.0).sd;
    ride.run(8.0, 1.0, true);
    let later = ride.train.ahead(9_000.0).sd;
    assert!(start > 2.0 * later && later > 0.0, "{start} {later}");
}

/// Effect of a gap of 6 m under 18 m of train: 0.25 · 0.02 · 6 · 6/18 rad.
#[test]
fn a_gap_of_the_map_widens_offsets_and_samples() {
    let mut ride = Ride::new(&long_vehicle());
    ride.run(40.0, 1.0, true);
    ride.run(3.0, 1.0, false);
    assert!((ride.train.ahead(9_000.0).sd - 0.06).abs() < 1e-9);
    ride.run(3.0, 2.0, false);
    assert!((ride.train.ahead(9_000.0).sd - 0.12).abs() < 1e-9);
    ride.run(2.0, 1.0, true);
    assert!((ride.train.ahead(9_000.0).sd - 0.01).abs() < 1e-6);
    let felt = ride.train.felt(ride.place_m).unwrap();
    for mean in [felt.tare, felt.load] {
        assert!((mean.doubt_mps2 - 0.01 * GRAVITY).abs() < 1e-6, "{mean:?}");
    }
}

#[test]
fn a_point_is_ahead_of_nothing_and_feels_what_is_read_now() {
    for (data, point) in [
        (vehicle().data(), true),
        (
            VehicleData {
                tare_span_m: [0.0, 9.0],
                ..vehicle().data()
            },
            false,
        ),
        (
            VehicleData {
                load_span_m: [0.0, 9.0],
                ..vehicle().data()
            },
            false,
        ),
        (
            VehicleData {
                imu_arm_m: 9.0,
                ..vehicle().data()
            },
            false,
        ),
    ] {
        let mut ride = Ride::new(&Vehicle::new(data).unwrap());
        ride.run(30.0, 1.0, true);
        let ahead = ride.train.ahead(9_000.0);
        assert_eq!(ahead == GradeOffset::default(), point, "{data:?}");
        let sample = ResampledSample {
            specific_force_mps2: Some(1.0),
            ..ResampledSample::default()
        };
        let now = [GRAVITY * PER_M * ride.place_m + BIAS_MPS2, 0.1];
        let [felt, blind] = [sample, ResampledSample::default()]
            .map(|sample| ride.train.ready((sample, ride.place_m)).felt);
        assert_eq!(blind, None);
        assert!(felt.is_some());
        assert!(!point || felt == Some(LoadedGrade::point(now)));
        ride.train.learn_bias(9_000.0, 0.0, 1.0);
        assert_eq!(ride.train.learnt_s == 0.0, point);
    }
}

#[test]
fn the_bias_is_the_mean_of_what_is_read_above_the_grade() {
    let mut ride = Ride::new(&long_vehicle());
    ride.run(40.0, 1.0, true);
    let theta = ride.effective(9_000.0);
    let at = |bias: Real| ((GRAVITY * theta.sin() - bias) / GRAVITY).asin();
    ride.train.learn_bias(9_000.0, at(0.1), STEP_S);
    let close = |train: &DistributedTrain, bias: Real| {
        assert!(
            (train.bias_mps2 - bias).abs() < GRAVITY * CELL,
            "{} {bias}",
            train.bias_mps2
        );
    };
    close(&ride.train, BIAS_MPS2 + 0.1);
    ride.train.learn_bias(9_000.0, at(-0.5), STEP_S);
    close(&ride.train, BIAS_MPS2 - 0.2);
    for _ in 0..4_000 {
        ride.train.learn_bias(9_000.0, theta, STEP_S);
    }
    close(&ride.train, BIAS_MPS2);
    // A memory of 20 s.
    let start = ride.train.bias_mps2;
    for _ in 0..2_000 {
        ride.train.learn_bias(9_000.0, at(1.0), STEP_S);
    }
    let moved = ride.train.bias_mps2 - start;
    assert!(
        (moved - (1.0 - Real::exp(-1.0))).abs() < 0.01 + GRAVITY * CELL,
        "{moved}"
    );
    // With rail under the train that nothing has read, nothing is learnt.
    let before = ride.train.bias_mps2;
    ride.run(1.0, 1.0, false);
    ride.train.learn_bias(9_000.0, theta, STEP_S);
    ride.run(1.0, 1.0, true);
    ride.train.learn_bias(9_000.0, theta, STEP_S);
    assert_eq!(ride.train.bias_mps2, before);
}

/// Driven back far enough, the tail stands on rail that is forgotten: the offset is what the instrument reads less its
/// bias.
#[test]
fn over_forgotten_rail_the_offset_at_the_imu_goes_by_the_bias() {
    let (mass_kg, known_sd) = (9_000.0, 0.03 / GRAVITY);
    let offset = PER_M * (ARM_M + middle_m(mass_kg));
    for (learn_s, by_bias) in [(4.0, false), (6.0, true)] {
        let mut ride = Ride::new(&long_vehicle());
        ride.run(60.0, 1.0, true);
        let theta = ride.effective(mass_kg);
        ride.train.learn_bias(mass_kg, theta, learn_s);
        let (imu, sd) = ride.train.imu_offset(mass_kg, theta);
        assert!((imu - offset).abs() < 2.0 * CELL && sd < 1e-9, "{imu} {sd}");
        ride.run(12.0, -1.0, true);
        let theta = ride.effective(mass_kg);
        let (imu, sd) = ride.train.imu_offset(mass_kg, theta);
        assert_eq!((sd - known_sd).abs() < 1e-12, by_bias, "{sd}");
        if by_bias {
            assert!((imu - offset).abs() < 2.0 * CELL, "{imu} {offset}");
        }
        let bias = ride.train.bias_mps2;
        ride.train.learn_bias(mass_kg, theta, STEP_S);
        assert_eq!(ride.train.bias_mps2, bias);
        // Not read just now, the bias does not help.
        ride.run(0.5, -1.0, false);
        let (_, sd) = ride.train.imu_offset(mass_kg, ride.effective(mass_kg));
        assert!(sd > known_sd + 0.005, "{sd}");
    }
}

/// Tare that reaches 4 m ahead of the IMU: a sample waits until the IMU has been there, or the train stands.
#[test]
fn samples_wait_until_the_rail_under_the_front_has_been_read() {
    let vehicle = Vehicle::new(VehicleData {
        tare_span_m: [-4.0, 14.0],
        load_span_m: [5.0, 9.0],
        ..vehicle().data()
    })
    .unwrap();
    let balance = crate::models::force_balance::ForceBalance::new(&vehicle);
    let mut signals = Resampler::new(20.0, 1.0, 0.0);
    let mut train = DistributedTrain::new(&vehicle, None);
    let mut place_m = 0.0;
    let mut given = std::vec::Vec::new();
    for k in 0..3_000 {
        place_m += STEP_S;
        let reading = Reading {
            speed_mps: Some(1.0),
            motor_torque_nm: Some(10.0),
            specific_force_mps2: Some(GRAVITY * PER_M * place_m),
            ..Reading::default()
        };
        let running = k < 2_990;
        let sample = signals.step(&reading, &balance, running, STEP_S);
        if let Some(next) = train.step(&signals, sample, &reading, running, STEP_S) {
            let [u, _] = next.felt.unwrap().tare.value;
            given.push((place_m, u / (GRAVITY * PER_M)));
        }
    }
    // One a second; each given 4 m of way after its place, with the mean 5 m behind that.
    for (k, (now_m, mean_m)) in given
        .iter()
        .enumerate()
        .filter(|(k, _)| (15..25).contains(k))
    {
        let taken_m = (k + 1) as Real;
        assert!((now_m - taken_m - 4.0).abs() < 0.4, "{now_m} {taken_m}");
        assert!((mean_m - (taken_m - 5.0)).abs() < 0.4, "{mean_m} {taken_m}");
    }
    // When it stands those that wait come, one a step.
    assert_eq!(given.len(), 29);
    assert!(!train.is_waiting());
    assert!((given[28].0 - given[27].0 - STEP_S).abs() < 1e-9);
}

#[test]
fn a_grade_is_steeper_by_a_sine_and_never_beyond_upright() {
    for theta in [-0.5, 0.0, 0.3] {
        for by in [-0.2, 0.0, 0.1] {
            let steep = steeper(theta, by);
            assert!((steep.sin() - theta.sin() - by).abs() < 1e-12);
        }
        assert_eq!(steeper(theta, 0.0), theta);
    }
    assert_eq!(steeper(1.2, 0.5), 0.5 * PI);
    assert_eq!(steeper(-1.2, -0.5), -0.5 * PI);
}

/// Rail that nothing has read counts by its share of the train: means are uncertain by u, offsets by that over g.
#[test]
fn the_uncertainty_of_an_offset_is_that_of_the_mean_over_g() {
    let mut ride = Ride::new(&long_vehicle());
    ride.run(6.0, 1.0, true);
    let now = ride.train.now.unwrap();
    let (_, doubt_mps2) = now.felt.whole(5_000.0, 9_000.0);
    assert!(doubt_mps2 > 0.05);
    let ahead = ride.train.ahead(9_000.0);
    assert!((ahead.sd * GRAVITY / doubt_mps2 - 1.0).abs() < 1e-9);
}
