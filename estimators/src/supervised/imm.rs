//! Slope by one or more models of the same state, with strong tracking or without, interacting or alone: the second
//! half of Guo, Wang, Zhao & Dai 2024, "Joint estimation of vehicle mass and road slope considering lateral motion",
//! Journal of Jilin University (Engineering), doi 10.13229/j.cnki.jdxbgxb.20221061, eq. 8–38. The mass is that of
//! [`DifferencedMass`].
//!
//! State [v, a, i], i = sin θ; measurements: specific force a + g i, wheel speed v.
//!
//! - kinematic model (eq. 8–13): a and i walk at random; needs no forces, works standing and braking
//! - dynamic model (eq. 14–17): a = (F/M − b − g (i + s μ c))/(1 + J/M) from the force balance; i walks at random
//!
//! F is the traction less air drag, b what a bend takes ([`Bends`](crate::models::single_track::Bends): nothing on a
//! rail). Standing, braking or without torque there is no force balance, and the dynamic model is the kinematic one. On
//! a long train i is what the instrument reads, and the force balance gets the effective grade, i less what
//! the core has seen it to be ahead by. The specific force comes without the bias that the core has found.
//!
//! Against the print: the force balance stands in the row of a and not in that of i (which left the slope without a
//! memory); no derivative of a measurement as input beside the measurement itself; no correction by the full innovation
//! inside the model; the fading factor is found from whitened innovations, fades the slope alone and only while they
//! are too large; J is in; in a bend the side force is taken off instead of scaling the traction.
//!

use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2, Vector3, matrix, vector};

use crate::Real;
use crate::api::aid::AidStatus;
use crate::api::estimator::Internal;
use crate::api::params::params;
use crate::api::reading::Reading;
use crate::api::real::{GRAVITY, PI, asin, sin, sqrt};
use crate::api::signals::{Value, Vehicle};
use crate::api::snapshot::state;
use crate::detect::gate::Gate;
use crate::detect::innovation_gate::Passage;
use crate::detect::validity::Integrity;
use crate::filters::ekf::{Ekf, Preview};
use crate::filters::gaussian::{Correction, Gaussian};
use crate::filters::imm::Imm;
use crate::filters::model::{Model, Process};
use crate::filters::strong_tracking::{Alarm, StrongTracking, fade};
use crate::models::force_balance::ForceBalance;
use crate::supervised::differenced_rls::{DifferencedMass, DifferencedParams};
use crate::supervised::pipeline::{Step, SupervisedMethod};
use crate::supervised::sample::BalanceSample;

params! {
    /// Parameters of the slope models.
    ModelParams {
        q_v ["m²/s³"] = 1e-6, 1e-12 => 10.0, "Process noise of speed.";
        q_a ["m²/s⁵"] = 0.3, 1e-9 => 100.0, "Process noise of acceleration in the kinematic model.";
        q_i ["1/s"] = 5e-4, 1e-12 => 1.0, "Process noise of the sine of the grade angle.";
        force_sd_mps2 ["m/s²"] = 0.03, 1e-4 => 10.0, "What the force balance leaves out, divided by the mass, in the dynamic model.";
        accel_sd_mps2 ["m/s²"] = 0.02, 1e-4 => 10.0, "Standard deviation of the specific force, vibration included.";
        grade0_deg ["deg"] = 0.0, -60.0 => 60.0, "Grade angle at the start.";
        grade0_sd_deg ["deg"] = 5.0, 0.001 => 90.0, "Its standard deviation.";
    }
}

params! {
    /// Interaction of the models.
    ImmParams {
        stay ["-"] = 0.95, 0.5 => 0.999999, "Probability of staying in a model from one wheel-speed sample to the next, at the start.";
    }
}

params! {
    /// Parameters of strong tracking.
    TrackingParams {
        memory ["-"] = 0.95, 0.0 => 1.0, "Memory ρ of strong tracking.";
        weakening ["-"] = 2.0, 1.0 => 100.0, "Weakening factor of strong tracking.";
        fading_max ["-"] = 50.0, 1.0 => 1e4, "Largest fading factor; 1 = no strong tracking.";
        alarm ["-"] = 3.0, 1.0 => 1e6, "Smoothed normalised innovation squared above which strong tracking acts.";
    }
}

/// Variance of a wheel speed that is not to enter, m²/s².
const REJECTED_VARIANCE: Real = 1e6;

/// Sine of the steepest grade.
const MAX_SINE: Real = 0.87;

/// Model of the acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Acceleration {
    /// At random.
    Kinematic,
    /// By the force balance.
    Dynamic,
}

/// Mass from differences, slope from two models.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlopeModels {
    params: ModelParams,
    models: [SlopeModel; 2],
    balance: ForceBalance,
    mu: Real,
    mass: DifferencedMass,
    /// Traction that a bend takes, N.
    bend_n: Real,
    /// Sine of the grade at the instrument less that of the effective grade, and its standard deviation.
    ahead: [Real; 2],
    imm: Imm<3, 2>,
    tracking: [(StrongTracking<2>, Alarm<2>); 2],
    fading: [Real; 2],
    /// Time since the last cycle, s.
    since_s: Real,
    started: bool,
    saturated: bool,
    last: Option<Correction<2, 3>>,
    bias_sd_mps2: Real,
    wheel_speed_sd_mps: Real,
    /// Of wheel speed and of specific force.
    gates: [Gate; 2],
}

/// The force balance of one step, divided by the mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// Acceleration on level track, m/s².
    pub level_mps2: Real,
    /// 1 + J/M.
    pub inertia: Real,
    /// Standard deviation of the acceleration, m/s².
    pub sd_mps2: Real,
}

/// One model: state [v, a, i], i = sin θ; measurement [f, v] with the specific force f = a + g i.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlopeModel {
    /// Model of the acceleration.
    pub acceleration: Acceleration,
    /// Process noise of v (m²/s³), of a where it walks at random (m²/s⁵) and of i (1/s).
    pub q: [Real; 3],
}

impl SlopeModel {
    /// The force balance, where this model goes by it.
    fn push<'a>(&self, u: &'a Option<Push>) -> Option<&'a Push> {
        u.as_ref()
            .filter(|_| self.acceleration == Acceleration::Dynamic)
    }
}

impl Process<3> for SlopeModel {
    /// `None` where there is no force balance: the dynamic model is then the kinematic one.
    type Input = Option<Push>;

    fn f(&self, x: &Vector3<Real>, u: &Option<Push>, dt: Real) -> Vector3<Real> {
        let a = self
            .push(u)
            .map_or(x.y, |u| -GRAVITY / u.inertia * x.z + u.level_mps2);
        vector![x.x + dt * x.y, a, x.z]
    }

    fn F(&self, _: &Vector3<Real>, u: &Option<Push>, dt: Real) -> Matrix3<Real> {
        let [by_a, by_i] = self
            .push(u)
            .map_or([1.0, 0.0], |u| [0.0, -GRAVITY / u.inertia]);
        matrix![1.0, dt, 0.0; 0.0, by_a, by_i; 0.0, 0.0, 1.0]
    }

    fn Q(&self, u: &Option<Push>, dt: Real) -> Matrix3<Real> {
        let [q_v, q_a, q_i] = self.q;
        let a = self.push(u).map_or(q_a * dt, |u| u.sd_mps2 * u.sd_mps2);
        Matrix3::from_diagonal(&vector![q_v * dt, a, q_i * dt])
    }
}

impl Model<3, 2> for SlopeModel {
    fn h(&self, x: &Vector3<Real>) -> Vector2<Real> {
        vector![x.y + GRAVITY * x.z, x.x]
    }

    fn H(&self, _: &Vector3<Real>) -> SMatrix<Real, 2, 3> {
        matrix![0.0, 1.0, GRAVITY; 1.0, 0.0, 0.0]
    }
}

impl SlopeModels {
    /// Builds the filters of the slope from the vehicle's nominal values and the parameters.
    pub fn new(
        vehicle: &Vehicle,
        params: ModelParams,
        mass: DifferencedParams,
        imm: ImmParams,
        tracking: TrackingParams,
        integrity: &Integrity,
        wheel_speed_sd_mps: Real,
    ) -> Self {
        let rad = PI / 180.0;
        let x = vector![0.0, 0.0, sin(params.grade0_deg * rad)];
        let sd = vector![wheel_speed_sd_mps, 0.5, params.grade0_sd_deg * rad];
        let tracking = (
            StrongTracking::new(tracking.memory, tracking.weakening, tracking.fading_max),
            Alarm::new(tracking.alarm),
        );
        Self {
            params,
            models: [Acceleration::Kinematic, Acceleration::Dynamic].map(|acceleration| {
                SlopeModel {
                    acceleration,
                    q: [params.q_v, params.q_a, params.q_i],
                }
            }),
            balance: ForceBalance::new(vehicle),
            mu: vehicle.running_resistance,
            mass: DifferencedMass::new(vehicle, mass),
            bend_n: 0.0,
            ahead: [0.0; 2],
            imm: Imm::new(Gaussian::independent(x, sd), imm.stay, true),
            tracking: [tracking; 2],
            fading: [1.0; 2],
            since_s: 0.0,
            started: false,
            saturated: false,
            last: None,
            bias_sd_mps2: 0.0,
            wheel_speed_sd_mps,
            gates: [Gate::new(integrity); 2],
        }
    }

    /// The force balance with the cosine of the combined estimate. `net_n` is what drives: traction less drag and bend.
    fn push(&self, net_n: Real, direction: Real, sine: Real) -> Push {
        let params = &self.params;
        let mass = self.mass.mass_kg().value;
        let inertia = 1.0 + self.balance.rotating_mass_kg / mass;
        let resistance = direction * self.mu * GRAVITY * sqrt(1.0 - sine * sine);
        // An error of mass is an error of traction over mass: it widens the noise of the row.
        let by_mass = net_n / mass * (self.mass.mass_kg().sd / mass).min(1.0);
        // The state is the grade that the instrument reads; the force balance holds for the effective one.
        let [ahead, ahead_sd] = self.ahead;
        let doubt = GRAVITY * ahead_sd;
        let sd =
            sqrt(params.force_sd_mps2 * params.force_sd_mps2 + by_mass * by_mass + doubt * doubt);
        Push {
            level_mps2: (net_n / mass - resistance + GRAVITY * ahead) / inertia,
            inertia,
            sd_mps2: sd / inertia,
        }
    }

    /// The force balance as it is now, at a wheel speed; `None` where there is none.
    fn push_now(&self, traction_n: Option<Real>, speed: Real) -> Option<Push> {
        let direction = if speed < 0.0 { -1.0 } else { 1.0 };
        let sine = self.imm.combined().x.z.clamp(-MAX_SINE, MAX_SINE);
        Some(self.push(traction_n? - self.bend_n, direction, sine))
    }

    /// Gates a wheel speed and a specific force, each against what all models together predict by the kinematic model,
    /// and takes what is not to enter, or not with its full weight, out by its noise `R`.
    fn gate(&mut self, z: &Vector2<Real>, R: &mut Matrix2<Real>, dt: Real) {
        let Gaussian { x, P } = self.imm.combined();
        let [q_v, q_a, q_i] = [self.params.q_v, self.params.q_a, self.params.q_i].map(|q| q * dt);
        let of_speed = P.m11 + dt * (2.0 * P.m12 + dt * P.m22) + q_v + R.m22;
        let of_force = P.m22 + GRAVITY * (2.0 * P.m23 + GRAVITY * (P.m33 + q_i)) + q_a + R.m11;
        let [speed_gate, force_gate] = &mut self.gates;
        let speed = speed_gate.judge(z.y - x.x - dt * x.y, of_speed);
        let force = force_gate.judge(z.x - x.y - GRAVITY * x.z, of_force);
        match speed.passage {
            Passage::Fuse => {}
            Passage::Reject => R.m22 = REJECTED_VARIANCE,
            Passage::Reopen => {
                let (y, _) = speed.innovation;
                for belief in &mut self.imm.beliefs {
                    belief.P.m11 += y * y;
                }
            }
        }
        // Huber (1964): a specific force beyond the gate moves the state as far as one on it. Rejected, it would keep
        // the acceleration from following the brakes.
        if force.test_ratio > 1.0 {
            R.m11 += (force.test_ratio - 1.0) * of_force;
        }
    }

    /// One cycle of interacting models on the specific force and a wheel speed.
    fn cycle(&mut self, reading: &Reading, push: &Option<Push>, z: &Vector2<Real>, dt: Real) {
        let params = self.params;
        let [force_sd, speed_sd] = [
            reading.noise.specific_force(params.accel_sd_mps2),
            reading.noise.wheel_speed(self.wheel_speed_sd_mps),
        ];
        // as told: what was learnt contains the vehicle driving off
        let told = [params.accel_sd_mps2, self.wheel_speed_sd_mps];
        self.mass.set_noise(told, dt);
        let mut R = Matrix2::from_diagonal(&vector![force_sd * force_sd, speed_sd * speed_sd]);
        if !self.started {
            for belief in &mut self.imm.beliefs {
                belief.x.x = z.y;
            }
            self.started = true;
        }
        self.gate(z, &mut R, dt);
        self.imm.mix();
        let mut logs = Vector2::repeat(Real::NEG_INFINITY);
        let filters = self
            .imm
            .beliefs
            .iter_mut()
            .zip(self.models)
            .zip(&mut self.tracking)
            .zip(&mut self.fading);
        let mut best = Real::NEG_INFINITY;
        for ((((belief, model), tracking), fading), log) in filters.zip(logs.iter_mut()) {
            let mut ekf = Ekf::new(model, *belief);
            let (tracking, alarm) = tracking;
            let Preview {
                y,
                carried,
                process,
            } = ekf.preview(*z, push, dt);
            let lambda = tracking.fading(&y, &carried, &process, &R);
            let jumped = alarm.active(&y, &(carried + process + R));
            *fading = if jumped { lambda } else { 1.0 };
            fade(&mut ekf.belief, &vector![1.0, 1.0, *fading]);
            ekf.predict(push, dt);
            // Fading step upon step would grow without end while measurements make no sense.
            ekf.belief
                .limit_variance(&vector![100.0, 100.0, MAX_SINE * MAX_SINE]);
            let correction = ekf.update(*z, &R);
            *belief = ekf.belief;
            let Some(correction) = correction else {
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
            let inside = belief.x.z.clamp(-MAX_SINE, MAX_SINE);
            self.saturated |= inside != belief.x.z;
            belief.x.z = inside;
        }
    }
}

impl SupervisedMethod for SlopeModels {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("kinematic_fading", "-"),
        Internal::new("dynamic_fading", "-"),
        Internal::new("mass_residual_n", "N"),
        Internal::new("bend_force_n", "N"),
        Internal::new("kinematic_grade_rad", "rad"),
        Internal::new("dynamic_grade_rad", "rad"),
        Internal::new("dynamic_model_probability", "-"),
    ];

    fn sample(&mut self, sample: &BalanceSample) -> AidStatus {
        self.mass.sample(sample)
    }

    fn pause(&mut self) {
        self.mass.pause();
    }

    fn open_load(&mut self) {
        self.mass.open_load();
    }

    fn step(&mut self, now: &Step) {
        self.bend_n = now.bend.force_n(self.mass.mass_kg().value);
        let [effective, effective_sd] = now.effective_rad;
        self.ahead = [sin(now.attitude.pitch_rad) - sin(effective), effective_sd];
        self.bias_sd_mps2 = now.bias_sd_mps2;
        self.since_s += now.dt;
        self.gates.iter_mut().for_each(|gate| gate.tick(now.dt));
        let reading = now.reading;
        if let Some((speed, f)) = reading.new_speed_mps.zip(reading.specific_force_mps2) {
            let period = self.since_s.min(1.0);
            self.since_s = 0.0;
            let push = self.push_now(now.traction_n, speed);
            let f = f - now.attitude.bias_mps2;
            let z = vector![f + now.bend.drift_mps2, speed];
            self.cycle(reading, &push, &z, period);
        }
    }

    fn mass_kg(&self) -> Value {
        self.mass.mass_kg()
    }

    fn effective_grade_rad(&self) -> Value {
        let Gaussian { x, P } = self.imm.combined();
        let cosine = sqrt(1.0 - x.z * x.z).max(0.1);
        let bias = self.bias_sd_mps2 / GRAVITY;
        let [ahead, ahead_sd] = self.ahead;
        Value {
            value: asin((x.z - ahead).clamp(-MAX_SINE, MAX_SINE)),
            sd: sqrt(P.m33 + bias * bias + ahead_sd * ahead_sd) / cosine,
            valid: self.started && self.since_s < 0.5 && !self.saturated,
        }
    }

    fn is_excited(&self) -> bool {
        self.mass.excited()
    }

    fn is_saturated(&self) -> bool {
        self.saturated || self.mass.saturated()
    }

    fn internal_values(&self, values: &mut [Real]) {
        let shared = [self.mass.residual_n(), self.bend_n];
        let grades = self.imm.beliefs.iter().map(|belief| asin(belief.x.z));
        let last_model = self.imm.probability().iter().skip(1).copied();
        let now = self.fading.iter().copied().chain(shared);
        let all = now.chain(grades).chain(last_model);
        for (place, value) in values.iter_mut().zip(all).take(Self::INTERNALS.len()) {
            *place = value;
        }
    }
}

state!(SlopeModels { mass, bend_n, ahead, imm, tracking, fading, since_s, started, saturated, last, gates, bias_sd_mps2;
    params, models, balance, mu, wheel_speed_sd_mps });

#[cfg(test)]
#[path = "imm_tests.rs"]
mod tests;
