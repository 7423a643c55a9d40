//! A published method as a pipeline: signals made of a [`Reading`], and an [`Estimate`] made of its answer.
//!
//! Supervision ends at "finite and started": what the method has found is valid as soon as it has found anything, and
//! no more is claimed. The train is a point.

use core::fmt;

use crate::api::estimator::Internal;
use crate::api::reading::Reading;
use crate::api::real::{sqrt, within};
use crate::api::signals::{Estimate, Flags, Value};
use crate::api::snapshot::{Archive, State, state};
use crate::api::vehicle::Vehicle;
use crate::methods::method::{Found, Method};
use crate::methods::signal_source::SignalSource;
use crate::models::force_balance::MAX_GRADE_RAD;
use crate::runner::Pipeline;
use crate::{Real, Time};

/// A published method made a pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Published<T> {
    method: T,
    source: SignalSource,
    range_kg: [Real; 2],
}

impl<T> Published<T> {
    /// Gives `method` signals behind a low-pass of corner and sampling rate `rates_hz`.
    pub fn new(vehicle: &Vehicle, rates_hz: [Real; 2], method: T) -> Self {
        Self {
            method,
            source: SignalSource::new(vehicle, rates_hz),
            range_kg: vehicle.mass_range_kg,
        }
    }
}

impl<T: Method + fmt::Debug> Pipeline for Published<T> {
    const INTERNALS: &'static [Internal] = T::INTERNALS;

    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate {
        let input = self.source.step(reading, t, dt);
        self.method.step(&input.signals);
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
            value: input.filtered_speed_mps,
            sd: WHEEL_SPEED_SD_MPS,
            started: true,
        };
        let speed = answer.speed_mps.unwrap_or(by_wheels);
        let (innovation, nis) = answer.innovation;
        Estimate {
            t: input.t,
            total_mass_kg: mass,
            grade_rad: grade,
            effective_grade_rad: grade,
            speed_mps: Value::new(speed.value, speed.sd, input.signals.speed_mps.is_some()),
            innovation,
            nis,
            flags: Flags {
                moving: input.moving,
                excited: input.running && mass.valid,
                saturated: mass_cut || grade_cut,
            },
            ..Estimate::default()
        }
    }

    fn internal_values(&self, values: &mut [Real]) {
        self.method.internal_values(values);
    }

    fn visit(&mut self, archive: &mut Archive) {
        State::visit(self, archive);
    }
}

/// Mass of a method without a mass: a uniform distribution over the vehicle's range, not valid.
pub fn no_mass(vehicle: &Vehicle) -> Value {
    let [low, high] = vehicle.mass_range_kg;
    Value::new(0.5 * (low + high), (high - low) / sqrt(12.0), false)
}

/// Standard deviation of wheel speed for a method without one, m/s.
const WHEEL_SPEED_SD_MPS: Real = 0.01;

/// Cuts an estimate to a range; the second value is true if it was cut.
fn cut(found: Found, [low, high]: [Real; 2]) -> (Value, bool) {
    let inside = within(found.value, low, high);
    let limited = inside != found.value;
    let value = Value::new(inside, found.sd, found.started && !limited);
    (value, limited)
}

state!(@[T: State] Published<T> { method, source; range_kg });
