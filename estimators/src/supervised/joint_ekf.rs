//! `joint_ekf_robust`: baseline of Liu et al. 2023: one extended Kalman filter for speed, slope and mass.
//!
//! State [v, θ, w], w = 10⁴/M (about 1, and the traction enters linearly). Force balance as in [`ForceBalance`]; w is constant;
//! wheel speed is the only measurement.
//!
//! The filter is overconfident: at steady speed the noise of its inputs passes for information, and after hours it is
//! certain of a mass that noise has made. The published variance of w therefore shrinks only while the speed
//! changes (`JointEkf::known`), which alone separates mass from slope; mass and slope are not valid before.
//!
//! A poor estimator by construction, kept as a baseline: from traction and speed alone a heavier train and a steeper slope look
//! alike, and only a force that varies faster than the slope can separate them. Expect mass errors of tens of percent.

use nalgebra::{Matrix1, Matrix3, vector};

use crate::api::aid::AidStatus;
use crate::api::estimator::Internal;
use crate::api::params::{param_groups, params};
use crate::api::real::{PI, sqrt, within};
use crate::api::signals::{Estimate, Flags, Value, Vehicle};
use crate::api::snapshot::{Archive, State, state};
use crate::detect::control::{self, Control};
use crate::detect::excitation_gate::ExcitationGate;
use crate::detect::gate::Gate;
use crate::detect::innovation_gate::Passage;
use crate::detect::plausibility::Instruments;
use crate::detect::validity::{Integrity, Source, Validity};
use crate::filters::ekf::Ekf;
use crate::filters::gaussian::{Correction, Gaussian};
use crate::methods::joint_ekf::{JointModel, Push, SCALE};
use crate::models::force_balance::ForceBalance;
use crate::preprocess::conditioning::ConditioningParams;
use crate::preprocess::front_end::Reading;
use crate::preprocess::resampler::Resampler;
use crate::rail::distributed_train::{DistributedTrain, steeper};
use crate::runner::{Pipeline, copy_into};
use crate::supervised::force_balance_ekf::MAX_GRADE_RAD;
use crate::supervised::supervision as supervise;
use crate::supervised::supervision::Supervision;
use crate::supervised::two_stage::motion;
use crate::{Real, Time};

params! {
    /// Parameters of `joint_ekf_robust`. Its grade must be free to move as fast as rails bend: a filter that holds it for steadier takes what the
    /// slope does for a matter of mass, and is sure of it.
    Own {
        mass0_kg ["kg"] = none, 1.0 => 1e6, "Total mass at the start; not set: the middle of the vehicle's mass range.";
        mass_sd ["-"] = 0.4, 0.001 => 2.0, "Standard deviation of that mass, as a share of it.";
        standstill_mps ["m/s"] = none, 0.0 => 2.0, "Speed below which the train counts as standing: no learning; not set: 0.05 on a rail, 0.3 on a road.";
        q_v ["m²/s³"] = 1e-4, 0.0 => 10.0, "Process noise of speed: force the balance leaves out, per unit mass.";
        q_theta ["rad²/s"] = 3e-4, 0.0 => 10.0, "Process noise of the grade angle while moving.";
        wheel_speed_sd_mps ["m/s"] = 0.005, 1e-6 => 10.0, "Standard deviation of wheel speed.";
        grade0_deg ["deg"] = 0.0, -60.0 => 60.0, "Grade angle at the start.";
        grade0_sd_deg ["deg"] = 5.0, 0.001 => 90.0, "Its standard deviation.";
        excitation_gate [flag] = true, "Let the reported uncertainty of the mass shrink only while the speed changes.";
    }
}

param_groups! {
    /// Parameters of `joint_ekf_robust`.
    Params { own: Own, supervision: Supervision, integrity: Integrity, conditioning: ConditioningParams }
}

/// Corner of the low-pass before the grades along the rail, Hz.
const CUTOFF_HZ: Real = 1.0;
/// Standard deviation of the speed above which it counts as changing, m/s, and the memory of that deviation, s.
const EXCITATION_MPS: Real = 0.05;
const EXCITATION_MEMORY_S: Real = 5.0;

/// How many times the range of the mass the filter itself goes beyond it.
const MAX_RATIO: Real = 100.0;

/// The pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointEkf {
    params: Params,
    standstill_mps: Real,
    balance: ForceBalance,
    mu: Real,
    range_kg: [Real; 2],
    ekf: Ekf<JointModel, 3>,
    /// For the grade at the IMU of a long train alone.
    signals: Resampler,
    train: DistributedTrain,
    /// Variance of w that was earned while the speed changed.
    earned: Real,
    gate: ExcitationGate,
    excited: bool,
    started: bool,
    saturated: bool,
    /// Innovation and NIS of the last wheel speed.
    last: Option<(Real, Real)>,
    validity: Validity,
    gate_of_speed: Gate,
    /// Standard deviation of wheel speed in use, m/s.
    wheel_speed_sd: Real,
    /// What became of the last wheel speed.
    wheel_speed: AidStatus,
}

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> JointEkf {
    let mass0 = vehicle.first_mass_kg(params.own.mass0_kg);
    let w0 = SCALE / mass0;
    let rad = PI / 180.0;
    let x = vector![0.0, params.own.grade0_deg * rad, w0];
    let sd = vector![
        params.own.wheel_speed_sd_mps,
        params.own.grade0_sd_deg * rad,
        w0 * params.own.mass_sd
    ];
    let balance = ForceBalance::new(vehicle);
    let model = JointModel {
        balance,
        q: [params.own.q_v, params.own.q_theta],
    };
    JointEkf {
        params: *params,
        standstill_mps: vehicle.standstill_mps(params.own.standstill_mps),
        balance,
        mu: vehicle.running_resistance,
        range_kg: vehicle.mass_range_kg,
        ekf: Ekf::new(model, Gaussian::independent(x, sd)),
        signals: Resampler::new(CUTOFF_HZ, 1.0, 0.0),
        train: DistributedTrain::new(
            &supervise::mapped(vehicle, params.supervision.grade_map),
            params.own.standstill_mps,
        ),
        earned: w0 * params.own.mass_sd * w0 * params.own.mass_sd,
        gate: ExcitationGate::new(
            params.own.excitation_gate,
            EXCITATION_MPS,
            EXCITATION_MEMORY_S,
        ),
        excited: false,
        started: false,
        saturated: false,
        last: None,
        validity: Validity::new(vehicle, params.integrity, Instruments::default()),
        gate_of_speed: Gate::new(&params.integrity),
        wheel_speed_sd: params.own.wheel_speed_sd_mps,
        wheel_speed: AidStatus::default(),
    }
}

impl JointEkf {
    fn predict(&mut self, reading: &Reading, running: bool, dt: Real) {
        let drive = reading
            .motor_torque_nm
            .zip(reading.speed_mps)
            .filter(|_| running);
        let Some((torque, speed)) = drive else {
            // Without a force balance speed carries no information on slope and mass: cut its tie to them.
            let P = &mut self.ekf.belief.P;
            let v = P.m11 + dt;
            let mut cut = Matrix3::identity();
            cut.m11 = 0.0;
            *P = cut * *P * cut;
            P.m11 = v;
            return;
        };
        let push = Push {
            traction_n: self.balance.net_traction(torque, speed),
            resistance: if speed < 0.0 { -self.mu } else { self.mu },
        };
        self.ekf.predict(&push, dt);
    }

    /// A wheel speed: gate and fuse.
    fn update(&mut self, speed: Real, running: bool) {
        let belief = &mut self.ekf.belief;
        if !self.started {
            belief.x.x = speed;
            self.started = true;
        }
        let (y, sd) = (speed - belief.x.x, self.wheel_speed_sd);
        let judgement = self.gate_of_speed.judge(y, belief.P.m11 + sd * sd);
        if judgement.passage == Passage::Reopen {
            belief.P.m11 += y * y;
        }
        if running {
            self.validity
                .innovation(Source::WheelSpeed, judgement.nis, judgement.period_s);
        }
        self.last = Some((y, judgement.nis));
        let passed = judgement.passage != Passage::Reject;
        let correction = passed.then(|| self.fuse(speed)).flatten();
        self.wheel_speed = judgement.status(correction.map(|c| (c.y.x, c.S.x)));
    }

    fn fuse(&mut self, speed: Real) -> Option<Correction<1, 3>> {
        let sd = self.wheel_speed_sd;
        let before = self.ekf.belief.P.m33;
        let correction = self.ekf.update(vector![speed], &Matrix1::new(sd * sd))?;
        if self.excited && before > 0.0 {
            self.earned *= self.ekf.belief.P.m33 / before;
        }
        self.last = Some((correction.y.x, correction.nis));
        let [low, high] = self.range_kg;
        let x = self.ekf.belief.x;
        let theta = within(x.y, -MAX_GRADE_RAD, MAX_GRADE_RAD);
        self.saturated = theta != x.y || self.w() != x.z;
        // The range of the mass limits what is published and not the filter: w cut back without the slope it is correlated with would contradict all
        // measurements before. Only where the force balance loses its sense does it stop.
        self.ekf.belief.x.y = theta;
        self.ekf.belief.x.z = within(x.z, SCALE / (MAX_RATIO * high), MAX_RATIO * SCALE / low);
        Some(correction)
    }
}

impl JointEkf {
    /// w within the range of the mass.
    fn w(&self) -> Real {
        let [low, high] = self.range_kg;
        within(self.ekf.belief.x.z, SCALE / high, SCALE / low)
    }

    /// Variance of w that is published: what the filter has, or what it has earned, whichever is larger.
    fn known(&self) -> Real {
        self.ekf.belief.P.m33.max(self.earned)
    }
}

impl Pipeline for JointEkf {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("inverse_mass", "-"),
        Internal::new("inverse_mass_sd", "-"),
        Internal::new("slope_mass_correlation", "-"),
    ];

    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate {
        let (moving, running) = motion(reading, self.standstill_mps);
        self.validity.observe(reading, dt);
        self.gate_of_speed.tick(dt);
        self.wheel_speed_sd = reading
            .noise
            .wheel_speed(self.params.own.wheel_speed_sd_mps);
        self.signals.step(reading, &self.balance, running, dt);
        self.train.step(&self.signals, None, reading, running, dt);
        if let Some(speed) = reading.speed_mps {
            self.gate.observe(speed, dt);
        }
        self.excited = running && self.gate.excited();
        self.predict(reading, running, dt);
        match control::wheel_speed(reading) {
            Control::New(speed) => self.update(speed, running),
            Control::Held => {}
            Control::Out(outcome) => self.wheel_speed = control::without(outcome),
        }
        let Gaussian { x, P } = self.ekf.belief;
        let [low, high] = self.range_kg;
        let mass = within(SCALE / x.z, low, high);
        let mass_sd = mass * sqrt(self.known()) / self.w();
        let grade_sd = sqrt(P.m22);
        let total_mass_kg = self.validity.mass(Value {
            value: mass,
            sd: mass_sd,
            // Mass and slope rest on the same innovations.
            valid: self.started && !self.saturated && self.validity.consistent(),
        });
        let ahead = self.train.ahead(mass);
        let grade = |by: Real, doubt: Real| {
            let sd = sqrt(grade_sd * grade_sd + doubt * doubt);
            Value {
                value: steeper(x.y, by).clamp(-MAX_GRADE_RAD, MAX_GRADE_RAD),
                sd,
                valid: running && total_mass_kg.valid,
            }
        };
        let estimate = Estimate {
            t,
            total_mass_kg,
            grade_rad: grade(ahead.imu, ahead.sd),
            effective_grade_rad: grade(0.0, 0.0),
            speed_mps: Value {
                value: x.x,
                sd: sqrt(P.m11),
                valid: reading.speed_mps.is_some(),
            },
            innovation: self.last.map_or(0.0, |(y, _)| y),
            nis: self.last.map_or(0.0, |(_, nis)| nis),
            flags: Flags {
                moving,
                excited: self.excited,
                saturated: self.saturated,
            },
        };
        self.validity.publish(estimate, true)
    }

    fn conditioning(&self) -> Option<ConditioningParams> {
        Some(self.params.conditioning)
    }

    const AID_SOURCES: &'static [&'static str] = &["wheel_speed"];

    fn aid_status(&self, status: &mut [AidStatus]) {
        copy_into(status, &[self.wheel_speed]);
    }

    fn internal_values(&self, values: &mut [Real]) {
        let P = self.ekf.belief.P;
        let correlation = P.m23 / sqrt(P.m22 * P.m33).max(1e-30);
        copy_into(values, &[self.ekf.belief.x.z, sqrt(P.m33), correlation]);
    }

    fn visit(&mut self, archive: &mut Archive) {
        State::visit(self, archive);
    }
}

state!(JointEkf { ekf, signals, train, earned, gate, excited, started, saturated, last, validity, gate_of_speed, wheel_speed_sd, wheel_speed; params, standstill_mps, balance, mu, range_kg });
