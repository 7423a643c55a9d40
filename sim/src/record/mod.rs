//! Recording of a run: columns in chunks, handed to sinks (Parquet here, Rerun in `monorig-viz`).
//!
//! | file | what it holds |
//! |---|---|
//! | `channels` | the channel table: every column with its unit and its value |
//! | `recorder` | the observer that fills rows and hands them on in chunks |
//! | `moments` | moments that scenario and track name, as events |
//! | `extra` | channels that others add, such as the Cramér-Rao bound |
//! | `background` | a sink on a thread of its own |
//! | `parquet` `readback` | columns written to a file, and read from one |
//! | `folder` `manifest` `identity` | the folder of a run; program and inputs of the run, and by which program |
//! | `arithmetic` | whether two machines round alike |
//! | `inputs` | copies of the files that a study was made from |
//! | `whole` | files that are there whole or not at all |

mod arithmetic;
mod background;
mod channels;
mod extra;
pub mod folder;
pub mod identity;
pub mod inputs;
pub mod manifest;
mod moments;
pub mod palette;
pub mod parquet;
pub mod readback;
pub mod recorder;
pub mod whole;

use crate::error::Error;
use crate::rail::RailFrame;
use crate::train::Train;

/// Data fixed for a run: handed to every sink before the first chunk.
pub struct Layout<'a> {
    /// Name of the scenario (stem of its file).
    pub scenario: &'a str,
    /// Seed of the run.
    pub seed: u64,
    /// Purpose of the scenario.
    pub why: &'a str,
    /// One entry per column of [`Chunk::values`].
    pub channels: &'a [Channel],
    /// One name per column of [`Chunk::poses`]: the bodies of the train.
    pub train: &'a Train,
    /// The rail, sampled densely enough to draw.
    pub rail: &'a [RailFrame],
    /// Rail profile outline in (l, u), m, closed, counter-clockwise; the rail's line is the origin.
    pub profile: &'a [[f64; 2]],
    /// Boxes beside the rail: pose centre + quaternion + full sizes are in the world.
    pub obstacles: &'a [(nalgebra::Isometry3<f64>, nalgebra::Vector3<f64>)],
    /// Stretches of the rail where an event acts.
    pub zones: &'a [MarkedStretch],
    /// Parts that a viewer shows in a special way.
    pub emphasis: Emphasis<'a>,
}

/// Parts of a run that a viewer shows in a special way. Files of columns need none of them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Emphasis<'a> {
    /// The estimator whose values the controller uses.
    pub in_loop: Option<&'a str>,
    /// Published methods that are shown for reference.
    pub references: &'a [&'a str],
    /// Faults of instruments.
    pub faults: &'a [MarkedTime],
    /// True for a recorded drive that is played back: nothing is known of rail and train.
    pub recorded: bool,
}

/// Time interval of a fault.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkedTime {
    /// Begin, s.
    pub from_s: f64,
    /// End, s; infinite if it lasts to the end of the run.
    pub to_s: f64,
    /// Name of the instrument.
    pub of: String,
    /// Label, such as `stuck`.
    pub what: String,
}

/// A stretch of the rail where an event acts.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkedStretch {
    /// Chainage of its begin, m.
    pub from_m: f64,
    /// Chainage of its end, m.
    pub to_m: f64,
    /// Label, such as `wet: adhesion 0.12`.
    pub what: String,
}

/// One scalar column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Path such as `truth/grade_at_imu`, `sensors/imu/specific_force_x`, `estimates/dffrls_aekf_robust/total_mass`,
    /// `estimates/dffrls_aekf_robust/total_mass_sd`, `internals/dffrls_aekf_robust/lambda`, `control/reference_speed`.
    pub path: String,
    /// Unit such as `m/s²`, `rad`, `kg`, `1`.
    pub unit: &'static str,
}

/// A chunk of a run, column by column.
#[derive(Clone, Debug, Default)]
pub struct Chunk {
    /// Times of the rows, ns since the start.
    pub time_ns: Vec<i64>,
    /// One column per channel; NaN = no value in this row (no new sample).
    pub values: Vec<Vec<f64>>,
    /// Times of the poses, ns.
    pub pose_time_ns: Vec<i64>,
    /// Per body: position xyz and quaternion xyzw of the body frame in the world, one per pose time.
    pub poses: Vec<Vec<([f64; 3], [f64; 4])>>,
    /// Per drive: angle of the left and right friction wheel, rad, one per pose time.
    pub wheel_angles: Vec<Vec<[f64; 2]>>,
    /// Things that happened: time ns, text.
    pub events: Vec<(i64, String)>,
}

/// Receives columns.
pub trait Sink {
    /// Called before the first chunk.
    fn begin(&mut self, layout: &Layout<'_>) -> Result<(), Error>;
    /// Receives the next chunk.
    fn chunk(&mut self, chunk: &Chunk) -> Result<(), Error>;
    /// The run is over: close the file so that it can be read.
    fn finish(&mut self) -> Result<(), Error>;
}

impl<S: Sink + ?Sized> Sink for &mut S {
    fn begin(&mut self, layout: &Layout<'_>) -> Result<(), Error> {
        (**self).begin(layout)
    }
    fn chunk(&mut self, chunk: &Chunk) -> Result<(), Error> {
        (**self).chunk(chunk)
    }
    fn finish(&mut self) -> Result<(), Error> {
        (**self).finish()
    }
}

impl<S: Sink + ?Sized> Sink for Box<S> {
    fn begin(&mut self, layout: &Layout<'_>) -> Result<(), Error> {
        (**self).begin(layout)
    }
    fn chunk(&mut self, chunk: &Chunk) -> Result<(), Error> {
        (**self).chunk(chunk)
    }
    fn finish(&mut self) -> Result<(), Error> {
        (**self).finish()
    }
}

pub use background::BackgroundSink;
pub use channels::{ChannelDescription, TruthColumn, descriptions, visit_truth};
pub use extra::ExtraChannels;
pub use recorder::Recorder;

#[cfg(test)]
mod testing {
    use super::*;

    /// A train without bodies: what a sink of columns needs.
    pub(crate) fn sample_train() -> Train {
        Train::default()
    }

    /// A layout with these channels.
    pub(crate) fn layout_of<'a>(channels: &'a [Channel], train: &'a Train) -> Layout<'a> {
        Layout {
            scenario: "hill",
            seed: 7,
            why: "a test",
            channels,
            train,
            rail: &[],
            profile: &[],
            obstacles: &[],
            zones: &[],
            emphasis: Emphasis::default(),
        }
    }

    /// Noise-like values with gaps (NaN), an infinity and a negative zero, at 50 Hz.
    pub(crate) fn sample_chunk(columns: usize, first_row: usize, rows: usize) -> Chunk {
        let mut state = first_row as u64 + 1;
        let mut noise = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let value = |column: usize, row: usize, x: f64| match (column, row % 7) {
            (1, 3) => f64::NAN,
            (2, 0) => f64::INFINITY,
            (2, 1) => -0.0,
            _ => x + column as f64,
        };
        let values = (0..columns)
            .map(|c| (0..rows).map(|r| value(c, r, noise())).collect())
            .collect();
        Chunk {
            time_ns: (0..rows)
                .map(|r| (first_row + r) as i64 * 20_000_000)
                .collect(),
            values,
            events: vec![(
                first_row as i64 * 20_000_000,
                format!("chunk at row {first_row}"),
            )],
            ..Chunk::default()
        }
    }
}
