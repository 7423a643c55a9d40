//! Parameters set by name: a number with unit and range, a flag, or a choice between words. Plain structs and tables of
//! keys, no serialisation library.

use core::fmt;

use crate::Real;
pub use crate::api::text::Name;

/// One parameter: what a program needs to check a value and to explain it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// Name in scenario files.
    pub name: &'static str,
    /// Description of the parameter, one sentence.
    pub doc: &'static str,
    /// Allowed values.
    pub kind: KeyKind,
}

/// Allowed values of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum KeyKind {
    /// A number.
    Number {
        /// Unit, `-` for none.
        unit: &'static str,
        /// Value when not set; `None` if the estimator then derives the value from the vehicle.
        default: Option<Real>,
        /// Smallest and largest value allowed.
        range: [Real; 2],
    },
    /// True or false.
    Flag {
        /// Value when not set.
        default: bool,
    },
    /// One of several words.
    Choice {
        /// Value when not set.
        default: &'static str,
        /// All words.
        choices: &'static [&'static str],
    },
}

/// A value for a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Setting<'a> {
    /// A number, in the unit of the key.
    Number(Real),
    /// True or false.
    Flag(bool),
    /// A word.
    Choice(&'a str),
}

impl From<f64> for Setting<'_> {
    fn from(number: f64) -> Self {
        Setting::Number(number as Real)
    }
}

impl From<f32> for Setting<'_> {
    fn from(number: f32) -> Self {
        Setting::Number(Real::from(number))
    }
}

impl From<bool> for Setting<'_> {
    fn from(flag: bool) -> Self {
        Setting::Flag(flag)
    }
}

impl<'a> From<&'a str> for Setting<'a> {
    fn from(word: &'a str) -> Self {
        Setting::Choice(word)
    }
}

impl fmt::Display for Setting<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Setting::Number(number) => write!(out, "{number}"),
            Setting::Flag(flag) => write!(out, "{flag}"),
            Setting::Choice(word) => write!(out, "{word}"),
        }
    }
}

impl Key {
    /// Value when not set; `None` if the estimator then derives the value from the vehicle.
    pub fn default(&self) -> Option<Setting<'static>> {
        match self.kind {
            KeyKind::Number { default, .. } => default.map(Setting::Number),
            KeyKind::Flag { default } => Some(Setting::Flag(default)),
            KeyKind::Choice { default, .. } => Some(Setting::Choice(default)),
        }
    }

    /// Smallest and largest value and the unit, of a number.
    pub fn number(&self) -> Option<([Real; 2], &'static str)> {
        match self.kind {
            KeyKind::Number { range, unit, .. } => Some((range, unit)),
            KeyKind::Flag { .. } | KeyKind::Choice { .. } => None,
        }
    }

    /// Checks that the parameter may have this value.
    pub fn check(&'static self, value: Setting) -> Result<(), ParamError> {
        match (self.kind, value) {
            (
                KeyKind::Number {
                    range: [low, high], ..
                },
                Setting::Number(number),
            ) => {
                if (low..=high).contains(&number) {
                    Ok(())
                } else {
                    Err(ParamError::OutOfRange(self, number))
                }
            }
            (KeyKind::Flag { .. }, Setting::Flag(_)) => Ok(()),
            (KeyKind::Choice { choices, .. }, Setting::Choice(word)) => {
                if choices.contains(&word) {
                    Ok(())
                } else {
                    Err(ParamError::NotAChoice(self, Name::new(word)))
                }
            }
            _ => Err(ParamError::OtherKind(self)),
        }
    }
}

/// Allowed values of a parameter, in words: `a number in 0…1 m/s`, `true or false`, `one of printed, corrected`.
impl fmt::Display for KeyKind {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            KeyKind::Number {
                unit: "-",
                range: [low, high],
                ..
            } => write!(out, "a number in {low}…{high}"),
            KeyKind::Number {
                unit,
                range: [low, high],
                ..
            } => write!(out, "a number in {low}…{high} {unit}"),
            KeyKind::Flag { .. } => write!(out, "true or false"),
            KeyKind::Choice { choices, .. } => {
                write!(out, "one of ")?;
                for (i, word) in choices.iter().enumerate() {
                    write!(out, "{}{word}", if i == 0 { "" } else { ", " })?;
                }
                Ok(())
            }
        }
    }
}

/// Reason why a parameter, or the vehicle, is refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ParamError {
    /// No estimator has this name; `registry::NAMES` lists all names.
    UnknownEstimator(Name),
    /// The estimator has no parameter of this name; `registry::keys` lists its parameters.
    UnknownKey(Name),
    /// The number is NaN or outside the range of the key.
    OutOfRange(&'static Key, Real),
    /// The word is not one of the key's choices.
    NotAChoice(&'static Key, Name),
    /// The key has another kind of value: a number, a flag or a word.
    OtherKind(&'static Key),
    /// The vehicle cannot be: the named field is not finite or not positive where it must be.
    Vehicle(&'static str),
}

impl fmt::Display for ParamError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ParamError::UnknownEstimator(name) => write!(out, "no estimator is called {name}"),
            ParamError::UnknownKey(name) => {
                write!(out, "the estimator has no parameter called {name}")
            }
            ParamError::OutOfRange(key, value) => {
                write!(
                    out,
                    "{} is {value} but must be {}: {}",
                    key.name, key.kind, key.doc
                )
            }
            ParamError::NotAChoice(key, word) => {
                write!(
                    out,
                    "{} is {word} but must be {}: {}",
                    key.name, key.kind, key.doc
                )
            }
            ParamError::OtherKind(key) => {
                write!(out, "{} must be {}: {}", key.name, key.kind, key.doc)
            }
            ParamError::Vehicle(field) => {
                write!(out, "{field} of the vehicle is not a usable number")
            }
        }
    }
}

impl core::error::Error for ParamError {}

/// The parameters of an estimator: set by name, listed for checks and documentation. Made by [`params!`](crate::params)
/// and [`param_groups!`](crate::param_groups).
pub trait Parameters: Default {
    /// All keys, group by group.
    const GROUPS: &'static [&'static [Key]];

    /// Sets one parameter by name, or refuses: unknown name, wrong kind of value, or out of range.
    fn set(&mut self, name: &str, value: Setting<'_>) -> Result<(), ParamError>;

    /// Value of a parameter; `None` if it is not set, or not known.
    fn get(&self, name: &str) -> Option<Setting<'static>>;

    /// The key of this name.
    fn key(name: &str) -> Option<&'static Key> {
        Self::GROUPS
            .iter()
            .copied()
            .flatten()
            .find(|key| key.name == name)
    }
}

/// Declares a group of parameters: struct, `Default` and [`Parameters`](crate::api::params::Parameters) from one list.
///
/// A field is a number with unit, default, range and a sentence; `none` in place of the default makes it an `Option`.
/// It is a flag with `[flag]`, and with `[choice T]` a choice, where `T` is made by [`choices!`](crate::choices).
///
/// ```
/// use monorig_estimators::api::params::{KeyKind, ParamError, Parameters, Setting};
///
/// monorig_estimators::choices! {
///     /// Which acceleration the filter uses.
///     Source {
///         /// That of the accelerometer.
///         SpecificForce = "specific_force",
///         /// That of the wheels.
///         Wheels = "wheels",
///     }
/// }
///
/// monorig_estimators::params! {
///     /// Parameters of my filter.
///     MyParams {
///         gain ["1/s"] = 0.5, 0.0 => 10.0, "Gain of the correction.";
///         mass0_kg ["kg"] = none, 1.0 => 1e6, "Mass at the start; not set: the middle of the vehicle's range.";
///         hold [flag] = true, "Hold the estimate while standing.";
///         source [choice Source] = Source::Wheels, "Where the acceleration comes from.";
///     }
/// }
///
/// let mut params = MyParams::default();
/// params.set("mass0_kg", Setting::Number(15e3))?;
/// params.set("source", Setting::Choice("specific_force"))?;
/// assert_eq!((params.mass0_kg, params.source), (Some(15e3), Source::SpecificForce));
///
/// assert!(matches!(params.set("gain", 11.0.into()), Err(ParamError::OutOfRange(key, _)) if key.name == "gain"));
/// assert!(matches!(params.set("gian", 1.0.into()), Err(ParamError::UnknownKey(name)) if name.as_str() == "gian"));
/// assert!(matches!(params.set("hold", 1.0.into()), Err(ParamError::OtherKind(_))));
/// assert_eq!(MyParams::key("hold").map(|key| key.kind), Some(KeyKind::Flag { default: true }));
/// # Ok::<(), ParamError>(())
/// ```
#[macro_export]
macro_rules! params {
    ($(#[$about:meta])* $name:ident { $($fields:tt)* }) => {
        $crate::params! { @field [$(#[$about])* $name] [] $($fields)* }
    };
    (@field $head:tt [$($done:tt)*] $field:ident [flag] = $default:expr, $doc:literal; $($rest:tt)*) => {
        $crate::params! { @field $head [$($done)* {
            $field, bool, $default, $doc,
            $crate::api::params::KeyKind::Flag { default: $default },
            (value) match value { $crate::api::params::Setting::Flag(flag) => Some(flag), _ => None },
            Some($crate::api::params::Setting::Flag(value))
        }] $($rest)* }
    };
    (@field $head:tt [$($done:tt)*] $field:ident [choice $choices:ident] = $default:expr, $doc:literal; $($rest:tt)*) => {
        $crate::params! { @field $head [$($done)* {
            $field, $choices, $default, $doc,
            $crate::api::params::KeyKind::Choice { default: $choices::word($default), choices: $choices::WORDS },
            (value) match value { $crate::api::params::Setting::Choice(word) => $choices::from_word(word), _ => None },
            Some($crate::api::params::Setting::Choice(value.word()))
        }] $($rest)* }
    };
    (@field $head:tt [$($done:tt)*] $field:ident [$unit:literal] = none, $low:expr => $high:expr, $doc:literal; $($rest:tt)*) => {
        $crate::params! { @field $head [$($done)* {
            $field, Option<$crate::Real>, None, $doc,
            $crate::api::params::KeyKind::Number { unit: $unit, default: None, range: [$low, $high] },
            (value) match value { $crate::api::params::Setting::Number(number) => Some(Some(number)), _ => None },
            value.map($crate::api::params::Setting::Number)
        }] $($rest)* }
    };
    (@field $head:tt [$($done:tt)*] $field:ident [$unit:literal] = $default:expr, $low:expr => $high:expr, $doc:literal; $($rest:tt)*) => {
        $crate::params! { @field $head [$($done)* {
            $field, $crate::Real, $default, $doc,
            $crate::api::params::KeyKind::Number { unit: $unit, default: Some($default), range: [$low, $high] },
            (value) match value { $crate::api::params::Setting::Number(number) => Some(number), _ => None },
            Some($crate::api::params::Setting::Number(value))
        }] $($rest)* }
    };
    (@field [$(#[$about:meta])* $name:ident]
        [$({ $field:ident, $type:ty, $default:expr, $doc:literal, $kind:expr, ($value:ident) $read:expr, $show:expr })*]) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name {
            $(#[doc = $doc] pub $field: $type,)*
        }

        impl $name {
            /// The parameters of this group.
            pub const KEYS: &'static [$crate::api::params::Key] = &[
                $($crate::api::params::Key { name: stringify!($field), doc: $doc, kind: $kind },)*
            ];
        }

        impl $crate::api::params::Parameters for $name {
            const GROUPS: &'static [&'static [$crate::api::params::Key]] = &[Self::KEYS];

            fn set(
                &mut self,
                name: &str,
                value: $crate::api::params::Setting<'_>,
            ) -> Result<(), $crate::api::params::ParamError> {
                let Some(key) = Self::KEYS.iter().find(|key| key.name == name) else {
                    return Err($crate::api::params::ParamError::UnknownKey($crate::api::params::Name::new(name)));
                };
                key.check(value)?;
                $(if name == stringify!($field) {
                    let $value = value;
                    if let Some(read) = $read {
                        self.$field = read;
                    }
                })*
                Ok(())
            }

            fn get(&self, name: &str) -> Option<$crate::api::params::Setting<'static>> {
                $(if name == stringify!($field) {
                    let $value = self.$field;
                    return $show;
                })*
                None
            }
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }
    };
}

/// Declares the words of a choice: an enum with its words, for [`params!`](crate::params).
#[macro_export]
macro_rules! choices {
    ($(#[$about:meta])* $name:ident { $($(#[$doc:meta])* $variant:ident = $word:literal,)* }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name {
            $($(#[$doc])* $variant,)*
        }

        impl $name {
            /// All words.
            pub const WORDS: &'static [&'static str] = &[$($word),*];

            /// All choices, in the order of the words.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// Word of the choice.
            pub const fn word(self) -> &'static str {
                match self {
                    $(Self::$variant => $word,)*
                }
            }

            /// The choice with this word.
            pub fn from_word(word: &str) -> Option<Self> {
                match word {
                    $($word => Some(Self::$variant),)*
                    _ => None,
                }
            }
        }
    };
}

/// Declares the parameters of a pipeline from groups made by [`params!`](crate::params).
#[macro_export]
macro_rules! param_groups {
    ($(#[$about:meta])* $name:ident { $($field:ident: $group:ident),* $(,)? }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $name {
            $(#[doc = concat!("Group [`", stringify!($group), "`].")] pub $field: $group,)*
        }

        impl $crate::api::params::Parameters for $name {
            const GROUPS: &'static [&'static [$crate::api::params::Key]] = &[$($group::KEYS),*];

            fn set(
                &mut self,
                name: &str,
                value: $crate::api::params::Setting<'_>,
            ) -> Result<(), $crate::api::params::ParamError> {
                $(if $group::KEYS.iter().any(|key| key.name == name) {
                    return $crate::api::params::Parameters::set(&mut self.$field, name, value);
                })*
                Err($crate::api::params::ParamError::UnknownKey($crate::api::params::Name::new(name)))
            }

            fn get(&self, name: &str) -> Option<$crate::api::params::Setting<'static>> {
                $(if $group::KEYS.iter().any(|key| key.name == name) {
                    return $crate::api::params::Parameters::get(&self.$field, name);
                })*
                None
            }
        }
    };
}

pub use crate::{choices, param_groups, params};
