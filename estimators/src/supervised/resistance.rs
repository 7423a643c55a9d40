//! `resistance_dffrls_robust`: running-resistance coefficient of a train of known mass by least squares with dynamic
//! forgetting (Liu et al. 2023, section 2.2, eq. 8–15).
//!
//! y = h μ,  y = (F − J v̇)/M − f,  h = sgn(v) g cos θ,  f = v̇ + g sin θ
//!
//! The paper takes the slope from a survey; f is then put together from v̇ and θ ([`Surveyed`], for callers with a
//! surveyed slope). The pipeline needs no map: an accelerometer reads f. What is not known shows in μ and is counted in
//! its standard deviation:
//!
//! - the accelerometer's bias b: μ is off by −sgn(v) b/g (0.00978 m/s² is 0.001), and a run in the other direction by
//!   as much the other way; in a survey an error of the slope does the same (0.1° is 0.0017)
//! - an error e of mass or torque: μ is off by e F/(M g), so that on a climb of 5° one percent is 0.001
//!
//! Against the print: the gain is divided by φ + hᵀ P h (eq. 14 lacks the inverse), the rotating masses have no g (eq.
//! 9), the residual that drives the forgetting is that of the estimate before (eq. 12) and measured in its own standard
//! deviations.

use nalgebra::vector;

use crate::api::aid::{AidOutcome, AidStatus};
use crate::api::estimator::Internal;
use crate::api::params::{param_groups, params};
use crate::api::real::{GRAVITY, asin, cos, sin, sqrt, within};
use crate::api::signals::{Command, Estimate, Flags, Measurements, Value, Vehicle};
use crate::api::snapshot::{Archive, State, state};
use crate::detect::control::{self, Control};
use crate::detect::plausibility::Instruments;
use crate::detect::validity::{Integrity, Source, Validity};
use crate::filters::forgetting::Forgetting;
use crate::filters::gaussian::Gaussian;
use crate::filters::ring_buffer::RingBuffer;
use crate::filters::rls::{Outcome, Rls};
use crate::models::force_balance::ForceBalance;
use crate::models::sample::ResampledSample;
use crate::preprocess::conditioning::ConditioningParams;
use crate::preprocess::front_end::motion;
use crate::preprocess::front_end::{FrontEnd, Reading};
use crate::preprocess::resampler::Resampler;
use crate::rail::grade_map::MappedTrain;
use crate::runner::{Pipeline, copy_into};
use crate::supervised::supervision as supervise;
use crate::supervised::supervision::Supervision;
use crate::{Error, Real, Time};

params! {
    /// Parameters of the identification of running resistance.
    ResistanceParams {
        known_mass_kg ["kg"] = none, 1.0 => 1e6, "Total mass, known; not set: the middle of the vehicle's mass range.";
        known_mass_sd ["-"] = 0.01, 0.0 => 1.0, "Standard deviation of mass and torque together, as a share; only widens what is reported.";
        accel_bias_sd_mps2 ["m/s²"] = none, 0.0 => 2.0, "Standard deviation of the accelerometer's bias (of g times the slope in a survey), which only widens what is reported; not set: that of the vehicle's sheet, or 0.01.";
        resistance0 ["-"] = 0.0, 0.0 => 1.0, "Running-resistance coefficient at the start.";
        resistance0_sd ["-"] = 0.5, 1e-4 => 1.0, "Its standard deviation.";
        lambda0 ["-"] = 0.98, 0.5 => 1.0, "Forgetting factor until the size of the residual is known.";
        delta ["-"] = 0.995, 0.5 => 1.0, "Smallest forgetting factor δ, per regression sample.";
        sigma ["-"] = 1.0, 0.0 => 1000.0, "How fast φ falls with the residual in units of its standard deviation.";
        residual_sd_mps2 ["m/s²"] = 0.02, 1e-4 => 1.0, "Expected residual of the force balance divided by the mass.";
        cutoff_hz ["Hz"] = 1.0, 0.05 => 20.0, "Corner of the matched low-pass all signals go through.";
        regression_hz ["Hz"] = 2.0, 0.1 => 1000.0, "Rate at which filtered samples enter the regression; λ is per such sample.";
        standstill_mps ["m/s"] = none, 0.0 => 2.0, "Speed below which the train counts as standing: no learning; not set: 0.05 on a rail, 0.3 on a road.";
        settle_s ["s"] = 1.5, 0.0 => 10.0, "Time after standing or braking before learning resumes (the filters forget).";
    }
}

param_groups! {
    /// Parameters of `resistance_dffrls_robust`.
    Params { resistance: ResistanceParams, supervision: Supervision, integrity: Integrity, conditioning: ConditioningParams }
}

/// Largest size of the coefficient: beyond it the rail would brake harder than the train weighs.
const MAX_COEFFICIENT: Real = 1.0;

/// The pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resistance {
    params: ResistanceParams,
    standstill_mps: Real,
    balance: ForceBalance,
    mass_kg: Real,
    rls: Rls<1>,
    signals: Resampler,
    train: MappedTrain,
    /// Samples, each with its place, that wait until the rail under the front of the train has been read.
    waiting: RingBuffer<(ResampledSample, Real), 32>,
    /// |F|/(M g) of the last sample: what a share of mass or torque makes of μ.
    load: Real,
    outcome: Outcome,
    validity: Validity,
    conditioning: ConditioningParams,
    bias_sd_mps2: Real,
    /// Time since the last sample of the regression, s.
    since_sample_s: Real,
    /// Status of the last wheel speed, and of the last sample of the force balance.
    aids: [AidStatus; 2],
}

/// Builds the estimator from the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> Resistance {
    let own = params.resistance;
    let prior = Gaussian::independent(vector![own.resistance0], vector![own.resistance0_sd]);
    let policy = Forgetting::Dynamic {
        floor: own.delta,
        sharpness: own.sigma,
        first: own.lambda0,
    };
    Resistance {
        params: own,
        standstill_mps: vehicle.standstill_mps(own.standstill_mps),
        balance: ForceBalance::new(vehicle),
        mass_kg: vehicle.first_mass_kg(own.known_mass_kg),
        rls: Rls::new(prior, policy),
        signals: Resampler::new(own.cutoff_hz, own.regression_hz, own.settle_s),
        train: MappedTrain::new(&supervise::mapped(vehicle, params.supervision.grade_map)),
        waiting: RingBuffer::new(),
        load: 0.0,
        outcome: Outcome::default(),
        validity: Validity::new(
            vehicle,
            params.integrity,
            Instruments {
                accelerometer: true,
                gyro: false,
            },
        ),
        conditioning: params.conditioning,
        bias_sd_mps2: vehicle.accel_bias_sd(own.accel_bias_sd_mps2, 0.01),
        since_sample_s: 0.0,
        aids: [AidStatus::default(); 2],
    }
}

impl Resistance {
    /// μ and its standard deviation, with what is taken as known in it.
    pub fn coefficient(&self) -> (Real, Real) {
        let x = self.rls.belief.x;
        let bias = self.bias_sd_mps2 / GRAVITY;
        let by_mass = self.params.known_mass_sd * self.load;
        let variance = self.rls.widened().x + bias * bias + by_mass * by_mass;
        (x.x, sqrt(variance))
    }

    /// One step. In a `survey` the specific force of the reading is not the accelerometer's but g sin θ.
    fn step(&mut self, reading: &Reading, survey: bool, dt: Real) -> (bool, bool) {
        let (moving, running) = motion(reading, self.standstill_mps);
        let sample = self.signals.step(reading, &self.balance, running, dt);
        let speed = reading.speed_mps.unwrap_or(self.signals.speed_mps());
        let place = self.signals.at_place().map(|[u, curvature]| {
            let rate = self.signals.acceleration_mps2();
            [if survey { u + rate } else { u }, curvature]
        });
        self.train.step(place, self.signals.speed_mps(), speed, dt);
        let [wheel_speed, force_balance] = &mut self.aids;
        *wheel_speed = control::wheel_speed_input(reading);
        if let Control::Out(outcome) = control::force_balance(reading, running, true) {
            *force_balance = control::without(outcome);
        }
        // At most one sample a step, so that no step has to serve many.
        let new = sample.map(|sample| (sample, self.train.place_m()));
        let oldest = new.and_then(|new| self.waiting.push(new));
        if let Some(next) = oldest.or_else(|| self.next(running)) {
            let status = self.sample(next);
            if let Some(nis) = status.nis() {
                self.validity
                    .innovation(Source::ForceBalance, nis, self.since_sample_s);
                self.since_sample_s = 0.0;
            }
            let [_, force_balance] = &mut self.aids;
            *force_balance = status;
        }
        (moving, running)
    }

    /// The next sample whose rail has been read, or any if the train is not `running`.
    fn next(&mut self, running: bool) -> Option<(ResampledSample, Real)> {
        let (_, place_m) = self.waiting.first()?;
        if running && !self.train.seen(place_m) {
            return None;
        }
        self.waiting.pop()
    }

    /// One sample: gate and fuse. What became of it.
    fn sample(&mut self, (now, place_m): (ResampledSample, Real)) -> AidStatus {
        let felt = now
            .specific_force_mps2
            .and_then(|_| self.train.felt(place_m));
        let Some(felt) = felt else {
            return control::without(AidOutcome::Stale);
        };
        // g sin θ, mean over the masses of the train; the rail not yet seen makes it doubtful.
        let (slope, doubt) = felt.whole(self.train.tare_kg(), self.mass_kg);
        let inertia = self.balance.rotating_mass_kg * now.acceleration_mps2;
        let y = (now.force_n - inertia) / self.mass_kg - now.acceleration_mps2 - slope;
        let direction = if now.speed_mps < 0.0 { -1.0 } else { 1.0 };
        let h = direction * GRAVITY * ForceBalance::cosine(slope, 0.0);
        let sd = self.params.residual_sd_mps2;
        let Some(outcome) = self
            .rls
            .update(y, &vector![h], sd * sd + doubt * doubt, false)
        else {
            return control::regressed(None, true);
        };
        self.outcome = outcome;
        self.load = (now.force_n / (self.mass_kg * GRAVITY)).abs();
        self.rls.belief.x.x = within(self.rls.belief.x.x, -MAX_COEFFICIENT, MAX_COEFFICIENT);
        control::regressed(Some(&outcome), true)
    }

    fn estimate(&self, reading: &Reading, (moving, running): (bool, bool), t: Time) -> Estimate {
        let felt = self
            .train
            .felt_now()
            .filter(|_| reading.specific_force_mps2.is_some());
        let (mean, doubt, here) = felt.map_or((0.0, GRAVITY, 0.0), |(felt, here)| {
            let (mean, doubt) = felt.whole(self.train.tare_kg(), self.mass_kg);
            (mean, doubt, here)
        });
        let bias = self.bias_sd_mps2;
        let known = felt.is_some() && reading.speed_mps.is_some();
        let grade = |u: Real, doubt: Real| {
            let noise = self.params.residual_sd_mps2;
            let sine = (u / GRAVITY).clamp(-0.85, 0.85);
            let u_sd = sqrt(bias * bias + noise * noise + doubt * doubt);
            let sd = u_sd / (GRAVITY * sqrt(1.0 - sine * sine));
            Value {
                value: asin(sine),
                sd,
                valid: known,
            }
        };
        Estimate {
            t,
            total_mass_kg: Value {
                value: self.mass_kg,
                sd: self.params.known_mass_sd * self.mass_kg,
                valid: self.params.known_mass_kg.is_some(),
            },
            grade_rad: grade(here, 0.0),
            effective_grade_rad: grade(mean, doubt),
            speed_mps: Value {
                value: reading.speed_mps.unwrap_or(self.signals.speed_mps()),
                sd: 0.01,
                valid: reading.speed_mps.is_some(),
            },
            innovation: self.outcome.residual,
            nis: self.outcome.normalised * self.outcome.normalised,
            flags: Flags {
                moving,
                excited: running && self.signals.settled(),
                saturated: self.rls.belief.x.x.abs() >= MAX_COEFFICIENT,
            },
        }
    }
}

impl Pipeline for Resistance {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("running_resistance", "-"),
        Internal::new("running_resistance_sd", "-"),
        Internal::new("lambda", "-"),
        Internal::new("residual_mps2", "m/s²"),
    ];

    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate {
        self.validity.observe(reading, dt);
        self.since_sample_s += dt;
        let motion = self.step(reading, false, dt);
        let estimate = self.estimate(reading, motion, t);
        self.validity.publish(estimate, true)
    }

    fn conditioning(&self) -> Option<ConditioningParams> {
        Some(self.conditioning)
    }

    const AID_SOURCES: &'static [&'static str] = &["wheel_speed", "force_balance"];

    fn aid_status(&self, status: &mut [AidStatus]) {
        copy_into(status, &self.aids);
    }

    fn internal_values(&self, values: &mut [Real]) {
        let (mu, sd) = self.coefficient();
        copy_into(
            values,
            &[mu, sd, self.outcome.lambda, self.outcome.residual],
        );
    }

    fn visit(&mut self, archive: &mut Archive) {
        State::visit(self, archive);
    }
}

/// The same with a slope from the caller, as in the paper, in place of the accelerometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surveyed {
    front_end: FrontEnd,
    resistance: Resistance,
}

impl Surveyed {
    /// Builds the estimator from the vehicle's nominal values and the parameters.
    pub fn new(vehicle: &Vehicle, params: &Params) -> Self {
        Self {
            front_end: FrontEnd::new(vehicle),
            resistance: new(vehicle, params),
        }
    }

    /// One step of `dt` seconds on a rail that by the survey has the grade angle `grade_rad` (rad, + uphill towards
    /// growing chainage) under the unit with the IMU. μ and its standard deviation. On an error nothing is changed.
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
        let (mut front_end, mut next) = (self.front_end, self.resistance);
        let mut reading = front_end.read(z, u, dt)?;
        reading.specific_force_mps2 = Some(GRAVITY * sin(grade_rad));
        next.step(&reading, true, dt);
        let (mu, sd) = next.coefficient();
        if !(mu.is_finite() && sd.is_finite()) {
            return Err(Error::Diverged);
        }
        (self.front_end, self.resistance) = (front_end, next);
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
        let free = self
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
state!(Resistance { rls, signals, train, waiting, load, outcome, aids, validity, since_sample_s; params, conditioning, bias_sd_mps2, standstill_mps, balance, mass_kg });
