//! Points of a survey from a CSV file: along the rail (chainage, height, perhaps heading), a map (chainage, grade,
//! perhaps heading, standard deviations), or in space (x east, y north, z up).
//!
//! From grades the height is the integral of their sines by the trapezoidal rule, from 0 on. From points in space the
//! chainage is the sum of the chords between them and the heading that of the chord round each point.

use crate::config::file::input_error;
use crate::error::{Error, wrong};
use std::path::Path;

/// Columns along the rail, the last of them if it was surveyed.
const ALONG: [&str; 3] = ["s_m", "height_m", "heading_deg"];
/// Columns of a map, as `monorig log track` writes them.
const MAP: [&str; 5] = [
    "s_m",
    "grade_deg",
    "sd_deg",
    "heading_deg",
    "heading_sd_deg",
];
/// Columns in space.
const SPACE: [&str; 3] = ["x_m", "y_m", "z_m"];

/// Such as `3 points`.
fn count(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// A point of a survey.
#[derive(Debug)]
pub(super) struct SurveyPoint {
    /// Chainage along the rail, m.
    pub s: f64,
    /// m.
    pub height: f64,
    /// Degrees, + left, if it was surveyed.
    pub heading: Option<f64>,
}

/// The points of a CSV file.
pub(super) fn points(text: &str, file: &Path) -> Result<Vec<SurveyPoint>, Error> {
    let at = |line: u64, message: String, help: &str| -> Error {
        wrong(file, usize::try_from(line).ok(), message, help)
    };
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let semicolons = |line: &csv::StringRecord| line.iter().any(|word| word.contains(';'));
    let mut columns: Vec<String> = Vec::new();
    let mut points: Vec<SurveyPoint> = Vec::new();
    let mut last_place: Option<[f64; 3]> = None;
    let mut places: Vec<[f64; 2]> = Vec::new();
    let mut last_sine: Option<f64> = None;
    for record in reader.records() {
        let record = record.map_err(|e| {
            let line = e.position().map_or(0, csv::Position::line);
            at(line, e.to_string(), "comma-separated numbers")
        })?;
        let line = record.position().map_or(0, csv::Position::line);
        if record.get(0).is_some_and(|word| word.starts_with('#')) {
            continue;
        }
        if semicolons(&record) {
            return Err(at(
                line,
                "you have semicolons between the values, and perhaps decimal commas".into(),
                "commas between the values and decimal points, such as `12.5,0.83`: a spreadsheet writes them with English number format",
            ));
        }
        if columns.is_empty() {
            columns = record.iter().map(str::to_owned).collect();
            let known = [&ALONG[..2], &ALONG, &MAP[..2], &MAP[..3], &MAP, &SPACE];
            if !known.iter().any(|names| columns == *names) {
                return Err(at(
                    line,
                    format!("the first line is `{}`", columns.join(",")),
                    "the names of the columns: s_m,height_m or s_m,height_m,heading_deg or s_m,grade_deg,sd_deg or s_m,grade_deg,sd_deg,heading_deg,heading_sd_deg or x_m,y_m,z_m",
                ));
            }
            continue;
        }
        if record.len() != columns.len() {
            return Err(at(
                line,
                format!(
                    "{} where there are {} columns",
                    count(record.len(), "value"),
                    columns.len()
                ),
                "as many numbers as there are columns, with decimal points",
            ));
        }
        let number = |i: usize| -> Result<f64, Error> {
            let word = record.get(i).unwrap_or("");
            let right = word
                .parse::<f64>()
                .ok()
                .filter(|x| x.is_finite() && x.abs() < 1e9);
            right.ok_or_else(|| {
                let found = match word {
                    "" => "nothing".to_owned(),
                    word => format!("`{word}`"),
                };
                at(
                    line,
                    format!("{found} in column {}", columns[i]),
                    "a finite number",
                )
            })
        };
        let point = if columns == SPACE {
            let place = [number(0)?, number(1)?, number(2)?];
            let step = last_place
                .replace(place)
                .map_or(0.0, |last| distance(last, place));
            SurveyPoint {
                s: points.last().map_or(0.0, |p: &SurveyPoint| p.s) + step,
                height: place[2],
                heading: None,
            }
        } else if columns.get(1).is_some_and(|name| name == MAP[1]) {
            let (s, sine) = (number(0)?, libm::sin(number(1)?.to_radians()));
            let before = last_sine.replace(sine).unwrap_or(sine);
            let rise = points.last().map_or(0.0, |last: &SurveyPoint| {
                last.height + 0.5 * (before + sine) * (s - last.s)
            });
            // the standard deviations are for who reads the map
            for place in [2, 4].into_iter().filter(|i| *i < columns.len()) {
                number(place)?;
            }
            SurveyPoint {
                s,
                height: rise,
                heading: (columns.len() == MAP.len())
                    .then(|| number(3))
                    .transpose()?,
            }
        } else {
            SurveyPoint {
                s: number(0)?,
                height: number(1)?,
                heading: (columns.len() == 3).then(|| number(2)).transpose()?,
            }
        };
        if columns == SPACE {
            places.push([number(0)?, number(1)?]);
        }
        if let Some(last) = points.last() {
            let ds = point.s - last.s;
            if ds < 1e-3 {
                let message = format!("chainage {} m after {} m", point.s, last.s);
                return Err(at(
                    line,
                    message,
                    "chainages that grow by at least 1 mm from line to line",
                ));
            }
            if (point.height - last.height).abs() >= ds {
                let message = format!(
                    "the height changes by {:.3} m over {ds:.3} m of rail",
                    point.height - last.height
                );
                return Err(at(
                    line,
                    message,
                    "a height change smaller than the length of rail it takes",
                ));
            }
        }
        points.push(point);
    }
    if points.len() < 4 {
        return Err(input_error(
            file,
            "",
            format!("the survey has {}", count(points.len(), "point")),
            "a line with the names of the columns, then at least 4 points",
        ));
    }
    if points[points.len() - 1].s - points[0].s > crate::rail::alignment::MAX_LENGTH_M {
        return Err(input_error(
            file,
            "",
            format!(
                "the survey is longer than {} m",
                crate::rail::alignment::MAX_LENGTH_M
            ),
            "chainages in metres",
        ));
    }
    for (i, heading) in headings(&places).into_iter().enumerate() {
        if let Some(point) = points.get_mut(i) {
            point.heading = Some(heading);
        }
    }
    Ok(points)
}

/// Length of the chord between two points, m: of points 5 m apart in a bend of 10 m it is 1 % less than the rail.
fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let square = |k: usize| (b[k] - a[k]) * (b[k] - a[k]);
    libm::sqrt(square(0) + square(1) + square(2))
}

/// Headings of points on the plan, degrees: of the chord from the point before to the one behind, at the ends of the
/// only chord.
fn headings(places: &[[f64; 2]]) -> Vec<f64> {
    let last = places.len().saturating_sub(1);
    (0..places.len())
        .map(|i| {
            let (a, b) = (places[i.saturating_sub(1)], places[(i + 1).min(last)]);
            libm::atan2(b[1] - a[1], b[0] - a[0]).to_degrees()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Vec<SurveyPoint>, Error> {
        points(text, Path::new("survey.csv"))
    }

    #[test]
    fn bad_surveys_name_the_line() {
        for (text, line, word) in [
            ("s,h\n0,0\n", ":1:", "s_m,height_m"),
            ("s_m,height_m\n0,0\n1,x\n", ":3:", "`x`"),
            ("s_m,height_m\n0,0\n# a comment\n1,NaN\n", ":4:", "`NaN`"),
            ("s_m,height_m\n0,0\n1,0.1\n1,0.2\n", ":4:", "grow"),
            ("s_m,height_m\n0,0\n1,0.1\n0.5,0.2\n", ":4:", "grow"),
            ("s_m,height_m\n0,0\n1,1.1\n", ":3:", "height change"),
            ("s_m,height_m\n0,0\n1\n", ":3:", "as many"),
            ("s_m;height_m\n0,0;1,5\n", ":1:", "semicolons"),
            ("s_m,height_m\n0;0\n", ":2:", "decimal points"),
            ("x_m,y_m,z_m\n0,0,0\n0,0,0\n", ":3:", "grow"),
        ] {
            let e = parsed(text).err().unwrap().to_string();
            assert!(e.contains(line) && e.contains(word), "{text}: {e}");
        }
        assert!(parsed("s_m,height_m\n0,0\n1,0\n2,0\n").is_err());
        assert!(parsed("").is_err());
    }

    /// A map: heights by the sines of its grades, headings as they stand; its standard deviations must be numbers.
    #[test]
    fn a_map_has_grades_and_perhaps_headings() {
        let title = "s_m,grade_deg,sd_deg,heading_deg,heading_sd_deg\n";
        let rows = "0,30,0.1,0,0.2\n1,30,0.1,5,0.2\n2,30,0.1,10,0.2\n3,30,0.1,15,0.2\n";
        let with = parsed(&format!("{title}{rows}")).unwrap();
        let headings: Vec<_> = with.iter().map(|p| p.heading).collect();
        assert_eq!(headings, [0.0, 5.0, 10.0, 15.0].map(Some));
        assert!((with[3].height - 1.5).abs() < 1e-12);
        let without = parsed("s_m,grade_deg\n0,30\n1,30\n2,30\n3,30\n").unwrap();
        assert!(without.iter().all(|p| p.heading.is_none()));
        let bad = format!("{title}{}", rows.replace("15,0.2", "15,x"));
        let told = parsed(&bad).err().unwrap().to_string();
        assert!(
            told.contains(":5:") && told.contains("heading_sd_deg"),
            "{told}"
        );
    }

    /// A helix by its points: the chainage is its length, the heading that of its tangent, but for the ends.
    #[test]
    fn points_in_space_have_chainage_and_heading() {
        let (radius, rise): (f64, f64) = (50.0, 0.1);
        let mut text = "x_m,y_m,z_m\n".to_owned();
        for i in 0..100 {
            let a = 0.02 * f64::from(i);
            let (x, y) = (radius * libm::sin(a), radius * (1.0 - libm::cos(a)));
            text += &format!("{},{},{}\n", 4.5e6 + x, 3.2e6 + y, rise * radius * a);
        }
        let points = parsed(&text).unwrap();
        let whole = radius * 1.98 * (1.0 + rise * rise).sqrt();
        assert!(
            (points[99].s - whole).abs() < 1e-3 * whole,
            "{}",
            points[99].s
        );
        for (i, p) in points.iter().enumerate().take(99).skip(1) {
            let heading = (0.02 * i as f64).to_degrees();
            assert!((p.heading.unwrap() - heading).abs() < 0.01, "{i}");
        }
    }
}
