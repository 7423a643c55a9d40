//! Instants.

use core::fmt;

use crate::Real;
use crate::api::snapshot::{Archive, Blank, State};

/// An instant, in whole nanoseconds since the start of the run or the origin of the clock; its range is ±290 years.
///
/// Whole numbers, so that a clock that has run for years still counts single steps, also on a controller with single
/// precision only.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Time(i64);

impl Time {
    /// From nanoseconds.
    pub const fn from_ns(ns: i64) -> Self {
        Self(ns)
    }

    /// From seconds, to the nearest nanosecond. NaN and what is beyond the ends become the latest or earliest instant,
    /// which no estimator takes.
    pub fn from_s(s: f64) -> Self {
        if s.is_nan() {
            return Self(i64::MAX);
        }
        Self(libm::round(s * 1e9) as i64)
    }

    /// In nanoseconds.
    pub const fn ns(self) -> i64 {
        self.0
    }

    /// In seconds.
    pub fn s(self) -> f64 {
        self.0 as f64 / 1e9
    }

    /// Seconds since an earlier instant; negative if it is later.
    pub fn since(self, earlier: Self) -> Real {
        self.0.saturating_sub(earlier.0) as Real * 1e-9
    }
}

/// Seconds with nine decimals.
impl fmt::Display for Time {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (sign, ns) = (if self.0 < 0 { "-" } else { "" }, self.0.unsigned_abs());
        let (whole, mut rest, mut digits) = (ns / 1_000_000_000, ns % 1_000_000_000, 9);
        while digits > 1 && rest % 10 == 0 {
            (rest, digits) = (rest / 10, digits - 1);
        }
        write!(out, "{sign}{whole}.{rest:0digits$}")
    }
}

impl State for Time {
    fn visit(&mut self, archive: &mut Archive) {
        self.0.visit(archive);
    }
}

impl Blank for Time {
    fn blank() -> Self {
        Self(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn a_clock_that_ran_for_two_hundred_years_counts_single_steps() {
        let years = Time::from_ns(200 * 31_557_600 * 1_000_000_000);
        let next = Time::from_ns(years.ns() + 5_000_000);
        assert!((next.since(years) - 0.005).abs() < 1e-9);
        assert!(next > years);
    }

    #[test]
    fn seconds_go_in_and_come_out() {
        for s in [0.0, 0.005, -3.25, 12_345.678_9] {
            assert_eq!(Time::from_s(s).s(), s);
        }
        assert_eq!(Time::from_s(f64::NAN), Time::from_s(f64::INFINITY));
        assert_eq!(Time::from_s(12.5).to_string(), "12.5");
        assert_eq!(Time::from_ns(-1).to_string(), "-0.000000001");
        assert_eq!(Time::from_s(3.0).to_string(), "3.0");
    }
}
