//! monorig-sim: truth → sensors → estimators → controller, a closed loop around a simulated vehicle.
//!
//! ```
//! use monorig_sim::{DriveCycle, Rail, Recorder, Settings, Sheet, Simulation, StepFrame, Train};
//!
//! let mut sim = Simulation::builder(
//!     Rail::load("../assets/tracks/liu2023_section1.yaml".as_ref())?,
//!     Train::load("../assets/trains/dx80_176y.yaml".as_ref())?,
//! )
//! .sensors(Sheet::load("../assets/sensors/liu2023.yaml".as_ref())?)
//! .load_mass_kg(10e3)
//! .drive_cycle(DriveCycle::by_time(&[(0.0, 0.0), (4.0, 1.0)])?)
//! .registered_estimator("tuned", Settings::of_type("dffrls_aekf_robust").set("delta", 0.9))
//! .in_loop("tuned")
//! .stop_after_s(10.0)
//! .build(1)?;
//! let (mut fastest, folder) = (0.0_f64, std::env::temp_dir().join("monorig-first-page"));
//! let mut watch = |frame: &StepFrame<'_>| fastest = fastest.max(frame.truth.speed_mps);
//! sim.run(&mut [&mut Recorder::parquet(folder)?, &mut watch])?;
//! assert!(sim.plant.truth().t_s > 9.99 && (0.9..1.2).contains(&fastest));
//! # Ok::<(), monorig_sim::Error>(())
//! ```
//!
//! A scenario file does the same: `Simulation::from_file("scenarios/minimal.yaml")?.build(1)?`. Estimators,
//! controllers, plants, instruments and observers of another crate are boxes that the builder takes, or types that it
//! adds to a [`Registry`] under a name that scenarios can use.
//!
//! | module | what it holds |
//! |---|---|
//! | [`checked`] | numbers whose range is checked while a file is read |
//! | [`config`] | the files of a scenario: YAML, URDF, CSV and STL, read and checked |
//! | [`rail`] | geometry of the rail |
//! | [`train`] | data model of the train: bodies, connections, drives |
//! | [`plant`] | what moves: rigid bodies in rapier, a point mass; out comes the truth |
//! | [`road`] | a car on a road, for experiments on road vehicles: one more plant |
//! | [`sensors`] | instruments: truth in, samples with errors and faults out |
//! | [`control`] | drive cycle, perception, speed controller |
//! | [`closed_loop`] | the loop itself, and how it is built from a scenario |
//! | [`guarded`] | foreign code, whose panics are errors |
//! | [`interrupt`] | the wish to end, such as Ctrl-C |
//! | [`lines`] | lines of bounded length |
//! | [`record`] | channels of a run, written to and read from files |

pub mod checked;
pub mod closed_loop;
pub mod config;
pub mod control;
pub mod error;
mod fading;
pub mod guarded;
pub mod interrupt;
pub mod lines;
pub mod plant;
pub mod rail;
pub mod record;
pub mod road;
pub mod sensors;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
pub mod train;

pub use closed_loop::registry::Registry;
pub use closed_loop::{Observer, Outcome, Simulation, SimulationBuilder, StepFrame};
pub use config::scenario::{DriveCycle, Event, Scenario, Settings};
pub use config::sensor_sheet::Sheet;
pub use control::{Controller, ControllerSetup, Perception, Reference};
pub use error::Error;
pub use plant::{Plant, Truth};
pub use rail::Rail;
pub use record::Recorder;
pub use sensors::Instrument;
pub use train::Train;
