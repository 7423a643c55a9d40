//! A published method as a pipeline: signals made of a [`Reading`], and an [`Estimate`] made of its answer.
//!
//! Supervision ends at "finite and started": what the method has found is valid as soon as it has found anything, and
//! no more is claimed. The train is a point.

use core::fmt;

use crate::api::estimator::Internal;
use crate::api::real::{sqrt, within};
use crate::api::signals::{Estimate, Flags, Value};
use crate::api::snapshot::{Archive, State, state};
use crate::api::vehicle::Vehicle;
use crate::methods::method::{Found, Method, Signals};
use crate::models::force_balance::{ForceBalance, MAX_GRADE_RAD};
use crate::preprocess::front_end::{Reading, motion};
use crate::preprocess::resampler::Resampler;
use crate::runner::Pipeline;
use crate::{Real, Time};

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
            speed_mps: reading.speed_mps,
            new_speed_mps: reading.new_speed_mps,
            specific_force_mps2: reading.specific_force_mps2,
            lateral_force_mps2: reading.lateral_force_mps2,
            yaw_rate_radps: reading.yaw_rate_radps,
            steering_angle_rad: reading.steering_angle_rad,
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

/// The mass of a method that finds none: a uniform distribution over the vehicle's range, not valid.
pub fn no_mass(vehicle: &Vehicle) -> Value {
    let [low, high] = vehicle.mass_range_kg;
    Value {
        value: 0.5 * (low + high),
        sd: (high - low) / sqrt(12.0),
        valid: false,
    }
}

/// Standard deviation of wheel speed for a method that gives none, m/s.
const WHEEL_SPEED_SD_MPS: Real = 0.01;

/// Cuts an estimate to a range; the second value is true if it was cut.
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
