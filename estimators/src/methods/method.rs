//! Signals and answer of a published method.
//!
//! A published method is a file of equations ([`liu_2023`](crate::methods::liu_2023) and its siblings) that imports
//! filters, models and this file. [`Published`](crate::methods::published::Published) makes a pipeline of it.

use crate::Real;
use crate::api::estimator::Internal;
use crate::api::snapshot::State;
use crate::models::sample::ResampledSample;

/// The signals of one step.
#[derive(Clone, Copy, Debug)]
pub struct Signals {
    /// Speed of the wheels, m/s.
    pub speed_mps: Option<Real>,
    /// Speed of the wheels where a new sample of it has come, m/s.
    pub new_speed_mps: Option<Real>,
    /// Specific force along the vehicle, m/s².
    pub specific_force_mps2: Option<Real>,
    /// Specific force across the vehicle, m/s².
    pub lateral_force_mps2: Option<Real>,
    /// Yaw rate, rad/s.
    pub yaw_rate_radps: Option<Real>,
    /// Steering angle, rad.
    pub steering_angle_rad: Option<Real>,
    /// Traction at the rims less the drag of the air, N, while the force balance holds: moving, brake released, torque
    /// known.
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

/// Estimate of one quantity.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Its value.
    pub value: Real,
    /// Its standard deviation, same unit.
    pub sd: Real,
    /// True if measurements have changed it since the start.
    pub started: bool,
}

/// Estimates of a method.
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

    /// Its estimates.
    fn answer(&self) -> Answer;

    /// Its internal quantities, as many as fit.
    fn internal_values(&self, values: &mut [Real]);
}
