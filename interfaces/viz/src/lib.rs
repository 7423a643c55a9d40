//! monorig-viz: a run as a Rerun recording, in a file and, if wished, in a viewer while it runs.
//!
//! The only crate that names Rerun types. The simulator hands it plain columns through
//! [`Sink`](monorig_sim::record::Sink); what is where:
//!
//! | entity | what |
//! |---|---|
//! | `world/track/…`, `world/obstacles` | rail (swept I-beam), boxes beside it |
//! | `world/train/<body>/<link>` | train; the body's entity carries its pose |
//! | `world/links/…` | drawbars and chains |
//! | `truth/… sensors/… estimates/… internals/… control/… bound/…` | one entity a channel, by its path |
//! | `world/ground` | roadway with a line every 10 m |
//! | `world/track/chainage`, `world/track/zones` | marks, stretches where an event acts |
//! | `world/event` | the latest event, where the train was |
//! | `plan/…` | the track from above, and the train on it |
//! | `display/<channel>` | made for the eye: degrees, ±2 standard deviations, `…/error` against the truth |
//! | `limits/…` | limits of χ² and of gates |
//! | `display/in_loop/…` | the same of the estimator in the loop, which is drawn over the others |
//! | `validity/<estimator>` | what it marks valid, as states over time |
//! | `acting/<instrument>`, `acting/rail` | faults and another adhesion, as states over time |
//! | `readout`, `events`, `about` | values once a second, what happened, why the scenario exists |
//!
//! Coordinates are relative to the start of the rail. Lines break where a value is missing or not valid (a row that is
//! not a number).
//!
//! One timeline, `sim_time` (ns since the start). Recording id = scenario and seed. Chunk ids count up, and no clock is
//! read, so the same run gives the same recording (see [`sink::RerunSink`]).

mod acting;
mod blueprint;
mod colours;
mod columns;
mod frames;
mod gaps;
mod lanes;
mod lines;
mod live;
mod motion;
mod origin;
mod plots;
pub mod readback;
mod readout;
mod scene;
mod series;
pub mod sink;
mod source;
mod states;
mod stream;
mod thinning;
mod track;
mod views;

pub use live::Live;
pub use sink::RerunSink;
