//! Range-checked numbers: checked while a file is read, so that an error has line, column and path.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Largest size of a number in a file; a larger number counts as a typing error.
const MAX_MAGNITUDE: f64 = 1e12;
/// Size below which a number other than zero counts as a typing error: a division by it has no physical meaning.
const MIN_MAGNITUDE: f64 = 1e-30;

macro_rules! checked {
    ($(#[$doc:meta])* $name:ident, $ok:expr, $right:literal, $schema:tt) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
        #[serde(try_from = "f64", into = "f64")]
        pub struct $name(f64);
        impl $name {
            /// The number.
            pub const fn get(self) -> f64 { self.0 }
            /// A number that the code guarantees to be right (defaults).
            pub const fn new(x: f64) -> Self { Self(x) }
        }
        impl TryFrom<f64> for $name {
            type Error = String;
            fn try_from(x: f64) -> Result<Self, String> {
                let ok: fn(f64) -> bool = $ok;
                finite(x, $right)?;
                if ok(x) { Ok(Self(x)) } else { Err(format!(concat!("{} is not ", $right, "; write ", $right), x)) }
            }
        }
        impl From<$name> for f64 {
            fn from(x: $name) -> f64 { x.0 }
        }
        impl JsonSchema for $name {
            fn schema_name() -> Cow<'static, str> { stringify!($name).into() }
            fn inline_schema() -> bool { true }
            fn json_schema(_: &mut SchemaGenerator) -> Schema { json_schema!($schema) }
        }
    };
}

fn finite(x: f64, right: &str) -> Result<(), String> {
    if !x.is_finite() {
        let what = if x.is_nan() {
            "not a number (NaN)"
        } else {
            "infinite"
        };
        Err(format!("this is {what}; write {right}"))
    } else if x.abs() > MAX_MAGNITUDE {
        Err(format!(
            "{x:e} is too large; write {right}, at most {MAX_MAGNITUDE:e}"
        ))
    } else if x != 0.0 && x.abs() < MIN_MAGNITUDE {
        Err(format!(
            "{x:e} is too small; write {right}, of a size of at least {MIN_MAGNITUDE:e}"
        ))
    } else {
        Ok(())
    }
}

checked!(
    /// A finite number.
    Finite, |_| true, "a finite number", { "type": "number", "minimum": -1e12, "maximum": 1e12 });
checked!(
    /// A finite number above zero.
    Positive, |x| x > 0.0, "a number above zero", { "type": "number", "exclusiveMinimum": 0, "maximum": 1e12 });
checked!(
    /// A finite number, zero or above.
    NonNegative, |x| x >= 0.0, "a number, zero or above", { "type": "number", "minimum": 0, "maximum": 1e12 });
checked!(
    /// A number from 0 to 1.
    Fraction, |x| (0.0..=1.0).contains(&x), "a number from 0 to 1", { "type": "number", "minimum": 0, "maximum": 1 });

macro_rules! zero {
    ($($name:ident),*) => {
        $(impl $name {
            /// 0.
            pub const ZERO: Self = Self::new(0.0);
        }
        impl Default for $name {
            fn default() -> Self { Self::ZERO }
        })*
    };
}
zero!(Finite, NonNegative, Fraction);

/// The key `version: 1` at the start of every file; any other version is refused.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "u32")]
pub struct Version1;

impl TryFrom<f64> for Version1 {
    type Error = String;
    fn try_from(version: f64) -> Result<Self, String> {
        if version == 1.0 {
            Ok(Self)
        } else {
            Err(format!(
                "this file has format version {version}, but this monorig reads only version 1; write `version: 1`, or use the monorig for which the file was written"
            ))
        }
    }
}

impl From<Version1> for u32 {
    fn from(_: Version1) -> u32 {
        1
    }
}

impl JsonSchema for Version1 {
    fn schema_name() -> Cow<'static, str> {
        "Version1".into()
    }
    fn inline_schema() -> bool {
        true
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "const": 1, "description": "Format version." })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_outside_their_range_are_refused() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e13, -1e13] {
            assert!(Finite::try_from(bad).is_err(), "{bad}");
            assert!(Positive::try_from(bad).is_err(), "{bad}");
            assert!(NonNegative::try_from(bad).is_err(), "{bad}");
            assert!(Fraction::try_from(bad).is_err(), "{bad}");
        }
        assert!(Positive::try_from(0.0).is_err() && Positive::try_from(1e-30).is_ok());
        for small in [f64::MIN_POSITIVE, 1e-320, -1e-31] {
            assert!(Finite::try_from(small).is_err(), "{small}");
        }
        assert!(NonNegative::try_from(0.0).is_ok() && NonNegative::try_from(-1e-9).is_err());
        assert!(Fraction::try_from(1.0).is_ok() && Fraction::try_from(1.000001).is_err());
        assert!(Finite::try_from(-1e12).is_ok());
    }

    #[test]
    fn only_version_one_is_read() {
        assert!(Version1::try_from(1.0).is_ok());
        for other in [0.0, 2.0, 1.5, f64::NAN] {
            assert!(Version1::try_from(other).is_err(), "{other}");
        }
    }
}
