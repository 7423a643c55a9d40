//! Plausibility of the instruments: the checks that find a wrong unit, sign or axis, which a filter would absorb into
//! its states.

use crate::Real;
use crate::api::reading::Reading;
use crate::api::snapshot::state;
use crate::detect::gravity_check::GravityCheck;
use crate::detect::kinematic_consistency::KinematicConsistency;
use crate::instruments::gyro_range::GyroRange;

/// Instruments that an estimate uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Instruments {
    /// Accelerometer.
    pub accelerometer: bool,
    /// Pitch gyro; yaw rates only widen or weigh and count as no use.
    pub gyro: bool,
    /// Pitch gyro that is left out after it has been found wrong.
    pub spare_gyro: bool,
}

/// The plausibility checks of one estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plausibility {
    on: bool,
    uses: Instruments,
    gravity: GravityCheck,
    gyro: GyroRange,
    kinematics: KinematicConsistency,
    /// True after the gyro has been found wrong.
    gyro_wrong: bool,
}

impl Plausibility {
    /// Checks of the instruments that an estimate `uses`, beside the wheels. If not `on`, all are plausible.
    pub fn new(on: bool, uses: Instruments) -> Self {
        Self {
            on,
            uses,
            gravity: GravityCheck::default(),
            gyro: GyroRange::default(),
            kinematics: KinematicConsistency::default(),
            gyro_wrong: false,
        }
    }

    /// Makes one step of `dt` seconds, with the rate of the grade, rad/s; returns true if the instruments are
    /// plausible.
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
            self.kinematics = self.kinematics.without_gyro();
        } else if !self.axes_are_right() {
            self.kinematics.doubt_slope();
        } else if self.kinematics.turns_otherwise() {
            self.gyro_wrong = true;
            self.kinematics.leave_gyro_out();
        }
    }

    /// Returns true until the gyro has shown a rate that is impossible, or disagrees with the slope by the
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
            self.gravity.observe([forward, left, up], dt);
            let across = left - speed * reading.yaw_rate_radps.unwrap_or(0.0);
            if self.gravity.plausible() {
                self.kinematics
                    .observe([forward, across], speed, grade_rate, dt);
            } else {
                // such forces would fill the filters for half a minute
                self.kinematics.interrupt();
            }
        } else {
            self.kinematics.interrupt();
        }
    }

    /// Returns true if no check contradicts the accelerometer alone.
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

state!(Plausibility { gravity, gyro, kinematics, gyro_wrong; on, uses });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::real::GRAVITY;
    use crate::testing::Random;

    /// Two seconds of a reading; whether it is plausible to an estimate that uses accelerometer or gyro.
    fn plausible(accelerometer: bool, gyro: bool, reading: &Reading) -> bool {
        let mut checks = Plausibility::new(
            true,
            Instruments {
                accelerometer,
                gyro,
                spare_gyro: false,
            },
        );
        (0..200).for_each(|_| checks.observe(reading, reading.pitch_rate_radps, 0.01));
        let mut off = Plausibility::new(
            false,
            Instruments {
                accelerometer,
                gyro,
                spare_gyro: false,
            },
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

    /// Returns true if the gyro is sound at the end of a [drive](driven) with one fault.
    fn gyro_is_kept(fault: Fault, wrong_s: core::ops::Range<Real>) -> bool {
        driven(120, &[(fault, wrong_s)]).gyro_is_sound()
    }

    /// Drives over hills of 0.1 rad, with a stop every 40 s. Each fault changes the reading for its time. Returns the
    /// checks at the end.
    fn driven(seconds: u16, faults: &[(Fault, core::ops::Range<Real>)]) -> Plausibility {
        let uses = Instruments {
            accelerometer: true,
            gyro: false,
            spare_gyro: true,
        };
        let mut checks = Plausibility::new(true, uses);
        let mut random = Random::new(5);
        let (dt, mut v, mut s): (Real, Real, Real) = (0.01, 0.0, 0.0);
        for k in 0..100 * seconds {
            let t = dt * Real::from(k);
            let wanted = if t % 40.0 < 4.0 { 0.0 } else { 1.0 };
            let a = ((wanted - v) / 0.3).clamp(-0.3, 0.3);
            (v, s) = (v + a * dt, s + v * dt);
            let (grade, bend) = (0.1 * (s / 4.0).sin(), 0.1 / 4.0 * (s / 4.0).cos());
            let mut noisy = |x: Real, sd: Real| Some(x + sd * random.normal());
            let mut reading = Reading {
                speed_mps: noisy(v, 0.002),
                specific_force_mps2: noisy(a + GRAVITY * grade.sin(), 0.02),
                lateral_force_mps2: noisy(0.0, 0.02),
                vertical_force_mps2: noisy(GRAVITY * grade.cos(), 0.02),
                pitch_rate_radps: noisy(bend * v, 0.001),
                yaw_rate_radps: Some(0.0),
                ..Reading::default()
            };
            for (fault, wrong_s) in faults {
                if wrong_s.contains(&t) {
                    fault(&mut reading);
                }
            }
            // a gyro that is left out measures no pitch rate
            let rate = reading.pitch_rate_radps;
            checks.step(&reading, rate.filter(|_| checks.gyro_is_sound()), dt);
        }
        checks
    }

    /// Change of a reading by a fault.
    type Fault = fn(&mut Reading);

    fn scale_force(z: &mut Reading, factor: Real) {
        let axes = [
            &mut z.specific_force_mps2,
            &mut z.lateral_force_mps2,
            &mut z.vertical_force_mps2,
        ];
        axes.into_iter().flatten().for_each(|f| *f *= factor);
    }

    /// The accelerometer or the wheels are wrong for a while, wherever on a hill that begins: it is not the gyro's
    /// fault.
    #[test]
    fn a_gyro_is_kept_while_another_instrument_is_wrong() {
        let faults: [(&str, Fault, &[Real]); 6] = [
            ("sign", |z| scale_force(z, -1.0), &[6.0, 20.0, 45.0]),
            ("in g", |z| scale_force(z, 1.0 / 9.81), &[6.0, 20.0, 45.0]),
            (
                "forward axis of the wrong sign",
                |z| z.specific_force_mps2 = z.specific_force_mps2.map(|f| -f),
                &[6.0, 12.6],
            ),
            (
                "forward and left exchanged",
                |z| core::mem::swap(&mut z.specific_force_mps2, &mut z.lateral_force_mps2),
                &[6.0, 20.0, 30.0],
            ),
            (
                "forward and up exchanged",
                |z| core::mem::swap(&mut z.specific_force_mps2, &mut z.vertical_force_mps2),
                &[6.0, 20.0, 45.0],
            ),
            (
                "wheels in km/h",
                |z| z.speed_mps = z.speed_mps.map(|v| 3.6 * v),
                &[6.0, 20.0, 45.0],
            ),
        ];
        for (name, fault, lengths) in faults {
            for for_s in lengths {
                for begin in 0..20 {
                    let from_s = 10.0 + 1.3 * Real::from(begin as f32);
                    let kept = gyro_is_kept(fault, from_s..from_s + for_s);
                    assert!(kept, "{name} from {from_s} s for {for_s} s");
                }
            }
        }
    }

    /// Axes of the accelerometer that were found exchanged stay so when the gyro is left out after a second in degrees.
    #[test]
    fn a_wrong_gyro_does_not_make_a_wrong_accelerometer_right() {
        let exchanged: Fault =
            |z| core::mem::swap(&mut z.specific_force_mps2, &mut z.lateral_force_mps2);
        let in_degrees: Fault =
            |z| z.pitch_rate_radps = z.pitch_rate_radps.map(|w| w * 180.0 / crate::api::real::PI);
        // before the stop at 80 s, which shows the axes without a gyro
        let mut checks = driven(78, &[(exchanged, 0.0..78.0), (in_degrees, 60.0..61.6)]);
        assert!(!checks.gyro_is_sound() && !checks.plausible());
        checks = driven(78, &[(in_degrees, 60.0..61.6)]);
        assert!(!checks.gyro_is_sound() && checks.plausible());
    }

    #[test]
    fn a_gyro_is_left_out_if_it_is_what_is_wrong() {
        let faults: [(&str, Fault); 2] = [
            ("dead", |z| z.pitch_rate_radps = Some(0.0)),
            ("sign", |z| {
                z.pitch_rate_radps = z.pitch_rate_radps.map(|w| -w)
            }),
        ];
        for (name, fault) in faults {
            for begin in 0..20 {
                let from_s = 1.0 + 2.0 * Real::from(begin as f32);
                assert!(
                    !gyro_is_kept(fault, from_s..120.0),
                    "{name} from {from_s} s"
                );
            }
        }
    }
}
