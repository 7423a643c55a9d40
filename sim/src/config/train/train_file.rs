//! The format of a train file.

use crate::config::checked::{NonNegative, Positive, Version1};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A train file, `assets/trains/*.yaml`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrainFile {
    /// Format version, 1.
    pub(crate) version: Version1,
    /// Name of the train.
    pub(crate) name: String,
    /// Units along the rail, front to rear.
    pub(crate) consist: Vec<UnitEntry>,
    /// Drawbars between neighbouring units.
    pub(crate) drawbar: Drawbar,
    /// The load.
    #[serde(default)]
    pub(crate) load: Option<LoadEntry>,
    /// Changes to the units' files for every drive unit of this train.
    #[serde(default)]
    pub(crate) drive: DriveChange,
    /// Limits of the track and of the load for this train.
    pub(crate) limits: LimitsFile,
    /// Running resistance.
    pub(crate) resistance: ResistanceFile,
}

/// A unit in the consist.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct UnitEntry {
    /// Name in this train, without `/`.
    pub name: String,
    /// Unit file, relative to this file.
    pub unit: String,
    /// Built in facing backwards.
    #[serde(default)]
    pub reversed: bool,
}

/// Drawbars between neighbouring units.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Drawbar {
    /// N/m.
    pub stiffness_npm: Positive,
    /// N·s/m.
    pub damping_nspm: NonNegative,
}

/// The load.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LoadEntry {
    /// Name in this train, without `/`.
    pub name: String,
    /// Unit file, relative to this file.
    pub unit: String,
    /// Name of the unit it hangs below.
    pub under: String,
}

/// Changes to the unit's file.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct DriveChange {
    /// Largest motor torque, N·m.
    pub torque_max_nm: Option<Positive>,
    /// Motor power, kW.
    pub power_kw: Option<Positive>,
    /// Adhesion coefficient on a clean dry rail.
    pub adhesion: Option<NonNegative>,
    /// Nominal clamp pressure, MPa.
    pub clamp_mpa: Option<NonNegative>,
}

/// Limits of the track and of the load for this train.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LimitsFile {
    /// Least horizontal radius, m.
    pub min_radius_horizontal_m: Positive,
    /// Least vertical radius, m.
    pub min_radius_vertical_m: Positive,
    /// Steepest grade, degrees.
    pub max_grade_deg: Positive,
    /// Highest speed, m/s.
    pub max_speed_mps: Positive,
    /// Rated load, kg.
    pub max_load_kg: NonNegative,
}

/// Running resistance of the whole train, each term of its own.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ResistanceFile {
    /// Rolling of the clamped friction wheels, per newton of clamp force.
    pub clamped_wheel: NonNegative,
    /// Rolling of the running wheels, per newton of wheel load.
    pub running_wheel: NonNegative,
    /// Rolling of the guide wheels, per newton of guide force.
    pub guide_wheel: NonNegative,
    /// Bearings of one rail-bound body, N.
    pub bearing_n: NonNegative,
    /// Bearings of one rail-bound body, N·s/m.
    pub bearing_nspm: NonNegative,
    /// Air drag ½ρ c_D A of the train, N·s²/m².
    pub air_nspm2: NonNegative,
}
