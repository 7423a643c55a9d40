//! A published method under supervision: the core of a train around the algorithm of the paper.
//!
//! 1. [core](crate::fusion::train_core): attitude and speed by instruments that have been checked, the rail that was
//!    read, the traction of the motors
//! 2. samples of the force balance behind a matched low-pass, which wait until the rail under the train has been read
//! 3. the [`SupervisedMethod`]: mass by its regression, and if it has one a grade by its own filter
//! 4. effective grade: mean over the masses by the core, and by the method where the core does not know it better
//!
//! The method's grade is worth what it was worth while the core knew the grade: its standard deviation is widened by
//! how far it was off then ([`MethodTrust`]).

use crate::api::aid::{AidOutcome, AidStatus, Rejection};
use crate::api::estimator::Internal;
use crate::api::params::params;
use crate::api::reading::Reading;
use crate::api::real::{exp, sqrt, within};
use crate::api::signals::{Estimate, Flags, Value, Vehicle};
use crate::api::snapshot::{Archive, State, state};
use crate::detect::control::{self, Control};
use crate::detect::validity::Integrity;
use crate::filters::ring_buffer::RingBuffer;
use crate::fusion::attitude::Attitude;
use crate::fusion::attitude::params::{AttitudeParams, AttitudeSupervision};
use crate::fusion::effective::{EffectiveGrade, UnitGrade};
use crate::fusion::swing_balance::params::SwingBalanceParams;
use crate::fusion::train_core::{TrainCore, layout};
use crate::fusion::train_source::{CoreSignals, TrainSample, TrainSource};
use crate::models::force_balance::MAX_GRADE_RAD;
use crate::models::sample::ResampledSample;
use crate::models::single_track::Bend;
use crate::preprocess::conditioning::ConditioningParams;
use crate::preprocess::front_end::motion;
use crate::preprocess::resampler::Resampler;
use crate::rail::mass_on_rail::MassOnRail;
use crate::rail::rail_memory::Place;
use crate::rail::train_means::TrainOnRail;
use crate::runner::{Pipeline, copy_into};
use crate::supervised::sample::BalanceSample;
use crate::{Real, Time};

params! {
    /// Switches of the supervisors around a method.
    Supervision {
        rail_memory [flag] = true, "Keep the rail under a long train in memory; off: the train is a point.";
        torque_monitor [flag] = true, "Torques are compared with each other and with the command; off: no comparison.";
        method_grade [flag] = true, "The effective grade uses the method's grade where the core's is not better; off: it does not.";
    }
}

/// Share of the wheelbase, times the curvature, that the pitch of a road vehicle trails the grade under its wheels by.
/// With x of the wheelbase L on a new curvature κ, the mean grade of the axles is κ x/2 and the pitch κ x²/(2 L), of
/// which the curvature seen is κ x/L: the pitch trails by ½ L (1 − x/L) times that, on the way by half of it.
const WHEELBASE_SHARE: Real = 0.25;
/// Speed up to which a pitch rate gives no curvature, m/s, and the time constant of the rate, s: vibration is no
/// curvature.
const MIN_CURVE_MPS: Real = 0.5;
const CURVE_S: Real = 0.1;
/// Samples that may wait for rail.
const WAITING: usize = 20;
/// Longest distance that the train can cover in the delay of the low-pass, m.
const MAX_DELAY_M: Real = 2.0;
/// Largest mean distance of the tare behind the remembered rail at which a sample is used when going back, m.
const MAX_BEHIND_M: Real = 0.3;

/// Signals of the core for a method in a step.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// Signals of the step.
    pub reading: &'a Reading,
    /// Attitude and speed.
    pub attitude: &'a Attitude,
    /// Traction at the rims less air drag, N; `None` while the force balance does not hold (standing, braking, torques
    /// unknown or in doubt, wheels that slip).
    pub traction_n: Option<Real>,
    /// Standard deviation of the accelerometer's bias that the attitude has, m/s².
    pub bias_sd_mps2: Real,
    /// Mean horizontal curvature under the train, 1/m.
    pub curvature_per_m: Real,
    /// Bend of a road.
    pub bend: Bend,
    /// True if the train moves.
    pub moving: bool,
    /// True if the train moves under the force balance alone.
    pub running: bool,
    /// Time since the step before, s.
    pub dt: Real,
}

/// A published method.
pub trait SupervisedMethod: Copy + core::fmt::Debug + State {
    /// Names of its internal quantities.
    const INTERNALS: &'static [Internal];

    /// Takes a sample of the force balance and returns its status.
    fn sample(&mut self, _sample: &BalanceSample) -> AidStatus {
        control::without(AidOutcome::Stale)
    }

    /// The force balance has been interrupted: standing, brake, slip.
    fn pause(&mut self) {}

    /// Another load may hang on the train, which has stood.
    fn open_load(&mut self) {}

    /// One step.
    fn step(&mut self, now: &Step);

    /// Total mass, kg.
    fn mass_kg(&self) -> Value;

    /// Effective grade by its own filter, rad; not valid without one.
    fn effective_grade_rad(&self) -> Value {
        Value::default()
    }

    /// True if its last sample was excited.
    fn is_excited(&self) -> bool;

    /// True if a limit acts.
    fn is_saturated(&self) -> bool;

    /// Its internal quantities, in the order of their names.
    fn internal_values(&self, values: &mut [Real]);
}

/// Memory of the error of the method's grade, s.
const TRUST_MEMORY_S: Real = 20.0;
/// Standard deviation of the core's grade up to which the core judges the method's grade, rad.
const JUDGE_SD_RAD: Real = 0.005;
/// Largest square of a difference that counts, in variances.
const MAX_SQUARE: Real = 1e4;

/// Trust in the method's grade: the running mean square of its differences from the core's, in their variances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MethodTrust {
    square: Real,
}

impl Default for MethodTrust {
    fn default() -> Self {
        Self { square: 1.0 }
    }
}

impl MethodTrust {
    /// Weights the effective grades of the core and of the method by their variances; the method's variance is widened
    /// by its past error. Of the variance of the core `common` is that of the pitch, which the grade at the IMU has
    /// too: that grade moves by its share. Returns the effective grade and the grade at the IMU.
    ///
    /// The two share instruments, so that the standard deviations are those of errors which are not independent.
    fn weigh(
        &mut self,
        [core, at_imu]: [Value; 2],
        common_sd: Real,
        method: Value,
        dt: Real,
    ) -> [Value; 2] {
        if !method.valid {
            return [core, at_imu];
        }
        let off = method.value - core.value;
        let core_variance = core.sd * core.sd;
        if core.sd < JUDGE_SD_RAD {
            let variance = core_variance + method.sd * method.sd;
            let square = (off * off / variance.max(Real::MIN_POSITIVE)).min(MAX_SQUARE);
            self.square += (1.0 - exp(-dt / TRUST_MEMORY_S)) * (square - self.square);
        }
        let method_variance = method.sd * method.sd * self.square.max(1.0);
        let both = (core_variance + method_variance).max(Real::MIN_POSITIVE);
        let moved = |grade: Value, variance: Real| {
            let share = variance / both;
            let other = sqrt((both - variance).max(0.0));
            Value {
                value: within(grade.value + share * off, -MAX_GRADE_RAD, MAX_GRADE_RAD),
                sd: (1.0 - share) * grade.sd + share * other,
                ..grade
            }
        };
        let common = (common_sd * common_sd).min(core_variance);
        [moved(core, core_variance), moved(at_imu, common)]
    }
}

/// The part of a standard deviation that another one does not explain.
fn without(sd: Real, other: Real) -> Real {
    sqrt((sd * sd - other * other).max(0.0))
}

state!(MethodTrust { square; } where |this| this.square >= 0.0);

/// Groups of parameters of every supervised method.
#[derive(Clone, Copy, Debug)]
pub struct CoreParams {
    /// Attitude filter.
    pub attitude: AttitudeParams,
    /// Supervisors of the attitude filter.
    pub attitude_supervision: AttitudeSupervision,
    /// Supervisors around the method.
    pub supervision: Supervision,
    /// Gates and validity rule.
    pub integrity: Integrity,
    /// Conditioning of the channels that the method reads itself.
    pub conditioning: ConditioningParams,
}

/// A method under supervision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Supervised<M> {
    source: TrainSource,
    core: TrainCore,
    train: TrainOnRail,
    tare_kg: Real,
    gain_sd: Real,
    front_m: Real,
    wheelbase_m: Real,
    standstill_mps: Real,
    method_grade: bool,
    conditioning: ConditioningParams,
    signals: Resampler,
    /// Samples, each with its place.
    waiting: RingBuffer<(ResampledSample, Place), WAITING>,
    /// Distance of the train ahead of its place in the delayed signals, m.
    late_m: Real,
    /// Time since the last sample that the method used, s.
    since_s: Real,
    curvature_per_m: Real,
    pitch_rate_radps: Real,
    method: M,
    effective: EffectiveGrade,
    trust: MethodTrust,
    /// Effective grade and grade at the IMU, rad.
    grades: [Value; 2],
    status: AidStatus,
}

impl<M: SupervisedMethod> Supervised<M> {
    /// Builds the estimator from the vehicle's nominal values, the parameters of the core, the corner of the low-pass
    /// of the samples, their rate (Hz) and their settling time (s), and the method.
    pub fn new(
        vehicle: &Vehicle,
        params: &CoreParams,
        [cutoff_hz, rate_hz, settle_s]: [Real; 3],
        method: M,
    ) -> Self {
        let CoreParams {
            attitude,
            attitude_supervision,
            supervision,
            integrity,
            conditioning,
        } = *params;
        let vehicle = match supervision.rail_memory {
            true => *vehicle,
            false => vehicle.as_point(),
        };
        let train = TrainOnRail::new(&layout(&vehicle), false);
        let torque = SwingBalanceParams::default();
        let [front_m, _] = train.span_m();
        Self {
            core: TrainCore::new(&vehicle, train.span_m(), integrity),
            source: TrainSource::new(
                &vehicle,
                attitude,
                attitude_supervision,
                &integrity,
                (&torque, supervision.torque_monitor),
                CoreSignals {
                    max_sum_sd: Real::MAX,
                    gyro_check: false,
                },
            ),
            train,
            tare_kg: vehicle.tare_kg,
            gain_sd: torque.gain_sd(vehicle.drives),
            front_m: -front_m,
            wheelbase_m: vehicle
                .road
                .map_or(0.0, |road| road.front_axle_m + road.rear_axle_m),
            standstill_mps: vehicle.standstill_mps(None),
            method_grade: supervision.method_grade,
            conditioning,
            signals: Resampler::new(cutoff_hz, rate_hz, settle_s),
            waiting: RingBuffer::new(),
            late_m: 0.0,
            since_s: 0.0,
            curvature_per_m: 0.0,
            pitch_rate_radps: 0.0,
            method,
            effective: EffectiveGrade::default(),
            trust: MethodTrust::default(),
            grades: [Value::default(); 2],
            status: AidStatus::default(),
        }
    }

    /// The sample that is processed in this step: the oldest whose rail has been read, or while the train is not
    /// `running`, and will read none, any.
    fn next(
        &mut self,
        reading: &Reading,
        force_n: Option<Real>,
        running: bool,
        dt: Real,
    ) -> Option<(ResampledSample, Place)> {
        let new = self.signals.step_force(reading, force_n, running, dt);
        let speed = reading.speed_mps.unwrap_or(self.signals.speed_mps());
        let late_m = self.late_m + (speed - self.signals.speed_mps()) * dt;
        self.late_m = within(late_m, -MAX_DELAY_M, MAX_DELAY_M);
        let rail = self.core.rail();
        let place = rail.ahead(rail.here(), -self.late_m);
        let full = new.and_then(|sample| self.waiting.push((sample, place)));
        if full.is_some() {
            return full;
        }
        let (_, place) = self.waiting.first()?;
        match running && !rail.read_up_to(place, self.front_m) {
            true => None,
            false => self.waiting.pop(),
        }
    }

    /// Processes a sample; returns its normalised innovation squared and its period, s, if the method has used it.
    fn take(&mut self, (sample, place): (ResampledSample, Place)) -> Option<(Real, Real)> {
        let means = self.train.at(self.core.rail(), place);
        self.curvature_per_m = means.bend_per_m;
        // Going back over rail that is no longer remembered, or never was.
        let onto_unknown =
            sample.speed_mps < 0.0 && means.behind_tare_kgm > MAX_BEHIND_M * self.tare_kg;
        if onto_unknown {
            self.status = control::without(AidOutcome::Rejected(Rejection::NotExcited));
            return None;
        }
        let sample = BalanceSample::new(sample, &means, self.tare_kg, self.source.read_sd());
        self.status = self.method.sample(&sample);
        let nis = self.status.nis()?;
        let period_s = self.since_s;
        self.since_s = 0.0;
        Some((nis, period_s))
    }

    fn weigh(&mut self, reading: &Reading, sample: &TrainSample, traction: Option<Real>, dt: Real) {
        let attitude = *self.source.attitude().found();
        let mass = self.method.mass_kg();
        let load_kg = (mass.value - self.tare_kg).max(0.0);
        let behind_sd_rad = self.core.rail().behind_sd_rad();
        let carried = MassOnRail {
            mass_kg: mass.value.max(self.tare_kg).max(1.0),
            load_kg,
            load_sd_kg: mass.sd,
            eta_rad: 0.0,
            eta_variance: behind_sd_rad * behind_sd_rad,
        };
        let (core, source) = (&self.core, &self.source);
        // The doubt of the mount is no reason to trust the method: it is added to the grades at the end.
        let mount_sd = source.attitude().mount_sd_rad();
        let unit = UnitGrade {
            constant_sd_rad: source.read_sd(),
            ..sample.unit
        };
        self.effective
            .step(&unit, &self.train, &carried, core.rail(), dt);
        let by_core = self.effective.value(true);
        let share = 1.0 - exp(-dt / CURVE_S);
        self.pitch_rate_radps += share * (attitude.pitch_rate_radps - self.pitch_rate_radps);
        let curvature = self.pitch_rate_radps / attitude.speed_mps.abs().max(MIN_CURVE_MPS);
        let trail_sd = WHEELBASE_SHARE * self.wheelbase_m * curvature;
        let [bias_sd_mps2, ..] = source.attitude().reading();
        let (moving, running) = motion(reading, self.standstill_mps);
        self.method.step(&Step {
            reading,
            attitude: &attitude,
            traction_n: traction,
            bias_sd_mps2,
            curvature_per_m: self.curvature_per_m,
            bend: source.bends().now(),
            moving,
            running,
            dt,
        });
        let by_method = self.method.effective_grade_rad();
        let known = self.method_grade && by_method.valid;
        let by_method = Value {
            valid: known,
            ..by_method
        };
        let attitude = self.source.attitude();
        let at_imu = Value {
            value: attitude.grade_at_imu_rad(),
            sd: without(attitude.grade_at_imu_sd_rad(), mount_sd),
            valid: true,
        };
        // Without samples of the IMU its errors are no longer those of the rail read before.
        let common_sd = if attitude.found().imu { at_imu.sd } else { 0.0 };
        let grades = self
            .trust
            .weigh([by_core, at_imu], common_sd, by_method, dt);
        let [effective, at_imu] = grades;
        let with = |grade: Value, mount_sd: Real, sd: Real| Value {
            sd: sqrt(grade.sd * grade.sd + mount_sd * mount_sd + sd * sd),
            ..grade
        };
        self.grades = [
            with(effective, source.mount_sd_under_train_rad(), trail_sd),
            with(at_imu, mount_sd, 0.0),
        ];
    }
}

impl<M: SupervisedMethod> Pipeline for Supervised<M> {
    const INTERNALS: &'static [Internal] = M::INTERNALS;

    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate {
        self.since_s += dt;
        let mut nis = None;
        let mass_kg = self.method.mass_kg().value;
        let input = self.source.step(reading, mass_kg, t, dt);
        if let Some(sample) = &input.sample {
            self.core.take(sample, input.speed_mps.sd, dt);
            let (_, running) = motion(reading, self.standstill_mps);
            let running = running && !sample.block.doubt;
            if self.core.has_lost_place() {
                self.waiting = RingBuffer::new();
                self.effective = EffectiveGrade::default();
                self.method.pause();
            }
            let force_n = sample.block.traction.map(|[force, _]| force);
            let sound = running && sample.block.sound;
            if let Some(placed) = self.next(reading, force_n, sound, dt) {
                nis = self.take(placed);
            }
            if let Control::Out(outcome) = control::force_balance(reading, running, true) {
                self.status = control::without(outcome);
            }
            if !self.signals.settled() {
                self.method.pause();
            }
            if self.core.may_have_another_load() {
                self.method.open_load();
            }
            let traction = force_n.filter(|_| running);
            self.weigh(reading, sample, traction, dt);
        }
        self.core.supervise(&input, nis);
        let awake = input.is_awake();
        let mass = self.method.mass_kg();
        let gain_kg = self.gain_sd * mass.value;
        let [effective, at_imu] = self.grades;
        let estimate = Estimate {
            total_mass_kg: Value {
                sd: sqrt(mass.sd * mass.sd + gain_kg * gain_kg),
                valid: mass.valid && awake,
                ..mass
            },
            grade_rad: Value {
                valid: awake,
                ..at_imu
            },
            effective_grade_rad: Value {
                valid: self.core.is_placed(&input),
                ..effective
            },
            flags: Flags {
                moving: input.moving,
                excited: self.signals.settled() && self.method.is_excited(),
                saturated: self.method.is_saturated(),
            },
            ..input.estimate()
        };
        self.core.publish(estimate)
    }

    fn internal_values(&self, values: &mut [Real]) {
        self.method.internal_values(values);
    }

    fn conditioning(&self) -> Option<ConditioningParams> {
        Some(self.conditioning)
    }

    const AID_SOURCES: &'static [&'static str] = &[
        "wheel_speed",
        "lateral_force",
        "vertical_force",
        "force_balance",
    ];

    fn aid_status(&self, status: &mut [AidStatus]) {
        let [wheels, lateral, vertical] = self.source.attitude().aid_status();
        copy_into(status, &[wheels, lateral, vertical, self.status]);
    }

    fn visit(&mut self, archive: &mut Archive) {
        State::visit(self, archive);
    }
}

state!(@[M: State] Supervised<M> { source, core, signals, waiting, late_m, since_s, curvature_per_m, pitch_rate_radps, method, effective, trust, grades, status;
    train, tare_kg, gain_sd, front_m, wheelbase_m, standstill_mps, method_grade, conditioning });

#[cfg(test)]
#[path = "pipeline_tests.rs"]
mod tests;
