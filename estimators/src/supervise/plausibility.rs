//! Plausibility of the instruments: the checks that find a wrong unit, sign or axis, which a filter would absorb into its states.

use crate::Real;
use crate::api::snapshot::state;
use crate::preprocess::front_end::Reading;
use crate::supervise::gravity_check::GravityCheck;
use crate::supervise::gyro_range::GyroRange;
use crate::supervise::kinematic_consistency::KinematicConsistency;

/// What an estimate rests on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Instruments {
    /// Accelerometer.
    pub accelerometer: bool,
    /// Pitch gyro; yaw rates only widen or weigh and count as no use.
    pub gyro: bool,
}

/// The plausibility checks of one estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plausibility {
    on: bool,
    uses: Instruments,
    standstill_mps: Real,
    gravity: GravityCheck,
    gyro: GyroRange,
    kinematics: KinematicConsistency,
}

impl Plausibility {
    /// Checks of the instruments that an estimate `uses`, beside the wheels. If not `on`, all are plausible.
    pub fn new(on: bool, uses: Instruments, standstill_mps: Real) -> Self {
        Self {
            on,
            uses,
            standstill_mps,
            gravity: GravityCheck::default(),
            gyro: GyroRange::default(),
            kinematics: KinematicConsistency::default(),
        }
    }

    /// One step of `dt` seconds.
    pub fn observe(&mut self, reading: &Reading, dt: Real) {
        let Some(speed) = reading.speed_mps.filter(|_| self.on) else {
            return;
        };
        let rates = reading.pitch_rate_radps.zip(reading.yaw_rate_radps);
        if let Some((pitch, yaw)) = rates {
            self.gyro.observe([pitch, yaw], speed, dt);
        }
        let across = reading.lateral_force_mps2.zip(reading.vertical_force_mps2);
        if let Some((forward, (left, up))) = reading.specific_force_mps2.zip(across) {
            let standing = speed.abs() < self.standstill_mps;
            self.gravity.observe([forward, left, up], standing, dt);
            self.kinematics
                .observe(forward, speed, reading.pitch_rate_radps, dt);
        }
    }

    /// Whether the wheels, and the instruments used beside them, can be what they are taken for. Wheels and accelerometer are found against
    /// each other: which of the two is wrong is not asked, and an estimate without the accelerometer is marked too.
    pub fn plausible(&self) -> bool {
        if !self.on {
            return true;
        }
        let wheels = self.kinematics.acceleration_consistent();
        let accelerometer = !self.uses.accelerometer || self.gravity.plausible();
        let gyro = !self.uses.gyro || (self.gyro.plausible() && self.kinematics.slope_consistent());
        wheels && accelerometer && gyro
    }
}

state!(Plausibility { gravity, gyro, kinematics; on, uses, standstill_mps });
