//! Surveyed tracks: points (chainage, height, perhaps heading) from a CSV file, smoothed by a spline.
//!
//! The chainage is measured along the rail, as by a wheel rolled along it, so that the height's derivative is sin θ. The
//! first point becomes chainage 0. Heights are smoothed to the stated standard deviation of the survey (`spline.rs`); the
//! curvature of the result is continuous, and zero at both ends.

use crate::config::checked::NonNegative;
use crate::config::file::{input_error, named, read_text};
use crate::error::{Error, InputError};
use crate::rail::alignment::{Angle, Law, Piece};
use crate::rail::spline::Spline;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A survey in a track file.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Survey {
    /// CSV file with the columns `s_m`, `height_m` and perhaps `heading_deg` (+ left), relative to the track file; lines
    /// that begin with # are comments.
    pub file: String,
    /// Standard deviation of a height, m; 0 = the rail passes through every point.
    pub height_noise_m: NonNegative,
    /// Standard deviation of a heading, degrees.
    #[serde(default = "exact")]
    pub heading_noise_deg: NonNegative,
}

fn exact() -> NonNegative {
    NonNegative::new(0.0)
}

/// Heading (if surveyed), grade and height of the first point, m.
pub(super) type Surveyed = (Option<Angle>, Angle);

/// Read and smooth a survey; `track` is the file that names it.
pub(super) fn read(survey: &Survey, track: &Path) -> Result<Surveyed, Error> {
    let file = named(track, "survey.file", &survey.file)?;
    let points = points(&read_text(&file)?, &file)?;
    let s: Vec<f64> = points.iter().map(|p| p.s - points[0].s).collect();
    let heights: Vec<f64> = points.iter().map(|p| p.height).collect();
    let grade = grade(
        &Spline::smooth(&s, &heights, survey.height_noise_m.get()),
        &file,
    )?;
    let headings: Option<Vec<f64>> = points.iter().map(|p| p.heading).collect();
    let heading = headings.map(|h| {
        heading(&Spline::smooth(
            &s,
            &unwrapped(h),
            survey.heading_noise_deg.get().to_radians(),
        ))
    });
    Ok((heading, grade))
}

/// sin θ is the derivative of the height.
fn grade(heights: &Spline, file: &Path) -> Result<Angle, Error> {
    let pieces: Vec<Piece> = heights
        .cubics()
        .map(|(from, to, c)| piece(from, to, Law::Sine([c[1], 2.0 * c[2], 3.0 * c[3]])))
        .collect();
    let angle = joined(pieces);
    for p in &angle.pieces {
        let (_, steepest) = p.extremes();
        if steepest > super::elements::MAX_GRADE_DEG.to_radians() {
            return Err(input_error(
                file,
                "",
                format!(
                    "the surveyed rail is {:.1}° steep between chainage {} and {} m",
                    steepest.to_degrees(),
                    p.from,
                    p.to
                ),
                format!(
                    "at most {}°: check for outliers, or state a larger height_noise_m",
                    super::elements::MAX_GRADE_DEG
                ),
            ));
        }
    }
    Ok(angle)
}

fn heading(headings: &Spline) -> Angle {
    joined(
        headings
            .cubics()
            .map(|(from, to, c)| piece(from, to, Law::Polynomial(c)))
            .collect(),
    )
}

fn piece(from: f64, to: f64, law: Law) -> Piece {
    Piece {
        from,
        to,
        law,
        bend_key: "survey".into(),
        angle_key: "survey".into(),
    }
}

fn joined(pieces: Vec<Piece>) -> Angle {
    let mut angle = Angle {
        start: 0.0,
        end: 0.0,
        pieces,
    };
    let length = angle.length();
    angle.start = angle.value(0.0);
    angle.end = angle.value(length * (1.0 - 1e-15));
    angle
}

/// Headings without the jump between 359° and 0°, rad.
fn unwrapped(degrees: Vec<f64>) -> Vec<f64> {
    let mut last = degrees.first().copied().unwrap_or(0.0);
    degrees
        .into_iter()
        .map(|h| {
            last = h - 360.0 * ((h - last) / 360.0).round();
            last.to_radians()
        })
        .collect()
}

const COLUMNS: [&str; 3] = ["s_m", "height_m", "heading_deg"];

/// Such as `3 points`.
fn count(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

struct SurveyPoint {
    s: f64,
    height: f64,
    heading: Option<f64>,
}

fn points(text: &str, file: &Path) -> Result<Vec<SurveyPoint>, Error> {
    let at = |line: u64, message: String, help: &str| -> Error {
        InputError {
            file: file.into(),
            line: usize::try_from(line).ok(),
            column: Some(1),
            key: String::new(),
            message,
            help: help.into(),
        }
        .into()
    };
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut columns: Vec<String> = Vec::new();
    let mut points: Vec<SurveyPoint> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| {
            let line = e.position().map_or(0, csv::Position::line);
            at(line, e.to_string(), "comma-separated numbers")
        })?;
        let line = record.position().map_or(0, csv::Position::line);
        if record.get(0).is_some_and(|word| word.starts_with('#')) {
            continue;
        }
        if columns.is_empty() {
            columns = record.iter().map(str::to_owned).collect();
            if columns != COLUMNS[..2] && columns != COLUMNS {
                return Err(at(
                    line,
                    format!("the first line is `{}`", columns.join(",")),
                    "the names of the columns: s_m,height_m or s_m,height_m,heading_deg",
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
        let point = SurveyPoint {
            s: number(0)?,
            height: number(1)?,
            heading: if columns.len() == 3 {
                Some(number(2)?)
            } else {
                None
            },
        };
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
    Ok(points)
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
        ] {
            let e = parsed(text).err().unwrap().to_string();
            assert!(e.contains(line) && e.contains(word), "{text}: {e}");
        }
        assert!(parsed("s_m,height_m\n0,0\n1,0\n2,0\n").is_err());
        assert!(parsed("").is_err());
    }

    /// A survey of a known rail, with errors of a known size: the grade comes back.
    #[test]
    fn a_noisy_survey_gives_the_grade_back() {
        let sigma = 0.002;
        let height = |s: f64| 2.0 * libm::sin(s / 20.0);
        let s: Vec<f64> = (0..=200).map(f64::from).collect();
        // a triangle-wave "noise" of known root mean square: amplitude/√3, incommensurable with the points
        let y: Vec<f64> = s
            .iter()
            .map(|s| {
                height(*s) + sigma * 3.0_f64.sqrt() * (2.0 * (s * 0.618_034_f64).fract() - 1.0)
            })
            .collect();
        let smooth = grade(&Spline::smooth(&s, &y, sigma), Path::new("s.csv")).unwrap();
        let rough = grade(&Spline::smooth(&s, &y, 0.0), Path::new("s.csv")).unwrap();
        let error = |a: &Angle| {
            (0..1900)
                .map(|i| 5.0 + 0.1 * f64::from(i))
                .map(|s| (a.value(s) - libm::asin(0.1 * libm::cos(s / 20.0))).abs())
                .fold(0.0, f64::max)
        };
        assert!(
            error(&smooth) < 0.1_f64.to_radians(),
            "{}",
            error(&smooth).to_degrees()
        );
        assert!(error(&smooth) < 0.5 * error(&rough));
    }

    #[test]
    fn headings_do_not_jump_at_north() {
        let h = unwrapped(vec![350.0, 359.0, 3.0, 12.0, 355.0, -20.0]);
        for w in h.windows(2) {
            assert!((w[1] - w[0]).abs() < 0.5);
        }
    }
}
