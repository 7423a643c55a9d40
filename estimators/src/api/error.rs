//! Why an estimator refuses an input. A refused input leaves the estimator as it was.

use core::fmt;

use crate::{Real, Time};

/// The refusal of one step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// The time step is not a number, not positive, or longer than a second.
    TimeStep(Real),
    /// The step's instant is not after the previous one.
    OutOfOrder {
        /// Instant of the refused step.
        t: Time,
        /// Instant of the step before it.
        last: Time,
    },
    /// The step's instant is further after the previous one than any pause: a wrong stamp. After a true pause, reset.
    TooFarAhead {
        /// Instant of the refused step.
        t: Time,
        /// Instant of the step before it.
        last: Time,
    },
    /// The time step is more than twice the time since the step before.
    ClockMismatch {
        /// The time step, s.
        dt: Real,
        /// Time since the step before by the stamps, s.
        since: Real,
    },
    /// A number of the named signal is NaN or infinite.
    NotFinite(&'static str),
    /// A number of the named signal is beyond what any crane can do.
    OutOfRange(&'static str),
    /// The step would have left the state without a finite value.
    Diverged,
}

impl fmt::Display for Error {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::TimeStep(dt) => write!(out, "time step {dt} s is not in 0…1 s"),
            Error::OutOfOrder { t, last } => {
                write!(out, "step at {t} s comes after one at {last} s")
            }
            Error::TooFarAhead { t, last } => write!(
                out,
                "step at {t} s comes too long after one at {last} s: a wrong stamp, or a pause that calls for a reset"
            ),
            Error::ClockMismatch { dt, since } => write!(
                out,
                "time step of {dt} s, but {since} s since the step before"
            ),
            Error::NotFinite(signal) => write!(out, "{signal} is not a finite number"),
            Error::OutOfRange(signal) => write!(out, "{signal} is beyond what a crane can do"),
            Error::Diverged => write!(out, "the step would leave the state without a finite value"),
        }
    }
}

impl core::error::Error for Error {}
