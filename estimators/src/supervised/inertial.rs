//! Slope from accelerometer and wheel speed with a curvature feed-forward: what the pipelines of the DFFRLS-AUKF method
//! share.
//!
//! x = [v, θ]:  v⁻ = v + dt (f − g sin θ),  θ⁻ = θ + dt ρ v,  z = wheel speed
//!
//! (The consistent reading of the DFFRLS-AUKF method's eq. 14–16, which print a state [a, θ′] whose units do not fit.)
//! The filter is unscented; the model is all but linear, so that an extended one agrees with it.
//!
//! It needs neither torque nor mass nor resistance, works under the brake and standing, and estimates no mass. The
//! specific force comes without the bias that the core has found.

use nalgebra::{Matrix1, Matrix2, SMatrix, Vector1, Vector2, matrix, vector};

use crate::Real;
use crate::api::estimator::Internal;
use crate::api::params::params;
use crate::api::reading::LearntNoise;
use crate::api::reading::Reading;
use crate::api::real::{GRAVITY, PI, asin, cos, sin, sqrt};
use crate::api::signals::{Value, Vehicle};
use crate::api::snapshot::state;
use crate::detect::control::{self, Control};
use crate::detect::gate::Gate;
use crate::detect::innovation_gate::Passage;
use crate::detect::validity::Integrity;
use crate::filters::gaussian::Gaussian;
use crate::filters::model::{Filter, Model, Process};
use crate::filters::sage_husa::{Adaptive, Noise, SageHusa};
use crate::filters::ukf::{SigmaParams, Ukf};
use crate::methods::published::no_mass;
use crate::models::force_balance::MAX_GRADE_RAD;
use crate::runner::copy_into;
use crate::supervised::curvature_rls::Curvature;
use crate::supervised::pipeline::{Step, SupervisedMethod};

params! {
    /// Parameters of the inertial slope filter.
    InertialParams {
        q_v ["m²/s³"] = 1e-6, 1e-12 => 10.0, "Process noise of speed.";
        q_theta ["rad²/s"] = 5e-6, 1e-12 => 10.0, "Process noise of the grade angle.";
        grade0_deg ["deg"] = 0.0, -60.0 => 60.0, "Grade angle at the start.";
        grade0_sd_deg ["deg"] = 5.0, 0.001 => 90.0, "Its standard deviation.";
    }
}

/// Inputs of [`InertialModel`] for a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Specific force f along the train, m/s²; `None` while the accelerometer is stale.
    pub specific_force_mps2: Option<Real>,
    /// Curvature ρ of the rail, 1/m: θ̇ = ρ v.
    pub curvature_per_m: Real,
    /// Standard deviation of the specific force beyond what the process noise of speed allows for, m/s².
    pub force_noise_mps2: Real,
}

/// The model: state [v, θ], measurement wheel speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InertialModel {
    /// Process noise of speed, m²/s³.
    pub q_v: Real,
    /// Process noise of the grade angle, rad²/s.
    pub q_theta: Real,
}

/// Process noise of speed without an accelerometer, m²/s³: it may do anything, up to 1 m/s² or so.
const BLIND_Q_V: Real = 1.0;

impl Process<2> for InertialModel {
    type Input = Motion;

    fn f(&self, x: &Vector2<Real>, u: &Motion, dt: Real) -> Vector2<Real> {
        let v_dot = u
            .specific_force_mps2
            .map_or(0.0, |f| f - GRAVITY * sin(x.y));
        let theta_dot = u.curvature_per_m * x.x;
        vector![x.x + dt * v_dot, x.y + dt * theta_dot]
    }

    fn F(&self, x: &Vector2<Real>, u: &Motion, dt: Real) -> Matrix2<Real> {
        let by_theta = u
            .specific_force_mps2
            .map_or(0.0, |_| -dt * GRAVITY * cos(x.y));
        let by_v = dt * u.curvature_per_m;
        matrix![1.0, by_theta; by_v, 1.0]
    }

    fn Q(&self, u: &Motion, dt: Real) -> Matrix2<Real> {
        let noise = u.force_noise_mps2 * u.force_noise_mps2 * dt;
        let q_v = u
            .specific_force_mps2
            .map_or(BLIND_Q_V, |_| self.q_v.max(noise));
        Matrix2::from_diagonal(&vector![q_v, self.q_theta]) * dt
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
    slope: Adaptive<Ukf<InertialModel, 2>, 1>,
    mass: Value,
    started: bool,
    /// True if accelerometer and wheels had a value in the last step.
    fresh: bool,
    saturated: bool,
    gate: Gate,
    bias_sd_mps2: Real,
    /// Sine of the grade at the instrument less that of the effective grade, and its standard deviation.
    ahead: [Real; 2],
    /// Standard deviation of wheel speed before any adaptation, m/s.
    unadapted_sd: Real,
    wheel_speed_sd_mps: Real,
}

fn model(params: &InertialParams) -> InertialModel {
    InertialModel {
        q_v: params.q_v,
        q_theta: params.q_theta,
    }
}

fn prior(params: &InertialParams, wheel_speed_sd_mps: Real) -> Gaussian<2> {
    let x = vector![0.0, params.grade0_deg * PI / 180.0];
    let sd = vector![wheel_speed_sd_mps, params.grade0_sd_deg * PI / 180.0];
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
        integrity: &Integrity,
        wheel_speed_sd_mps: Real,
    ) -> Self {
        let filter = Ukf {
            model: model(&params),
            belief: prior(&params, wheel_speed_sd_mps),
            spread: sigma.spread(),
        };
        let R = Matrix1::new(wheel_speed_sd_mps * wheel_speed_sd_mps);
        let noise = fading.map_or(Noise::Known(R), |b| {
            Noise::SageHusa(SageHusa::new(R, b, [0.01, 100.0]))
        });
        Self {
            params,
            curvature,
            slope: Adaptive { filter, noise },
            mass: no_mass(vehicle),
            started: false,
            fresh: false,
            saturated: false,
            gate: Gate::new(integrity),
            bias_sd_mps2: 0.0,
            ahead: [0.0; 2],
            unadapted_sd: wheel_speed_sd_mps,
            wheel_speed_sd_mps,
        }
    }

    fn predict(&mut self, reading: &Reading, dt: Real) {
        self.gate.tick(dt);
        self.learn_noise(&reading.noise);
        let motion = Motion {
            specific_force_mps2: reading.specific_force_mps2,
            curvature_per_m: self.curvature.per_m().0,
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
        self.unadapted_sd = learnt.wheel_speed(self.wheel_speed_sd_mps);
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
        if judgement.passage != Passage::Reject {
            self.fuse(speed);
        }
    }

    fn fuse(&mut self, speed: Real) {
        let z = vector![speed];
        if self.slope.update(z).is_some() {
            self.limit();
            self.slope.adapt(z);
        }
    }
}

impl SupervisedMethod for CurvatureSlope {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("curvature_per_m", "1/m"),
        Internal::new("curvature_sd_per_m", "1/m"),
        Internal::new("lambda", "-"),
        Internal::new("wheel_speed_sd_mps", "m/s"),
        Internal::new("method_grade_rad", "rad"),
        Internal::new("method_grade_sd_rad", "rad"),
    ];
    const WEIGHS: bool = false;

    fn step(&mut self, now: &Step) {
        let unbiased = now.reading.specific_force_mps2;
        let reading = Reading {
            specific_force_mps2: unbiased.map(|f| f - now.attitude.bias_mps2),
            ..*now.reading
        };
        let [effective, effective_sd] = now.effective_rad;
        self.ahead = [sin(now.attitude.pitch_rad) - sin(effective), effective_sd];
        self.bias_sd_mps2 = now.bias_sd_mps2;
        self.fresh = reading.specific_force_mps2.is_some() && reading.speed_mps.is_some();
        let theta = self.slope.filter.belief().x.y;
        self.curvature.step(&reading, theta, now.dt);
        self.predict(&reading, now.dt);
        if let Control::New(speed) = control::wheel_speed(&reading) {
            self.update(speed);
        }
    }

    fn mass_kg(&self) -> Value {
        self.mass
    }

    fn effective_grade_rad(&self) -> Value {
        let Gaussian { x, P } = *self.slope.filter.belief();
        // g sin θ is read with the bias.
        let bias_rad = self.bias_sd_mps2 / (GRAVITY * cos(x.y));
        let [ahead, ahead_sd] = self.ahead;
        let limit = sin(MAX_GRADE_RAD);
        Value {
            value: asin((sin(x.y) - ahead).clamp(-limit, limit)),
            sd: sqrt(P.m22 + bias_rad * bias_rad + ahead_sd * ahead_sd),
            valid: self.started && self.fresh && !self.saturated,
        }
    }

    fn is_excited(&self) -> bool {
        self.curvature.learning()
    }

    fn is_saturated(&self) -> bool {
        self.saturated || self.slope.noise.limited()
    }

    fn internal_values(&self, values: &mut [Real]) {
        let (rho, rho_sd) = self.curvature.per_m();
        let grade = self.effective_grade_rad();
        let now = [
            rho,
            rho_sd,
            self.curvature.lambda(),
            sqrt(self.slope.noise.R().x),
            grade.value,
            grade.sd,
        ];
        copy_into(values, &now);
    }
}

state!(CurvatureSlope { curvature, slope, mass, started, fresh, saturated, gate, bias_sd_mps2, ahead, unadapted_sd; params, wheel_speed_sd_mps });

#[cfg(test)]
#[path = "inertial_tests.rs"]
mod tests;
