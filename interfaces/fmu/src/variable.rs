//! A variable of an FMU. Its value is a number, whatever its type; its reference is its place, counted from 1.

/// Reference of the time, which FMI 3.0 has among the variables.
pub(crate) const TIME: u32 = 0;

/// Type of a variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    /// A number.
    Real,
    /// A whole number.
    Integer,
    /// 0 or 1.
    Boolean,
    /// One word of several, by its number counted from 1.
    Word(&'static [&'static str]),
}

/// Part that a variable plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Causality {
    /// Set before each step.
    Input,
    /// Written by each step.
    Output,
    /// Set before the first step.
    Parameter,
}

/// A variable of an FMU.
#[derive(Clone, Debug)]
pub(crate) struct Variable {
    pub name: String,
    pub kind: Kind,
    pub causality: Causality,
    /// Unit of a number; `1` for none.
    pub unit: &'static str,
    /// Value at the start; NaN of a parameter that the estimator then derives itself.
    pub start: f64,
    /// Least and largest value.
    pub range: Option<[f64; 2]>,
    pub about: String,
}

impl Variable {
    pub fn input(name: String, unit: &'static str, about: &str) -> Self {
        Self {
            name,
            kind: Kind::Real,
            causality: Causality::Input,
            unit,
            start: 0.0,
            range: None,
            about: about.to_owned(),
        }
    }

    pub fn output(name: impl Into<String>, unit: &'static str, about: &str) -> Self {
        Self {
            causality: Causality::Output,
            ..Self::input(name.into(), unit, about)
        }
    }

    pub fn flag(name: impl Into<String>, about: &str) -> Self {
        Self {
            kind: Kind::Boolean,
            ..Self::output(name, "1", about)
        }
    }
}

/// 1 for yes, 0 for no.
pub(crate) fn number(flag: bool) -> f64 {
    f64::from(u8::from(flag))
}
