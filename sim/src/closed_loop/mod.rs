//! The closed loop: command → plant → truth → sensors → estimators → controller → observers.
//!
//! | file | what it holds |
//! |---|---|
//! | `run` | the loop, and the observers of it |
//! | `builder` | a scenario put together |
//! | `registry` | the estimators and controllers a scenario can name |
//! | `parts` | those that it names, checked and built |
//! | `estimators` | the estimators that run side by side |
//! | `events` | the events of a scenario, applied when they are due |
//! | `instruments` | the instruments of a scenario, fitted to its vehicle |
//! | `nominal_vehicle` | vehicle parameters given to estimators and controller |
//! | `obstacles` | the obstacles and walls of a scenario, placed beside the rail |

pub mod builder;
pub mod estimators;
pub mod events;
mod instruments;
mod nominal_vehicle;
pub mod obstacles;
mod parts;
pub mod registry;
pub mod run;
