//! The file of ranges: what is drawn, and from where to where.

use monorig_sim::closed_loop::registry::{Refusal, Registry};
use monorig_sim::config::checked::{Finite, Fraction, NonNegative, Positive, Version1};
use monorig_sim::config::file::{Document, input_error, named};
use monorig_sim::config::scenario::Settings;
use monorig_sim::config::sensor_sheet::Sheet;
use monorig_sim::error::Error;
use monorig_sim::rail::profile::Profile;
use monorig_sim::train::Train;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// A file of ranges. A pair of numbers is a range, its smaller end first.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Ranges")] // the name in the JSON schema
pub struct RangesFile {
    /// Format version, 1.
    pub(crate) version: Version1,
    /// Purpose of the courses.
    pub(crate) why: String,
    /// Rail profile file, relative to this file.
    pub(crate) profile: String,
    /// Trains to choose from.
    pub(crate) trains: Vec<TrainRange>,
    /// Sensor sheets to choose from, with equal probability; relative to this file.
    pub(crate) sensors: Vec<String>,
    /// Factor on every noise of the sheet; uniform in its logarithm.
    pub(crate) noise_factor: [Positive; 2],
    /// Factor on every bias, drift and scale error of the sheet; uniform in its logarithm.
    pub(crate) bias_factor: [Positive; 2],
    /// The track.
    pub track: TrackRanges,
    /// The drive.
    pub(crate) drive: DriveRanges,
    /// Estimators of every scenario, written as in a scenario.
    pub(crate) estimators: BTreeMap<String, Settings>,
    /// The estimator in the loop, as in a scenario.
    #[serde(default)]
    pub(crate) in_loop: Option<String>,
}

/// A train to choose.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct TrainRange {
    /// Train file, relative to this file.
    pub(crate) train: String,
    /// Weight with which this train is chosen.
    pub(crate) weight: Positive,
    /// Load on the hook, kg.
    pub(crate) load_kg: [NonNegative; 2],
}

/// Ranges for tracks.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrackRanges {
    /// Length, m.
    pub(crate) length_m: [Positive; 2],
    /// Grades, degrees; limited to grades that the motors can climb with 70 % of their force.
    pub grade_deg: [Finite; 2],
    /// Length of stretches of constant grade, m.
    pub(crate) grade_length_m: [Positive; 2],
    /// Radii of crests and sags, of transitions the least radius, m; uniform in their logarithm.
    pub(crate) vertical_radius_m: [Positive; 2],
    /// Share of the tracks that are straight in plan.
    pub(crate) straight_share: Fraction,
    /// Straights between bends, m.
    pub(crate) straight_m: [Positive; 2],
    /// Radii of bends, m; uniform in their logarithm.
    pub(crate) radius_m: [Positive; 2],
    /// Turn of a bend, degrees, to the left or to the right.
    pub(crate) bend_deg: [Positive; 2],
    /// Easement at both ends of bends, and of crests and sags that are arcs, m.
    pub(crate) easement_m: [NonNegative; 2],
    /// Share of the tracks with rail joints.
    pub(crate) jointed_share: Fraction,
    /// Distance of joints, m.
    pub(crate) joint_every_m: [Positive; 2],
    /// Kink of a joint, degrees.
    pub(crate) joint_kink_deg: [NonNegative; 2],
    /// Step of a joint, m.
    pub(crate) joint_step_m: [NonNegative; 2],
}

/// Ranges for drives.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct DriveRanges {
    /// Time at standstill before the first start and at every stop, s.
    pub(crate) stand_s: [Positive; 2],
    /// Speed, m/s; limited to speeds at which the motors can climb with 70 % of their power.
    pub(crate) speed_mps: [Positive; 2],
    /// Acceleration, m/s².
    pub(crate) acceleration_mps2: [Positive; 2],
    /// Largest number of stops; every number from 0 to it is equally likely.
    pub(crate) max_stops: u32,
    /// Share of the drives that end with a return over a part of the distance.
    pub(crate) reversal_share: Fraction,
}

/// Length of the longest drawn track, m.
const MAX_TRACK_M: f64 = 50_000.0;
/// Largest number of stretches of a drawn track.
const MAX_PIECES: f64 = 20_000.0;
/// Largest number of joints of a drawn track.
const MAX_JOINTS: f64 = 100_000.0;
/// Largest number of stops of a drawn drive.
const MAX_STOPS: f64 = 1_000.0;

impl RangesFile {
    /// Read and check a file of ranges; the files it names are read when courses are drawn.
    pub fn load(path: &Path) -> Result<Self, Error> {
        let document = Document::read(path)?;
        let file: Self = document.parse()?;
        for (key, low, high) in file.ranges() {
            if low > high {
                return Err(document.error(
                    key,
                    format!("this range goes from {low} to {high}"),
                    "write the smaller number first",
                ));
            }
        }
        let (track, longest) = (&file.track, file.track.length_m[1].get());
        for (key, pieces, most) in [
            ("track.length_m", longest, MAX_TRACK_M),
            (
                "track.grade_length_m",
                longest / track.grade_length_m[0].get(),
                MAX_PIECES,
            ),
            (
                "track.straight_m",
                longest / track.straight_m[0].get(),
                MAX_PIECES,
            ),
            (
                "track.joint_every_m",
                longest / track.joint_every_m[0].get(),
                MAX_JOINTS,
            ),
            (
                "drive.max_stops",
                f64::from(file.drive.max_stops),
                MAX_STOPS,
            ),
        ] {
            if pieces > most {
                return Err(document.error(
                    key,
                    format!("courses of up to {longest} m would have {pieces:.0} of these"),
                    format!("at most {most}"),
                ));
            }
        }
        if file.trains.is_empty() || file.sensors.is_empty() {
            let key = if file.trains.is_empty() {
                "trains"
            } else {
                "sensors"
            };
            return Err(document.error(key, "this list has no entry", "one at least"));
        }
        if let Some((name, _)) = file.estimators.iter().find(|(_, e)| e.from.is_some()) {
            return Err(document.error(
                format!("estimators.{name}.from"),
                "a drawn scenario cannot name a parameter file",
                "write the parameters themselves",
            ));
        }
        Ok(file)
    }

    /// Reads every named file, and looks up every estimator.
    pub fn check(&self, path: &Path, registry: &Registry) -> Result<(), Error> {
        for (i, train) in self.trains.iter().enumerate() {
            Train::load(&named(path, &format!("trains[{i}].train"), &train.train)?)?;
        }
        for (i, sheet) in self.sensors.iter().enumerate() {
            Sheet::load(&named(path, &format!("sensors[{i}]"), sheet)?)?;
        }
        Profile::load(&named(path, "profile", &self.profile)?)?;
        for (name, settings) in &self.estimators {
            let wrong = |key: String, refusal: Refusal| {
                input_error(path, key, refusal.message, refusal.help)
            };
            let key = format!("estimators.{name}");
            let of = registry
                .estimator_of(name, settings)
                .map_err(|refusal| wrong(key.clone(), refusal))?;
            for parameter in settings.values.keys() {
                of.key(parameter)
                    .map_err(|refusal| wrong(format!("{key}.{parameter}"), refusal))?;
            }
        }
        Ok(())
    }

    /// Every range with its key.
    fn ranges(&self) -> Vec<(String, f64, f64)> {
        fn ends<T: Into<f64> + Copy>(key: &str, [low, high]: [T; 2]) -> (String, f64, f64) {
            (key.to_owned(), low.into(), high.into())
        }
        let (track, drive) = (&self.track, &self.drive);
        let mut all = vec![
            ends("noise_factor", self.noise_factor),
            ends("bias_factor", self.bias_factor),
            ends("track.length_m", track.length_m),
            ends("track.grade_deg", track.grade_deg),
            ends("track.grade_length_m", track.grade_length_m),
            ends("track.vertical_radius_m", track.vertical_radius_m),
            ends("track.straight_m", track.straight_m),
            ends("track.radius_m", track.radius_m),
            ends("track.bend_deg", track.bend_deg),
            ends("track.easement_m", track.easement_m),
            ends("track.joint_every_m", track.joint_every_m),
            ends("track.joint_kink_deg", track.joint_kink_deg),
            ends("track.joint_step_m", track.joint_step_m),
            ends("drive.stand_s", drive.stand_s),
            ends("drive.speed_mps", drive.speed_mps),
            ends("drive.acceleration_mps2", drive.acceleration_mps2),
        ];
        let trains = self.trains.iter().enumerate();
        all.extend(trains.map(|(i, t)| ends(&format!("trains[{i}].load_kg"), t.load_kg)));
        all
    }
}
