//! `complementary_filter`: grade from the pitch gyro in the short run and from the accelerometer, less the acceleration
//! of the wheels, in the long run. A baseline beside the published methods.
//!
//! e = (f − v̇)/g − sin θ,  θ ← θ + dt (ω − b + e/τ),  b ← b − dt e/(τ τ_b)
//!
//! (Mahony, Hamel & Pflimlin 2008, IEEE Trans. Automatic Control 53(5), eq. 48, in one dimension, with the wheels in
//! place of the assumption that the vehicle does not accelerate.) All three signals of e go through one low-pass. It
//! has no covariance: the standard deviation is that of the accelerometer's bias, of the residual behind the crossover,
//! and of the start as it dies out. It needs neither torque nor mass, and estimates no mass. No channel is conditioned;
//! the train is a point.

use crate::api::aid::{AidOutcome, AidStatus};
use crate::api::estimator::Internal;
use crate::api::params::{param_groups, params};
use crate::api::reading::Reading;
use crate::api::real::{GRAVITY, PI, exp, sin, sqrt};
use crate::api::signals::{Estimate, Flags, Value, Vehicle};
use crate::api::snapshot::{Archive, State, state};
use crate::detect::control;
use crate::detect::plausibility::{Instruments, Plausibility};
use crate::detect::validity::{BaselineIntegrity, Integrity, Source, Validity};
use crate::filters::low_pass::MatchedFilter;
use crate::instruments::gate::{Gate, Passage};
use crate::methods::published::no_mass;
use crate::models::force_balance::MAX_GRADE_RAD;
use crate::runner::{Pipeline, copy_into};
use crate::{Real, Time};

params! {
    /// The filter.
    Own {
        crossover_s ["s"] = 2.0, 0.05 => 1000.0, "Time constant τ: the accelerometer counts for slower motion, the gyro for faster.";
        bias_time_s ["s"] = 30.0, 0.1 => 1e6, "Time constant τ_b in which the gyro's bias is learnt.";
        cutoff_hz ["Hz"] = 1.0, 0.05 => 20.0, "Corner of the low-pass of specific force, wheel speed and grade.";
        residual_sd_mps2 ["m/s²"] = 0.1, 1e-4 => 10.0, "Standard deviation of the residual g e after this low-pass.";
        accel_bias_sd_mps2 ["m/s²"] = none, 0.0 => 2.0, "Standard deviation of the accelerometer's bias, which only widens the reported deviation; not set: the value of the vehicle's sheet, or 0.05.";
        grade0_deg ["deg"] = 0.0, -60.0 => 60.0, "Grade angle at the start.";
        grade0_sd_deg ["deg"] = 5.0, 0.001 => 90.0, "Standard deviation of the grade angle at the start.";
    }
}

param_groups! {
    /// Parameters of `complementary_filter`.
    Params { own: Own, integrity: Integrity, baseline: BaselineIntegrity }
}

/// Largest gyro bias, rad/s.
const MAX_BIAS_RADPS: Real = 0.2;

/// The pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ComplementaryFilter {
    params: Own,
    standstill_mps: Real,
    bias_sd_mps2: Real,
    mass: Value,
    point: bool,
    force: MatchedFilter,
    speed: MatchedFilter,
    sine: MatchedFilter,
    theta: Real,
    bias: Real,
    gate: Gate,
    plausibility: Plausibility,
    validity: Validity,
    /// Time of corrections, s.
    corrected_s: Real,
    clamped: bool,
    residual: Real,
    aids: [AidStatus; 2],
}

/// Builds the estimator from the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> ComplementaryFilter {
    let own = params.own;
    let filter = MatchedFilter::new(own.cutoff_hz);
    let uses = Instruments {
        accelerometer: true,
        gyro: true,
        spare_gyro: false,
    };
    ComplementaryFilter {
        params: own,
        standstill_mps: vehicle.standstill_mps(None),
        bias_sd_mps2: vehicle.accel_bias_sd(own.accel_bias_sd_mps2, 0.05),
        mass: no_mass(vehicle),
        point: vehicle.is_point(),
        force: filter,
        speed: filter,
        sine: filter,
        theta: own.grade0_deg * PI / 180.0,
        bias: 0.0,
        gate: params.integrity.gate(params.baseline.innovation_gate),
        plausibility: Plausibility::new(params.integrity.plausibility, uses),
        validity: Validity::new(params.integrity),
        corrected_s: 0.0,
        clamped: false,
        residual: 0.0,
        aids: [AidStatus::default(); 2],
    }
}

impl ComplementaryFilter {
    /// The residual g e, m/s², if both instruments are there.
    fn residual(&mut self, reading: &Reading, dt: Real) -> Option<Real> {
        let Some((f, v)) = reading.specific_force_mps2.zip(reading.speed_mps) else {
            for filter in [&mut self.force, &mut self.speed, &mut self.sine] {
                filter.empty();
            }
            return None;
        };
        self.force.step(f, dt);
        self.speed.step(v, dt);
        self.sine.step(sin(self.theta), dt);
        Some(self.force.value()? - self.speed.rate() - GRAVITY * self.sine.value()?)
    }

    /// Correction by a residual: gate and fuse.
    fn correct(&mut self, residual: Real, dt: Real) {
        let own = self.params;
        let start = own.grade0_sd_deg * PI / 180.0 * GRAVITY * self.start_share();
        let variance = own.residual_sd_mps2 * own.residual_sd_mps2 + start * start;
        let judgement = self.gate.judge(residual, variance);
        self.validity
            .innovation(Source::Accelerometer, judgement.nis, judgement.period_s);
        self.residual = residual;
        let passed = judgement.passage != Passage::Reject;
        let [_, accelerometer] = &mut self.aids;
        *accelerometer = judgement.status(passed.then_some((residual, variance)));
        if passed {
            let turn = residual / (GRAVITY * own.crossover_s);
            self.theta += dt * turn;
            self.bias =
                (self.bias - dt * turn / own.bias_time_s).clamp(-MAX_BIAS_RADPS, MAX_BIAS_RADPS);
            self.corrected_s += dt;
        }
    }

    /// Share of the initial error that remains.
    fn start_share(&self) -> Real {
        exp(-(self.corrected_s / self.params.crossover_s).min(50.0))
    }
}

impl Pipeline for ComplementaryFilter {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("gyro_bias_radps", "rad/s"),
        Internal::new("residual_mps2", "m/s²"),
    ];

    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate {
        let plausible = self
            .plausibility
            .step(reading, reading.pitch_rate_radps, dt);
        self.validity.observe(plausible, dt);
        self.gate.tick(dt);
        let rate = reading
            .pitch_rate_radps
            .map_or(0.0, |rate| rate - self.bias);
        self.theta += dt * rate;
        let residual = self.residual(reading, dt);
        match residual {
            Some(residual) => self.correct(residual, dt),
            None => {
                let [_, accelerometer] = &mut self.aids;
                *accelerometer = control::without(AidOutcome::Stale);
            }
        }
        let [wheel_speed, _] = &mut self.aids;
        *wheel_speed = control::wheel_speed_input(reading);
        let inside = self.theta.clamp(-MAX_GRADE_RAD, MAX_GRADE_RAD);
        self.clamped = inside != self.theta || self.bias.abs() >= MAX_BIAS_RADPS;
        self.theta = inside;

        let own = self.params;
        let start = own.grade0_sd_deg * PI / 180.0 * self.start_share();
        // The crossover averages the residual over about its own time; its correlation is that of the low-pass.
        let share = 1.0 / (1.0 + 2.0 * PI * own.cutoff_hz * own.crossover_s);
        let noise = own.residual_sd_mps2 / GRAVITY;
        let bias = self.bias_sd_mps2 / GRAVITY;
        let sd = sqrt(bias * bias + noise * noise * share + start * start);
        let fresh = residual.is_some() && reading.pitch_rate_radps.is_some();
        let grade_rad = Value::new(self.theta, sd, fresh && !self.clamped);
        let estimate = Estimate {
            t,
            total_mass_kg: self.mass,
            grade_rad,
            // The effective grade of a long train is another; nothing here finds it.
            effective_grade_rad: Value {
                valid: grade_rad.valid && self.point,
                ..grade_rad
            },
            speed_mps: Value::new(
                self.speed.value().unwrap_or(0.0),
                0.05,
                reading.speed_mps.is_some(),
            ),
            innovation: self.residual,
            nis: (self.residual / own.residual_sd_mps2) * (self.residual / own.residual_sd_mps2),
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

    const AID_SOURCES: &'static [&'static str] = &["wheel_speed", "accelerometer"];

    fn aid_status(&self, status: &mut [AidStatus]) {
        copy_into(status, &self.aids);
    }

    fn internal_values(&self, values: &mut [Real]) {
        copy_into(values, &[self.bias, self.residual]);
    }

    fn visit(&mut self, archive: &mut Archive) {
        State::visit(self, archive);
    }
}

state!(ComplementaryFilter { force, speed, sine, theta, bias, gate, plausibility, validity, corrected_s, clamped, residual, aids;
    params, standstill_mps, bias_sd_mps2, mass, point });
