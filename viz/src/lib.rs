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
//! | `truth/… sensors/… estimates/… internals/… control/…` | one entity per channel, as named by the simulator |
//! | `display/<channel>` | made for the eye from channels: degrees, ±2 standard deviations |
//! | `events`, `about` | what happened, why the scenario exists |
//!
//! One timeline, `sim_time` (ns since the start). Recording id = scenario and seed. Chunk ids count up, and no clock is
//! read, so the same run gives the same recording (see [`sink::RerunSink`]).

mod blueprint;
mod columns;
mod frames;
mod live;
mod packed;
mod plots;
pub mod readback;
mod scene;
mod series;
pub mod sink;
mod stream;

pub use live::Live;
pub use sink::RerunSink;
