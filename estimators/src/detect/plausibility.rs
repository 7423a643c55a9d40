//! Plausibility of the instruments: the checks that find a wrong unit, sign or axis, which a filter would absorb into
//! its states.

use crate::Real;
use crate::api::snapshot::state;
use crate::detect::gravity_check::GravityCheck;
use crate::detect::gyro_range::GyroRange;
use crate::detect::kinematic_consistency::KinematicConsistency;
use crate::preprocess::front_end::Reading;

/// Instruments that an estimate uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Instruments {
    /// Accelerometer.
    pub accelerometer: bool,
    /// Pitch gyro; yaw rates only widen or weigh and count as no use.
    pub gyro: bool,
    /// Pitch gyro that is left out once it has been found to be wrong.
    pub spare_gyro: bool,
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
    /// True once the gyro has been found to be wrong.
    gyro_wrong: bool,
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
            gyro_wrong: false,
        }
    }

    /// One step of `dt` seconds, with the rate of the grade, rad/s; whether the instruments are plausible.
    pub fn step(&mut self, reading: &Reading, grade_rate: Option<Real>, dt: Real) -> bool {
        self.observe(reading, grade_rate, dt);
        if self.uses.spare_gyro && !self.gyro_wrong {
            self.judge_gyro();
        }
        self.plausible()
    }

    fn judge_gyro(&mut self) {
        if !self.gyro.plausible() {
            self.gyro_wrong = true;
            // nothing that such rates have been compared with counts
            self.kinematics = KinematicConsistency::default();
        } else if !self.axes_are_right() {
            self.kinematics.doubt_slope();
        } else if self.kinematics.turns_otherwise() {
            self.gyro_wrong = true;
            self.kinematics.leave_gyro_out();
        }
    }

    /// Returns true until the gyro has turned faster than a vehicle can, or otherwise than the slope by the
    /// accelerometer: a wrong unit, sign or axis stays.
    pub fn gyro_is_sound(&self) -> bool {
        !self.gyro_wrong
    }

    fn observe(&mut self, reading: &Reading, grade_rate: Option<Real>, dt: Real) {
        let Some(speed) = reading.speed_mps.filter(|_| self.on) else {
            self.kinematics.interrupt();
            return;
        };
        let rates = grade_rate.zip(reading.yaw_rate_radps);
        if let Some((pitch, yaw)) = rates {
            self.gyro.observe([pitch, yaw], speed, dt);
        }
        let across = reading.lateral_force_mps2.zip(reading.vertical_force_mps2);
        if let Some((forward, (left, up))) = reading.specific_force_mps2.zip(across) {
            let standing = speed.abs() < self.standstill_mps;
            self.gravity.observe([forward, left, up], standing, dt);
            let across = left - speed * reading.yaw_rate_radps.unwrap_or(0.0);
            self.kinematics
                .observe([forward, across], speed, grade_rate, dt);
        } else {
            self.kinematics.interrupt();
        }
    }

    /// Returns true if nothing speaks against the accelerometer alone.
    fn axes_are_right(&self) -> bool {
        self.gravity.plausible() && !self.kinematics.axes_swapped()
    }

    /// Returns true if the wheels, and the instruments used beside them, are plausible. Wheels and accelerometer are
    /// compared with each other. The comparison does not show which of the two is wrong, so an estimate without the
    /// accelerometer is marked too.
    fn plausible(&self) -> bool {
        if !self.on {
            return true;
        }
        let wheels = self.kinematics.acceleration_consistent();
        let accelerometer = !self.uses.accelerometer || self.axes_are_right();
        let gyro = !self.uses.gyro || (self.gyro.plausible() && self.kinematics.slope_consistent());
        wheels && accelerometer && gyro
    }
}

state!(Plausibility { gravity, gyro, kinematics, gyro_wrong; on, uses, standstill_mps });

#[cfg(test)]
mod tests {
    use super::*;

    /// Two seconds of a reading; whether it is plausible to an estimate that uses accelerometer or gyro.
    fn plausible(accelerometer: bool, gyro: bool, reading: &Reading) -> bool {
        let mut checks = Plausibility::new(
            true,
            Instruments {
                accelerometer,
                gyro,
                spare_gyro: false,
            },
            0.05,
        );
        (0..200).for_each(|_| checks.observe(reading, reading.pitch_rate_radps, 0.01));
        let mut off = Plausibility::new(
            false,
            Instruments {
                accelerometer,
                gyro,
                spare_gyro: false,
            },
            0.05,
        );
        (0..200).for_each(|_| off.observe(reading, reading.pitch_rate_radps, 0.01));
        assert!(off.plausible());
        checks.plausible()
    }

    fn level(up_mps2: Real, speed_mps: Real, pitch_rate_radps: Real) -> Reading {
        Reading {
            speed_mps: Some(speed_mps),
            specific_force_mps2: Some(0.0),
            lateral_force_mps2: Some(0.0),
            vertical_force_mps2: Some(up_mps2),
            pitch_rate_radps: Some(pitch_rate_radps),
            yaw_rate_radps: Some(0.0),
            ..Reading::default()
        }
    }

    #[test]
    fn an_instrument_that_is_not_used_ends_nothing() {
        let (fine, in_g, in_deg) = (
            level(9.81, 1.0, 0.0),
            level(1.0, 1.0, 0.0),
            level(9.81, 1.0, 2.0),
        );
        for accelerometer in [false, true] {
            for gyro in [false, true] {
                assert!(plausible(accelerometer, gyro, &fine));
                assert_eq!(plausible(accelerometer, gyro, &in_g), !accelerometer);
                assert_eq!(plausible(accelerometer, gyro, &in_deg), !gyro);
            }
        }
    }

    /// 7 % beside g: too much standing, and little enough moving.
    #[test]
    fn it_stands_below_the_standstill_speed() {
        for (speed, fine) in [(0.0, false), (0.04, false), (-0.04, false), (0.06, true)] {
            assert_eq!(
                plausible(true, false, &level(9.1, speed, 0.0)),
                fine,
                "{speed}"
            );
        }
    }
}
