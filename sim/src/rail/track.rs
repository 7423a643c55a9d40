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
//! Both lists begin at chainage 0. When one ends before the other, the rail goes on straight (horizontal list) or at the
//! grade reached (vertical list); a list may be left out altogether. Radii are those of the angle along the rail: dψ/ds = 1/R.

use super::alignment::{Angle, Builder};
use super::joints::JointsFile;
use super::survey::{self, Survey};
use crate::checked::{Finite, NonNegative, Positive};
use crate::error::Error;
use crate::file::input_error;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Steepest grade that can be described, degrees: beyond it a rail's "left" means little.
pub const STEEPEST_DEG: f64 = 60.0;
const MOST_TURN_DEG: f64 = 36_000.0;

/// A track file.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrackFile {
    /// Format version, 1.
    pub version: u32,
    /// Name.
    pub name: String,
    /// What the track is for, and where its figures come from.
    #[serde(default)]
    pub about: String,
    /// Rail profile file, relative to this file.
    pub profile: String,
    /// Where the rail begins.
    #[serde(default)]
    pub start: Start,
    /// Horizontal alignment from chainage 0.
    #[serde(default)]
    pub horizontal: Vec<Horizontal>,
    /// Vertical profile from chainage 0.
    #[serde(default)]
    pub vertical: Vec<Vertical>,
    /// Surveyed points instead of `vertical`, and, if they have headings, instead of `horizontal`.
    #[serde(default)]
    pub survey: Option<Survey>,
    /// Rail joints.
    #[serde(default)]
    pub joints: Option<JointsFile>,
}

/// Where the rail begins, in the world (z up).
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Start {
    /// m.
    pub x_m: Finite,
    /// m.
    pub y_m: Finite,
    /// m.
    pub z_m: Finite,
    /// Heading, degrees, + left from the x axis.
    pub heading_deg: Finite,
}

impl Default for Start {
    fn default() -> Self {
        Self {
            x_m: Finite::ZERO,
            y_m: Finite::ZERO,
            z_m: Finite::ZERO,
            heading_deg: Finite::ZERO,
        }
    }
}

impl Start {
    pub(super) fn position(&self) -> Vector3<f64> {
        Vector3::new(self.x_m.get(), self.y_m.get(), self.z_m.get())
    }
}

/// Kinds of horizontal element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HorizontalKind {
    /// Straight: `length_m`.
    Line,
    /// Circular arc: `angle_deg` (+ left) with `radius_m` or `length_m`; `easement_m` = length of a clothoid at each end.
    Arc,
    /// Curvature linear in s from where the last element left it: `length_m`, `to_radius_m` (+ left; left out = straight).
    Clothoid,
    /// The `elements`, `times` times.
    Repeat,
}

/// One element of the horizontal alignment; which keys it takes depends on its kind.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Horizontal {
    /// Kind of element.
    pub kind: HorizontalKind,
    /// Length along the rail, m.
    pub length_m: Option<Positive>,
    /// Radius of an arc, m.
    pub radius_m: Option<Positive>,
    /// Change of heading over an arc, degrees, + left.
    pub angle_deg: Option<Finite>,
    /// Length of the clothoid at each end of an arc, m.
    pub easement_m: Option<NonNegative>,
    /// Radius at the end of a clothoid, m, + left.
    pub to_radius_m: Option<Finite>,
    /// How often to repeat.
    pub times: Option<u32>,
    /// What to repeat.
    pub elements: Option<Vec<Horizontal>>,
}

/// Kinds of vertical element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum VerticalKind {
    /// Constant grade: `length_m`; `grade_deg` sets the grade if it is the first element, and must else be the grade reached.
    Grade,
    /// Circular vertical arc: `to_grade_deg` with `radius_m` or `length_m`; `easement_m` at each end as for horizontal arcs.
    Arc,
    /// Curvature linear in s, up to the middle and down again: `to_grade_deg` with `length_m` or `radius_m` (the least).
    Transition,
    /// The `elements`, `times` times.
    Repeat,
}

/// One element of the vertical profile; which keys it takes depends on its kind.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Vertical {
    /// Kind of element.
    pub kind: VerticalKind,
    /// Length along the rail, m.
    pub length_m: Option<Positive>,
    /// Radius of an arc, least radius of a transition, m.
    pub radius_m: Option<Positive>,
    /// Grade, degrees, + uphill.
    pub grade_deg: Option<Finite>,
    /// Grade at the end of the element, degrees, + uphill.
    pub to_grade_deg: Option<Finite>,
    /// Length over which an arc's curvature grows and falls, at each end, m.
    pub easement_m: Option<NonNegative>,
    /// How often to repeat.
    pub times: Option<u32>,
    /// What to repeat.
    pub elements: Option<Vec<Vertical>>,
}

/// A path written in `file`, relative to it.
pub(super) fn beside(file: &Path, path: &str) -> PathBuf {
    file.parent().unwrap_or(Path::new("")).join(path)
}

impl TrackFile {
    /// Heading and grade along the chainage.
    pub(super) fn angles(&self, file: &Path) -> Result<(Angle, Angle), Error> {
        let bad = |key: &str, message: &str, help: &str| Err(input_error(file, key, message, help));
        if self.version != 1 {
            return bad(
                "version",
                "this is not a format this program knows",
                "version: 1",
            );
        }
        let surveyed = match &self.survey {
            Some(s) if self.vertical.is_empty() => Some(survey::read(s, file)?),
            Some(_) => {
                return bad(
                    "vertical",
                    "the survey gives the heights already",
                    "either vertical or survey",
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
                "the survey gives the headings already",
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
                let mut b = Builder::new(file, self.start.heading_deg.get().to_radians());
                horizontal(&self.horizontal, "horizontal", &mut b)?;
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
                let mut b = Builder::new(file, first.to_radians());
                vertical(&self.vertical, "vertical", &mut b)?;
                b.finish()
            }
        };
        Ok((heading, grade))
    }
}

/// The keys of one element: which are there, which its kind takes, and errors that name them.
struct Keys<'a> {
    file: &'a Path,
    path: &'a str,
    kind: &'static str,
}

impl Keys<'_> {
    fn bad<T>(
        &self,
        key: &str,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Result<T, Error> {
        Err(input_error(
            self.file,
            format!("{}.{key}", self.path),
            message,
            help,
        ))
    }

    fn only(&self, takes: &[&str], given: &[(&str, bool)]) -> Result<(), Error> {
        match given
            .iter()
            .find(|(key, there)| *there && !takes.contains(key))
        {
            Some((key, _)) => self.bad(
                key,
                format!("{} has no {key}", self.kind),
                format!("it takes {}", takes.join(", ")),
            ),
            None => Ok(()),
        }
    }

    fn need<T>(&self, key: &str, value: Option<T>) -> Result<T, Error> {
        value.map_or_else(
            || {
                self.bad(
                    key,
                    format!("{} needs {key}", self.kind),
                    format!("add {key}"),
                )
            },
            Ok,
        )
    }

    /// Run the repeated elements through `f`, with their path.
    fn repeat<E>(
        &self,
        times: Option<u32>,
        elements: &Option<Vec<E>>,
        mut f: impl FnMut(&[E], &str) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let times = self.need("times", times)?;
        let elements = self.need("elements", elements.as_ref())?;
        if !(1..=100_000).contains(&times) {
            return self.bad(
                "times",
                format!("{times} times"),
                "a number from 1 to 100000",
            );
        }
        if elements.is_empty() {
            return self.bad("elements", "nothing to repeat", "a list of elements");
        }
        (0..times).try_for_each(|_| f(elements, &format!("{}.elements", self.path)))
    }
}

fn horizontal(elements: &[Horizontal], list: &str, b: &mut Builder<'_>) -> Result<(), Error> {
    for (i, e) in elements.iter().enumerate() {
        let path = format!("{list}[{i}]");
        let given = [
            ("length_m", e.length_m.is_some()),
            ("radius_m", e.radius_m.is_some()),
            ("angle_deg", e.angle_deg.is_some()),
            ("easement_m", e.easement_m.is_some()),
            ("to_radius_m", e.to_radius_m.is_some()),
            ("times", e.times.is_some()),
            ("elements", e.elements.is_some()),
        ];
        let keys = |kind| Keys {
            file: b.file,
            path: &path,
            kind,
        };
        let length_key = format!("{path}.length_m");
        match e.kind {
            HorizontalKind::Line => {
                let keys = keys("a line");
                keys.only(&["length_m"], &given)?;
                let length = keys.need("length_m", e.length_m)?.get();
                b.long_enough(length, &length_key)?;
                b.bend(length, [0.0, 0.0], [&length_key, &length_key])?;
            }
            HorizontalKind::Arc => {
                let keys = keys("an arc");
                keys.only(&["angle_deg", "radius_m", "length_m", "easement_m"], &given)?;
                let angle = keys.need("angle_deg", e.angle_deg)?.get();
                if angle == 0.0 || angle.abs() > MOST_TURN_DEG {
                    return keys.bad(
                        "angle_deg",
                        format!("an arc through {angle}°"),
                        "an angle other than 0; + turns left, − right",
                    );
                }
                let (radius, length) =
                    (e.radius_m.map(Positive::get), e.length_m.map(Positive::get));
                let easement = e.easement_m.map_or(0.0, NonNegative::get);
                b.arc(
                    angle.to_radians(),
                    radius,
                    length,
                    easement,
                    &path,
                    &format!("{path}.angle_deg"),
                )?;
            }
            HorizontalKind::Clothoid => {
                let keys = keys("a clothoid");
                keys.only(&["length_m", "to_radius_m"], &given)?;
                let length = keys.need("length_m", e.length_m)?.get();
                b.long_enough(length, &length_key)?;
                let to = match e.to_radius_m.map(Finite::get) {
                    Some(0.0) => {
                        return keys.bad(
                            "to_radius_m",
                            "a radius of 0",
                            "+ turns left, − right; leave it out to end straight",
                        );
                    }
                    Some(r) => 1.0 / r,
                    None => 0.0,
                };
                let key = if to == 0.0 {
                    length_key
                } else {
                    format!("{path}.to_radius_m")
                };
                b.bend(length, [b.curvature, to], [&key, &key])?;
            }
            HorizontalKind::Repeat => {
                let keys = keys("a repeat");
                keys.only(&["times", "elements"], &given)?;
                keys.repeat(e.times, &e.elements, |elements, list| {
                    horizontal(elements, list, b)
                })?;
            }
        }
    }
    Ok(())
}

fn vertical(elements: &[Vertical], list: &str, b: &mut Builder<'_>) -> Result<(), Error> {
    for (i, e) in elements.iter().enumerate() {
        let path = format!("{list}[{i}]");
        let given = [
            ("length_m", e.length_m.is_some()),
            ("radius_m", e.radius_m.is_some()),
            ("grade_deg", e.grade_deg.is_some()),
            ("to_grade_deg", e.to_grade_deg.is_some()),
            ("easement_m", e.easement_m.is_some()),
            ("times", e.times.is_some()),
            ("elements", e.elements.is_some()),
        ];
        let keys = |kind| Keys {
            file: b.file,
            path: &path,
            kind,
        };
        let (radius, length) = (e.radius_m.map(Positive::get), e.length_m.map(Positive::get));
        match e.kind {
            VerticalKind::Grade => {
                let keys = keys("a grade");
                keys.only(&["length_m", "grade_deg"], &given)?;
                let length = keys.need("length_m", length)?;
                b.long_enough(length, &format!("{path}.length_m"))?;
                let reached = b.angle.to_degrees();
                if let Some(grade) = e.grade_deg.map(Finite::get) {
                    steep(&keys, "grade_deg", grade)?;
                    if (grade - reached).abs() > 1e-6 {
                        return keys.bad(
                            "grade_deg",
                            format!(
                                "{grade}° does not join: the element before ends at {reached:.6}°"
                            ),
                            "an arc or a transition between the two, or no grade_deg",
                        );
                    }
                }
                let key = if e.grade_deg.is_some() {
                    format!("{path}.grade_deg")
                } else {
                    format!("{path}.length_m")
                };
                b.bend(length, [0.0, 0.0], [&key, &key])?;
            }
            VerticalKind::Arc | VerticalKind::Transition => {
                let arc = e.kind == VerticalKind::Arc;
                let keys = keys(if arc { "an arc" } else { "a transition" });
                let takes = ["to_grade_deg", "radius_m", "length_m", "easement_m"];
                keys.only(if arc { &takes } else { &takes[..3] }, &given)?;
                let to = keys.need("to_grade_deg", e.to_grade_deg)?.get();
                steep(&keys, "to_grade_deg", to)?;
                let turn = to.to_radians() - b.angle;
                if turn.abs() < 1e-9 {
                    return keys.bad(
                        "to_grade_deg",
                        format!("the grade is {to}° already"),
                        "another grade, or kind: grade",
                    );
                }
                let angle_key = format!("{path}.to_grade_deg");
                if arc {
                    b.arc(
                        turn,
                        radius,
                        length,
                        e.easement_m.map_or(0.0, NonNegative::get),
                        &path,
                        &angle_key,
                    )?;
                } else {
                    b.transition(turn, radius, length, &path, &angle_key)?;
                }
                b.angle = to.to_radians(); // what was asked for, without the rounding of the way there
            }
            VerticalKind::Repeat => {
                let keys = keys("a repeat");
                keys.only(&["times", "elements"], &given)?;
                keys.repeat(e.times, &e.elements, |elements, list| {
                    vertical(elements, list, b)
                })?;
            }
        }
    }
    Ok(())
}

fn steep(keys: &Keys<'_>, key: &str, grade_deg: f64) -> Result<(), Error> {
    if grade_deg.abs() > STEEPEST_DEG {
        return keys.bad(
            key,
            format!("a grade of {grade_deg}°"),
            format!("at most {STEEPEST_DEG}° up or down"),
        );
    }
    Ok(())
}
