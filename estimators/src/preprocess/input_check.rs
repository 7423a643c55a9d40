//! Checks of one step's input: every number finite and possible, the clock going forward.

use crate::api::signals::{Command, Measurements};
use crate::api::snapshot::state;
use crate::{Error, Real, Time};

/// Longest pause between two steps, s. A stamp further ahead is a fault of the clock; taken, it would make every later
/// step late.
const MAX_PAUSE_S: Real = 60.0;

/// Latest instant: 285 years, which leaves room for clocks that count from 1970.
const MAX_TIME: Time = Time::from_ns(9_000_000_000_000_000_000);

/// Largest time step as a multiple of the elapsed time: the rest is jitter.
const MAX_DT_RATIO: Real = 2.0;

/// Input check of an estimator: refuses a step whose numbers are not finite, are beyond what a crane can do, or whose
/// clock does not go forward.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InputCheck {
    last: Option<Time>,
}

impl InputCheck {
    /// Checks one step's input and notes its instant; on an error nothing is changed.
    pub fn accept(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<(), Error> {
        self.clock(z.t, dt)?;
        numbers(z, u)?;
        self.last = Some(z.t);
        Ok(())
    }

    fn clock(&self, t: Time, dt: Real) -> Result<(), Error> {
        if !(dt > 0.0 && dt <= 1.0) {
            return Err(Error::TimeStep(dt));
        }
        possible("time", t)?;
        let Some(last) = self.last else {
            return Ok(());
        };
        let since = t.since(last);
        if t <= last {
            Err(Error::OutOfOrder { t, last })
        } else if since > MAX_PAUSE_S {
            Err(Error::TooFarAhead { t, last })
        } else if dt > MAX_DT_RATIO * since {
            Err(Error::ClockMismatch { dt, since })
        } else {
            Ok(())
        }
    }
}

#[inline]
fn possible(signal: &'static str, t: Time) -> Result<(), Error> {
    if t > MAX_TIME || t.ns() < -MAX_TIME.ns() {
        return Err(Error::OutOfRange(signal));
    }
    Ok(())
}

/// Largest size of each signal, in its unit.
const MAX_FORCE_MPS2: Real = 1e3;
const MAX_RATE_RADPS: Real = 1e3;
const MAX_TORQUE_NM: Real = 1e5;
const MAX_SPEED_MPS: Real = 1e2;
const MAX_STEERING_RAD: Real = 1e1;
const MAX_BRAKE: Real = 1e2;

/// Refuses the first number that is not finite or is impossible.
fn numbers(z: &Measurements, u: &Command) -> Result<(), Error> {
    for s in z.specific_force_mps2.iter() {
        check("specific force", s.t, &s.value, MAX_FORCE_MPS2)?;
    }
    for s in z.angular_rate_radps.iter() {
        check("angular rate", s.t, &s.value, MAX_RATE_RADPS)?;
    }
    for s in z.motor_torque_nm.iter().flatten() {
        check("motor torque", s.t, &[s.value], MAX_TORQUE_NM)?;
    }
    for s in z.wheel_speed_mps.iter().flatten() {
        check("wheel speed", s.t, &[s.value], MAX_SPEED_MPS)?;
    }
    for s in z.steering_angle_rad.iter() {
        check("steering angle", s.t, &[s.value], MAX_STEERING_RAD)?;
    }
    check(
        "torque command",
        Time::default(),
        &u.motor_torque_nm,
        MAX_TORQUE_NM,
    )?;
    check("brake command", Time::default(), &[u.brake], MAX_BRAKE)
}

#[inline]
fn check(signal: &'static str, t: Time, values: &[Real], limit: Real) -> Result<(), Error> {
    possible(signal, t)?;
    // NaN is not below any limit. Without early ends, so that comparisons run side by side.
    if values.iter().fold(true, |ok, v| ok & (v.abs() <= limit)) {
        Ok(())
    } else if values.iter().any(|v| !v.is_finite()) {
        Err(Error::NotFinite(signal))
    } else {
        Err(Error::OutOfRange(signal))
    }
}

state!(InputCheck { last; });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::signals::Sample;

    fn with_speed(t_s: f64, value: Real) -> Measurements {
        let t = Time::from_s(t_s);
        let mut z = Measurements::at(t);
        z.wheel_speed_mps[0] = Some(Sample { t, value });
        z
    }

    #[test]
    fn bad_input_is_named_and_changes_nothing() {
        let (mut check, u) = (InputCheck::default(), Command::default());
        check.accept(&with_speed(1.0, 1.0), &u, 0.01).unwrap();
        let before = check;
        let good = with_speed(2.0, 1.0);
        for dt in [0.0, -0.1, 2.0, Real::NAN, Real::INFINITY] {
            let refused = check.accept(&good, &u, dt);
            assert!(matches!(refused, Err(Error::TimeStep(_))));
        }
        let at = |t_s: f64| with_speed(t_s, 1.0);
        for t_s in [1.0, 0.5, -1e9] {
            let refused = check.accept(&at(t_s), &u, 0.01);
            assert!(matches!(refused, Err(Error::OutOfOrder { .. })));
        }
        for t_s in [f64::NAN, 1e10, -1e10] {
            let refused = check.accept(&at(t_s), &u, 0.01);
            assert_eq!(refused, Err(Error::OutOfRange("time")));
        }
        let refused = check.accept(&at(61.1), &u, 0.01);
        assert!(matches!(refused, Err(Error::TooFarAhead { .. })));
        let refused = check.accept(&at(1.004), &u, 0.01);
        assert!(matches!(refused, Err(Error::ClockMismatch { .. })));
        for (value, error) in [
            (Real::NAN, Error::NotFinite("wheel speed")),
            (1e9, Error::OutOfRange("wheel speed")),
        ] {
            assert_eq!(check.accept(&with_speed(2.0, value), &u, 0.01), Err(error));
        }
        let z = Measurements {
            specific_force_mps2: Some(Sample {
                t: Time::from_s(2.0),
                value: [0.0, Real::INFINITY, 0.0],
            }),
            ..good
        };
        assert_eq!(
            check.accept(&z, &u, 0.01),
            Err(Error::NotFinite("specific force"))
        );
        let brake = Command {
            brake: Real::NAN,
            ..u
        };
        assert_eq!(
            check.accept(&good, &brake, 0.01),
            Err(Error::NotFinite("brake command"))
        );
        assert_eq!(check, before);
        check.accept(&good, &u, 0.01).unwrap();
    }

    #[test]
    fn the_limits_themselves_are_possible() {
        let u = Command::default();
        let at = |ns: i64| Measurements::at(Time::from_ns(ns));
        let second = 1_000_000_000;
        // A pause of a minute to the nanosecond of its rounding; twice the time that has passed.
        for (since, dt) in [(60 * second - 1, 0.01), (second / 4, 0.5)] {
            let mut check = InputCheck::default();
            check.accept(&at(second), &u, 0.01).unwrap();
            assert_eq!(check.accept(&at(second + since), &u, dt), Ok(()));
            assert!(
                check
                    .accept(&at(second + since + 61 * second), &u, dt)
                    .is_err()
            );
        }
        for ns in [MAX_TIME.ns(), -MAX_TIME.ns()] {
            assert_eq!(InputCheck::default().accept(&at(ns), &u, 1.0), Ok(()));
        }
        for value in [100.0, -100.0] {
            let z = with_speed(1.0, value);
            assert_eq!(InputCheck::default().accept(&z, &u, 0.01), Ok(()));
            let beyond = with_speed(1.0, 1.001 * value);
            assert!(InputCheck::default().accept(&beyond, &u, 0.01).is_err());
        }
    }
}
