//! What a run leaves behind: columns in chunks, handed to sinks (Parquet here, Rerun in `monorig-viz`).

use crate::error::Error;
use crate::rail::Frame as RailFrame;
use crate::train::Train;

/// What is fixed for a run: handed to every sink before the first chunk.
pub struct Layout<'a> {
    /// Scenario name (file stem) and seed.
    pub scenario: &'a str,
    /// See above.
    pub seed: u64,
    /// Why the scenario exists.
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
}

/// One scalar column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Path such as `truth/grade_at_imu`, `sensors/imu/specific_force_x`, `estimates/dffrls_aekf/total_mass`,
    /// `estimates/dffrls_aekf/total_mass_sd`, `internals/dffrls_aekf/lambda`, `control/reference_speed`.
    pub path: String,
    /// Unit such as `m/s²`, `rad`, `kg`, `1`.
    pub unit: &'static str,
}

/// Some seconds of a run, column by column.
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

/// Somewhere columns go.
pub trait Sink {
    /// Before the first chunk.
    fn begin(&mut self, layout: &Layout<'_>) -> Result<(), Error>;
    /// Some more seconds.
    fn chunk(&mut self, chunk: &Chunk) -> Result<(), Error>;
    /// The run is over: close the file so that it can be read.
    fn finish(&mut self) -> Result<(), Error>;
}
