//! What the published methods share: signals in, numbers out. No mathematics of theirs.
//!
//! A published method is a file of equations ([`liu_2023`](crate::methods::liu_2023) and its siblings). This file makes signals of a
//! [`Reading`] for it, and an [`Estimate`] of what it answers. Supervision ends at "finite and started": what the method has found is
//! valid as soon as it has found anything, and no more is claimed. The train is a point.

use core::fmt;

use crate::api::estimator::Internal;
use crate::api::real::{sqrt, within};
use crate::api::signals::{Estimate, Flags, Value};
use crate::api::snapshot::{Archive, State, state};
use crate::api::vehicle::Vehicle;
use crate::models::force_balance::ForceBalance;
use crate::preprocess::front_end::Reading;
use crate::preprocess::resampler::{ResampledSample, Resampler};
use crate::runner::Pipeline;
use crate::supervised::force_balance_ekf::MAX_GRADE_RAD;
use crate::supervised::two_stage::motion;
use crate::{Real, Time};

/// The signals of one step.
#[derive(Clone, Copy, Debug)]
pub struct Signals<'a> {
    /// All channels.
    pub reading: &'a Reading,
    /// Traction at the rims less the drag of the air, N, while the force balance holds: moving, brake released, torque known.
    pub traction_n: Option<Real>,
    /// Drag of the air, N, that has been taken off it.
    pub drag_n: Real,
    /// Sign of the speed, ±1.
    pub direction: Real,
    /// Speed, torque and accelerometer behind one low-pass, where a sample is due and the force balance holds.
    pub sample: Option<ResampledSample>,
    /// Acceleration of the wheels v̇ behind that low-pass, m/s².
    pub acceleration_mps2: Real,
    /// Length of the step, s.
    pub dt: Real,
}

/// A quantity as a method has it.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Its value.
    pub value: Real,
    /// Its standard deviation, same unit.
    pub sd: Real,
    /// Whether the method has found it, or only starts from it.
    pub started: bool,
}

/// What a method has found.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    /// Total mass, kg; `None` from a method that finds none.
    pub mass_kg: Option<Found>,
    /// Grade angle, rad.
    pub grade_rad: Found,
    /// Speed, m/s; `None` from a method that takes that of the wheels.
    pub speed_mps: Option<Found>,
    /// Innovation of the last measurement, and its square normalised.
    pub innovation: (Real, Real),
}

/// A published method.
pub trait Method: Copy + State {
    /// Names of its internal quantities.
    const INTERNALS: &'static [Internal];

    /// One step.
    fn step(&mut self, z: &Signals);

    /// What it has found.
    fn answer(&self) -> Answer;

    /// Its internal quantities, as many as fit.
    fn internal_values(&self, values: &mut [Real]);
}

/// A published method made a pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Published<T> {
    method: T,
    balance: ForceBalance,
    signals: Resampler,
    standstill_mps: Real,
    range_kg: [Real; 2],
    direction: Real,
}

impl<T> Published<T> {
    /// Gives `method` signals behind a low-pass of corner `cutoff_hz`, sampled at `rate_hz`.
    pub fn new(vehicle: &Vehicle, [cutoff_hz, rate_hz]: [Real; 2], method: T) -> Self {
        Self {
            method,
            balance: ForceBalance::new(vehicle),
            signals: Resampler::new(cutoff_hz, rate_hz, 0.0),
            standstill_mps: vehicle.standstill_mps(None),
            range_kg: vehicle.mass_range_kg,
            direction: 1.0,
        }
    }
}

impl<T: Method + fmt::Debug> Pipeline for Published<T> {
    const INTERNALS: &'static [Internal] = T::INTERNALS;

    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate {
        let (moving, running) = motion(reading, self.standstill_mps);
        let sample = self.signals.step(reading, &self.balance, running, dt);
        if moving && let Some(v) = reading.speed_mps {
            self.direction = if v < 0.0 { -1.0 } else { 1.0 };
        }
        let drive = reading.motor_torque_nm.zip(reading.speed_mps);
        self.method.step(&Signals {
            reading,
            traction_n: drive
                .filter(|_| running)
                .map(|(torque, speed)| self.balance.net_traction(torque, speed)),
            drag_n: reading.speed_mps.map_or(0.0, |v| self.balance.drag(v)),
            direction: self.direction,
            sample,
            acceleration_mps2: self.signals.acceleration_mps2(),
            dt,
        });
        let answer = self.method.answer();
        let [low, high] = self.range_kg;
        let mass = answer.mass_kg.unwrap_or(Found {
            value: 0.5 * (low + high),
            sd: (high - low) / sqrt(12.0), // a uniform distribution
            started: false,
        });
        let (mass, mass_cut) = cut(mass, [low, high]);
        let (grade, grade_cut) = cut(answer.grade_rad, [-MAX_GRADE_RAD, MAX_GRADE_RAD]);
        let by_wheels = Found {
            value: self.signals.speed_mps(),
            sd: WHEEL_SPEED_SD_MPS,
            started: true,
        };
        let speed = answer.speed_mps.unwrap_or(by_wheels);
        let (innovation, nis) = answer.innovation;
        Estimate {
            t,
            total_mass_kg: mass,
            grade_rad: grade,
            effective_grade_rad: grade,
            speed_mps: Value {
                value: speed.value,
                sd: speed.sd,
                valid: reading.speed_mps.is_some(),
            },
            innovation,
            nis,
            flags: Flags {
                moving,
                excited: running && mass.valid,
                saturated: mass_cut || grade_cut,
            },
        }
    }

    fn internal_values(&self, values: &mut [Real]) {
        self.method.internal_values(values);
    }

    fn visit(&mut self, archive: &mut Archive) {
        State::visit(self, archive);
    }
}

/// The mass of a method that finds none: what the vehicle's range says (a uniform distribution), not valid.
pub fn no_mass(vehicle: &Vehicle) -> Value {
    let [low, high] = vehicle.mass_range_kg;
    Value {
        value: 0.5 * (low + high),
        sd: (high - low) / sqrt(12.0),
        valid: false,
    }
}

/// What the wheels' speed is taken for where a method says nothing of it, m/s.
const WHEEL_SPEED_SD_MPS: Real = 0.01;

/// What has been found, cut to a range, and whether it had to be.
fn cut(found: Found, [low, high]: [Real; 2]) -> (Value, bool) {
    let inside = within(found.value, low, high);
    let limited = inside != found.value;
    let value = Value {
        value: inside,
        sd: found.sd,
        valid: found.started && !limited,
    };
    (value, limited)
}

state!(@[T: State] Published<T> { method, signals, direction; balance, standstill_mps, range_kg });
