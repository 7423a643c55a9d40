//! Standard deviation of the grade: consistent in both directions.
//!
//! Each case draws worlds that are the estimator's own model, with the noises, biases and errors of its parameters. The
//! normalised estimation error squared (NEES) of the published grade must be χ² distributed: a standard deviation of 0,
//! or one that is too small by the cosine of the grade, is above the band, one that is too large is below. In each case
//! another term of the variance is the large one. The grades are steep (25 to 30°), where a cosine counts.

use super::*;
use crate::Time;
use crate::api::signals::{Sample, Value, VehicleData};
use crate::testing::chi_square_band;

const RUNS: u64 = 300;
const STEP_S: Real = 0.01;
const GRAVITY: Real = 9.81;

/// One wheel, so that the noise of wheel speed is that of the sensor.
fn single() -> Vehicle {
    Vehicle::new(VehicleData {
        drives: 1,
        efficiency: 1.0,
        ..vehicle().data()
    })
    .unwrap()
}

/// Readings of the instruments in one step.
struct Instruments {
    torque_nm: Real,
    speed_mps: Real,
    specific_force_mps2: Real,
}

/// One step of an estimator.
fn step(estimator: &mut AnyEstimator, k: i64, read: &Instruments) -> Estimate {
    let t = Time::from_ns(10_000_000 * k);
    let mut z = Measurements::at(t);
    let sample = |value| Some(Sample { t, value });
    z.motor_torque_nm[0] = sample(read.torque_nm);
    z.wheel_speed_mps[0] = sample(read.speed_mps);
    z.specific_force_mps2 = Some(Sample {
        t,
        value: [read.specific_force_mps2, 0.0, GRAVITY],
    });
    z.angular_rate_radps = Some(Sample { t, value: [0.0; 3] });
    estimator.step(&z, &Command::default(), STEP_S).unwrap()
}

/// Mean NEES of the grade at the end of each run, and whether it is inside the band of as many independent errors.
fn assert_consistent(case: &str, run: impl Fn(u64) -> (Value, Real)) {
    let squares = (1..=RUNS).map(|seed| {
        let (grade, truth) = run(seed);
        ((grade.value - truth) / grade.sd).powi(2)
    });
    let nees = squares.sum::<Real>() / RUNS as Real;
    let (low, high) = chi_square_band(RUNS as usize);
    std::println!("{case}: NEES {nees:.3}, band {low:.3}…{high:.3}");
    assert!((low..high).contains(&nees), "{case}: {nees}");
}

/// (M + J) v̇ = F − M g (sin θ + μ cos θ) plus white noise, θ a random walk. F keeps the speed and goes by measured
/// speed alone: a force computed from the true grade would carry information that the filter's model does not have.
struct Traction {
    mass_kg: Real,
    mu: Real,
    theta: Real,
    q_v: Real,
    q_theta: Real,
    wheel_speed_sd: Real,
}

impl Traction {
    fn resisted(&self) -> Real {
        self.mass_kg * GRAVITY * (self.theta.sin() + self.mu * self.theta.cos())
    }

    /// Drives for `seconds`; the effective grade as estimated at the end, and as it is.
    fn run(
        mut self,
        estimator: &mut AnyEstimator,
        random: &mut Random,
        seconds: i64,
    ) -> (Value, Real) {
        let vehicle = single();
        let (mut v, mut measured) = (1.2, 1.2);
        let mut integral = self.resisted();
        let mut last = Value::default();
        for k in 1..=100 * seconds {
            integral += 2e4 * STEP_S * (1.2 - measured);
            let force = 3e4 * (1.2 - measured) + integral;
            let a = (force - self.resisted()) / (self.mass_kg + vehicle.rotating_mass_kg);
            v += STEP_S * a + (self.q_v * STEP_S).sqrt() * random.normal();
            self.theta += (self.q_theta * STEP_S).sqrt() * random.normal();
            measured = v + self.wheel_speed_sd * random.normal();
            let read = Instruments {
                torque_nm: force * vehicle.wheel_radius_m / vehicle.gear_ratio,
                speed_mps: measured,
                specific_force_mps2: a + GRAVITY * self.theta.sin(),
            };
            last = step(estimator, k, &read).effective_grade_rad;
        }
        (last, self.theta)
    }
}

/// Settings of a mass that is not learnt: its error, and that of the running resistance, are drawn from the prior.
fn two_stage(
    name: &str,
    fixed: &[(&str, Setting)],
    mass_sd: Real,
    mu_sd: Real,
    seed: u64,
) -> (Value, Real) {
    let mut random = Random::new(seed);
    let (mass0_kg, grade0_deg, q_v, q_theta, wheel_speed_sd) = (12_000.0, 25.0, 1e-4, 2e-5, 0.005);
    let told = [
        ("noise", Setting::Choice("told")),
        ("mass0_kg", Setting::Number(mass0_kg)),
        ("mass_sd", mass_sd.into()),
        ("mu_sd", mu_sd.into()),
        ("q_v", q_v.into()),
        ("q_theta", q_theta.into()),
        ("wheel_speed_sd_mps", wheel_speed_sd.into()),
        ("grade0_deg", grade0_deg.into()),
    ];
    let settings = told.into_iter().chain(fixed.iter().copied());
    let mut estimator = build(name, &single(), settings).unwrap();
    let world = Traction {
        mass_kg: mass0_kg * (1.0 + mass_sd * random.normal()),
        mu: single().running_resistance * (1.0 + mu_sd * random.normal()),
        theta: (grade0_deg + 3.0 * random.normal()).to_radians(),
        q_v,
        q_theta,
        wheel_speed_sd,
    };
    world.run(&mut estimator, &mut random, 9)
}

#[test]
fn grade_of_the_force_balance_by_noise_by_mass_and_by_resistance() {
    // Mass and resistance stay at their parameters: no sample counts.
    let regression = [
        ("excitation_mps2", Setting::Number(10.0)),
        ("unexcited_weight", 0.0.into()),
    ];
    // Samples come after ten seconds only; no strong tracking.
    let two_models = [("settle_s", Setting::Number(10.0)), ("alarm", 1e6.into())];
    for (name, fixed) in [
        ("dffrls_aekf_robust", &regression),
        ("mmrls_sh_stf_robust", &two_models),
    ] {
        for (term, mass_sd, mu_sd) in [
            ("noise", 0.001, 0.0),
            ("mass", 0.06, 0.0),
            ("resistance", 0.001, 1.0),
        ] {
            assert_consistent(&std::format!("{name}, {term}"), |seed| {
                two_stage(name, fixed, mass_sd, mu_sd, seed)
            });
        }
    }
}

/// v̇ and θ by the inertial model: θ a random walk, the accelerometer with noise and a bias.
fn inertial(name: &str, accel_bias_sd: Real, seed: u64) -> (Value, Real) {
    let mut random = Random::new(seed);
    let (q_v, q_theta, wheel_speed_sd, grade0_deg): (Real, Real, Real, Real) =
        (1e-6, 5e-6, 0.005, 30.0);
    let settings = [
        ("noise", Setting::Choice("told")),
        ("q_v", Setting::Number(q_v)),
        ("q_theta", q_theta.into()),
        ("wheel_speed_sd_mps", wheel_speed_sd.into()),
        ("accel_bias_sd_mps2", accel_bias_sd.into()),
        ("grade0_deg", grade0_deg.into()),
        // The rail is straight in the mean, and the parameter is set so.
        ("curvature_sd_per_m", 1e-4.into()),
        ("jerk_sd_mps3", 100.0.into()),
    ];
    let mut estimator = build(name, &single(), settings).unwrap();
    let bias = accel_bias_sd * random.normal();
    let (mut v, mut theta) = (0.8, (grade0_deg + 3.0 * random.normal()).to_radians());
    let mut last = Value::default();
    for k in 1..=600 {
        let a = 0.5 * (0.8 - v) + 0.2 * (0.03 * k as Real).sin();
        let f = a + GRAVITY * theta.sin();
        v += STEP_S * a;
        theta += (q_theta * STEP_S).sqrt() * random.normal();
        let read = Instruments {
            torque_nm: 0.0,
            speed_mps: v + wheel_speed_sd * random.normal(),
            specific_force_mps2: f + bias + (q_v / STEP_S).sqrt() * random.normal(),
        };
        last = step(&mut estimator, k, &read).grade_rad;
    }
    (last, theta)
}

#[test]
fn grade_of_the_inertial_filter_by_noise_and_by_bias() {
    for (term, bias_sd) in [("noise", 0.0), ("bias", 0.3)] {
        assert_consistent(&std::format!("inertial, {term}"), |seed| {
            inertial("dffrls_aukf_robust", bias_sd, seed)
        });
    }
}

/// Nothing but the bias of the accelerometer is wrong.
#[test]
fn grade_of_the_resistance_method_by_bias() {
    assert_consistent("resistance_dffrls_robust", |seed| {
        let mut random = Random::new(seed);
        let settings = [
            ("noise", Setting::Choice("told")),
            ("accel_bias_sd_mps2", Setting::Number(0.3)),
            ("residual_sd_mps2", 1e-4.into()),
        ];
        let mut estimator = build("resistance_dffrls_robust", &single(), settings).unwrap();
        let (theta, bias) = (Real::to_radians(30.0), 0.3 * random.normal());
        let read = Instruments {
            torque_nm: 300.0,
            speed_mps: 0.8,
            specific_force_mps2: GRAVITY * theta.sin() + bias,
        };
        let last = (1..=300).map(|k| step(&mut estimator, k, &read)).last();
        (last.unwrap().grade_rad, theta)
    });
}
