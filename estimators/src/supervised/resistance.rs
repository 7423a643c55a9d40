//! `resistance_dffrls_robust`: running-resistance coefficient of a train of known mass by least squares with dynamic
//! forgetting (Liu et al. 2023, section 2.2, eq. 8–15).
//!
//! y = h μ,  y = (F − J v̇)/M − f,  h = sgn(v) g cos θ,  f = v̇ + g sin θ
//!
//! The paper takes the slope from a survey. The pipeline needs no map: the core reads the rail. What is not known
//! shows in μ and is counted in its standard deviation:
//!
//! - the accelerometer's bias b: μ is off by −sgn(v) b/g (0.00978 m/s² is 0.001), and a run in the other direction by
//!   as much the other way; in a survey an error of the slope does the same (0.1° is 0.0017)
//! - an error e of mass or torque: μ is off by e F/(M g), so that on a climb of 5° one percent is 0.001
//!
//! Against the print: the gain is divided by φ + hᵀ P h (eq. 14 lacks the inverse), the rotating masses have no g (eq.
//! 9), the residual that drives the forgetting is that of the estimate before (eq. 12) and measured in its own standard
//! deviations.

use nalgebra::vector;

use crate::api::aid::AidStatus;
use crate::api::estimator::Internal;
use crate::api::params::{param_groups, params};
use crate::api::real::{GRAVITY, cos, sin, sqrt, within};
use crate::api::signals::{Command, Measurements, Value, Vehicle};
use crate::api::snapshot::state;
use crate::detect::control;
use crate::detect::validity::Integrity;
use crate::filters::forgetting::Forgetting;
use crate::filters::gaussian::Gaussian;
use crate::filters::rls::{Outcome, Rls};
use crate::fusion::attitude::params::{AttitudeParams, AttitudeSupervision};
use crate::models::force_balance::ForceBalance;
use crate::preprocess::conditioning::ConditioningParams;
use crate::preprocess::front_end::{FrontEnd, motion};
use crate::preprocess::resampler::Resampler;
use crate::runner::copy_into;
use crate::supervised::pipeline::{CoreParams, Step, Supervised, SupervisedMethod, Supervision};
use crate::supervised::sample::BalanceSample;
use crate::{Error, Real};

params! {
    /// Parameters of the identification of running resistance.
    ResistanceParams {
        known_mass_kg ["kg"] = none, 1.0 => 1e6, "Total mass, known; not set: the middle of the vehicle's mass range.";
        known_mass_sd ["-"] = 0.01, 0.0 => 1.0, "Standard deviation of mass and torque together, as a share; only widens what is reported.";
        resistance0 ["-"] = 0.0, 0.0 => 1.0, "Running-resistance coefficient at the start.";
        resistance0_sd ["-"] = 0.5, 1e-4 => 1.0, "Its standard deviation.";
        lambda0 ["-"] = 0.98, 0.5 => 1.0, "Forgetting factor until the size of the residual is known.";
        delta ["-"] = 0.995, 0.5 => 1.0, "Smallest forgetting factor δ, per regression sample.";
        sigma ["-"] = 1.0, 0.0 => 1000.0, "How fast φ falls with the residual in units of its standard deviation.";
        cutoff_hz ["Hz"] = 1.0, 0.05 => 20.0, "Corner of the matched low-pass all signals go through.";
        regression_hz ["Hz"] = 2.0, 0.1 => 1000.0, "Rate at which filtered samples enter the regression; λ is per such sample.";
        settle_s ["s"] = 1.5, 0.0 => 10.0, "Time after standing or braking before learning resumes (the filters forget).";
        residual_sd_mps2 ["m/s²"] = 0.02, 1e-4 => 1.0, "Expected residual of the force balance divided by the mass.";
    }
}

param_groups! {
    /// Parameters of `resistance_dffrls_robust`.
    Params { resistance: ResistanceParams, supervision: Supervision, attitude: AttitudeParams, attitude_supervision: AttitudeSupervision, integrity: Integrity, conditioning: ConditioningParams }
}

/// Largest size of the coefficient: beyond it the rail would brake harder than the train weighs.
const MAX_COEFFICIENT: Real = 1.0;

/// The method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resistance {
    params: ResistanceParams,
    balance: ForceBalance,
    mass_kg: Real,
    tare_kg: Real,
    rls: Rls<1>,
    /// |F|/(M g) of the last sample: what a share of mass or torque makes of μ.
    load: Real,
    outcome: Outcome,
    bias_sd_mps2: Real,
    running: bool,
}

/// The pipeline.
pub type ResistancePipeline = Supervised<Resistance>;

/// Builds the estimator from the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> ResistancePipeline {
    let core = CoreParams {
        attitude: params.attitude,
        attitude_supervision: params.attitude_supervision,
        supervision: params.supervision,
        integrity: params.integrity,
        conditioning: params.conditioning,
    };
    Supervised::new(
        vehicle,
        &core,
        params.resistance.sampling(),
        Resistance::new(
            vehicle,
            params.resistance,
            params.attitude.accel_bias_sd_mps2,
        ),
    )
}

impl Resistance {
    fn new(vehicle: &Vehicle, params: ResistanceParams, bias_sd_mps2: Option<Real>) -> Self {
        let prior =
            Gaussian::independent(vector![params.resistance0], vector![params.resistance0_sd]);
        let policy = Forgetting::Dynamic {
            floor: params.delta,
            sharpness: params.sigma,
            first: params.lambda0,
        };
        Self {
            params,
            balance: ForceBalance::new(vehicle),
            mass_kg: vehicle.first_mass_kg(params.known_mass_kg),
            tare_kg: vehicle.tare_kg,
            rls: Rls::new(prior, policy),
            load: 0.0,
            outcome: Outcome::default(),
            bias_sd_mps2: vehicle.accel_bias_sd(bias_sd_mps2, 0.01),
            running: false,
        }
    }

    /// μ and its standard deviation, with what is taken as known in it.
    pub fn coefficient(&self) -> (Real, Real) {
        let x = self.rls.belief.x;
        let bias = self.bias_sd_mps2 / GRAVITY;
        let by_mass = self.params.known_mass_sd * self.load;
        let variance = self.rls.widened().x + bias * bias + by_mass * by_mass;
        (x.x, sqrt(variance))
    }
}

impl SupervisedMethod for Resistance {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("running_resistance", "-"),
        Internal::new("running_resistance_sd", "-"),
        Internal::new("lambda", "-"),
        Internal::new("residual_mps2", "m/s²"),
    ];

    fn sample(&mut self, now: &BalanceSample) -> AidStatus {
        // g sin θ, mean over the masses of the train; rail not yet read makes it doubtful.
        let [slope, doubt] = now.whole(self.tare_kg, self.mass_kg);
        let inertia = self.balance.rotating_mass_kg * now.sample.acceleration_mps2;
        let y =
            (now.sample.force_n - inertia) / self.mass_kg - now.sample.acceleration_mps2 - slope;
        let h = now.direction() * GRAVITY * ForceBalance::cosine(slope, 0.0);
        let sd = self.params.residual_sd_mps2;
        let r = sd * sd + doubt * doubt;
        let Some(outcome) = self.rls.update(y, &vector![h], r, false) else {
            return control::regressed(None, true);
        };
        self.outcome = outcome;
        self.load = (now.sample.force_n / (self.mass_kg * GRAVITY)).abs();
        self.rls.belief.x.x = within(self.rls.belief.x.x, -MAX_COEFFICIENT, MAX_COEFFICIENT);
        control::regressed(Some(&outcome), true)
    }

    fn step(&mut self, now: &Step) {
        self.running = now.running;
    }

    fn mass_kg(&self) -> Value {
        Value {
            value: self.mass_kg,
            sd: self.params.known_mass_sd * self.mass_kg,
            valid: self.params.known_mass_kg.is_some(),
        }
    }

    fn is_excited(&self) -> bool {
        self.running
    }

    fn is_saturated(&self) -> bool {
        self.rls.belief.x.x.abs() >= MAX_COEFFICIENT
    }

    fn internal_values(&self, values: &mut [Real]) {
        let (mu, sd) = self.coefficient();
        copy_into(
            values,
            &[mu, sd, self.outcome.lambda, self.outcome.residual],
        );
    }
}

impl ResistanceParams {
    /// Corner of the low-pass, Hz, rate of the samples, Hz, and settling time, s.
    pub fn sampling(&self) -> [Real; 3] {
        [self.cutoff_hz, self.regression_hz, self.settle_s]
    }
}

/// The same on a surveyed rail, as in the paper: the caller gives the effective grade.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surveyed {
    front_end: FrontEnd,
    signals: Resampler,
    standstill_mps: Real,
    method: Resistance,
}

impl Surveyed {
    /// Builds the estimator from the vehicle's nominal values and the parameters.
    pub fn new(vehicle: &Vehicle, params: &Params) -> Self {
        let [cutoff_hz, rate_hz, settle_s] = params.resistance.sampling();
        Self {
            front_end: FrontEnd::new(vehicle),
            signals: Resampler::new(cutoff_hz, rate_hz, settle_s),
            standstill_mps: vehicle.standstill_mps(None),
            method: Resistance::new(
                vehicle,
                params.resistance,
                params.attitude.accel_bias_sd_mps2,
            ),
        }
    }

    /// One step of `dt` seconds on a rail whose mean grade under the train by the survey is `grade_rad` (rad, + uphill
    /// towards growing chainage). μ and its standard deviation. On an error nothing is changed.
    pub fn step(
        &mut self,
        z: &Measurements,
        u: &Command,
        dt: Real,
        grade_rad: Real,
    ) -> Result<(Real, Real), Error> {
        if !grade_rad.is_finite() {
            return Err(Error::NotFinite("surveyed grade"));
        }
        let mut next = *self;
        let mut reading = *next.front_end.read(z, u, dt)?;
        reading.specific_force_mps2 = Some(GRAVITY * sin(grade_rad));
        let (_, running) = motion(&reading, self.standstill_mps);
        let balance = &self.method.balance;
        if let Some(sample) = next.signals.step(&reading, balance, running, dt) {
            let slope = sample.specific_force_mps2.unwrap_or(0.0);
            next.method.sample(&BalanceSample {
                sample,
                u_mps2: [slope; 2],
                ..BalanceSample::default()
            });
        }
        let (mu, sd) = next.method.coefficient();
        if !(mu.is_finite() && sd.is_finite()) {
            return Err(Error::Diverged);
        }
        *self = next;
        Ok((mu, sd))
    }
}

/// Speed that a train of known mass and running resistance takes under a measured torque on a surveyed rail, by the
/// force balance alone: what an identified coefficient is verified with (Liu et al. 2023, figure 3b).
///
/// It integrates, so an error of force grows into one of speed without end: 0.001 of μ is 0.1 m/s after ten seconds.
/// Start it again from the measured speed every few seconds and look at how far it has come by then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedPrediction {
    balance: ForceBalance,
    mass_kg: Real,
    coefficient: Real,
    speed_mps: Real,
}

impl SpeedPrediction {
    /// A train of `mass_kg` with the running-resistance `coefficient`, at `speed_mps` now.
    pub fn new(vehicle: &Vehicle, mass_kg: Real, coefficient: Real, speed_mps: Real) -> Self {
        Self {
            balance: ForceBalance::new(vehicle),
            mass_kg,
            coefficient,
            speed_mps,
        }
    }

    /// Speed after `dt` seconds with the sum of all motor torques, N·m, on a grade of `grade_rad`, m/s. Resistance
    /// brakes and holds, it never drives.
    pub fn step(&mut self, motor_torque_nm: Real, grade_rad: Real, dt: Real) -> Real {
        let v = self.speed_mps;
        let traction = self.balance.net_traction(motor_torque_nm, v);
        let [free, _] = self
            .balance
            .acceleration(traction, self.mass_kg, grade_rad, 0.0);
        let inertia = 1.0 + self.balance.rotating_mass_kg / self.mass_kg;
        let brake = self.coefficient * GRAVITY * cos(grade_rad) / inertia;
        let pushed = v + free * dt;
        self.speed_mps = if pushed > 0.0 {
            (pushed - brake * dt).max(0.0)
        } else {
            (pushed + brake * dt).min(0.0)
        };
        self.speed_mps
    }
}

state!(Resistance { rls, load, outcome, running; params, bias_sd_mps2, balance, mass_kg, tare_kg });
