//! Parameters that a scenario sets by name: a table of keys, plain structs, no serialisation library.

use core::fmt;

use crate::Real;

/// One parameter: what a rig needs to check a value and to explain it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// Name in scenario files.
    pub name: &'static str,
    /// Unit, `-` for none.
    pub unit: &'static str,
    /// Value when not set.
    pub default: Real,
    /// Smallest and largest value allowed.
    pub range: [Real; 2],
    /// What it is, one sentence.
    pub doc: &'static str,
}

/// Why a parameter is refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParamError {
    /// No estimator has this name; `registry::NAMES` lists those there are.
    UnknownEstimator,
    /// The estimator has no parameter of that name; `registry::keys` lists those it has.
    UnknownKey,
    /// The value is NaN or outside the range of the key.
    OutOfRange(&'static Key),
    /// What the vehicle is said to be cannot be: the named field is not finite or not positive where it must be.
    Vehicle(&'static str),
}

impl fmt::Display for ParamError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ParamError::UnknownEstimator => write!(out, "no estimator of this name"),
            ParamError::UnknownKey => write!(out, "the estimator has no parameter of this name"),
            ParamError::OutOfRange(key) => {
                let [low, high] = key.range;
                write!(
                    out,
                    "{} must be in {low}…{high} {}: {}",
                    key.name, key.unit, key.doc
                )
            }
            ParamError::Vehicle(field) => {
                write!(out, "{field} of the vehicle is not a usable number")
            }
        }
    }
}

impl core::error::Error for ParamError {}

/// Declares a group of parameters: struct, `Default`, key table and `set`, from one list.
macro_rules! params {
    ($(#[$about:meta])* $name:ident { $($field:ident [$unit:literal] = $default:expr, $low:expr => $high:expr, $doc:literal;)* }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name {
            $(#[doc = concat!($doc, " Unit: ", $unit, ".")] pub $field: $crate::Real,)*
        }

        impl $name {
            /// The parameters of this group.
            pub const KEYS: &'static [$crate::api::params::Key] = &[
                $($crate::api::params::Key {
                    name: stringify!($field), unit: $unit, default: $default, range: [$low, $high], doc: $doc,
                },)*
            ];

            /// Sets one parameter. `Ok(false)` if it is not of this group.
            pub fn set(&mut self, name: &str, value: $crate::Real) -> Result<bool, $crate::api::params::ParamError> {
                let Some(key) = Self::KEYS.iter().find(|key| key.name == name) else { return Ok(false) };
                let [low, high] = key.range;
                if !(low..=high).contains(&value) {
                    return Err($crate::api::params::ParamError::OutOfRange(key));
                }
                $(if name == stringify!($field) { self.$field = value; })*
                Ok(true)
            }
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }
    };
}

/// Declares the parameters of a pipeline: groups made by [`params!`], with the table of all their keys and one `set`.
macro_rules! param_groups {
    ($(#[$about:meta])* $name:ident { $($field:ident: $group:ident),* }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $name {
            $(#[doc = concat!("Group [`", stringify!($group), "`].")] pub $field: $group,)*
        }

        impl $name {
            /// All keys, group by group.
            pub const KEYS: &'static [&'static [$crate::api::params::Key]] = &[$($group::KEYS),*];

            /// Sets one parameter by name.
            pub fn set(&mut self, name: &str, value: $crate::Real) -> Result<(), $crate::api::params::ParamError> {
                $(if self.$field.set(name, value)? { return Ok(()); })*
                Err($crate::api::params::ParamError::UnknownKey)
            }
        }
    };
}

pub(crate) use {param_groups, params};
