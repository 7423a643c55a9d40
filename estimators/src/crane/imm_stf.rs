//! `imm_stf`: Guo, Wang, Zhao & Dai 2024, "Joint estimation of vehicle mass and road slope considering lateral motion",
//! Journal of Jilin University (Engineering), doi 10.13229/j.cnki.jdxbgxb.20221061: mass by differenced least squares ([`DifferencedMass`]),
//! slope by two strong-tracking filters that interact as time-varying multiple models ([`Imm`]).
//!
//! State [v, a, i], i = sin θ; measurements: specific force a + g i, wheel speed v.
//!
//! - kinematic model: a and i walk at random; knows nothing of forces, works standing and braking
//! - dynamic model: a = (F/M − g (i + s μ c))/(1 + J/M) from the force balance; i walks at random
//!
//! Against the print: the force balance stands in the row of a and not in that of i (which left the slope without a memory); no
//! derivative of a measurement as input beside the measurement itself; no correction by the full innovation inside the model; the
//! fading factor is found from whitened innovations, fades the slope alone and only while they are too large; J is in.
//! The lateral factor η = |a_x|/√(a_x² + a_y²) can be switched on; as printed it vanishes in steady curving and is noise at rest, so
//! that here it acts only while both accelerations are well above noise.
//!
//! As wide as its kinematic half is its bias: an accelerometer error of 0.01 m/s² is 0.06°.

use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2, Vector3, matrix, vector};

use super::{
    differenced_mass::{DifferencedMass, DifferencedParams},
    force_balance::ForceBalance,
    front_end::Reading,
    hosted::{Pipeline, copy_into},
    mass_then_slope::motion,
    params::{param_groups, params},
};
use crate::{
    Real,
    gaussian::{Correction, Gaussian},
    imm::Imm,
    real::{GRAVITY, PI, asin, sin, sqrt},
    signals::{Estimate, Flags, Value, Vehicle},
    strong_tracking::{Alarm, StrongTracking, fade},
};

params! {
    /// Parameters of the two models and of their interaction.
    ImmParams {
        q_v ["m²/s³"] = 1e-6, 1e-12 => 10.0, "Process noise of speed.";
        q_a ["m²/s⁵"] = 0.3, 1e-9 => 100.0, "Process noise of acceleration in the kinematic model.";
        q_i ["1/s"] = 5e-4, 1e-12 => 1.0, "Process noise of the sine of the grade angle.";
        force_sd_mps2 ["m/s²"] = 0.03, 1e-4 => 10.0, "What the force balance leaves out, divided by the mass, in the dynamic model.";
        accel_sd_mps2 ["m/s²"] = 0.02, 1e-4 => 10.0, "Standard deviation of the specific force, vibration included.";
        accel_bias_sd_mps2 ["m/s²"] = 0.01, 0.0 => 1.0, "Standard deviation of the accelerometer's bias, which the filters cannot see.";
        wheel_speed_sd_mps ["m/s"] = 0.005, 1e-6 => 10.0, "Standard deviation of wheel speed.";
        grade0_deg ["deg"] = 0.0, -60.0 => 60.0, "Grade angle at the start.";
        grade0_sd_deg ["deg"] = 5.0, 0.001 => 90.0, "Its standard deviation.";
        stay ["-"] = 0.95, 0.5 => 0.999999, "Probability of staying in a model from one wheel-speed sample to the next, at the start.";
        time_varying ["-"] = 1.0, 0.0 => 1.0, "1: transition probabilities lean to the likelier model; 0: fixed.";
        memory ["-"] = 0.95, 0.0 => 1.0, "Memory ρ of strong tracking.";
        weakening ["-"] = 2.0, 1.0 => 100.0, "Weakening factor of strong tracking.";
        fading_max ["-"] = 50.0, 1.0 => 1e4, "Largest fading factor; 1 = no strong tracking.";
        alarm ["-"] = 3.0, 1.0 => 1e6, "Smoothed normalised innovation squared above which strong tracking acts.";
        lateral ["-"] = 0.0, 0.0 => 1.0, "1: traction times the lateral factor η.";
    }
}

param_groups! {
    /// Parameters of `imm_stf`.
    Params { imm: ImmParams, mass: DifferencedParams }
}

/// Sine of the steepest grade.
const STEEPEST: Real = 0.87;
/// Accelerations, m/s², along and across, above which the lateral factor acts.
const LATERAL_GATE: [Real; 2] = [0.3, 0.5];

/// The pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImmStf {
    params: Params,
    balance: ForceBalance,
    mu: Real,
    mass: DifferencedMass,
    /// Kinematic model, dynamic model.
    imm: Imm<3, 2>,
    tracking: [(StrongTracking<2>, Alarm<2>); 2],
    fading: [Real; 2],
    lateral: Real,
    /// Time since the last cycle, s.
    since_s: Real,
    started: bool,
    saturated: bool,
    last: Option<Correction<2, 3>>,
}

/// One model at one instant: x⁻ = A x + u.
#[derive(Clone, Copy)]
struct Model {
    A: Matrix3<Real>,
    u: Vector3<Real>,
    Q: Matrix3<Real>,
}

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> ImmStf {
    let imm = params.imm;
    let rad = PI / 180.0;
    let x = vector![0.0, 0.0, sin(imm.grade0_deg * rad)];
    let sd = vector![imm.wheel_speed_sd_mps, 0.5, imm.grade0_sd_deg * rad];
    let tracking = (
        StrongTracking::new(imm.memory, imm.weakening, imm.fading_max),
        Alarm::new(imm.alarm),
    );
    ImmStf {
        params: *params,
        balance: ForceBalance::new(vehicle),
        mu: vehicle.running_resistance,
        mass: DifferencedMass::new(vehicle, params.mass),
        imm: Imm::new(
            Gaussian::independent(x, sd),
            imm.stay,
            imm.time_varying >= 0.5,
        ),
        tracking: [tracking; 2],
        fading: [1.0; 2],
        lateral: 1.0,
        since_s: 0.0,
        started: false,
        saturated: false,
        last: None,
    }
}

/// z = [f, v] = H x.
fn measurement() -> SMatrix<Real, 2, 3> {
    matrix![0.0, 1.0, GRAVITY; 1.0, 0.0, 0.0]
}

impl ImmStf {
    fn kinematic(&self, dt: Real) -> Model {
        let imm = &self.params.imm;
        Model {
            A: matrix![1.0, dt, 0.0; 0.0, 1.0, 0.0; 0.0, 0.0, 1.0],
            u: Vector3::zeros(),
            Q: Matrix3::from_diagonal(&vector![imm.q_v * dt, imm.q_a * dt, imm.q_i * dt]),
        }
    }

    /// The force balance linearised in i = sin θ, with the cosine of the combined estimate.
    fn dynamic(&self, traction_n: Real, direction: Real, sine: Real, dt: Real) -> Model {
        let imm = &self.params.imm;
        let mass = self.mass.mass_kg().value;
        let inertia = 1.0 + self.balance.rotating_mass_kg / mass;
        let resistance = direction * self.mu * GRAVITY * sqrt(1.0 - sine * sine);
        // An error of mass is an error of traction over mass: it widens the noise of the row.
        let by_mass = traction_n / mass * (self.mass.mass_kg().sd / mass).min(1.0);
        let sd = sqrt(imm.force_sd_mps2 * imm.force_sd_mps2 + by_mass * by_mass) / inertia;
        Model {
            A: matrix![1.0, dt, 0.0; 0.0, 0.0, -GRAVITY / inertia; 0.0, 0.0, 1.0],
            u: vector![0.0, (traction_n / mass - resistance) / inertia, 0.0],
            Q: Matrix3::from_diagonal(&vector![imm.q_v * dt, sd * sd, imm.q_i * dt]),
        }
    }

    /// Share of the traction that acts along the train (eq. 1), 1 unless switched on and both accelerations are well above noise.
    fn lateral_factor(&self, reading: &Reading) -> Real {
        let (Some(x), Some(y)) = (reading.specific_force_mps2, reading.lateral_force_mps2) else {
            return 1.0;
        };
        let [along, across] = LATERAL_GATE;
        if self.params.imm.lateral < 0.5 || x.abs() < along || y.abs() < across {
            return 1.0;
        }
        x.abs() / sqrt(x * x + y * y)
    }

    /// One cycle of interacting models on a wheel speed and the specific force.
    fn cycle(&mut self, models: [Model; 2], z: &Vector2<Real>) {
        let imm = self.params.imm;
        let H = measurement();
        let R = Matrix2::from_diagonal(&vector![
            imm.accel_sd_mps2 * imm.accel_sd_mps2,
            imm.wheel_speed_sd_mps * imm.wheel_speed_sd_mps
        ]);
        if !self.started {
            for belief in &mut self.imm.beliefs {
                belief.x.x = z.y;
            }
            self.started = true;
        }
        self.imm.mix();
        let mut logs = Vector2::<Real>::repeat(Real::NEG_INFINITY);
        let filters = self
            .imm
            .beliefs
            .iter_mut()
            .zip(models)
            .zip(&mut self.tracking)
            .zip(&mut self.fading);
        let mut best = Real::NEG_INFINITY;
        for ((((belief, model), (tracking, alarm)), fading), log) in filters.zip(logs.iter_mut()) {
            belief.x = model.A * belief.x + model.u;
            let carried_P = model.A * belief.P * model.A.transpose();
            let y = z - H * belief.x;
            let (carried, process) = (H * carried_P * H.transpose(), H * model.Q * H.transpose());
            let lambda = tracking.fading(&y, &carried, &process, &R);
            let jumped = alarm.active(&y, &(carried + process + R));
            *fading = if jumped { lambda } else { 1.0 };
            fade(belief, &vector![1.0, 1.0, *fading]);
            belief.P = model.A * belief.P * model.A.transpose() + model.Q;
            // Fading step upon step would grow without end while measurements make no sense.
            belief.limit_variance(&vector![100.0, 100.0, STEEPEST * STEEPEST]);
            belief.symmetrise();
            let Some(correction) = belief.correct(y, &H, &R) else {
                continue;
            };
            *log = correction.log_likelihood;
            if *log > best {
                (best, self.last) = (*log, Some(correction));
            }
        }
        self.imm.weigh(&logs);
        self.saturated = false;
        for belief in &mut self.imm.beliefs {
            let inside = belief.x.z.clamp(-STEEPEST, STEEPEST);
            self.saturated |= inside != belief.x.z;
            belief.x.z = inside;
        }
    }
}

impl Pipeline for ImmStf {
    const INTERNALS: &'static [&'static str] = &[
        "dynamic_model_probability",
        "kinematic_grade_rad",
        "dynamic_grade_rad",
        "kinematic_fading",
        "dynamic_fading",
        "mass_residual_n",
        "lateral_factor",
    ];

    fn advance(&mut self, reading: &Reading, t_s: Real, dt: Real) -> Estimate {
        let (moving, running) = motion(reading, self.params.mass.standstill_mps);
        let lateral = self.lateral_factor(reading);
        self.lateral = lateral;
        self.mass.step(reading, &self.balance, running, lateral, dt);

        self.since_s += dt;
        if let Some((speed, f)) = reading.new_speed_mps.zip(reading.specific_force_mps2) {
            let period = self.since_s.min(1.0);
            self.since_s = 0.0;
            let kinematic = self.kinematic(period);
            let sine = self.imm.combined().x.z.clamp(-STEEPEST, STEEPEST);
            // Standing, braking or without torque both models are the kinematic one.
            let dynamic = reading
                .motor_torque_nm
                .filter(|_| running)
                .map_or(kinematic, |torque| {
                    let direction = if speed < 0.0 { -1.0 } else { 1.0 };
                    self.dynamic(
                        self.balance.traction(torque, speed) * lateral,
                        direction,
                        sine,
                        period,
                    )
                });
            self.cycle([kinematic, dynamic], &vector![f, speed]);
        }

        let Gaussian { x, P } = self.imm.combined();
        let (imm, theta) = (self.params.imm, asin(x.z));
        let cosine = sqrt(1.0 - x.z * x.z).max(0.1);
        let bias = imm.accel_bias_sd_mps2 / GRAVITY;
        let sd = sqrt(P.m33 + bias * bias) / cosine;
        let known = self.started && self.since_s < 0.5;
        let grade_rad = Value {
            value: theta,
            sd,
            valid: known && sd < 0.05,
        };
        Estimate {
            t_s,
            total_mass_kg: self.mass.mass_kg(),
            grade_rad,
            effective_grade_rad: grade_rad,
            speed_mps: Value {
                value: x.x,
                sd: sqrt(P.m11),
                valid: known,
            },
            innovation: self.last.map_or(0.0, |c| c.y.y),
            nis: self.last.map_or(0.0, |c| c.nis / 2.0),
            flags: Flags {
                moving,
                excited: self.mass.excited(),
                saturated: self.saturated || self.mass.saturated(),
            },
        }
    }

    fn internal_values(&self, values: &mut [Real]) {
        let [kinematic, dynamic] = &self.imm.beliefs;
        let [kinematic_fading, dynamic_fading] = self.fading;
        let probability = self.imm.probability().y;
        let (residual, lateral) = (self.mass.residual_n(), self.lateral);
        let grades = [asin(kinematic.x.z), asin(dynamic.x.z)];
        copy_into(
            values,
            &[
                probability,
                grades[0],
                grades[1],
                kinematic_fading,
                dynamic_fading,
                residual,
                lateral,
            ],
        );
    }
}
