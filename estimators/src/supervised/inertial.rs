//! Slope from accelerometer and wheel speed with a curvature feed-forward: what the pipelines of the DFFRLS-AUKF method
//! share.
//!
//! x = [v, θ]:  v⁻ = v + dt (f − g sin θ),  θ⁻ = θ + dt ρ v,  z = wheel speed
//!
//! (The consistent reading of the DFFRLS-AUKF method's eq. 14–16, which print a state [a, θ′] whose units do not fit.)
//! The filter is unscented; the model is all but linear, so that an extended one agrees with it.
//!
//! It needs neither torque nor mass nor resistance, works under the brake and standing, and estimates no mass. Its
//! slope is never better than the accelerometer's bias: 0.01 m/s² is 0.06°. With a pitch gyro in place of ρ v it is
//! several times better.

use nalgebra::{Matrix1, Matrix2, SMatrix, Vector1, Vector2, matrix, vector};

use crate::api::aid::AidStatus;
use crate::api::estimator::Internal;
use crate::api::params::params;
use crate::api::real::{GRAVITY, PI, cos, sin, sqrt};
use crate::api::signals::{Estimate, Flags, Value, Vehicle};
use crate::api::snapshot::{Archive, State, state};
use crate::detect::control::{self, Control};
use crate::detect::gate::Gate;
use crate::detect::innovation_gate::Passage;
use crate::detect::plausibility::Instruments;
use crate::detect::validity::{Source, Validity};
use crate::filters::gaussian::{Correction, Gaussian};
use crate::filters::model::{Filter, Model, Process};
use crate::filters::sage_husa::{Adaptive, Noise, SageHusa};
use crate::filters::ukf::{SigmaParams, Ukf};
use crate::methods::published::no_mass;
use crate::models::force_balance::MAX_GRADE_RAD;
use crate::preprocess::conditioning::{ConditioningParams, LearntNoise};
use crate::preprocess::front_end::Reading;
use crate::rail::distributed_train::{DistributedTrain, steeper};
use crate::runner::{Pipeline, copy_into};
use crate::supervised::curvature_rls::Curvature;
use crate::supervised::supervision::{Supervisors, mapped};
use crate::{Real, Time};

params! {
    /// Parameters of the inertial slope filter.
    InertialParams {
        q_v ["m²/s³"] = 1e-6, 1e-12 => 10.0, "Process noise of speed.";
        q_theta ["rad²/s"] = 5e-6, 1e-12 => 10.0, "Process noise of the grade angle with the curvature feed-forward.";
        q_theta_gyro ["rad²/s"] = 1e-8, 1e-12 => 10.0, "Process noise of the grade angle with the gyro.";
        wheel_speed_sd_mps ["m/s"] = 0.005, 1e-6 => 10.0, "Standard deviation of wheel speed.";
        accel_bias_sd_mps2 ["m/s²"] = none, 0.0 => 2.0, "Standard deviation of the accelerometer's bias, which the filter cannot see; not set: that of the vehicle's sheet, or 0.01.";
        grade0_deg ["deg"] = 0.0, -60.0 => 60.0, "Grade angle at the start.";
        grade0_sd_deg ["deg"] = 5.0, 0.001 => 90.0, "Its standard deviation.";
        gyro [flag] = false, "The pitch gyro carries the slope forward, not the curvature.";
    }
}

/// Inputs of [`InertialModel`] for a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Specific force f along the train, m/s²; `None` while the accelerometer is stale.
    pub specific_force_mps2: Option<Real>,
    /// Change of the grade angle.
    pub turn: SlopeRate,
    /// Standard deviation of the specific force beyond what the process noise of speed allows for, m/s².
    pub force_noise_mps2: Real,
}

/// Change of the grade angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SlopeRate {
    /// With the curvature ρ of the rail, 1/m: θ̇ = ρ v.
    Curvature(Real),
    /// At the rate of a pitch gyro, rad/s.
    Gyro(Real),
}

/// The model: state [v, θ], measurement wheel speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InertialModel {
    /// Process noise of speed, m²/s³.
    pub q_v: Real,
    /// Process noise of the grade angle, rad²/s, by the curvature and by the gyro.
    pub q_theta: [Real; 2],
}

/// Process noise of speed without an accelerometer, m²/s³: it may do anything, up to 1 m/s² or so.
const BLIND_Q_V: Real = 1.0;

impl Process<2> for InertialModel {
    type Input = Motion;

    fn f(&self, x: &Vector2<Real>, u: &Motion, dt: Real) -> Vector2<Real> {
        let v_dot = u
            .specific_force_mps2
            .map_or(0.0, |f| f - GRAVITY * sin(x.y));
        let theta_dot = match u.turn {
            SlopeRate::Curvature(rho) => rho * x.x,
            SlopeRate::Gyro(rate) => rate,
        };
        vector![x.x + dt * v_dot, x.y + dt * theta_dot]
    }

    fn F(&self, x: &Vector2<Real>, u: &Motion, dt: Real) -> Matrix2<Real> {
        let by_theta = u
            .specific_force_mps2
            .map_or(0.0, |_| -dt * GRAVITY * cos(x.y));
        let by_v = match u.turn {
            SlopeRate::Curvature(rho) => dt * rho,
            SlopeRate::Gyro(_) => 0.0,
        };
        matrix![1.0, by_theta; by_v, 1.0]
    }

    fn Q(&self, u: &Motion, dt: Real) -> Matrix2<Real> {
        let noise = u.force_noise_mps2 * u.force_noise_mps2 * dt;
        let q_v = u
            .specific_force_mps2
            .map_or(BLIND_Q_V, |_| self.q_v.max(noise));
        let [by_curvature, by_gyro] = self.q_theta;
        let q_theta = match u.turn {
            SlopeRate::Curvature(_) => by_curvature,
            SlopeRate::Gyro(_) => by_gyro,
        };
        Matrix2::from_diagonal(&vector![q_v, q_theta]) * dt
    }
}

impl Model<2, 1> for InertialModel {
    fn h(&self, x: &Vector2<Real>) -> Vector1<Real> {
        vector![x.x]
    }

    fn H(&self, _: &Vector2<Real>) -> SMatrix<Real, 1, 2> {
        matrix![1.0, 0.0]
    }
}

/// The filter with its curvature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvatureSlope {
    params: InertialParams,
    curvature: Curvature,
    train: DistributedTrain,
    mass_range_kg: [Real; 2],
    slope: Adaptive<Ukf<InertialModel, 2>, 1>,
    mass: Value,
    standstill_mps: Real,
    started: bool,
    saturated: bool,
    /// Innovation and NIS of the last wheel speed.
    last: Option<(Real, Real)>,
    validity: Validity,
    conditioning: ConditioningParams,
    gate: Gate,
    bias_sd_mps2: Real,
    /// Standard deviation of wheel speed before any adaptation, m/s.
    unadapted_sd: Real,
    /// Status of the last wheel speed.
    wheel_speed: AidStatus,
}

fn model(params: &InertialParams) -> InertialModel {
    InertialModel {
        q_v: params.q_v,
        q_theta: [params.q_theta, params.q_theta_gyro],
    }
}

fn prior(params: &InertialParams) -> Gaussian<2> {
    let x = vector![0.0, params.grade0_deg * PI / 180.0];
    let sd = vector![params.wheel_speed_sd_mps, params.grade0_sd_deg * PI / 180.0];
    Gaussian::independent(x, sd)
}

impl CurvatureSlope {
    /// Builds the estimator from the vehicle, the parameters, the regression of the curvature, the sigma points, and
    /// the `fading` factor of Sage & Husa (`None`: the noise of wheel speed is known).
    pub fn new(
        vehicle: &Vehicle,
        params: InertialParams,
        curvature: Curvature,
        sigma: SigmaParams,
        fading: Option<Real>,
        supervision: &Supervisors,
    ) -> Self {
        let filter = Ukf {
            model: model(&params),
            belief: prior(&params),
            spread: sigma.spread(),
        };
        let R = Matrix1::new(params.wheel_speed_sd_mps * params.wheel_speed_sd_mps);
        let noise = fading.map_or(Noise::Known(R), |b| {
            Noise::SageHusa(SageHusa::new(R, b, [0.01, 100.0]))
        });
        Self {
            params,
            standstill_mps: curvature.standstill_mps(),
            train: DistributedTrain::new(
                &mapped(vehicle, supervision.grade_map),
                Some(curvature.standstill_mps()),
            ),
            mass_range_kg: vehicle.mass_range_kg,
            curvature,
            slope: Adaptive { filter, noise },
            mass: no_mass(vehicle),
            started: false,
            saturated: false,
            last: None,
            validity: Validity::new(
                vehicle,
                supervision.integrity,
                Instruments {
                    accelerometer: true,
                    gyro: params.gyro,
                },
            ),
            conditioning: supervision.conditioning,
            gate: Gate::new(&supervision.integrity),
            bias_sd_mps2: vehicle.accel_bias_sd(params.accel_bias_sd_mps2, 0.01),
            unadapted_sd: params.wheel_speed_sd_mps,
            wheel_speed: AidStatus::default(),
        }
    }

    fn predict(&mut self, reading: &Reading, dt: Real) {
        let gyro = reading.pitch_rate_radps.filter(|_| self.params.gyro);
        self.gate.tick(dt);
        self.learn_noise(&reading.noise);
        let motion = Motion {
            specific_force_mps2: reading.specific_force_mps2,
            turn: gyro.map_or(
                SlopeRate::Curvature(self.curvature.per_m().0),
                SlopeRate::Gyro,
            ),
            force_noise_mps2: self.force_noise(reading, dt),
        };
        // P is kept positive definite by Q; should rounding break it, the next measurement finds the last one.
        let _ = self.slope.filter.predict(&motion, dt);
        self.saturated = false;
        self.limit();
    }

    /// Noise of the specific force that the samples show, m/s²: 0 unless it is several times what the process noise of
    /// speed stands for (the vehicle's own motion is in it).
    fn force_noise(&self, reading: &Reading, dt: Real) -> Real {
        let told = sqrt(self.params.q_v / dt);
        let learnt = reading.noise.specific_force_mps2;
        learnt.filter(|sd| *sd > 4.0 * told).unwrap_or(0.0)
    }

    /// Holds the grade within the steepest that a rail can have, whatever an instrument reads.
    fn limit(&mut self) {
        let x = &mut self.slope.filter.belief_mut().x;
        let inside = x.y.clamp(-MAX_GRADE_RAD, MAX_GRADE_RAD);
        self.saturated |= inside != x.y;
        x.y = inside;
    }

    /// The noise that the samples show, for the gate and where the noise is not adapted.
    fn learn_noise(&mut self, learnt: &LearntNoise) {
        self.unadapted_sd = learnt.wheel_speed(self.params.wheel_speed_sd_mps);
        if let Noise::Known(R) = &mut self.slope.noise {
            R.x = self.unadapted_sd * self.unadapted_sd;
        }
    }

    /// A wheel speed: gate and fuse.
    fn update(&mut self, speed: Real) {
        let belief = self.slope.filter.belief_mut();
        if !self.started {
            belief.x.x = speed;
            self.started = true;
        }
        let y = speed - belief.x.x;
        let variance = belief.P.m11 + self.unadapted_sd * self.unadapted_sd;
        let judgement = self.gate.judge(y, variance);
        if judgement.passage == Passage::Reopen {
            belief.P.m11 += y * y;
        }
        self.validity
            .innovation(Source::WheelSpeed, judgement.nis, judgement.period_s);
        self.last = Some((y, judgement.nis));
        let passed = judgement.passage != Passage::Reject;
        let correction = passed.then(|| self.fuse(speed)).flatten();
        self.wheel_speed = judgement.status(correction.map(|c| (c.y.x, c.S.x)));
    }

    fn fuse(&mut self, speed: Real) -> Option<Correction<1, 2>> {
        let z = vector![speed];
        let correction = self.slope.update(z)?;
        self.last = Some((correction.y.x, correction.nis));
        self.limit();
        self.slope.adapt(z);
        Some(correction)
    }
}

impl Pipeline for CurvatureSlope {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("curvature_per_m", "1/m"),
        Internal::new("curvature_sd_per_m", "1/m"),
        Internal::new("lambda", "-"),
        Internal::new("wheel_speed_sd_mps", "m/s"),
        Internal::new("slope_filter_sd_rad", "rad"),
    ];

    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate {
        self.validity.observe(reading, dt);
        self.curvature
            .step(reading, self.slope.filter.belief().x.y, dt);
        let (place, delayed_mps) = self.curvature.at_place();
        let speed = reading.speed_mps.unwrap_or(delayed_mps);
        self.train.roll(place, delayed_mps, speed, dt);
        self.predict(reading, dt);
        match control::wheel_speed(reading) {
            Control::New(speed) => self.update(speed),
            Control::Held => {}
            Control::Out(outcome) => self.wheel_speed = control::without(outcome),
        }
        let Gaussian { x, P } = *self.slope.filter.belief();
        // g sin θ is read with the bias.
        let bias_rad = self.bias_sd_mps2 / (GRAVITY * cos(x.y));
        let sd = sqrt(P.m22 + bias_rad * bias_rad);
        let known = self.started
            && reading.specific_force_mps2.is_some()
            && reading.speed_mps.is_some()
            && !self.saturated;
        // It has no mass: the spread of the effective grade over all masses possible is added to the doubt.
        let ahead = self.train.ahead(self.mass.value);
        let [light, heavy] = self.mass_range_kg.map(|kg| self.train.ahead(kg).unit);
        let spread = (heavy - light) / sqrt(12.0);
        let grade = |by: Real, doubt: Real| {
            let sd = sqrt(sd * sd + doubt * doubt);
            Value {
                value: steeper(x.y, by).clamp(-MAX_GRADE_RAD, MAX_GRADE_RAD),
                sd,
                valid: known,
            }
        };
        let doubt = sqrt(ahead.sd * ahead.sd + spread * spread);
        let estimate = Estimate {
            t,
            total_mass_kg: self.mass,
            grade_rad: grade(ahead.imu - ahead.unit, 0.0),
            effective_grade_rad: grade(-ahead.unit, doubt),
            speed_mps: Value {
                value: x.x,
                sd: sqrt(P.m11),
                valid: reading.speed_mps.is_some(),
            },
            innovation: self.last.map_or(0.0, |(y, _)| y),
            nis: self.last.map_or(0.0, |(_, nis)| nis),
            flags: Flags {
                moving: reading
                    .speed_mps
                    .is_some_and(|v| v.abs() > self.standstill_mps),
                excited: false,
                saturated: self.saturated || self.slope.noise.limited(),
            },
        };
        self.validity.publish(estimate, false)
    }

    fn conditioning(&self) -> Option<ConditioningParams> {
        Some(self.conditioning)
    }

    const AID_SOURCES: &'static [&'static str] = &["wheel_speed"];

    fn aid_status(&self, status: &mut [AidStatus]) {
        copy_into(status, &[self.wheel_speed]);
    }

    fn internal_values(&self, values: &mut [Real]) {
        let (rho, rho_sd) = self.curvature.per_m();
        copy_into(
            values,
            &[
                rho,
                rho_sd,
                self.curvature.lambda(),
                sqrt(self.slope.noise.R().x),
                sqrt(self.slope.filter.belief().P.m22),
            ],
        );
    }

    fn visit(&mut self, archive: &mut Archive) {
        State::visit(self, archive);
    }
}

state!(CurvatureSlope { curvature, train, slope, mass, started, saturated, last, validity, gate, unadapted_sd, wheel_speed; params, conditioning, bias_sd_mps2, mass_range_kg, standstill_mps });

#[cfg(test)]
#[path = "inertial_tests.rs"]
mod tests;
