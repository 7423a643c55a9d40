//! `ekf_v_theta_biases`: the textbook extended Kalman filter for a grade from accelerometer, pitch gyro and wheel
//! speed, with both biases as states and a 3σ gate. A baseline beside the published methods.
//!
//! x = [v, θ, b_g, b_a]:  v⁻ = v + dt (f − b_a − g sin θ),  θ⁻ = θ + dt (ω − b_g),  b⁻ = b,  z = wheel speed
//!
//! (Groves 2013, "Principles of GNSS, inertial, and multisensor integrated navigation systems", chapters 5 and 16, in
//! one dimension.) It needs neither torque nor mass nor resistance, and estimates no mass. Only b_a + g sin θ is seen:
//! what the accelerometer is off by is shared out between the two by their first standard deviations, and shows in that
//! of the grade. No channel is conditioned; the train is a point.

use nalgebra::{Matrix1, Matrix4, SMatrix, Vector1, Vector4, matrix, vector};

use crate::api::aid::AidStatus;
use crate::api::estimator::Internal;
use crate::api::params::{param_groups, params};
use crate::api::reading::Reading;
use crate::api::real::{GRAVITY, PI, cos, sin, sqrt};
use crate::api::signals::{Estimate, Flags, Value, Vehicle};
use crate::api::snapshot::{Archive, State, state};
use crate::detect::control::{self, Control};
use crate::detect::plausibility::{Instruments, Plausibility};
use crate::detect::validity::{BaselineIntegrity, Integrity, Source, Validity};
use crate::filters::ekf::Ekf;
use crate::filters::gaussian::{Correction, Gaussian};
use crate::filters::model::{Model, Process};
use crate::instruments::gate::{Gate, Passage};
use crate::methods::published::no_mass;
use crate::models::force_balance::MAX_GRADE_RAD;
use crate::runner::{Pipeline, copy_into};
use crate::{Real, Time};

params! {
    /// The filter.
    Own {
        q_v ["m²/s³"] = 1e-4, 1e-12 => 10.0, "Process noise of speed: noise of the accelerometer with vibration.";
        q_theta ["rad²/s"] = 1e-6, 1e-12 => 10.0, "Process noise of the grade angle: noise of the gyro with vibration and misalignment.";
        q_gyro_bias ["rad²/s³"] = 1e-11, 0.0 => 1.0, "Process noise of the gyro's bias.";
        q_accel_bias ["m²/s⁵"] = 1e-8, 0.0 => 1.0, "Process noise of the accelerometer's bias.";
        gyro_bias_sd_radps ["rad/s"] = none, 0.0 => 0.2, "Standard deviation of the gyro's bias at the start; not set: the value of the vehicle's sheet, or 0.01.";
        accel_bias_sd_mps2 ["m/s²"] = none, 0.0 => 2.0, "Standard deviation of the accelerometer's bias at the start; not set: the value of the vehicle's sheet, or 0.05.";
        wheel_speed_sd_mps ["m/s"] = 0.02, 1e-6 => 10.0, "Standard deviation of wheel speed.";
        reject_sd ["-"] = 3.0, 1.0 => 100.0, "Gate of the wheel speed, in standard deviations; replaces `gate_sd`.";
        grade0_deg ["deg"] = 0.0, -60.0 => 60.0, "Grade angle at the start.";
        grade0_sd_deg ["deg"] = 5.0, 0.001 => 90.0, "Standard deviation of the grade angle at the start.";
    }
}

param_groups! {
    /// Parameters of `ekf_v_theta_biases`.
    Params { own: Own, integrity: Integrity, baseline: BaselineIntegrity }
}

/// Process noise of speed without an accelerometer, m²/s³, and of the grade angle without a gyro, rad²/s.
const BLIND_Q: [Real; 2] = [1.0, 1e-4];

/// Inputs of the model: specific force along the train, m/s², and pitch rate, rad/s; `None` while stale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Inertial {
    /// Specific force f, m/s².
    pub specific_force_mps2: Option<Real>,
    /// Pitch rate ω, rad/s.
    pub pitch_rate_radps: Option<Real>,
}

/// The model: state [v, θ, b_g, b_a], measurement wheel speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BiasModel {
    /// Process noise of the four states.
    pub q: [Real; 4],
}

impl Process<4> for BiasModel {
    type Input = Inertial;

    fn f(&self, x: &Vector4<Real>, u: &Inertial, dt: Real) -> Vector4<Real> {
        let v_dot = u
            .specific_force_mps2
            .map_or(0.0, |f| f - x.w - GRAVITY * sin(x.y));
        let theta_dot = u.pitch_rate_radps.map_or(0.0, |rate| rate - x.z);
        vector![x.x + dt * v_dot, x.y + dt * theta_dot, x.z, x.w]
    }

    fn F(&self, x: &Vector4<Real>, u: &Inertial, dt: Real) -> Matrix4<Real> {
        let force = if u.specific_force_mps2.is_some() {
            dt
        } else {
            0.0
        };
        let rate = if u.pitch_rate_radps.is_some() {
            dt
        } else {
            0.0
        };
        matrix![
            1.0, -force * GRAVITY * cos(x.y), 0.0, -force;
            0.0, 1.0, -rate, 0.0;
            0.0, 0.0, 1.0, 0.0;
            0.0, 0.0, 0.0, 1.0
        ]
    }

    fn Q(&self, u: &Inertial, dt: Real) -> Matrix4<Real> {
        let [q_v, q_theta, q_g, q_a] = self.q;
        let [blind_v, blind_theta] = BLIND_Q;
        let q_v = u.specific_force_mps2.map_or(blind_v, |_| q_v);
        let q_theta = u.pitch_rate_radps.map_or(blind_theta, |_| q_theta);
        Matrix4::from_diagonal(&vector![q_v, q_theta, q_g, q_a]) * dt
    }
}

impl Model<4, 1> for BiasModel {
    fn h(&self, x: &Vector4<Real>) -> Vector1<Real> {
        vector![x.x]
    }

    fn H(&self, _: &Vector4<Real>) -> SMatrix<Real, 1, 4> {
        matrix![1.0, 0.0, 0.0, 0.0]
    }
}

/// The pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EkfVThetaBiases {
    params: Own,
    standstill_mps: Real,
    mass: Value,
    point: bool,
    ekf: Ekf<BiasModel, 4>,
    gate: Gate,
    plausibility: Plausibility,
    validity: Validity,
    started: bool,
    clamped: bool,
    /// Innovation and NIS of the last wheel speed.
    last: (Real, Real),
    wheel_speed: AidStatus,
}

/// Builds the estimator from the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> EkfVThetaBiases {
    let own = params.own;
    let rad = PI / 180.0;
    let gyro_sd = own.gyro_bias_sd_radps.or(vehicle.gyro_bias_sd_radps);
    let sd = vector![
        own.wheel_speed_sd_mps,
        own.grade0_sd_deg * rad,
        gyro_sd.unwrap_or(0.01),
        vehicle.accel_bias_sd(own.accel_bias_sd_mps2, 0.05)
    ];
    let model = BiasModel {
        q: [own.q_v, own.q_theta, own.q_gyro_bias, own.q_accel_bias],
    };
    let x = vector![0.0, own.grade0_deg * rad, 0.0, 0.0];
    let uses = Instruments {
        accelerometer: true,
        gyro: true,
        spare_gyro: false,
    };
    EkfVThetaBiases {
        params: own,
        standstill_mps: vehicle.standstill_mps(None),
        mass: no_mass(vehicle),
        point: vehicle.is_point(),
        ekf: Ekf::new(model, Gaussian::independent(x, sd)),
        gate: Gate::new(
            params.baseline.innovation_gate,
            own.reject_sd,
            params.integrity.gate_timeout_s,
        ),
        plausibility: Plausibility::new(params.integrity.plausibility, uses),
        validity: Validity::new(params.integrity),
        started: false,
        clamped: false,
        last: (0.0, 0.0),
        wheel_speed: AidStatus::default(),
    }
}

impl EkfVThetaBiases {
    fn update(&mut self, speed: Real) {
        let belief = &mut self.ekf.belief;
        if !self.started {
            belief.x.x = speed;
            self.started = true;
        }
        let (y, sd) = (speed - belief.x.x, self.params.wheel_speed_sd_mps);
        let judgement = self.gate.judge(y, belief.P.m11 + sd * sd);
        if judgement.passage == Passage::Reopen {
            belief.P.m11 += y * y;
        }
        self.validity
            .innovation(Source::WheelSpeed, judgement.nis, judgement.period_s);
        self.last = (y, judgement.nis);
        let correction: Option<Correction<1, 4>> = match judgement.passage {
            Passage::Reject => None,
            _ => self.ekf.update(vector![speed], &Matrix1::new(sd * sd)),
        };
        self.wheel_speed = judgement.status(correction.map(|c| (c.y.x, c.S.x)));
    }

    /// Limits the grade to the steepest grade of a track, for any reading of an instrument.
    fn clamp(&mut self) {
        let theta = &mut self.ekf.belief.x.y;
        let inside = theta.clamp(-MAX_GRADE_RAD, MAX_GRADE_RAD);
        self.clamped = inside != *theta;
        *theta = inside;
    }
}

impl Pipeline for EkfVThetaBiases {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("gyro_bias_radps", "rad/s"),
        Internal::new("gyro_bias_sd_radps", "rad/s"),
        Internal::new("accel_bias_mps2", "m/s²"),
        Internal::new("accel_bias_sd_mps2", "m/s²"),
    ];

    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate {
        let plausible = self
            .plausibility
            .step(reading, reading.pitch_rate_radps, dt);
        self.validity.observe(plausible, dt);
        self.gate.tick(dt);
        let inertial = Inertial {
            specific_force_mps2: reading.specific_force_mps2,
            pitch_rate_radps: reading.pitch_rate_radps,
        };
        self.ekf.predict(&inertial, dt);
        match control::wheel_speed(reading) {
            Control::New(speed) => self.update(speed),
            Control::Held => {}
            Control::Out(outcome) => self.wheel_speed = control::without(outcome),
        }
        self.clamp();
        let Gaussian { x, P } = self.ekf.belief;
        let fresh = reading.speed_mps.is_some();
        let imu = reading.specific_force_mps2.is_some() && reading.pitch_rate_radps.is_some();
        let grade_rad = Value::new(
            x.y,
            sqrt(P.m22),
            self.started && fresh && imu && !self.clamped,
        );
        let (innovation, nis) = self.last;
        let estimate = Estimate {
            t,
            total_mass_kg: self.mass,
            grade_rad,
            // The effective grade of a long train is another; nothing here finds it.
            effective_grade_rad: Value {
                valid: grade_rad.valid && self.point,
                ..grade_rad
            },
            speed_mps: Value::new(x.x, sqrt(P.m11), self.started && fresh),
            innovation,
            nis,
            flags: Flags {
                moving: reading
                    .speed_mps
                    .is_some_and(|v| v.abs() > self.standstill_mps),
                excited: false,
                saturated: self.clamped,
            },
            ..Estimate::default()
        };
        self.validity.publish(estimate, false)
    }

    const AID_SOURCES: &'static [&'static str] = &["wheel_speed"];

    fn aid_status(&self, status: &mut [AidStatus]) {
        copy_into(status, &[self.wheel_speed]);
    }

    fn internal_values(&self, values: &mut [Real]) {
        let Gaussian { x, P } = &self.ekf.belief;
        copy_into(values, &[x.z, sqrt(P.m33), x.w, sqrt(P.m44)]);
    }

    fn visit(&mut self, archive: &mut Archive) {
        State::visit(self, archive);
    }
}

state!(EkfVThetaBiases { ekf, gate, plausibility, validity, started, clamped, last, wheel_speed; params, standstill_mps, mass, point });
