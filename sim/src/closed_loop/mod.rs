//! The closed loop: command → plant → truth → sensors → estimators → controller → observers.
//!
//! | file | what it holds |
//! |---|---|
//! | `run` | the loop |
//! | `simulation` | what a simulation ready to run consists of |
//! | `builder` | what it is built from: a scenario, or code |
//! | `registry` | the estimators and controllers that a scenario can name |
//! | `assemble` `checks` `parts` | from builder to simulation: put together, checked, estimators and controller built |
//! | `recorded` | a recorded drive in the loop |
//! | `resolved` | a scenario with all defaults written out |
//! | `estimators` | an estimator in a run |
//! | `answers` | counts of the answers of an estimator outside of the program |
//! | `observer` | what is shown to recorders and metrics after each step |
//! | `instruments` | the instruments of a scenario, fitted to its vehicle |
//! | `events` | the events of a scenario, applied when they are due |
//! | `end` | when a run ends, and how |
//! | `mass_layout` | where the masses sit, for estimators that use more than spans |
//! | `moving` | a train or a car |
//! | `nominal_vehicle` | vehicle parameters given to estimators and controller |
//! | `told` | what of them is drawn about the truth |
//! | `interned` | names kept as long as the program |
//! | `obstacles` | the obstacles and walls of a scenario, placed beside the rail |

mod answers;
mod assemble;
pub mod builder;
mod checks;
mod end;
pub mod estimators;
pub(crate) mod events;
mod instruments;
mod interned;
mod mass_layout;
mod moving;
mod nominal_vehicle;
mod observer;
pub(crate) mod obstacles;
mod parts;
pub mod recorded;
pub mod registry;
mod resolved;
pub mod run;
mod simulation;
mod step_plant;
mod told;
mod wall_clock;

pub use answers::{AnswerCounter, AnswerCounts};
pub use builder::SimulationBuilder;
pub use end::Outcome;
pub use interned::interned;
pub use observer::{Observer, StepFrame};
pub use registry::Registry;
pub use resolved::resolved;
pub use run::run;
pub use simulation::Simulation;
pub use told::tolerances;
pub use wall_clock::WallClock;
