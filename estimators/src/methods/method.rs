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
    /// Speed of the wheels if a new sample has come, m/s.
    pub new_speed_mps: Option<Real>,
    /// Specific force along the vehicle, m/s².
    pub specific_force_mps2: Option<Real>,
    /// Specific force across the vehicle, m/s².
    pub lateral_force_mps2: Option<Real>,
    /// Yaw rate, rad/s.
    pub yaw_rate_radps: Option<Real>,
    /// Steering angle, rad.
    pub steering_angle_rad: Option<Real>,
    /// Traction at the wheel rims minus air drag, N, while the force balance holds: moving, brake released, torque
    /// known.
    pub traction_n: Option<Real>,
    /// Air drag, N, that was subtracted.
    pub drag_n: Real,
    /// Sign of the speed, ±1.
    pub direction: Real,
    /// Speed, torque and accelerometer after one low-pass, if a sample is due and the force balance holds.
    pub sample: Option<ResampledSample>,
    /// Acceleration of the wheels v̇ after this low-pass, m/s².
    pub acceleration_mps2: Real,
    /// Length of the step, s.
    pub dt: Real,
}

/// Estimate of one quantity.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Its value.
    pub value: Real,
    /// Standard deviation, in the same unit.
    pub sd: Real,
    /// True if measurements have changed it since the start.
    pub started: bool,
}

/// Estimates of a method.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    /// Total mass, kg; `None` for a method without a mass.
    pub mass_kg: Option<Found>,
    /// Grade angle, rad.
    pub grade_rad: Found,
    /// Speed, m/s; `None` for a method that uses the wheels' speed.
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
