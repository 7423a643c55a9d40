//! Estimators and the plant as FMUs for co-simulation, FMI 2.0 and 3.0. One shared library serves both standards; a
//! file in the FMU says what it is.
//!
//! | file | what it holds |
//! |---|---|
//! | `part` | what an FMU holds, as that file says it |
//! | `export` | an estimator or a plant, made an FMU |
//! | `package` | an FMU put together |
//! | `description` | its `modelDescription.xml` |
//! | `variable` | a variable, and the values of all |
//! | `model/` | the estimator or the plant behind the variables |
//! | `instance` | an instance, whatever the standard |
//! | `two` `three` | the functions of FMI 2.0 and 3.0 |

#![allow(clippy::missing_safety_doc)] // the standards say what each pointer must be

mod description;
mod export;
mod instance;
mod model;
mod package;
mod part;
mod three;
mod two;
mod variable;

pub use export::{built, estimator, plant, vehicle};
pub use package::{Package, binary, library};

/// A version of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fmi {
    /// FMI 2.0.
    Two,
    /// FMI 3.0.
    Three,
}
