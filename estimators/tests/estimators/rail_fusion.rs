//! Laws of `rail_fusion` and `attitude`: what makes bias and load observable, consistency in both directions, and no
//! NaN whatever comes in.

use crate::common::Random;
use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::mass_layout::MassLayout;
use monorig_estimators::api::params::{KeyKind, Setting};
use monorig_estimators::api::signals::{Command, Estimate, Measurements, Sample, Slot};
use monorig_estimators::registry::{self, AnyEstimator};
use monorig_estimators::{Real, Time, Vehicle, VehicleData};

const DT: Real = 0.005;
const G: Real = 9.81;
const TARE_KG: Real = 9_000.0;
const CHAIN_M: Real = 0.6;
const MU: Real = 0.02;
/// Of a calibrated IMU, as the estimators take it where the vehicle gives none.
const BIAS_SD: Real = 0.00978;
const VRW: Real = 6.94e-4;
const ARW: Real = 4.072e-5;

/// A train whose masses all rest at the IMU: their places do not matter in these tests.
fn vehicle() -> Vehicle {
    let mut layout = MassLayout::even(TARE_KG, [0.0; 2], [0.0; 2]);
    layout.load.chain_m = CHAIN_M;
    Vehicle::new(VehicleData {
        tare_kg: TARE_KG,
        drives: 8,
        wheel_radius_m: 0.17,
        gear_ratio: 19.0,
        running_resistance: MU,
        mass_range_kg: [0.5 * TARE_KG, TARE_KG + 30_000.0],
        layout: Some(layout),
        ..VehicleData::default()
    })
    .unwrap()
}

/// A train on a rail of one grade after a level stretch, with a load that hangs on chains: equations of motion of a
/// carriage with a pendulum (small angles), written from mechanics and not from the estimator.
struct World {
    random: Random,
    bias: [Real; 2],
    load_kg: Real,
    ramp_rad: Real,
    ramp_at_m: Real,
    /// Grade of the rail behind the start, rad, and length of a train that rests evenly on its rail behind the IMU, m.
    behind_rad: Real,
    span_m: Real,
    /// When it turns round, s.
    back_at_s: Real,
    t: Real,
    s: Real,
    v: Real,
    theta: Real,
    swing: [Real; 2],
}

impl World {
    fn new(seed: u64, load_kg: Real, ramp_rad: Real) -> Self {
        let mut random = Random::new(seed);
        let bias = [BIAS_SD * random.normal(), BIAS_SD * random.normal()];
        Self {
            random,
            bias,
            load_kg,
            ramp_rad,
            ramp_at_m: 10.0,
            behind_rad: 0.0,
            span_m: 0.0,
            back_at_s: Real::MAX,
            t: 0.0,
            s: 0.0,
            v: 0.0,
            theta: 0.0,
            swing: [0.0; 2],
        }
    }

    /// Of a place: 5 m of transition to the ramp, 2 m to the rail behind the start.
    fn grade_at(&self, s: Real) -> Real {
        self.ramp_rad * ((s - self.ramp_at_m) / 5.0).clamp(0.0, 1.0)
            + self.behind_rad * (-0.5 * s).clamp(0.0, 1.0)
    }

    fn grade(&self) -> Real {
        self.grade_at(self.s)
    }

    /// Sine of the grade, mean over the train.
    fn mean_sine(&self) -> Real {
        const PARTS: u16 = 40;
        let part = |k| self.s - self.span_m * (Real::from(k) + 0.5) / Real::from(PARTS);
        let sum: Real = (0..PARTS).map(|k| self.grade_at(part(k)).sin()).sum();
        sum / Real::from(PARTS)
    }

    fn step(&mut self) -> (Measurements, Command) {
        let gone_back = (0.35 * (self.t - self.back_at_s)).clamp(0.0, 2.0);
        let wanted = (0.35 * (self.t - 1.0)).clamp(0.0, 1.0) - gone_back;
        let total = TARE_KG + self.load_kg;
        let [phi, phi_dot] = self.swing;
        let way = if self.v < 0.0 { -1.0 } else { 1.0 };
        let resistance = match self.v == 0.0 {
            true => 0.0,
            false => way * MU * total * G,
        };
        let force = if self.t < 1.0 {
            0.0
        } else {
            way * MU * total * G + total * G * self.mean_sine() + 20_000.0 * (wanted - self.v)
        };
        // φ is counted from plumb: gravity pulls on all of it along the rail, and the chains pull by m g φ more.
        let a =
            (force - resistance + self.load_kg * G * phi - total * G * self.mean_sine()) / TARE_KG;
        let holds = self.t < self.back_at_s && self.v <= 0.0 && a < 0.0;
        let a = if holds { 0.0 } else { a };
        let rate = phi_dot - DT * (G * phi + a) / CHAIN_M;
        self.swing = [phi + DT * rate, rate];
        self.v += DT * a;
        self.s += DT * self.v;
        let before = self.theta;
        self.theta = self.grade();
        self.t += DT;
        self.measure(a, (self.theta - before) / DT, force)
    }

    fn measure(&mut self, a: Real, theta_dot: Real, force: Real) -> (Measurements, Command) {
        let t = Time::from_s(self.t);
        let mut z = Measurements::at(t);
        let noise = VRW / DT.sqrt();
        let (sine, cosine) = self.theta.sin_cos();
        let [bx, bz] = self.bias;
        let force_mps2 = [
            a + G * sine + bx + noise * self.random.normal(),
            noise * self.random.normal(),
            G * cosine + bz + noise * self.random.normal() + self.v * theta_dot,
        ];
        z.specific_force_mps2 = Some(Sample {
            t,
            value: force_mps2,
        });
        let rate = ARW / DT.sqrt();
        let mut turn = || rate * self.random.normal();
        let value = [turn(), -theta_dot + turn(), turn()];
        z.angular_rate_radps = Some(Sample { t, value });
        let mut u = Command::default();
        for i in 0..8 {
            let torque = force * 0.17 / 19.0 / 8.0;
            u.motor_torque_nm[i] = torque;
            let value = torque * (1.0 + 0.01 * self.random.normal()) + 0.2 * self.random.normal();
            z.motor_torque_nm[i] = Some(Sample { t, value });
            let value = self.v + 0.005 * self.random.normal();
            z.wheel_speed_mps[i] = Some(Sample { t, value });
        }
        (z, u)
    }

    fn run(&mut self, estimator: &mut AnyEstimator, seconds: Real) -> Estimate {
        let mut last = Estimate::default();
        for _ in 0..(seconds / DT) as usize {
            let (z, u) = self.step();
            last = estimator.step(&z, &u, DT).unwrap();
        }
        last
    }
}

/// The IMU of this world is mounted exactly.
const MOUNTED_EXACTLY: [(&str, Setting<'static>); 1] = [("mount_sd_deg", Setting::Number(0.0))];

fn build(name: &str, settings: &[(&'static str, Setting<'static>)]) -> AnyEstimator {
    registry::build(name, &vehicle(), settings.iter().copied()).unwrap()
}

fn internal(estimator: &AnyEstimator, name: &str) -> Real {
    let at = estimator
        .internals()
        .iter()
        .position(|internal| internal.name == name)
        .unwrap();
    let mut values = [0.0; 32];
    estimator.internal_values(&mut values);
    values[at]
}

#[test]
fn the_bias_is_observable_on_a_slope_and_not_on_the_level() {
    // By the law |f| = g, f_z measures b_z on the level, and on a slope of 8° with it cos θ, at a sensitivity of sin θ
    // = 0.14. On the level nothing separates b_x from θ. Without f_z nothing does anywhere. With biases that are
    // constant by the parameters and n = √5 · 6.94e-4 m/s/√s of noise in f_z, 12 s on the level and 27 s on the slope
    // make n √(1/12 + 1/27)/0.14 = 0.0039 m/s², 0.40 of the prior.
    let bias_sd = |ramp_deg: Real, settings: &[(&'static str, Setting<'static>)]| {
        let constant = ("accel_bias_walk", Setting::Number(0.0));
        let settings: Vec<_> = settings.iter().copied().chain([constant]).collect();
        let mut estimator = build("rail_fusion", &settings);
        let mut world = World::new(3, 10_000.0, ramp_deg.to_radians());
        world.run(&mut estimator, 45.0);
        let (b, sd) = (
            internal(&estimator, "accel_bias_mps2"),
            internal(&estimator, "accel_bias_sd_mps2"),
        );
        assert!((b - world.bias[0]).abs() < 4.0 * sd, "{ramp_deg}°: {b}");
        sd
    };
    let (level, slope) = (bias_sd(0.0, &[]), bias_sd(8.0, &[]));
    let without = bias_sd(8.0, &[("vertical_force", Setting::Flag(false))]);
    assert!(level > 0.9 * BIAS_SD, "level {level}");
    assert!(slope < 0.45 * BIAS_SD, "slope {slope}");
    assert!(without > 0.9 * BIAS_SD, "without f_z {without}");
}

/// The mount of an instrument that is not calibrated may be as askew as its bias is large, and |f| = g does not show
/// it: the grade stays as uncertain as it was at the start, on the slope too.
#[test]
fn a_mount_that_may_be_askew_is_said_in_the_standard_deviation() {
    for name in ["rail_fusion", "attitude"] {
        for seed in 0..6 {
            let told = ("accel_bias_sd_mps2", Setting::Number(0.25));
            let mut estimator = build(name, &[told]);
            let mut world = World::new(60 + seed, 10_000.0, 0.14);
            world.bias[0] = 0.25 * if seed % 2 == 0 { 1.0 } else { -1.5 };
            let grade = world.run(&mut estimator, 45.0).grade_rad;
            assert!(grade.sd > 0.8 * 0.25 / G, "{name}: {}", grade.sd);
            let error = (grade.value - world.theta).abs();
            assert!(
                error < 3.0 * grade.sd,
                "{name} {seed}: {error} {}",
                grade.sd
            );
        }
    }
}

#[test]
fn one_start_on_the_level_weighs_a_load_that_swings() {
    for load_kg in [2_000.0, 7_000.0, 14_000.0] {
        let mass = TARE_KG + load_kg;
        let mut estimator = build("rail_fusion", &[]);
        let mut world = World::new(5, load_kg, 0.0);
        let found = world.run(&mut estimator, 14.0).total_mass_kg;
        let error = (found.value / mass - 1.0).abs();
        assert!(error < 0.03, "{load_kg} kg: {error}");
        assert!(found.valid && error < 4.0 * found.sd / mass, "{load_kg} kg");
        // Its standard deviation without what no filter can see.
        let sd = internal(&estimator, "load_filter_sd_kg");
        assert!(sd < 0.03 * mass, "{load_kg} kg: {sd}");
    }
}

/// A train that goes back onto a slope that nothing has read: the force balance finds it, and the effective grade has
/// it once, not twice.
#[test]
fn rail_behind_the_start_counts_once_in_the_effective_grade() {
    let (span_m, behind_rad) = (18.0, 0.06);
    let nominal = Vehicle::new(VehicleData {
        layout: Some(MassLayout::even(TARE_KG, [0.0, span_m], [0.0, span_m])),
        tare_span_m: [0.0, span_m],
        load_span_m: [0.0, span_m],
        ..vehicle().data()
    })
    .unwrap();
    for seed in 0..6 {
        let mut estimator = registry::build("rail_fusion", &nominal, MOUNTED_EXACTLY).unwrap();
        let mut world = World::new(80 + seed, 0.0, 0.1);
        (world.behind_rad, world.span_m, world.back_at_s) = (behind_rad, span_m, 40.0);
        // up the ramp and back, to where all of the train is on the slope and its rear on what was never read
        while world.t < world.back_at_s || world.s > -5.0 {
            world.run(&mut estimator, 0.5);
        }
        for _ in 0..10 {
            let found = world.run(&mut estimator, 0.5).effective_grade_rad;
            let error = found.value - world.mean_sine().asin();
            // 4 σ of the force's own 0.001 rad and of the accelerometer's bias
            assert!(error.abs() < 4.0 * 0.0014, "{seed}: {error}");
            assert!(error.abs() < 3.0 * found.sd, "{seed}: {error}");
        }
    }
}

#[test]
fn the_standard_deviation_of_the_grade_is_neither_too_small_nor_too_large() {
    const RUNS: u64 = 24;
    for name in ["rail_fusion", "attitude"] {
        let mut nees = 0.0;
        for seed in 0..RUNS {
            let mut estimator = build(name, &MOUNTED_EXACTLY);
            let mut world = World::new(100 + seed, 8_000.0, 0.14);
            let grade = world.run(&mut estimator, 40.0).grade_rad;
            let error = (grade.value - world.theta) / grade.sd;
            nees += error * error / RUNS as Real;
        }
        // χ² with 24 degrees of freedom over 24: 1 ± 3 √(2/24). The noise of f_z is taken five times too large in
        // variance on purpose, so that standard deviations are up to √5 too large.
        let spread = 3.0 * (2.0 / RUNS as Real).sqrt();
        assert!(nees < 1.0 + spread, "{name}: {nees}");
        assert!(nees > (1.0 - 0.7 * spread) / 5.0, "{name}: {nees}");
    }
}

#[test]
fn every_switch_can_be_off() {
    for name in ["rail_fusion", "attitude"] {
        for key in registry::keys(name).unwrap() {
            if let KeyKind::Flag { .. } = key.kind {
                let mut estimator = build(name, &[(key.name, Setting::Flag(false))]);
                let mut world = World::new(7, 10_000.0, 0.1);
                let found = world.run(&mut estimator, 25.0);
                let error = (found.grade_rad.value - world.theta).abs();
                // No gyro, no f_z, no gate: worse, but no nonsense.
                assert!(
                    found.is_finite() && error < 0.02,
                    "{name}.{}: {error}",
                    key.name
                );
            }
        }
    }
}

#[test]
fn nothing_that_passes_the_input_check_makes_a_nan() {
    for name in ["rail_fusion", "attitude"] {
        let mut estimator = build(name, &[]);
        let mut random = Random::new(11);
        let mut world = World::new(13, 10_000.0, 0.1);
        for k in 0..40_000 {
            let (mut z, mut u) = world.step();
            let size = [1.0, 10.0, 1e3, 1e6][(k / 500) % 4];
            let mut wild = |value: &mut Real| {
                if random.chance(0.02) {
                    *value = size * random.normal();
                }
            };
            if (k / 2_000) % 2 == 1 {
                for slot in Slot::all() {
                    let Some(mut sample) = slot.get(&z) else {
                        continue;
                    };
                    let values = slot.measurand.shape().values();
                    sample.value.iter_mut().take(values).for_each(&mut wild);
                    slot.set(&mut z, Some(sample));
                }
                u.motor_torque_nm.iter_mut().for_each(&mut wild);
            }
            if random.chance(0.05) {
                z.specific_force_mps2 = None;
            }
            if random.chance(0.05) {
                z.angular_rate_radps = None;
            }
            // An error is an answer; a NaN is not.
            if let Ok(estimate) = estimator.step(&z, &u, DT) {
                assert!(estimate.is_finite(), "{name} at {k}");
                let sds = [
                    estimate.total_mass_kg.sd,
                    estimate.grade_rad.sd,
                    estimate.effective_grade_rad.sd,
                ];
                assert!(sds.iter().all(|sd| *sd >= 0.0), "{name} at {k}");
            }
        }
    }
}
