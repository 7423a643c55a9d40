//! Stamps: whole nanoseconds, read from text without a detour over floating point.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Nanoseconds of a second.
pub const NS: i64 = 1_000_000_000;

/// Unit of a column of time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum TimeUnit {
    /// Seconds.
    #[default]
    #[serde(rename = "s")]
    Seconds,
    /// Milliseconds.
    #[serde(rename = "ms")]
    Milliseconds,
    /// Microseconds.
    #[serde(rename = "us")]
    Microseconds,
    /// Nanoseconds.
    #[serde(rename = "ns")]
    Nanoseconds,
    /// Date and time as ISO 8601, such as `2023-11-14T22:13:20.125Z`; without a zone it is taken as UTC.
    #[serde(rename = "iso8601")]
    Iso8601,
}

impl TimeUnit {
    /// Digits behind the point that a nanosecond has in this unit; none for dates.
    fn digits(self) -> Option<u32> {
        match self {
            Self::Seconds => Some(9),
            Self::Milliseconds => Some(6),
            Self::Microseconds => Some(3),
            Self::Nanoseconds => Some(0),
            Self::Iso8601 => None,
        }
    }

    /// A stamp from text, ns; decimals beyond the nanosecond are rounded half away from zero.
    pub fn parse(self, text: &str) -> Option<i64> {
        match self.digits() {
            Some(digits) => decimal(text.trim(), digits),
            None => iso8601(text.trim()),
        }
    }

    /// A stamp from a number, ns, rounded to the nearest.
    pub fn of_f64(self, x: f64) -> Option<i64> {
        let ns = (x * 10f64.powi(self.digits()? as i32)).round();
        (ns.abs() < 9.2e18).then_some(ns as i64)
    }

    /// A stamp from a whole number, ns.
    pub fn of_i64(self, x: i64) -> Option<i64> {
        x.checked_mul(10i64.pow(self.digits()?))
    }
}

/// A decimal number times 10^`digits`, rounded to a whole one.
fn decimal(text: &str, digits: u32) -> Option<i64> {
    let (negative, rest) = match text.as_bytes().first()? {
        b'-' => (true, text.get(1..)?),
        b'+' => (false, text.get(1..)?),
        _ => (false, text),
    };
    let (mantissa, exponent) = match rest.split_once(['e', 'E']) {
        Some((m, e)) => (m, e.parse::<i32>().ok()?),
        None => (rest, 0),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    if whole.len() + fraction.len() == 0 || whole.len() + fraction.len() > 36 {
        return None;
    }
    let mut number: i128 = 0;
    for c in whole.bytes().chain(fraction.bytes()) {
        if !c.is_ascii_digit() {
            return None;
        }
        number = number * 10 + i128::from(c - b'0');
    }
    let shift = digits as i32 + exponent.clamp(-60, 60) - fraction.len() as i32;
    let value = match shift {
        0.. => number.checked_mul(10i128.checked_pow(shift as u32)?)?,
        _ => match 10i128.checked_pow(shift.unsigned_abs()) {
            Some(by) => (number + by / 2) / by,
            None => 0,
        },
    };
    i64::try_from(if negative { -value } else { value }).ok()
}

/// Nanoseconds since 1970 of a date and time.
fn iso8601(text: &str) -> Option<i64> {
    let number = |from: usize, to: usize| -> Option<i64> {
        let digits = text.get(from..to)?;
        digits.bytes().all(|b| b.is_ascii_digit()).then_some(())?;
        digits.parse().ok()
    };
    let mark =
        |at: usize, any: &str| any.contains(text.as_bytes().get(at).map_or('?', |b| *b as char));
    let separated =
        mark(4, "-") && mark(7, "-") && mark(10, "T ") && mark(13, ":") && mark(16, ":");
    separated.then_some(())?;
    let (year, month, day) = (number(0, 4)?, number(5, 7)?, number(8, 10)?);
    let (hour, minute) = (number(11, 13)?, number(14, 16)?);
    let tail = text.get(17..)?;
    let zone_at = tail.find(['Z', 'z', '+', '-']).unwrap_or(tail.len());
    let (seconds, zone) = tail.split_at(zone_at);
    let seconds_ns = decimal(&seconds.replace(',', "."), 9)?;
    let zone_min = match zone {
        "" | "Z" | "z" => 0,
        _ => {
            let hours: i64 = zone.get(1..3)?.parse().ok()?;
            let rest = zone.get(3..)?.trim_start_matches(':');
            let minutes: i64 = if rest.is_empty() {
                0
            } else {
                rest.parse().ok()?
            };
            (hours * 60 + minutes) * if zone.starts_with('-') { -1 } else { 1 }
        }
    };
    let possible = (1..=12).contains(&month) && (1..=31).contains(&day) && hour < 24 && minute < 60;
    possible.then_some(())?;
    // days since 1970 by the civil calendar (Hinnant 2014, days_from_civil)
    let y = if month <= 2 { year - 1 } else { year };
    let era = y.div_euclid(400);
    let of_era = y.rem_euclid(400);
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let days = era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468;
    let minutes = (days * 24 + hour) * 60 + minute - zone_min;
    minutes.checked_mul(60 * NS)?.checked_add(seconds_ns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_read_to_the_nanosecond() {
        let s = |text| TimeUnit::Seconds.parse(text);
        assert_eq!(s("1700000000.123456789"), Some(1_700_000_000_123_456_789));
        assert_eq!(s("-0.5"), Some(-500_000_000));
        assert_eq!(s("1e-3"), Some(1_000_000));
        assert_eq!(s("1.5E2"), Some(150 * NS));
        assert_eq!(s("0.0000000015"), Some(2));
        assert_eq!(TimeUnit::Milliseconds.parse("12.5"), Some(12_500_000));
        assert_eq!(
            TimeUnit::Nanoseconds.parse("1700000000123456789"),
            Some(1_700_000_000_123_456_789)
        );
        for bad in [
            "",
            "-",
            "x",
            "1.2.3",
            "1e99",
            "99999999999999999999",
            "nan",
            "1e",
        ] {
            assert_eq!(s(bad), None, "{bad}");
        }
    }

    /// `date -u -d @1700000000 --iso-8601=seconds` says 2023-11-14T22:13:20+00:00.
    #[test]
    fn dates_are_those_of_the_calendar() {
        let d = |text| TimeUnit::Iso8601.parse(text);
        assert_eq!(d("2023-11-14T22:13:20Z"), Some(1_700_000_000 * NS));
        assert_eq!(
            d("2023-11-14 22:13:20.5"),
            Some(1_700_000_000 * NS + NS / 2)
        );
        assert_eq!(
            d("2023-11-15T00:13:20,25+02:00"),
            Some(1_700_000_000 * NS + NS / 4)
        );
        assert_eq!(d("1970-01-01T00:00:00Z"), Some(0));
        assert_eq!(d("2000-02-29T00:00:00Z"), Some(951_782_400 * NS));
        for bad in [
            "2023-13-14T22:13:20Z",
            "2023-11-14",
            "14.11.2023 22:13:20",
            "",
        ] {
            assert_eq!(d(bad), None, "{bad}");
        }
    }
}
