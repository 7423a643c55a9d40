//! A course: its files.

use super::drive::{self, Drive, Reach};
use super::ranges::RangesFile;
use super::track::{self, round};
use super::{Draws, instruments};
use monorig_sim::config::file::named;
use monorig_sim::config::scenario::Settings;
use monorig_sim::config::sensor_sheet::Sheet;
use monorig_sim::error::Error;
use monorig_sim::train::Train;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

/// Largest share of the motors' force and power on the steepest climb.
const SHARE: f64 = 0.7;
/// Free distance at both ends of the track beside the train's length, m.
const ROOM_M: f64 = 3.0;
/// Share of the free distance that a drive covers by its speed reference. A reference by time fixes speeds, not places:
/// what the controller lags in a grade it does not make up for.
const COVERED: f64 = 0.9;
/// Time from the end of the drive to the end of the run, s.
const AFTER_S: f64 = 2.0;
const GRAVITY_MPS2: f64 = 9.81;
/// Folder beside the scenarios for their parts.
const PARTS: &str = "parts";

/// A course: what is to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// Name of the scenario.
    pub name: String,
    /// Files of the course, the scenario last.
    pub files: Vec<DrawnFile>,
    /// End of the run, s.
    pub(crate) over_s: f64,
    /// Drive units of the train.
    pub(crate) drives: usize,
    /// Instruments of the sensor sheet.
    pub(crate) instruments: Vec<&'static str>,
}

/// A drawn file.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnFile {
    /// Relative to the folder of the scenarios.
    pub path: PathBuf,
    /// Text of the file.
    pub text: String,
}

/// The course of this seed. `file` is where the ranges were read, `folder` where the course is going to be written:
/// what the course uses of what is there is named from there. It must be there.
pub fn course(ranges: &RangesFile, file: &Path, folder: &Path, seed: u64) -> Result<Course, Error> {
    let name = format!("drawn_{seed}");
    let mut draws = Draws::new(seed, "train");
    let weights: Vec<f64> = ranges.trains.iter().map(|t| t.weight.get()).collect();
    let place = draws.place(&weights);
    let chosen = &ranges.trains[place];
    let train_path = named(file, &format!("trains[{place}].train"), &chosen.train)?;
    let train = Train::load(&train_path)?;
    let load_kg = round(draws.within(chosen.load_kg), 0);
    let climb = Climb::of(&train, load_kg, ranges);
    let length_m = train.limits.length_m;
    let track = track::draw(&ranges.track, seed, length_m, climb.steepest_deg);
    let reach = Reach {
        way_m: COVERED * (track.length_m - length_m - 2.0 * ROOM_M),
        speed_mps: climb.speed_mps,
    };
    let drive = drive::draw(&ranges.drive, seed, reach);

    let mut draws = Draws::new(seed, "sensors");
    let place = draws.place(&vec![1.0; ranges.sensors.len()]);
    let sheet_path = named(file, &format!("sensors[{place}]"), &ranges.sensors[place])?;
    let noise = round(draws.log_within(ranges.noise_factor), 2);
    let bias = round(draws.log_within(ranges.bias_factor), 2);

    let profile = named(file, "profile", &ranges.profile)?;
    let profile = format!("../{}", relative(folder, &profile)?); // from PARTS
    let over_s = round(drive.over_s + AFTER_S, 1);
    let scenario = Scenario {
        version: 1,
        why: format!(
            "{} Drawn with seed {seed}: noise × {noise}, biases × {bias}.",
            ranges.why.trim()
        ),
        track: format!("{PARTS}/{name}_track.yaml"),
        train: relative(folder, &train_path)?,
        load: Load { mass_kg: load_kg },
        sensors: format!("{PARTS}/{name}_sensors.yaml"),
        start: Start {
            chainage_m: round(length_m + ROOM_M, 1),
        },
        stop: Stop { after_s: over_s },
        drive,
        estimators: &ranges.estimators,
        in_loop: ranges.in_loop.as_deref(),
        seeds: [seed],
    };
    let track_text = format!(
        "version: 1\nname: {name}\nprofile: {profile:?}\n{}",
        track.text
    );
    let sheet_text = instruments::scaled(&sheet_path, noise, bias)?;
    let drawn = |path: String, text| DrawnFile {
        path: path.into(),
        text,
    };
    // numbers and strings: nothing in here can fail to serialise
    let scenario_text = serde_yaml::to_string(&scenario).unwrap_or_default();
    Ok(Course {
        files: vec![
            drawn(scenario.track, track_text),
            drawn(scenario.sensors, sheet_text),
            drawn(format!("{name}.yaml"), scenario_text),
        ],
        over_s,
        drives: train.drives.len(),
        instruments: Sheet::load(&sheet_path)?.specs().into_keys().collect(),
        name,
    })
}

/// Path of the file `to`, relative to the folder `from`.
fn relative(from: &Path, to: &Path) -> Result<String, Error> {
    let whole = |path: &Path| std::fs::canonicalize(path).map_err(Error::at(path));
    let (from, to) = (whole(from)?, whole(to)?);
    // up to the folder that both are in, then down
    let (from, to) = (from.components(), to.components());
    let both = from.clone().zip(to.clone());
    let shared = both.take_while(|(a, b)| a == b).count();
    let up = from.skip(shared).map(|_| Component::ParentDir);
    let way: PathBuf = up.chain(to.skip(shared)).collect();
    Ok(way.to_string_lossy().into_owned())
}

/// Steepest grade that a loaded train can climb.
struct Climb {
    steepest_deg: f64,
    speed_mps: f64,
}

impl Climb {
    fn of(train: &Train, load_kg: f64, ranges: &RangesFile) -> Self {
        let weight_n = (train.tare_kg() + load_kg) * GRAVITY_MPS2;
        let resistance = train.nominal_running_resistance(weight_n / GRAVITY_MPS2, GRAVITY_MPS2);
        let drives = train.drives.iter();
        let (force, power) = drives.fold((0.0, 0.0), |(force, power), d| {
            let rim = d.torque_max_nm * d.gear_ratio / d.wheel_radius_m;
            (
                force + SHARE * rim * d.efficiency_drive,
                power + SHARE * d.power_w * d.efficiency_drive,
            )
        });
        let [_, hardest] = ranges.drive.acceleration_mps2;
        let level = resistance + hardest.get() / GRAVITY_MPS2;
        let sine = (force / weight_n - level).clamp(0.0, 1.0);
        let limit = train.limits.max_grade_rad;
        let steepest = libm::asin(sine).min(limit);
        let [low, high] = ranges.track.grade_deg.map(|g| g.get().to_radians());
        let drawn = steepest.min(high.abs().max(low.abs()));
        let needed = weight_n * (libm::sin(drawn) + level);
        Self {
            steepest_deg: steepest.to_degrees(),
            speed_mps: (power / needed).min(train.limits.max_speed_mps),
        }
    }
}

/// A scenario, in the order in which it is written.
#[derive(Serialize)]
struct Scenario<'a> {
    version: u32,
    why: String,
    track: String,
    train: String,
    load: Load,
    sensors: String,
    start: Start,
    stop: Stop,
    drive: Drive,
    estimators: &'a BTreeMap<String, Settings>,
    #[serde(skip_serializing_if = "Option::is_none")]
    in_loop: Option<&'a str>,
    seeds: [u64; 1],
}

#[derive(Serialize)]
struct Load {
    mass_kg: f64,
}

#[derive(Serialize)]
struct Start {
    chainage_m: f64,
}

#[derive(Serialize)]
struct Stop {
    after_s: f64,
}
