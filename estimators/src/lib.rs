//! Estimators of the load mass of a monorail crane, a train or a car, and of the grade under it, from motor torque,
//! wheel speed and an IMU.
//!
//! `no_std`, no allocation, no panic, no NaN; the same bits on every machine. In single precision it is the package
//! `monorig-estimators-f32`.
//!
//! # Quick start
//!
//! ```
//! use monorig_estimators::supervised::liu_2023::dffrls_aekf_robust;
//! use monorig_estimators::{Command, Estimator, Measurements, Runner, Sample, Time, Vehicle, VehicleData};
//!
//! let vehicle = Vehicle::new(VehicleData {
//!     tare_kg: 4_000.0,
//!     drives: 1,
//!     wheel_radius_m: 0.17,
//!     gear_ratio: 20.0,
//!     efficiency: 0.9,
//!     running_resistance: 0.02,
//!     mass_range_kg: [4_000.0, 30_000.0],
//!     ..VehicleData::default()
//! })?;
//! let params = dffrls_aekf_robust::Params::default();
//! let mut estimator = Runner::new("dffrls_aekf_robust", dffrls_aekf_robust::new, &vehicle, &params);
//!
//! for step in 1..=2_000 {
//!     let t = Time::from_ns(5_000_000 * step);
//!     let (v, a) = (0.5 + 0.002 * step as f64 * 0.005, 0.002);
//!     let force = 12_000.0 * (a + 0.02 * 9.81);
//!     let mut z = Measurements::at(t);
//!     z.wheel_speed_mps[0] = Some(Sample { t, value: v });
//!     z.motor_torque_nm[0] = Some(Sample { t, value: force * 0.17 / (20.0 * 0.9) });
//!     z.specific_force_mps2 = Some(Sample { t, value: [a, 0.0, 9.81] });
//!     let estimate = estimator.step(&z, &Command::default(), 0.005)?;
//!     assert!(estimate.grade_rad.value.is_finite() && estimate.total_mass_kg.sd > 0.0);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! By name, with parameters from a file: [`registry::build`]. An estimator of your own: [`Estimator`], with parameters
//! of [`params!`].
//!
//! # Map
//!
//! | module | holds |
//! |---|---|
//! | [`api`] | what crosses the border: signals, vehicle, trait, parameters, errors, snapshots, time |
//! | [`filters`] | algorithms, one a file; none depends on the vehicle |
//! | [`instruments`] | checks of single instruments: stuck, spikes, staleness, range, noise, innovation gate |
//! | [`preprocess`] | from samples to signals: input check, sample and hold, wheel-speed vote, resampler |
//! | [`models`] | attitude of a body with an IMU, force balance, bends, slope force, swing of the load |
//! | [`aiding`] | measurements of a state that many instruments see, one a file, and the one way to fuse them |
//! | [`rail`] | the rail as it was read, and the train on it |
//! | [`detect`] | detectors, gates, the validity rule |
//! | [`methods`] | published methods with their errata corrected: equations, one file a source |
//! | `printed` | the same letter by letter, errata and all (feature `printed`) |
//! | [`supervised`] | a published method under supervision, as the example |
//! | [`fusion`] | our own: attitude filter, swing balance, `rail_fusion` |
//! | [`runner`] | an estimator made of a pipeline: checks, snapshots, a new start after a step that diverges |
//! | [`registry`] | all of them by name (feature `registry`) |
//!
//! Each source has a cargo feature of its own (`liu2023`, `huainan`, `guo2024`, `patent`, `resistance`, `rail_fusion`,
//! `baseline`, `bench`).
//!
//! # Notation
//!
//! Filter code uses the letters of the books:
//!
//! | `x` `P` | `F` `H` | `Q` `R` | `y` `S` `K` | `lambda` | `theta` |
//! |---|---|---|---|---|---|
//! | state, covariance | Jacobians of transition and measurement | process and measurement noise | innovation, its covariance, gain | forgetting factor | grade angle, rad, + uphill towards growing chainage |
#![no_std]
#![forbid(unsafe_code)]
#![allow(non_snake_case)]
// A build with some of the sources leaves shared parts unused.
#![cfg_attr(
    not(all(
        feature = "liu2023",
        feature = "huainan",
        feature = "guo2024",
        feature = "patent",
        feature = "resistance",
        feature = "rail_fusion",
        feature = "baseline"
    )),
    allow(dead_code)
)]
#![cfg_attr(single_precision, allow(clippy::excessive_precision))] // constants are written out for both scalars
#![cfg_attr(
    not(test),
    deny(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing,
        clippy::unreachable
    )
)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

#[cfg(test)]
extern crate std;

#[macro_use]
mod variants;

pub(crate) mod aiding;
pub mod api;
pub(crate) mod detect;
pub mod filters;
pub mod fusion;
pub(crate) mod instruments;
pub mod methods;
pub mod models;
pub mod preprocess;
#[cfg(feature = "printed")]
pub mod printed;
pub(crate) mod rail;
#[cfg(feature = "registry")]
pub mod registry;
pub mod runner;
pub mod supervised;
mod tuning;

#[cfg(test)]
mod behaviour;
#[cfg(test)]
mod testing;

pub use api::aid::AidStatus;
pub use api::error::Error;
pub use api::estimator::{Estimator, Internal};
pub use api::params::{ParamError, Parameters, Setting};
pub use api::real::Real;
pub use api::signals::{Command, Estimate, Measurements, Sample, Value};
pub use api::snapshot::SnapshotError;
pub use api::time::Time;
pub use api::vehicle::{Vehicle, VehicleData};
pub use nalgebra;
pub use runner::Runner;
