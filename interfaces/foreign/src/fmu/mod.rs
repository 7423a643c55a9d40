//! Estimators and controllers that are FMUs for co-simulation, FMI 2.0 and 3.0. A scenario names one by
//! `fmu: ./mine.fmu`; it is then checked, built and run as ours are.
//!
//! | file | what it holds |
//! |---|---|
//! | `package` | an FMU: unpacked, checked, its functions |
//! | `description` | what its `modelDescription.xml` says |
//! | `ports` | its variables for our inputs and outputs |
//! | `calls` `log.c` | the functions of both standards, and an instance |
//! | `running` | an instance in a run |
//! | `estimator` `controller` | what it is in the loop |

mod calls;
mod controller;
mod description;
mod estimator;
mod package;
mod ports;
mod running;

pub(crate) use controller::controller_of;
pub(crate) use estimator::estimator_of;

#[cfg(unix)]
pub(crate) use package::{FOLDER, unpack_in};
