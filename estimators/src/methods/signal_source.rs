//! First stage of a published method: makes of the reading of a step the input of the method. No parameter of the
//! method changes it but the low-pass's corner and rate.

use crate::api::reading::Reading;
use crate::api::snapshot::state;
use crate::api::vehicle::Vehicle;
use crate::methods::method::Signals;
use crate::models::force_balance::ForceBalance;
use crate::preprocess::front_end::motion;
use crate::preprocess::resampler::Resampler;
use crate::{Real, Time};

/// Input of a published method in one step, and further signals for its estimate.
#[derive(Clone, Copy, Debug)]
pub struct MethodInput {
    /// Instant of the step.
    pub(super) t: Time,
    /// Signals of the method.
    pub(super) signals: Signals,
    /// Speed of the wheels behind the low-pass, m/s.
    pub(super) filtered_speed_mps: Real,
    /// True if the vehicle moves.
    pub(super) moving: bool,
    /// True if the vehicle moves under the force balance alone.
    pub(super) running: bool,
}

/// Turns readings into inputs of a published method: low-pass, force balance, direction of motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignalSource {
    balance: ForceBalance,
    resampler: Resampler,
    standstill_mps: Real,
    direction: Real,
}

impl SignalSource {
    /// Signals behind a low-pass of corner `cutoff_hz`, sampled at `rate_hz`.
    pub(super) fn new(vehicle: &Vehicle, [cutoff_hz, rate_hz]: [Real; 2]) -> Self {
        Self {
            balance: ForceBalance::new(vehicle),
            resampler: Resampler::new(cutoff_hz, rate_hz, 0.0),
            standstill_mps: vehicle.standstill_mps(None),
            direction: 1.0,
        }
    }
}

impl SignalSource {
    /// The input of one step at the instant `t` after `dt` seconds.
    #[inline]
    pub(super) fn step(&mut self, reading: &Reading, t: Time, dt: Real) -> MethodInput {
        let (moving, running) = motion(reading, self.standstill_mps);
        let sample = self.resampler.step(reading, &self.balance, running, dt);
        if moving && let Some(v) = reading.speed_mps {
            self.direction = if v < 0.0 { -1.0 } else { 1.0 };
        }
        let drive = reading.motor_torque_nm.zip(reading.speed_mps);
        MethodInput {
            t,
            signals: Signals {
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
                acceleration_mps2: self.resampler.acceleration_mps2(),
                dt,
            },
            filtered_speed_mps: self.resampler.speed_mps(),
            moving,
            running,
        }
    }
}

state!(SignalSource { resampler, direction; balance, standstill_mps });
