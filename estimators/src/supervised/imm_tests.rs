//! Tests of [`super`]: the force balance as a row of the model, and what makes a grade valid.

use super::*;
use crate::api::reading::LearntNoise;
use crate::fusion::attitude::Attitude;
use crate::models::single_track::Bends;
use crate::testing::steps;
use crate::testing::vehicles::{Turn, car, vehicle};

const DT: Real = 0.01;
const WHEEL_SD: Real = 0.005;

fn build(vehicle: &Vehicle, params: ModelParams, mass: DifferencedParams) -> SlopeModels {
    let open = Integrity {
        innovation_gate: false,
        ..Integrity::default()
    };
    let still = TrackingParams {
        fading_max: 1.0,
        ..Default::default()
    };
    let imm = ImmParams::default();
    SlopeModels::new(vehicle, params, mass, imm, still, &open, WHEEL_SD)
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
            let [expected, _] = balance.acceleration(4e4, 15_000.0, theta, direction * 0.02);
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
    let mut stage = dynamic(&vehicle(), 0.001);
    let read = reading(1.0, 100.0);
    let attitude = steps::attitude(&read, Real::asin(0.39));
    let (ahead, doubt): (Real, Real) = (0.0767, 0.01);
    let now = steps::step(&read, &attitude, &ForceBalance::new(&vehicle()), DT);
    stage.step(&Step {
        effective_rad: [Real::asin(0.39 - ahead), doubt],
        ..now
    });
    let (sine, net_n) = (0.39, 6e4);
    let push = stage.push(net_n, 1.0, sine);
    let next = stage.models[0].f(&vector![1.0, 0.0, sine], &Some(push), DT);
    let (mass, resistance) = (15_000.0, 0.02 * Real::sqrt(1.0 - sine * sine));
    let expected = (net_n - mass * 9.81 * (sine - ahead + resistance)) / (mass + 1_045.0);
    assert!((next.y - expected).abs() < 1e-9);
    // An uncertain effective grade is an uncertain acceleration.
    let (by_grade, by_mass) = (9.81 * doubt, net_n / mass * 0.001);
    let sd = (0.03 * 0.03 + by_grade * by_grade + by_mass * by_mass).sqrt();
    assert!((push.sd_mps2 * (1.0 + 1_045.0 / mass) / sd - 1.0).abs() < 1e-6);
}

#[test]
fn there_is_a_force_balance_while_there_is_traction() {
    let mut stage = dynamic(&vehicle(), 0.1);
    for (speed, direction) in [(1.0, 1.0), (-1.0, -1.0)] {
        let push = stage.push_now(Some(3e4), speed);
        assert_eq!(push, Some(stage.push(3e4, direction, 0.0)));
        assert_eq!(stage.push_now(None, speed), None);
    }
    // The sine of a grade that makes no sense is cut.
    for belief in &mut stage.imm.beliefs {
        belief.x.z = -5.0;
    }
    let push = stage.push_now(Some(3e4), 1.0);
    assert_eq!(push, Some(stage.push(3e4, 1.0, -MAX_SINE)));
    // In a bend the bend takes its part.
    let mut road = dynamic(&car(), 0.01);
    let turn = Turn::solve(2_170.0, 10.0, 0.3, 0.0).reading();
    let mut bends = Bends::new(&car(), 1.0);
    bends.step(&turn, &road.balance, 2_170.0, DT);
    let (attitude, balance) = (steps::attitude(&turn, 0.0), road.balance);
    road.step(&Step {
        bend: bends.now(),
        ..steps::step(&turn, &attitude, &balance, DT)
    });
    let bend_n = bends.now().force_n(road.mass.mass_kg().value);
    assert!(bend_n > 100.0);
    let sine = road.imm.combined().x.z;
    let push = road.push_now(Some(3e3), 10.0);
    assert_eq!(push, Some(road.push(3e3 - bend_n, 1.0, sine)));
}

/// Level, at rest in all signals: F keeps the speed. The method's effective grade after that time.
fn steady(stage: &mut SlopeModels, seconds: Real, read: impl Fn(Reading) -> Reading) -> Value {
    let torque = 15_000.0 * 9.81 * 0.02 * 0.17 / 20.0 / 0.9;
    let level = Reading {
        specific_force_mps2: Some(0.0),
        ..reading(1.0, torque)
    };
    let (reading, balance) = (read(level), stage.balance);
    let attitude = steps::attitude(&reading, 0.0);
    for _ in 0..(seconds / DT).round() as usize {
        stage.step(&steps::step(&reading, &attitude, &balance, DT));
    }
    stage.effective_grade_rad()
}

#[test]
fn a_grade_is_valid_for_half_a_second_after_its_last_measurement() {
    let mut stage = dynamic(&vehicle(), 0.1);
    let found = steady(&mut stage, 5.0, |level| level);
    assert!(found.valid && found.value.abs() < 1e-3, "{found:?}");
    let held = |level| Reading {
        new_speed_mps: None,
        ..level
    };
    let no_force = |level| Reading {
        specific_force_mps2: None,
        ..level
    };
    let no_speed = |level| Reading {
        speed_mps: None,
        new_speed_mps: None,
        ..level
    };
    for lacking in [held, no_force, no_speed] {
        let mut stage = stage;
        let before = stage.imm;
        assert!(steady(&mut stage, 0.49, lacking).valid);
        assert!(!steady(&mut stage, 0.02, lacking).valid);
        // Wheel speed and accelerometer are fused together or not at all.
        assert_eq!(stage.imm, before);
        assert!(steady(&mut stage, 1.0, |level| level).valid);
    }
    // Nor before the first.
    let mut new = dynamic(&vehicle(), 0.1);
    assert!(!steady(&mut new, 0.2, held).valid);
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
        assert!(stage.is_saturated() && !found.valid);
        assert_eq!(stage.imm.beliefs[0].x.z, sign * MAX_SINE);
    }
    assert!(steady(&mut stage, 5.0, |level| level).valid);
    assert!(!stage.is_saturated());
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
    steady(&mut stage, DT, |level| level);
    assert!((stage.imm.combined().x.x - 1.0).abs() < 1e-3);
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
        let y = z - expected;
        let [mut speed, mut force] = stage.gates;
        let (speed, force) = (speed.judge(y.y, S.m22), force.judge(y.x, S.m11));
        stage.gate(&z, &mut used, dt);
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

/// Noise as learnt is that of the measurements, and the bias that the core has found is taken off the specific force:
/// one cycle is one of a plain filter with these.
#[test]
fn a_cycle_fuses_the_force_less_its_bias_by_the_noise_learnt() {
    let noise = LearntNoise {
        wheel_speed_mps: Some(0.03),
        specific_force_mps2: Some(0.2),
    };
    let mut stage = dynamic(&vehicle(), 0.1);
    steady(&mut stage, 1.0, |level| level);
    let before = stage.imm.beliefs[0];
    let read = Reading {
        noise,
        specific_force_mps2: Some(0.3),
        motor_torque_nm: None,
        ..reading(1.02, 0.0)
    };
    let attitude = Attitude {
        bias_mps2: 0.05,
        ..steps::attitude(&read, 0.0)
    };
    let balance = stage.balance;
    stage.step(&steps::step(&read, &attitude, &balance, DT));
    let mut plain = Ekf::new(stage.models[0], before);
    plain.predict(&None, DT);
    let R = Matrix2::from_diagonal(&vector![0.2 * 0.2, 0.03 * 0.03]);
    plain.update(vector![0.3 - 0.05, 1.02], &R).unwrap();
    for belief in stage.imm.beliefs {
        assert!((belief.x - plain.belief.x).norm() < 1e-9, "{belief:?}");
        assert!((belief.P - plain.belief.P).norm() < 1e-9);
    }
}

/// sin θ at the instrument, less what the core has seen it to be ahead by.
#[test]
fn the_grade_is_the_effective_one_with_the_doubt_of_its_offset_and_of_the_bias() {
    let ride = |ahead: Real, ahead_sd: Real, bias_sd_mps2: Real| {
        let mut stage = dynamic(&vehicle(), 0.001);
        for model in &mut stage.models {
            model.acceleration = Acceleration::Kinematic;
        }
        let read = Reading {
            specific_force_mps2: Some(9.81 * 0.3),
            ..reading(1.0, 0.0)
        };
        let attitude = steps::attitude(&read, Real::asin(0.3));
        let balance = stage.balance;
        for _ in 0..2_000 {
            let now = steps::step(&read, &attitude, &balance, DT);
            stage.step(&Step {
                effective_rad: [Real::asin(0.3 - ahead), ahead_sd],
                bias_sd_mps2,
                ..now
            });
        }
        stage.effective_grade_rad()
    };
    let alone = ride(0.0, 0.0, 0.0);
    assert!((alone.value.sin() - 0.3).abs() < 1e-3, "{alone:?}");
    let long = ride(0.0767, 0.03, 0.1);
    assert!((long.value.sin() - 0.3 + 0.0767).abs() < 1e-3, "{long:?}");
    let cosine = Real::sqrt(1.0 - 0.3 * 0.3);
    let expected = 0.03 * 0.03 + (0.1 / 9.81) * (0.1 / 9.81);
    let doubt = (long.sd * long.sd - alone.sd * alone.sd) * cosine * cosine;
    assert!(
        (doubt / expected - 1.0).abs() < 1e-2,
        "{doubt:e} {expected:e}"
    );
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
}
