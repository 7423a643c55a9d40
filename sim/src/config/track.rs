//! The track file: what can be written, and how it becomes two angles along the chainage.
//!
//! ```yaml
//! version: 1
//! name: up and round
//! profile: ../rails/i140e.yaml
//! horizontal:
//!   - {kind: line, length_m: 30}
//!   - {kind: arc, radius_m: 4, angle_deg: 90, easement_m: 2}   # + left
//! vertical:
//!   - {kind: grade, length_m: 20}                              # level: the first grade is 0 unless said
//!   - {kind: transition, to_grade_deg: 8, length_m: 6}
//! ```
//!
//! Both lists begin at chainage 0. When one ends before the other, the rail goes on straight (horizontal list) or at
//! the grade reached (vertical list); a list may be left out altogether. Radii are those of the angle along the rail:
//! dψ/ds = 1/R.

pub(crate) mod elements;
mod points;
pub(crate) mod survey;

use crate::config::checked::{Finite, NonNegative, Positive, Version1};
use crate::config::file::{Sets, named, read_yaml_with, with_sets};
use crate::error::{DataError, Error};
use crate::rail::alignment::{AlignmentBuilder, Angle};
use crate::rail::joints::{JointSpec, Joints};
use crate::rail::profile::Profile;
use crate::rail::{Place, Rail, Section};
use elements::{Horizontal, Vertical};
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;
use survey::Survey;

/// A track file.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrackFile {
    /// Format version, 1.
    pub(crate) version: Version1,
    /// Name.
    pub(crate) name: String,
    /// Purpose of the track, and the source of its figures.
    #[serde(default)]
    pub(crate) about: String,
    /// Rail profile file, relative to this file; not for a road.
    #[serde(default)]
    pub(crate) profile: Option<String>,
    /// Width of the lane, m: makes the track a road for a car.
    #[serde(default)]
    pub(crate) road_width_m: Option<Positive>,
    /// Start of the rail.
    #[serde(default)]
    pub(crate) start: TrackStart,
    /// Horizontal alignment from chainage 0.
    #[serde(default)]
    pub(crate) horizontal: Vec<Horizontal>,
    /// Vertical profile from chainage 0.
    #[serde(default)]
    pub(crate) vertical: Vec<Vertical>,
    /// Surveyed points instead of `vertical`, and, if they have headings, instead of `horizontal`.
    #[serde(default)]
    pub(crate) survey: Option<Survey>,
    /// Rail joints.
    #[serde(default)]
    pub(crate) joints: Option<JointsFile>,
}

/// Start of the rail in the world (z up).
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Start")] // the name in the JSON schema
pub(crate) struct TrackStart {
    /// m.
    pub x_m: Finite,
    /// m.
    pub y_m: Finite,
    /// m.
    pub z_m: Finite,
    /// Heading, degrees, + left from the x axis.
    pub heading_deg: Finite,
}

impl Default for TrackStart {
    fn default() -> Self {
        Self {
            x_m: Finite::ZERO,
            y_m: Finite::ZERO,
            z_m: Finite::ZERO,
            heading_deg: Finite::ZERO,
        }
    }
}

impl TrackStart {
    pub(crate) fn position(&self) -> Vector3<f64> {
        Vector3::new(self.x_m.get(), self.y_m.get(), self.z_m.get())
    }
}

impl TrackFile {
    /// Heading and grade along the chainage, and the named elements.
    pub(crate) fn angles(&self, file: &Path) -> Result<(Angle, Angle, Vec<Place>), Error> {
        let mut places: Vec<(String, Place)> = Vec::new();
        let bad = |key: &str, message: &str, help: &str| {
            Err(DataError::new(key, message, help).in_file(file))
        };
        let surveyed = match &self.survey {
            Some(s) if self.vertical.is_empty() => Some(survey::read(s, file)?),
            Some(_) => {
                return bad(
                    "vertical",
                    "the survey already gives the heights",
                    "use either vertical or survey",
                );
            }
            None => None,
        };
        let (surveyed_heading, surveyed_grade) =
            surveyed.map_or((None, None), |(h, g)| (h, Some(g)));
        if surveyed_heading.is_some()
            && (!self.horizontal.is_empty() || self.start.heading_deg.get() != 0.0)
        {
            return bad(
                "horizontal",
                "the survey already gives the headings",
                "either a heading_deg column in the survey, or horizontal and start.heading_deg",
            );
        }
        if self.horizontal.is_empty() && self.vertical.is_empty() && self.survey.is_none() {
            return bad(
                "horizontal",
                "the track has no elements",
                "such as horizontal: [{kind: line, length_m: 100}]",
            );
        }
        let heading = match surveyed_heading {
            Some(h) => h,
            None => {
                let mut b = AlignmentBuilder::new(self.start.heading_deg.get().to_radians());
                elements::horizontal(&self.horizontal, "horizontal", &mut b)
                    .map_err(|e| e.in_file(file))?;
                places.append(&mut b.places);
                b.finish()
            }
        };
        let grade = match surveyed_grade {
            Some(g) => g,
            None => {
                let first = self
                    .vertical
                    .first()
                    .and_then(|v| v.grade_deg)
                    .map_or(0.0, Finite::get);
                let mut b = AlignmentBuilder::new(first.to_radians());
                elements::vertical(&self.vertical, "vertical", &mut b)
                    .map_err(|e| e.in_file(file))?;
                places.append(&mut b.places);
                b.finish()
            }
        };
        for (i, (path, place)) in places.iter().enumerate() {
            if places
                .iter()
                .take(i)
                .any(|(_, other)| other.name == place.name)
            {
                return Err(elements::name_taken(path, &place.name).in_file(file));
            }
        }
        let places = places.into_iter().map(|(_, place)| place).collect();
        Ok((heading, grade, places))
    }
}

impl Rail {
    /// Read a track file, and the profile and survey it names.
    pub fn load(path: &Path) -> Result<Self, Error> {
        Self::load_with(path, &Sets::default())
    }

    /// Loads a track with changes of the track file.
    pub(crate) fn load_with(path: &Path, sets: &Sets) -> Result<Self, Error> {
        let rail = Self::read(&read_yaml_with(path, sets)?, path);
        rail.map_err(|e| with_sets(e, sets))
    }

    /// The rail or road of a track file already parsed; `path` is named in errors, and paths inside it are relative to
    /// it.
    pub(crate) fn read(track: &TrackFile, path: &Path) -> Result<Self, Error> {
        let section = match (&track.profile, track.road_width_m) {
            (Some(profile), None) => {
                Section::Rail(Profile::load(&named(path, "profile", profile)?)?)
            }
            (None, Some(width)) => Section::road(width.get()),
            (Some(_), Some(_)) => {
                let e = DataError::new(
                    "road_width_m",
                    "this track has a rail profile and the width of a road",
                    "keep `profile` for a rail, or `road_width_m` for a road",
                );
                return Err(e.in_file(path));
            }
            (None, None) => {
                let e = DataError::new(
                    "profile",
                    "this track is neither a rail nor a road",
                    "`profile: ../rails/i140e.yaml` makes it a rail, `road_width_m: 3.75` a road",
                );
                return Err(e.in_file(path));
            }
        };
        Self::with_section(track, section, path)
    }

    /// Build a rail from a track; `file` is named in errors, and paths inside the track are relative to it.
    #[cfg(any(test, feature = "testing"))]
    pub(crate) fn build(track: &TrackFile, profile: Profile, file: &Path) -> Result<Self, Error> {
        Self::with_section(track, Section::Rail(profile), file)
    }

    fn with_section(track: &TrackFile, section: Section, file: &Path) -> Result<Self, Error> {
        let (horizontal, vertical, places) = track.angles(file)?;
        let length = horizontal.length().max(vertical.length());
        let joints = track
            .joints
            .map(|joints| Joints::new(&joints.into(), length))
            .transpose()
            .map_err(|e| e.under("joints").in_file(file))?;
        let mut rail = Self::new(
            &track.name,
            track.start.position(),
            horizontal,
            vertical,
            joints,
            section,
        );
        rail.places = places;
        Ok(rail)
    }
}

/// Rail joints in a track file.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JointsFile {
    /// Length of a piece of rail, m.
    pub every_m: Positive,
    /// Deflection at a joint, degrees; signs alternate.
    #[serde(default = "none")]
    pub kink_deg: NonNegative,
    /// Height step at a joint, m; signs alternate.
    #[serde(default = "none")]
    pub step_m: NonNegative,
    /// Radius of the wheel that rolls over the step, m.
    #[serde(default = "wheel")]
    pub wheel_radius_m: Positive,
}

fn none() -> NonNegative {
    NonNegative::new(0.0)
}

fn wheel() -> Positive {
    Positive::new(0.0875)
}

impl From<JointsFile> for JointSpec {
    fn from(j: JointsFile) -> Self {
        Self {
            every_m: j.every_m.get(),
            kink_deg: j.kink_deg.get(),
            step_m: j.step_m.get(),
            wheel_radius_m: j.wheel_radius_m.get(),
        }
    }
}
