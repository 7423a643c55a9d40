//! The front of a published method: what makes of the samples of a step the input of the method.
//!
//! No parameter of the method changes it but the low-pass's corner and rate. So a search for parameters runs it once
//! over a recording, and a trial runs the method alone on what it has made, with the same bits.

use crate::api::signals::{Command, Measurements};
use crate::api::snapshot::state;
use crate::api::vehicle::Vehicle;
use crate::methods::method::Signals;
use crate::models::force_balance::ForceBalance;
use crate::preprocess::front_end::{FrontEnd, Reading, motion};
use crate::preprocess::resampler::Resampler;
use crate::{Error, Real, Time};

/// Input of a published method in one step, and what its estimate takes of the signals besides.
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
    /// True if it does so under the force balance alone.
    pub(super) running: bool,
}

/// Turns readings into inputs of a published method: low-pass, force balance, direction of motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SignalSource {
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

    /// The input of one step of `dt` seconds.
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

/// The whole front of a published method: signal front end and source of its signals. Two that are equal make the same
/// of the same samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Front {
    pub(super) front_end: FrontEnd,
    pub(super) source: SignalSource,
}

impl Front {
    /// Checks one step's input and makes of it that of the method; on an error nothing is changed.
    pub fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<MethodInput, Error> {
        let reading = self.front_end.read(z, u, dt)?;
        Ok(self.source.step(&reading, z.t, dt))
    }
}
