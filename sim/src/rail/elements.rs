//! From the elements of a track file to stretches of an angle: which keys each kind takes, and what they mean.

use super::alignment::Builder;
use super::track::{Horizontal, HorizontalKind, STEEPEST_DEG, Vertical, VerticalKind};
use crate::checked::{Finite, NonNegative, Positive};
use crate::error::Error;
use crate::file::input_error;
use std::path::Path;

/// An arc of more turns than a hundred is a slip of the pen.
const MOST_TURN_DEG: f64 = 36_000.0;

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

/// String a list of horizontal elements together; `list` is its key path.
pub(super) fn horizontal(
    elements: &[Horizontal],
    list: &str,
    b: &mut Builder<'_>,
) -> Result<(), Error> {
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

/// String a list of vertical elements together; `list` is its key path.
pub(super) fn vertical(
    elements: &[Vertical],
    list: &str,
    b: &mut Builder<'_>,
) -> Result<(), Error> {
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
