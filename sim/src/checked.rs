//! Numbers that are what they say: checked while a file is read, so that an error has line, column and path.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Beyond this size a number in a file is taken for a slip of the pen.
const HUGE: f64 = 1e12;

macro_rules! checked {
    ($(#[$doc:meta])* $name:ident, $ok:expr, $right:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize, JsonSchema)]
        #[serde(try_from = "f64", into = "f64")]
        pub struct $name(f64);
        impl $name {
            /// The number.
            pub const fn get(self) -> f64 { self.0 }
            /// A number known to be right when the code is written (defaults).
            pub(crate) const fn new(x: f64) -> Self { Self(x) }
        }
        impl TryFrom<f64> for $name {
            type Error = String;
            fn try_from(x: f64) -> Result<Self, String> {
                let ok: fn(f64) -> bool = $ok;
                if x.is_finite() && x.abs() <= HUGE && ok(x) { Ok(Self(x)) } else { Err(format!(concat!("{} is not ", $right), x)) }
            }
        }
        impl From<$name> for f64 {
            fn from(x: $name) -> f64 { x.0 }
        }
    };
}

checked!(
    /// A finite number.
    Finite, |_| true, "a finite number");
checked!(
    /// A finite number above zero.
    Positive, |x| x > 0.0, "a finite number above zero");
checked!(
    /// A finite number, zero or above.
    NonNegative, |x| x >= 0.0, "a finite number, zero or above");
checked!(
    /// A number from 0 to 1.
    Fraction, |x| (0.0..=1.0).contains(&x), "a number from 0 to 1");

impl Finite {
    /// 0.
    pub const ZERO: Self = Self::new(0.0);
}
