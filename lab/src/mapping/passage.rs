//! The estimates along a run, read back from its folder.

use monorig_sim::config::file::input_error;
use monorig_sim::error::Error;
use monorig_sim::record::readback;
use std::path::Path;

/// Internals that an estimator must have for a map.
const INTERNALS: [&str; 8] = [
    "pitch_rad",
    "accel_bias_mps2",
    "accel_bias_sd_mps2",
    "read_sd",
    "wheel_scale_sd",
    "imu_arm_m",
    "heading_rad",
    "heading_sd_rad",
];

/// One estimator along a run, with a number for each row.
#[derive(Clone, Debug, Default)]
pub struct Passage {
    pub(crate) t_s: Vec<f64>,
    /// Speed of the unit's middle, m/s.
    pub(crate) speed_mps: Vec<f64>,
    /// Standard deviation of that speed, m/s.
    pub(crate) speed_sd_mps: Vec<f64>,
    /// True where the grade is marked valid.
    pub(crate) valid: Vec<bool>,
    /// Pitch of the unit, nose up, rad.
    pub(crate) pitch_rad: Vec<f64>,
    /// Bias of the accelerometer along the unit, m/s².
    pub(crate) bias_mps2: Vec<f64>,
    /// Standard deviation of that bias, m/s².
    pub(crate) bias_sd_mps2: Vec<f64>,
    /// Standard deviation of sin θ + b/g, including the IMU's mounting.
    pub(crate) read_sd: Vec<f64>,
    /// Standard deviation of the scale of the wheel speeds.
    pub(crate) scale_sd: Vec<f64>,
    /// Heading since the start, + left, within ±π, rad.
    pub(crate) heading_rad: Vec<f64>,
    /// Standard deviation of the heading, rad.
    pub(crate) heading_sd_rad: Vec<f64>,
    /// Distance of the IMU ahead of the unit's middle, m.
    pub(crate) arm_m: f64,
    /// Chainage of the IMU in the first row, m; none in a recorded drive.
    pub start_m: Option<f64>,
}

impl Passage {
    /// Reads the estimator `name` of the run in `folder`; an estimator without the internals of an attitude filter is
    /// an error.
    pub fn read(folder: &Path, name: &str) -> Result<Self, Error> {
        let file = folder.join("channels.parquet");
        let ours = [format!("estimates/{name}/"), format!("internals/{name}/")];
        let wanted =
            |c: &str| c == "truth/chainage" || ours.iter().any(|group| c.starts_with(group));
        let (_, columns) = readback::columns(&file, wanted)?;
        let missing = |of: String, help: &str| input_error(folder, "", of, help);
        if columns.find(&format!("estimates/{name}/grade")).is_none() {
            return Err(missing(
                format!("this run has no estimator `{name}`"),
                "name an estimator of this run with --estimator",
            ));
        }
        let estimate = |of: &str| columns.get(&format!("estimates/{name}/{of}"));
        let internal = |of: &str| {
            let column = columns.find(&format!("internals/{name}/{of}"));
            column.ok_or_else(|| {
                missing(
                    format!("`{name}` does not report its {of}, which a map needs"),
                    "use rail_fusion or attitude, with --estimator",
                )
            })
        };
        let [
            pitch,
            bias,
            bias_sd,
            read_sd,
            scale_sd,
            arm,
            heading,
            heading_sd,
        ] = INTERNALS.map(internal);
        let first = |column: &[f64]| column.iter().copied().find(|x| x.is_finite());
        Ok(Self {
            t_s: columns.get("time")?.to_vec(),
            speed_mps: estimate("speed")?.to_vec(),
            speed_sd_mps: estimate("speed_sd")?.to_vec(),
            valid: estimate("grade_valid")?.iter().map(|x| *x == 1.0).collect(),
            pitch_rad: pitch?.to_vec(),
            bias_mps2: bias?.to_vec(),
            bias_sd_mps2: bias_sd?.to_vec(),
            read_sd: read_sd?.to_vec(),
            scale_sd: scale_sd?.to_vec(),
            heading_rad: heading?.to_vec(),
            heading_sd_rad: heading_sd?.to_vec(),
            arm_m: first(arm?).unwrap_or(0.0),
            start_m: columns.find("truth/chainage").and_then(first),
        })
    }
}
