//! Stamps: whole nanoseconds, read from text without a detour over floating point.

use chrono::format::{self, Item, Parsed, StrftimeItems, parse_and_remainder};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;

/// Nanoseconds of a second.
pub(crate) const NS: i64 = 1_000_000_000;

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
    /// Date and time as ISO 8601, such as `2023-11-14T22:13:20.125Z`; without a zone it is taken as UTC. Also
    /// `14.11.2023 22:13:20`, `2023/11/14 22:13:20`, `14-Nov-2023 22:13:20`, and a time of day alone.
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

    /// A stamp from text, ns; decimals beyond the nanosecond are rounded half away from zero, and cut off in a date.
    pub(crate) fn parse(self, text: &str) -> Option<i64> {
        match self.digits() {
            Some(digits) => decimal(text.trim(), digits),
            None => iso8601(text.trim()),
        }
    }

    /// A stamp from a number, ns, rounded to the nearest.
    pub(crate) fn of_f64(self, x: f64) -> Option<i64> {
        let ns = (x * 10f64.powi(self.digits()? as i32)).round();
        (ns.abs() < 9.2e18).then_some(ns as i64)
    }

    /// A stamp from a whole number, ns.
    pub(crate) fn of_i64(self, x: i64) -> Option<i64> {
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

/// Parts of a date and time as chrono takes them.
type Items = LazyLock<Vec<Item<'static>>>;
/// Dates before a time of day: ISO 8601, and what loggers write besides. Day and month are never guessed.
static DATES: LazyLock<[Vec<Item<'static>>; 4]> = LazyLock::new(|| {
    ["%Y-%m-%d", "%d.%m.%Y", "%Y/%m/%d", "%d-%b-%Y"].map(|date| StrftimeItems::new(date).collect())
});
static TIME: Items = LazyLock::new(|| StrftimeItems::new("T%H:%M:%S%.f").collect());
static ZONE: Items = LazyLock::new(|| StrftimeItems::new("%#z").collect());

/// Nanoseconds since 1970 of a date and time; `T` or a space between the two, a point or a comma before the decimals.
fn iso8601(text: &str) -> Option<i64> {
    let text = text.replacen(' ', "T", 1).replace(',', ".");
    // a time of day alone is one of the first day
    let text = match text.as_bytes().get(2) {
        Some(b':') => format!("1970-01-01T{text}"),
        _ => text,
    };
    let dated = |date: &Vec<Item<'static>>| {
        let mut parsed = Parsed::new();
        let time = parse_and_remainder(&mut parsed, &text, date.iter()).ok()?;
        Some((parsed, time))
    };
    let (mut parsed, time) = DATES.iter().find_map(dated)?;
    match parse_and_remainder(&mut parsed, time, TIME.iter()).ok()? {
        "" => {
            parsed.set_offset(0).ok()?;
        }
        zone => format::parse(&mut parsed, zone, ZONE.iter()).ok()?,
    }
    parsed.to_datetime().ok()?.timestamp_nanos_opt()
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

    /// `date -u -d @1700000000 --iso-8601=seconds` prints 2023-11-14T22:13:20+00:00.
    #[test]
    fn dates_are_those_of_the_calendar() {
        let d = |text: &str| TimeUnit::Iso8601.parse(text);
        assert_eq!(d("2023-11-14T22:13:20Z"), Some(1_700_000_000 * NS));
        assert_eq!(
            d("2023-11-14 22:13:20.5"),
            Some(1_700_000_000 * NS + NS / 2)
        );
        assert_eq!(
            d("2023-11-15T00:13:20,25+02:00"),
            Some(1_700_000_000 * NS + NS / 4)
        );
        for other in [
            "14.11.2023 22:13:20",
            "2023/11/14 22:13:20",
            "14-Nov-2023 22:13:20",
        ] {
            assert_eq!(d(other), Some(1_700_000_000 * NS), "{other}");
        }
        assert_eq!(d("01:00:00.5"), Some(3600 * NS + NS / 2));
        for zone in ["+0200", "+02"] {
            let there = d(&format!("2023-11-15 00:13:20.000000001{zone}"));
            assert_eq!(there, Some(1_700_000_000 * NS + 1), "{zone}");
        }
        assert_eq!(d("1970-01-01T00:00:00Z"), Some(0));
        assert_eq!(d("2000-02-29T00:00:00Z"), Some(951_782_400 * NS));
        for bad in [
            "2023-13-14T22:13:20Z",
            "2023-02-30T22:13:20Z",
            "2023-11-14",
            "14.11.23 22:13:20",
            "11/14/2023 22:13:20",
            "22:13",
            "",
        ] {
            assert_eq!(d(bad), None, "{bad}");
        }
    }
}
