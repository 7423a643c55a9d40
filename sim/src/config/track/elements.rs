//! The elements of a track file, converted to stretches of an angle: which keys each kind takes, and what they mean.

use crate::config::checked::{Finite, NonNegative, Positive};
use crate::error::DataError;
use crate::rail::Place;
use crate::rail::alignment::AlignmentBuilder;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Steepest grade that can be described, degrees: beyond it a rail's "left" means little.
pub const MAX_GRADE_DEG: f64 = 60.0;

/// Kinds of horizontal element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HorizontalKind {
    /// Straight: `length_m`.
    Line,
    /// Circular arc: `angle_deg` (+ left) with `radius_m` or `length_m`; `easement_m` = length of a clothoid at each
    /// end.
    Arc,
    /// Curvature linear in s, beginning at the end of the last element: `length_m`, `to_radius_m` (+ left; left out =
    /// straight).
    Clothoid,
    /// The `elements`, `times` times.
    Repeat,
}

/// One element of the horizontal alignment; its keys depend on its kind.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Horizontal {
    /// Kind of element.
    pub kind: HorizontalKind,
    /// Name, for windows of expectations (`after: {rear_enters: climb}`).
    pub name: Option<String>,
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
    /// Number of repetitions.
    pub times: Option<u32>,
    /// The elements that are repeated.
    pub elements: Option<Vec<Horizontal>>,
}

/// Kinds of vertical element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum VerticalKind {
    /// Constant grade: `length_m`; `grade_deg` sets the grade if it is the first element, and must else be the grade
    /// reached.
    Grade,
    /// Circular vertical arc: `to_grade_deg` with `radius_m` or `length_m`; `easement_m` at each end as for horizontal
    /// arcs.
    Arc,
    /// Curvature linear in s, up to the middle and down again: `to_grade_deg` with `length_m` or `radius_m` (the
    /// least).
    Transition,
    /// The `elements`, `times` times.
    Repeat,
}

/// One element of the vertical profile; its keys depend on its kind.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Vertical {
    /// Kind of element.
    pub kind: VerticalKind,
    /// Name, for windows of expectations (`after: {rear_enters: climb}`).
    pub name: Option<String>,
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
    /// Number of repetitions.
    pub times: Option<u32>,
    /// The elements that are repeated.
    pub elements: Option<Vec<Vertical>>,
}

/// Largest turn of an arc, degrees; more than a hundred turns count as a typing error.
const MAX_TURN_DEG: f64 = 36_000.0;

/// The keys of one element: which are there, which its kind takes, and errors that name them.
struct ElementKeys<'a> {
    path: &'a str,
    kind: &'static str,
}

impl ElementKeys<'_> {
    fn bad<T>(
        &self,
        key: &str,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Result<T, DataError> {
        Err(DataError::new(
            format!("{}.{key}", self.path),
            message,
            help,
        ))
    }

    fn only(&self, takes: &[&str], given: &[(&str, bool)]) -> Result<(), DataError> {
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

    fn need<T>(&self, key: &str, value: Option<T>) -> Result<T, DataError> {
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
        mut f: impl FnMut(&[E], &str) -> Result<(), DataError>,
    ) -> Result<(), DataError> {
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
    b: &mut AlignmentBuilder,
) -> Result<(), DataError> {
    for (i, e) in elements.iter().enumerate() {
        let path = format!("{list}[{i}]");
        let from_m = b.chainage_m();
        let given = [
            ("length_m", e.length_m.is_some()),
            ("radius_m", e.radius_m.is_some()),
            ("angle_deg", e.angle_deg.is_some()),
            ("easement_m", e.easement_m.is_some()),
            ("to_radius_m", e.to_radius_m.is_some()),
            ("times", e.times.is_some()),
            ("elements", e.elements.is_some()),
        ];
        let keys = |kind| ElementKeys { path: &path, kind };
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
                if angle == 0.0 || angle.abs() > MAX_TURN_DEG {
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
                            "+ turns left, − right; leave out the radius to end straight",
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
        named(&e.name, &path, from_m, b)?;
    }
    Ok(())
}

/// String a list of vertical elements together; `list` is its key path.
pub(super) fn vertical(
    elements: &[Vertical],
    list: &str,
    b: &mut AlignmentBuilder,
) -> Result<(), DataError> {
    for (i, e) in elements.iter().enumerate() {
        let path = format!("{list}[{i}]");
        let from_m = b.chainage_m();
        let given = [
            ("length_m", e.length_m.is_some()),
            ("radius_m", e.radius_m.is_some()),
            ("grade_deg", e.grade_deg.is_some()),
            ("to_grade_deg", e.to_grade_deg.is_some()),
            ("easement_m", e.easement_m.is_some()),
            ("times", e.times.is_some()),
            ("elements", e.elements.is_some()),
        ];
        let keys = |kind| ElementKeys { path: &path, kind };
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
                                "{grade}° does not fit: the element before ends at {reached:.6}°"
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
                        format!("the grade already is {to}°"),
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
        named(&e.name, &path, from_m, b)?;
    }
    Ok(())
}

/// Keeps the place of an element with a name; of a repeated element the first place counts.
fn named(
    name: &Option<String>,
    path: &str,
    from_m: f64,
    b: &mut AlignmentBuilder,
) -> Result<(), DataError> {
    let Some(name) = name else { return Ok(()) };
    match b.places.iter().find(|(_, place)| place.name == *name) {
        Some((at, _)) if at == path => Ok(()),
        Some(_) => Err(name_taken(path, name)),
        None => {
            let place = Place {
                name: name.clone(),
                from_m,
                to_m: b.chainage_m(),
            };
            b.places.push((path.to_owned(), place));
            Ok(())
        }
    }
}

/// Two elements have one name.
pub(super) fn name_taken(path: &str, name: &str) -> DataError {
    DataError::new(
        format!("{path}.name"),
        format!("another element already has the name `{name}`"),
        "give each result its own name element",
    )
}

fn steep(keys: &ElementKeys<'_>, key: &str, grade_deg: f64) -> Result<(), DataError> {
    if grade_deg.abs() > MAX_GRADE_DEG {
        return keys.bad(
            key,
            format!("a grade of {grade_deg}°"),
            format!("at most {MAX_GRADE_DEG}° up or down"),
        );
    }
    Ok(())
}
