//! Checks of one step's input: every number finite and possible, the clock going forward.

use core::slice;

use crate::api::signals::{Command, MAX_DRIVES, Measurements, Sample};
use crate::api::snapshot::state;
use crate::{Error, Real, Time};

/// Longest pause between two steps, s. A stamp further ahead is a fault of the clock; taken, it would make every later
/// step late.
const MAX_PAUSE_S: Real = 60.0;

/// Latest instant: 285 years, which leaves room for clocks that count from 1970.
const MAX_TIME: Time = Time::from_ns(9_000_000_000_000_000_000);

/// Largest time step as a multiple of the time that has passed: the rest is jitter.
const MAX_DT_RATIO: Real = 2.0;

/// Input check of an estimator: refuses a step whose numbers are not finite, are beyond what a crane can do, or whose
/// clock does not go forward.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InputCheck {
    last: Option<Time>,
}

impl InputCheck {
    /// Checks one step's input and notes its instant; on an error nothing is changed. How the motor torques and wheel
    /// speeds have come: those of the first `drives` units, and those of the others.
    pub fn accept(
        &mut self,
        z: &Measurements,
        u: &Command,
        dt: Real,
        drives: usize,
    ) -> Result<[[Stamps; 2]; 2], Error> {
        self.clock(z.t, dt)?;
        let stamps = match all_possible(z, u, drives) {
            Some(stamps) => stamps,
            None => {
                numbers(z, u)?;
                [[Stamps::Differ; 2]; 2]
            }
        };
        self.last = Some(z.t);
        Ok(stamps)
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

/// Stamps of the samples of one channel of all drive units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stamps {
    /// None has.
    Missing,
    /// All have, with one stamp.
    Same(Time),
    /// Otherwise.
    Differ,
}

/// The newest stamp of samples that have come so, own and others.
#[inline]
pub fn newest(samples: &[Option<Sample<Real>>], came: [Stamps; 2]) -> Option<Time> {
    match came {
        [Stamps::Missing, Stamps::Missing] => None,
        [Stamps::Same(t), Stamps::Missing] => Some(t),
        _ => samples.iter().flatten().map(|s| s.t).max(),
    }
}

fn time_possible(t: Time) -> bool {
    (t <= MAX_TIME) & (t.ns() >= -MAX_TIME.ns())
}

// NaN is not below any limit.
fn within(value: Real, limit: Real) -> bool {
    value.abs() <= limit
}

/// Compares the stamps of the samples; `None` if a sample is not possible.
#[inline]
fn stamps(samples: &[Option<Sample<Real>>], limit: Real) -> Option<Stamps> {
    if missing(samples) {
        return Some(Stamps::Missing);
    }
    let first = samples.iter().flatten().next()?;
    let same = |s: &Sample<Real>| s.t == first.t && within(s.value, limit);
    if time_possible(first.t) && samples.iter().all(|s| s.as_ref().is_some_and(same)) {
        return Some(Stamps::Same(first.t));
    }
    let possible = |s: &Sample<Real>| time_possible(s.t) && within(s.value, limit);
    let all = samples.iter().flatten().all(possible);
    all.then_some(Stamps::Differ)
}

/// Returns true if there is no sample: eight at a time, as mostly there is none.
#[inline]
fn missing(samples: &[Option<Sample<Real>>]) -> bool {
    let (eights, rest) = samples.as_chunks::<8>();
    let some =
        |eight: &[Option<Sample<Real>>; 8]| eight.iter().fold(false, |any, s| any | s.is_some());
    !eights.iter().any(some) && rest.iter().all(Option::is_none)
}

/// Compares the stamps of motor torques and of wheel speeds; `None` if any number is not finite or not possible.
/// [`numbers`] finds which one.
#[inline]
fn all_possible(z: &Measurements, u: &Command, drives: usize) -> Option<[[Stamps; 2]; 2]> {
    let vector = |s: &Option<Sample<[Real; 3]>>, limit: Real| match s {
        Some(s) => (s.value.iter()).fold(time_possible(s.t), |ok, v| ok & within(*v, limit)),
        None => true,
    };
    let drives = drives.min(MAX_DRIVES);
    let (torques, more_torques) = z.motor_torque_nm.split_at(drives);
    let (speeds, more_speeds) = z.wheel_speed_mps.split_at(drives);
    let [own_torques, other_torques, own_speeds, other_speeds, _] = [
        stamps(torques, MAX_TORQUE_NM)?,
        stamps(more_torques, MAX_TORQUE_NM)?,
        stamps(speeds, MAX_SPEED_MPS)?,
        stamps(more_speeds, MAX_SPEED_MPS)?,
        stamps(slice::from_ref(&z.steering_angle_rad), MAX_STEERING_RAD)?,
    ];
    // Without early ends, so that comparisons run side by side.
    let commands = u.motor_torque_nm.iter();
    let rest = vector(&z.specific_force_mps2, MAX_FORCE_MPS2)
        & vector(&z.angular_rate_radps, MAX_RATE_RADPS)
        & commands.fold(true, |ok, torque| ok & within(*torque, MAX_TORQUE_NM))
        & within(u.brake, MAX_BRAKE);
    rest.then_some([[own_torques, other_torques], [own_speeds, other_speeds]])
}

/// Refuses the first number that is not finite, or not possible.
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

fn check(signal: &'static str, t: Time, values: &[Real], limit: Real) -> Result<(), Error> {
    possible(signal, t)?;
    if values.iter().any(|v| !v.is_finite()) {
        return Err(Error::NotFinite(signal));
    }
    if values.iter().any(|v| v.abs() > limit) {
        Err(Error::OutOfRange(signal))
    } else {
        Ok(())
    }
}

state!(InputCheck { last; });

#[cfg(test)]
mod tests {
    use super::*;

    fn with_speed(t_s: f64, value: Real) -> Measurements {
        let t = Time::from_s(t_s);
        let mut z = Measurements::at(t);
        z.wheel_speed_mps[0] = Some(Sample { t, value });
        z
    }

    #[test]
    fn bad_input_is_named_and_changes_nothing() {
        let (mut check, u) = (InputCheck::default(), Command::default());
        check.accept(&with_speed(1.0, 1.0), &u, 0.01, 8).unwrap();
        let before = check;
        let good = with_speed(2.0, 1.0);
        for dt in [0.0, -0.1, 2.0, Real::NAN, Real::INFINITY] {
            let refused = check.accept(&good, &u, dt, 8);
            assert!(matches!(refused, Err(Error::TimeStep(_))));
        }
        let at = |t_s: f64| with_speed(t_s, 1.0);
        for t_s in [1.0, 0.5, -1e9] {
            let refused = check.accept(&at(t_s), &u, 0.01, 8);
            assert!(matches!(refused, Err(Error::OutOfOrder { .. })));
        }
        for t_s in [f64::NAN, 1e10, -1e10] {
            let refused = check.accept(&at(t_s), &u, 0.01, 8);
            assert_eq!(refused, Err(Error::OutOfRange("time")));
        }
        let refused = check.accept(&at(61.1), &u, 0.01, 8);
        assert!(matches!(refused, Err(Error::TooFarAhead { .. })));
        let refused = check.accept(&at(1.004), &u, 0.01, 8);
        assert!(matches!(refused, Err(Error::ClockMismatch { .. })));
        for (value, error) in [
            (Real::NAN, Error::NotFinite("wheel speed")),
            (1e9, Error::OutOfRange("wheel speed")),
        ] {
            assert_eq!(
                check.accept(&with_speed(2.0, value), &u, 0.01, 8),
                Err(error)
            );
        }
        let z = Measurements {
            specific_force_mps2: Some(Sample {
                t: Time::from_s(2.0),
                value: [0.0, Real::INFINITY, 0.0],
            }),
            ..good
        };
        assert_eq!(
            check.accept(&z, &u, 0.01, 8),
            Err(Error::NotFinite("specific force"))
        );
        let brake = Command {
            brake: Real::NAN,
            ..u
        };
        assert_eq!(
            check.accept(&good, &brake, 0.01, 8),
            Err(Error::NotFinite("brake command"))
        );
        assert_eq!(check, before);
        check.accept(&good, &u, 0.01, 8).unwrap();
    }

    #[test]
    fn how_samples_have_come() {
        let (mut z, u) = (with_speed(1.0, 1.0), Command::default());
        let came = |z: &Measurements| InputCheck::default().accept(z, &u, 0.01, 2);
        let stamps = |z: &Measurements| came(z).map(|channels| channels.map(|[own, _]| own));
        assert_eq!(stamps(&z), Ok([Stamps::Missing, Stamps::Differ]));
        z.wheel_speed_mps[1] = z.wheel_speed_mps[0];
        assert_eq!(stamps(&z), Ok([Stamps::Missing, Stamps::Same(z.t)]));
        // A unit that the train does not have: it does not count, but must be possible.
        z.motor_torque_nm[2] = z.wheel_speed_mps[0];
        assert_eq!(stamps(&z), Ok([Stamps::Missing, Stamps::Same(z.t)]));
        let nan = Some(Sample {
            t: z.t,
            value: Real::NAN,
        });
        (z.motor_torque_nm[2], z.motor_torque_nm[0]) = (nan, z.wheel_speed_mps[0]);
        assert_eq!(stamps(&z), Err(Error::NotFinite("motor torque")));
        z.motor_torque_nm = [z.wheel_speed_mps[0]; MAX_DRIVES];
        z.motor_torque_nm[1] = Some(Sample {
            t: Time::from_s(0.9),
            value: 0.0,
        });
        assert_eq!(stamps(&z), Ok([Stamps::Differ, Stamps::Same(z.t)]));
    }

    #[test]
    fn the_limits_themselves_are_possible() {
        let u = Command::default();
        let at = |ns: i64| Measurements::at(Time::from_ns(ns));
        let second = 1_000_000_000;
        // A pause of a minute to the nanosecond of its rounding; twice the time that has passed.
        for (since, dt) in [(60 * second - 1, 0.01), (second / 4, 0.5)] {
            let mut check = InputCheck::default();
            check.accept(&at(second), &u, 0.01, 8).unwrap();
            assert_eq!(
                check.accept(&at(second + since), &u, dt, 8).map(drop),
                Ok(())
            );
            assert!(
                check
                    .accept(&at(second + since + 61 * second), &u, dt, 8)
                    .is_err()
            );
        }
        for ns in [MAX_TIME.ns(), -MAX_TIME.ns()] {
            assert_eq!(
                InputCheck::default().accept(&at(ns), &u, 1.0, 8).map(drop),
                Ok(())
            );
        }
        for value in [100.0, -100.0] {
            let z = with_speed(1.0, value);
            assert_eq!(
                InputCheck::default().accept(&z, &u, 0.01, 8).map(drop),
                Ok(())
            );
            let beyond = with_speed(1.0, 1.001 * value);
            assert!(InputCheck::default().accept(&beyond, &u, 0.01, 8).is_err());
        }
    }
}
