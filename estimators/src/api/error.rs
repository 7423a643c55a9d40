//! Reasons why an estimator refuses an input. A refused input leaves the estimator as it was, a step that diverges
//! starts it anew; a broken one cannot go on.

use core::fmt;

pub use crate::api::text::Reason;
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
        /// Instant of the previous step.
        last: Time,
    },
    /// The step's instant is further after the previous one than any pause: a wrong stamp. After a true pause, reset.
    TooFarAhead {
        /// Instant of the refused step.
        t: Time,
        /// Instant of the previous step.
        last: Time,
    },
    /// The time step is more than twice the time since the previous step.
    ClockMismatch {
        /// The time step, s.
        dt: Real,
        /// Time since the previous step by the stamps, s.
        since: Real,
    },
    /// A number of the named signal is NaN or infinite.
    NotFinite(&'static str),
    /// A number of the named signal is impossible for a crane.
    OutOfRange(&'static str),
    /// The step has led to a value that is not finite: the estimator has started anew, as after `reset`.
    Diverged,
    /// A reason of your own estimator: this step is refused, and the estimator is as it was.
    Own(Reason),
    /// A reason why your own estimator cannot go on: the run ends here.
    Broken(Reason),
}

impl Error {
    /// Refusal of a step for your own reason, of which the first 96 bytes are kept.
    pub fn own(reason: impl fmt::Display) -> Self {
        Self::Own(Reason::of(reason))
    }

    /// End of an estimator for your own reason, of which the first 96 bytes are kept.
    pub fn broken(reason: impl fmt::Display) -> Self {
        Self::Broken(Reason::of(reason))
    }
}

impl fmt::Display for Error {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::TimeStep(dt) => write!(out, "the time step {dt} s is not in 0…1 s"),
            Error::OutOfOrder { t, last } => {
                write!(out, "the step at {t} s comes after a step at {last} s")
            }
            Error::TooFarAhead { t, last } => write!(
                out,
                "the step at {t} s comes too long after the step at {last} s: its stamp is wrong, or the pause needs a reset"
            ),
            Error::ClockMismatch { dt, since } => write!(
                out,
                "the time step is {dt} s, but the previous step was {since} s ago"
            ),
            Error::NotFinite(signal) => write!(out, "{signal} is not a finite number"),
            Error::OutOfRange(signal) => {
                write!(out, "{signal} has a value that is impossible for a crane")
            }
            Error::Diverged => write!(
                out,
                "the step gave a value that is not finite: the estimator has started again"
            ),
            Error::Own(reason) | Error::Broken(reason) => write!(out, "{reason}"),
        }
    }
}

impl core::error::Error for Error {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Estimate;
    use std::string::ToString;

    /// A step returns this by value: a reason in it may not make it longer than an estimate.
    #[test]
    fn a_reason_costs_a_step_nothing() {
        let longest = size_of::<Estimate>().max(128);
        assert!(size_of::<Result<Estimate, Error>>() <= longest);
        let told = Error::own(format_args!("no fix for {} s", 2.5));
        assert_eq!(told.to_string(), "no fix for 2.5 s");
    }
}
