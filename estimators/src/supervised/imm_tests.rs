//! Tests of [`super`]: the force balance as a row of the model, and what makes a grade valid.

use super::*;
use crate::api::signals::VehicleData;
use crate::detect::validity::Integrity;
use crate::testing::vehicles::{Turn, car, vehicle};

const DT: Real = 0.01;

/// Supervisors without innovation gates.
fn open() -> Supervisors {
    Supervisors {
        grade_map: true,
        integrity: Integrity {
            innovation_gate: false,
            nis_monitor: false,
            plausibility: false,
            ..Integrity::default()
        },
        ..Supervisors::default()
    }
}

fn build(vehicle: &Vehicle, params: ModelParams, mass: DifferencedParams) -> SlopeModels {
    let still = TrackingParams {
        fading_max: 1.0,
        ..Default::default()
    };
    SlopeModels::new(vehicle, params, mass, ImmParams::default(), still, &open())
}

/// The dynamic model twice, without strong tracking: interacting with itself, it is as if alone.
fn dynamic(vehicle: &Vehicle, mass_sd: Real) -> SlopeModels {
    let mass = DifferencedParams {
        mass0_kg: Some(15_000.0),
        mass_sd,
        ..Default::default()
    };
    let mut stage = build(vehicle, ModelParams::default(), mass);
    stage.models = [stage.models[1]; 2];
    stage
}

fn reading(speed: Real, torque: Real) -> Reading {
    Reading {
        new_speed_mps: Some(speed),
        speed_mps: Some(speed),
        motor_torque_nm: Some(torque),
        specific_force_mps2: Some(1.0),
        ..Reading::default()
    }
}

/// (M + J) v̇ = F − M g (i + s μ c): what the model makes of the force is the acceleration of the balance, on any
/// slope, both ways.
#[test]
fn the_dynamic_row_is_the_force_balance() {
    let (stage, balance) = (dynamic(&vehicle(), 0.1), ForceBalance::new(&vehicle()));
    let model = stage.models[0];
    for sine in [-0.4, 0.0, 0.5] {
        for direction in [1.0, -1.0] {
            let push = stage.push(4e4, direction, sine);
            let x = vector![1.0, 7.0, sine];
            let next = model.f(&x, &Some(push), DT);
            let theta = Real::asin(sine);
            let expected = balance.acceleration(4e4, 15_000.0, theta, direction * 0.02);
            assert!((next.y - expected).abs() < 1e-9, "{} {expected}", next.y);
            assert!((next.x - 1.07).abs() < 1e-12 && next.z == sine);
            // What the balance leaves out, and a tenth of the mass, moved by F = M g …: in quadrature, over 1 + J/M.
            let sd = Real::hypot(0.03, 4e4 / 15_000.0 * 0.1) / (1.0 + 1_045.0 / 15_000.0);
            assert!((push.sd_mps2 / sd - 1.0).abs() < 1e-9);
            let Q = model.Q(&Some(push), DT);
            let params = ModelParams::default();
            let expected = vector![params.q_v * DT, sd * sd, params.q_i * DT];
            assert!((Q.diagonal() - expected).norm() < 1e-9 * sd);
        }
    }
    // Without a force balance, and in the kinematic model, the acceleration walks at random.
    let kinematic = SlopeModel {
        acceleration: Acceleration::Kinematic,
        ..model
    };
    for (model, push) in [(model, None), (kinematic, Some(stage.push(1e4, 1.0, 0.0)))] {
        assert_eq!(model.f(&vector![1.0, 0.5, 0.1], &push, DT).y, 0.5);
        assert!((model.Q(&push, DT).m22 - 0.3 * DT).abs() < 1e-12);
    }
}

/// The state is the grade that the IMU reads, the balance holds for the mean under the train.
#[test]
fn the_balance_of_a_long_train_is_that_of_its_effective_grade() {
    let long = Vehicle::new(VehicleData {
        tare_span_m: [0.0, 18.0],
        load_span_m: [5.0, 9.0],
        ..vehicle().data()
    })
    .unwrap();
    let mut stage = dynamic(&long, 0.001);
    let balance = ForceBalance::new(&long);
    // sin θ grows by 1 % a metre; 1 m/s.
    for k in 0..4_000 {
        let sine = 0.01 * DT * k as Real;
        let mut read = reading(1.0, 100.0);
        read.specific_force_mps2 = Some(9.81 * sine);
        stage.mass.step(&read, &balance, true, DT);
    }
    // The middle of 5 t over 18 m and 10 t around 7 m is 7.67 m behind.
    let ahead = stage.mass.ahead();
    assert!((ahead.unit - 0.0767).abs() < 0.002, "{ahead:?}");
    let (sine, net_n) = (0.39, 6e4);
    let next = stage.models[0].f(
        &vector![1.0, 0.0, sine],
        &Some(stage.push(net_n, 1.0, sine)),
        DT,
    );
    let (mass, resistance) = (15_000.0, 0.02 * Real::sqrt(1.0 - sine * sine));
    let expected = (net_n - mass * 9.81 * (sine - ahead.unit + resistance)) / (mass + 1_045.0);
    assert!((next.y - expected).abs() < 1e-9);
    // Uncertain offsets are uncertain accelerations.
    stage.mass.step(
        &Reading {
            specific_force_mps2: None,
            ..reading(1.0, 100.0)
        },
        &balance,
        true,
        1.0,
    );
    let doubt = 9.81 * stage.mass.ahead().sd;
    assert!(doubt > 0.1);
    let by_mass = net_n / mass * 0.001;
    let sd = (0.03 * 0.03 + doubt * doubt + by_mass * by_mass).sqrt() / (1.0 + 1_045.0 / mass);
    assert!((stage.push(net_n, 1.0, sine).sd_mps2 / sd - 1.0).abs() < 1e-6);
}

#[test]
fn there_is_a_force_balance_while_the_train_runs_and_torque_is_known() {
    let mut stage = dynamic(&vehicle(), 0.1);
    for (speed, direction) in [(1.0, 1.0), (-1.0, -1.0)] {
        let read = reading(speed, 300.0);
        let net_n = stage.balance.net_traction(300.0, speed);
        let push = stage.push_now(&read, true, speed);
        assert_eq!(push, Some(stage.push(net_n, direction, 0.0)));
        assert_eq!(stage.push_now(&read, false, speed), None);
        let silent = Reading {
            motor_torque_nm: None,
            ..read
        };
        assert_eq!(stage.push_now(&silent, true, speed), None);
    }
    // The sine of a grade that makes no sense is cut.
    for belief in &mut stage.imm.beliefs {
        belief.x.z = -5.0;
    }
    let push = stage.push_now(&reading(1.0, 300.0), true, 1.0);
    let net_n = stage.balance.net_traction(300.0, 1.0);
    assert_eq!(push, Some(stage.push(net_n, 1.0, -MAX_SINE)));
    // In a bend the bend takes its part.
    let mut road = dynamic(&car(), 0.01);
    let turn = Turn::solve(2_170.0, 10.0, 0.3, 0.0).reading();
    for _ in 0..500 {
        road.mass.step(&turn, &road.balance, true, DT);
    }
    let bend_n = road.mass.bend().force_n(road.mass.mass_kg().value);
    let net_n = road
        .balance
        .net_traction(turn.motor_torque_nm.unwrap(), 10.0)
        - bend_n;
    assert!(bend_n > 100.0);
    assert_eq!(
        road.push_now(&turn, true, 10.0),
        Some(road.push(net_n, 1.0, 0.0))
    );
}

/// Level, at rest in all signals: F keeps the speed.
fn steady(stage: &mut SlopeModels, seconds: Real, read: impl Fn(Reading) -> Reading) -> Estimate {
    let torque = 15_000.0 * 9.81 * 0.02 * 0.17 / 20.0 / 0.9;
    let level = Reading {
        specific_force_mps2: Some(0.0),
        ..reading(1.0, torque)
    };
    let steps = (seconds / DT).round() as usize;
    (0..steps)
        .map(|_| stage.advance(&read(level), Time::default(), DT))
        .last()
        .unwrap()
}

#[test]
fn a_grade_is_valid_for_half_a_second_after_its_last_measurement() {
    let mut stage = dynamic(&vehicle(), 0.1);
    let found = steady(&mut stage, 5.0, |level| level);
    assert!(found.grade_rad.valid && found.speed_mps.valid && found.flags.moving);
    assert!((found.speed_mps.value - 1.0).abs() < 1e-3 && found.grade_rad.value.abs() < 1e-3);
    let held = |level| Reading {
        new_speed_mps: None,
        ..level
    };
    assert!(steady(&mut stage, 0.49, held).grade_rad.valid);
    assert!(!steady(&mut stage, 0.02, held).grade_rad.valid);
    assert!(steady(&mut stage, 1.0, |level| level).grade_rad.valid);
    let no_force = |level| Reading {
        specific_force_mps2: None,
        ..level
    };
    let no_speed = |level| Reading {
        speed_mps: None,
        new_speed_mps: None,
        ..level
    };
    for lacking in [no_force, no_speed] {
        let mut stage = stage;
        assert!(!steady(&mut stage, DT, lacking).grade_rad.valid);
    }
    // Nor before the first.
    let mut new = dynamic(&vehicle(), 0.1);
    assert!(!steady(&mut new, 0.2, held).grade_rad.valid);
}

#[test]
fn wheel_speed_and_accelerometer_are_fused_together_or_not_at_all() {
    let mut stage = dynamic(&vehicle(), 0.1);
    let mut status = [AidStatus::default(); 3];
    steady(&mut stage, 1.0, |level| level);
    stage.aid_status(&mut status);
    let fused = crate::api::aid::AidOutcome::Fused;
    assert_eq!([status[0].outcome, status[1].outcome], [fused; 2]);
    assert!(status[0].innovation_variance > 0.005 * 0.005);
    assert!(status[1].innovation_variance > 0.02 * 0.02);
    steady(&mut stage, 0.1, |level| Reading {
        specific_force_mps2: None,
        ..level
    });
    stage.aid_status(&mut status);
    assert_eq!(status[1].outcome, crate::api::aid::AidOutcome::Stale);
    let before = stage.imm;
    steady(&mut stage, 0.1, |level| Reading {
        new_speed_mps: None,
        speed_mps: None,
        ..level
    });
    stage.aid_status(&mut status);
    assert_eq!(status[0].outcome, crate::api::aid::AidOutcome::Stale);
    assert_eq!(stage.imm, before);
}

/// Two measurements: the normalised innovation squared is reported per measurement.
#[test]
fn the_innovation_told_is_that_of_wheel_speed() {
    let mut stage = dynamic(&vehicle(), 0.1);
    steady(&mut stage, 2.0, |level| level);
    let found = steady(&mut stage, DT, |level| Reading {
        new_speed_mps: Some(1.01),
        speed_mps: Some(1.01),
        ..level
    });
    let last = stage.last.unwrap();
    assert!((found.innovation - 0.01).abs() < 1e-3);
    assert_eq!(found.innovation, last.y.y);
    let S = last.S.try_inverse().unwrap();
    assert!((found.nis - 0.5 * last.y.dot(&(S * last.y))).abs() < 1e-9);
}

#[test]
fn a_limit_of_the_slope_is_told_and_left_again() {
    let mut stage = dynamic(&vehicle(), 0.1);
    for (sign, force) in [(1.0, 30.0), (-1.0, -30.0)] {
        let found = steady(&mut stage, 5.0, |level| Reading {
            specific_force_mps2: Some(force),
            motor_torque_nm: None,
            ..level
        });
        assert!(found.flags.saturated && !found.grade_rad.valid);
        assert_eq!(stage.imm.beliefs[0].x.z, sign * MAX_SINE);
    }
    assert!(!steady(&mut stage, 5.0, |level| level).flags.saturated);
}

#[test]
fn it_starts_from_the_grade_told() {
    let params = ModelParams {
        grade0_deg: 30.0,
        grade0_sd_deg: 3.0,
        ..Default::default()
    };
    let stage = build(&vehicle(), params, DifferencedParams::default());
    let belief = stage.imm.beliefs[0];
    assert!((belief.x.z - 0.5).abs() < 1e-12);
    assert!((belief.P.m33.sqrt() - Real::to_radians(3.0)).abs() < 1e-12);
}

#[test]
fn the_first_wheel_speed_is_the_speed_at_the_start() {
    let mut stage = dynamic(&vehicle(), 0.1);
    assert_eq!(steady(&mut stage, DT, |level| level).innovation, 0.0);
}

/// Each measurement against what the kinematic model predicts of it: S = H (F P Fᵀ + Q) Hᵀ + R.
#[test]
fn the_gates_judge_by_the_innovation_of_the_kinematic_model() {
    let mut stage = dynamic(&vehicle(), 0.1);
    stage.gates = [Gate::new(&Integrity::default()); 2];
    #[rustfmt::skip]
    let L = Matrix3::new(
        0.1, 0.0, 0.0,
        0.04, 0.2, 0.0,
        0.003, 0.02, 0.03,
    );
    let (x, dt) = (vector![1.0, 0.3, 0.1], 0.2);
    let R = Matrix2::new(0.01, 0.0, 0.0, 0.0025);
    let model = SlopeModel {
        acceleration: Acceleration::Kinematic,
        ..stage.models[0]
    };
    let (F, H) = (model.F(&x, &None, dt), model.H(&x));
    let mut seen = [0; 3];
    for k in 0..40 {
        let belief = Gaussian {
            x,
            P: L * L.transpose(),
        };
        stage.imm.beliefs = [belief; 2];
        let predicted = F * belief.P * F.transpose() + model.Q(&None, dt);
        let S = H * predicted * H.transpose() + R;
        let expected = model.h(&model.f(&x, &None, dt));
        let z = expected
            + if k < 10 {
                vector![0.1, -0.05]
            } else {
                vector![90.0, 9.0]
            };
        let mut used = R;
        stage.gates.iter_mut().for_each(|gate| gate.tick(dt));
        let [speed, force] = stage.gate(&z, &mut used, dt);
        let y = z - expected;
        assert!((speed.innovation.0 - y.y).abs() < 1e-9);
        assert!((force.innovation.0 - y.x).abs() < 1e-9);
        assert!((speed.innovation.1 / S.m22 - 1.0).abs() < 1e-9);
        assert!((force.innovation.1 / S.m11 - 1.0).abs() < 1e-9);
        // A specific force beyond the gate has as much more noise.
        let beyond = (force.test_ratio - 1.0).max(0.0);
        assert!((used.m11 - R.m11 - beyond * S.m11).abs() < 1e-9 * used.m11);
        assert!(k < 10 || beyond > 0.0);
        let widened = stage.imm.beliefs[0].P.m11 - belief.P.m11;
        match speed.passage {
            Passage::Fuse => assert_eq!((used.m22, widened), (R.m22, 0.0)),
            Passage::Reject => assert_eq!((used.m22, widened), (1e6, 0.0)),
            Passage::Reopen => {
                assert_eq!(used.m22, R.m22);
                assert!((widened - y.y * y.y).abs() < 1e-9);
            }
        }
        seen[speed.passage as usize] += 1;
    }
    assert!(seen.iter().all(|count| *count > 0), "{seen:?}");
}

/// Measurement noise as learnt enters as its variance.
#[test]
fn learnt_noise_is_the_noise_of_the_measurements() {
    let variances = |force: Real, speed: Real| {
        let mut stage = dynamic(&vehicle(), 0.1);
        let noise = crate::preprocess::conditioning::LearntNoise {
            wheel_speed_mps: Some(speed),
            specific_force_mps2: Some(force),
        };
        steady(&mut stage, DT, |level| Reading { noise, ..level });
        stage.aids.map(|status| status.innovation_variance)
    };
    let ([a, b], [c, d]) = (variances(0.1, 0.03), variances(0.2, 0.06));
    assert!((c - a - 0.0027).abs() < 1e-9 && (d - b - 0.03).abs() < 1e-9);
}

/// sin θ grows by 1 % a metre; the IMU reads the grade under its unit, 7.67 m ahead of the middle of all masses.
#[test]
fn a_long_train_on_a_ramp() {
    let long = Vehicle::new(VehicleData {
        tare_span_m: [0.0, 18.0],
        load_span_m: [5.0, 9.0],
        imu_arm_m: 1.0,
        ..vehicle().data()
    })
    .unwrap();
    let mut stage = dynamic(&long, 0.001);
    for model in &mut stage.models {
        model.acceleration = Acceleration::Kinematic;
    }
    let ride = |stage: &mut SlopeModels, from: usize, to: usize, read: bool| {
        let mut found = Estimate::default();
        for k in from..to {
            let sine = 0.01 * DT * k as Real;
            let reading = Reading {
                specific_force_mps2: Some(9.81 * sine).filter(|_| read),
                motor_torque_nm: None,
                ..reading(1.0, 0.0)
            };
            found = stage.advance(&reading, Time::default(), DT);
        }
        found
    };
    let found = ride(&mut stage, 0, 4_000, true);
    let [imu, effective] = [found.grade_rad, found.effective_grade_rad];
    assert!((imu.value.sin() - 0.4 - 0.01).abs() < 4e-3, "{imu:?}");
    assert!(
        (effective.value.sin() - 0.4 + 0.0767).abs() < 4e-3,
        "{effective:?}"
    );
    // All rail has been read; what the mass is uncertain by moves the middle of the train, (9 m₀ + 7 (M − m₀))/M behind
    // the front.
    let mass = stage.mass.mass_kg();
    let expected = 0.01 * 2.0 * 5_000.0 / (mass.value * mass.value) * mass.sd;
    let doubt = (effective.sd * effective.sd - imu.sd * imu.sd).sqrt();
    assert!(
        (doubt / expected - 1.0).abs() < 0.1,
        "{doubt:e} {expected:e}"
    );
    // 3 m that the accelerometer has not read: 0.06 rad.
    let found = ride(&mut stage, 4_000, 4_300, false);
    let [imu, effective] = [found.grade_rad.sd, found.effective_grade_rad.sd];
    assert!(((effective * effective - imu * imu).sqrt() - 0.06).abs() < 1e-3);
}

#[test]
fn internal_quantities_are_told_in_their_order() {
    let mut stage = dynamic(&vehicle(), 0.1);
    steady(&mut stage, 2.0, |level| level);
    stage.fading = [3.0, 4.0];
    let mut values = [9.0; 8];
    stage.internal_values(&mut values);
    let [a, b] = stage.imm.beliefs.map(|belief| asin(belief.x.z));
    let p = stage.imm.probability()[1];
    assert_eq!(
        values,
        [3.0, 4.0, stage.mass.residual_n(), 0.0, a, b, p, 9.0]
    );
    assert_eq!(stage.conditioning(), Some(open().conditioning));
}
