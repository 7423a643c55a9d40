//! Surveyed tracks: points from a CSV file (`points`), smoothed by a spline.
//!
//! The chainage is measured along the rail, as by a wheel rolled along it, so that the height's derivative is sin θ.
//! The first point becomes chainage 0. Heights are smoothed to the stated standard deviation of the survey
//! (`spline.rs`); the curvature of the result is continuous, and zero at both ends.

use crate::config::checked::NonNegative;
use crate::config::file::{input_error, named, read_text};
use crate::config::track::points::{SurveyPoint, points};
use crate::error::Error;
use crate::rail::alignment::{Angle, Law, Piece};
use crate::rail::spline::Spline;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A survey in a track file.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Survey {
    /// CSV file with the columns `s_m`, `height_m` and perhaps `heading_deg` (+ left), or `s_m`, `grade_deg` and
    /// perhaps `sd_deg`, `heading_deg`, `heading_sd_deg`, or `x_m`, `y_m`, `z_m`; relative to the track file; lines
    /// that begin with # are comments.
    pub file: String,
    /// Standard deviation of a height, m, such as 0.003; 0 = the rail passes through every point.
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
    let points: Vec<SurveyPoint> = points(&read_text(&file)?, &file)?;
    let s: Vec<f64> = points.iter().map(|p| p.s - points[0].s).collect();
    let heights: Vec<f64> = points.iter().map(|p| p.height).collect();
    let smoothed = Spline::smooth(&s, &heights, survey.height_noise_m.get());
    keeps_relief(&smoothed, &s, &heights, survey, track)?;
    let grade = grade(&smoothed, &file)?;
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

/// Relief, in standard deviations of a height, below which relief and noise cannot be separated.
const MAX_DEVIATIONS: f64 = 3.0;
/// No survey of a rail is worse than this standard deviation, m: what is stated beyond it explains no relief.
const MAX_PLAUSIBLE_NOISE_M: f64 = 0.1;
/// Least share of the relief (the spread of the heights about the chord of the track) that smoothing may leave.
const MIN_RELIEF: f64 = 0.9;

/// A line smoothed too much is another track: it must keep the relief of the points.
fn keeps_relief(
    smoothed: &Spline,
    s: &[f64],
    heights: &[f64],
    survey: &Survey,
    track: &Path,
) -> Result<(), Error> {
    let noise = survey.height_noise_m.get();
    if noise == 0.0 {
        return Ok(());
    }
    let line = smoothed.knots();
    let (before, after) = (relief(s, heights), relief(s, line));
    // what is noise by what is stated is no relief
    if before > MAX_DEVIATIONS * noise.min(MAX_PLAUSIBLE_NOISE_M) && after < MIN_RELIEF * before {
        let message = format!(
            "smoothing with {noise} m leaves {:.0} % of the track's relief ({before:.3} m)",
            100.0 * after / before
        );
        let help = "the standard deviation of a height in metres, such as height_noise_m: 0.003 (a levelled survey; 0.03 from satellites)";
        return Err(input_error(track, "survey.height_noise_m", message, help));
    }
    Ok(())
}

/// Standard deviation of heights about the straight line from the first to the last point, m.
fn relief(s: &[f64], heights: &[f64]) -> f64 {
    let (Some(first), Some(last), Some(end)) = (heights.first(), heights.last(), s.last()) else {
        return 0.0;
    };
    let off = s
        .iter()
        .zip(heights)
        .map(|(s, h)| h - first - (last - first) * s / end);
    libm::sqrt(off.map(|x| x * x).sum::<f64>() / heights.len() as f64)
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
                    "at most {}°: check for outliers, or state a larger height_noise_m (0.003 is usual)",
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

#[cfg(test)]
mod tests {
    use super::*;

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

    /// A map of grades, as `monorig log track` writes it, is the rail with these grades.
    #[test]
    fn grades_of_a_map_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let grade_deg = |s: f64| 8.0 * libm::sin(s / 15.0);
        let mut csv = "s_m,grade_deg,sd_deg\n".to_owned();
        for i in 0..400 {
            let s = 0.25 * f64::from(i);
            csv += &format!("{s},{},0.02\n", grade_deg(s));
        }
        std::fs::write(folder.path().join("map.csv"), csv).unwrap();
        let survey = Survey {
            file: "map.csv".into(),
            height_noise_m: NonNegative::new(0.0),
            heading_noise_deg: exact(),
        };
        let (heading, grade) = read(&survey, &folder.path().join("track.yaml")).unwrap();
        assert!(heading.is_none());
        for i in 0..190 {
            let s = 2.0 + 0.5 * f64::from(i);
            let off = grade.value(s).to_degrees() - grade_deg(s);
            assert!(off.abs() < 1e-3, "{s}: {off}");
        }
    }

    fn judged(noise_m: f64, heights: &[f64]) -> Result<(), Error> {
        let s: Vec<f64> = (0..heights.len()).map(|i| 5.0 * i as f64).collect();
        let survey = Survey {
            file: "s.csv".into(),
            height_noise_m: NonNegative::new(noise_m),
            heading_noise_deg: exact(),
        };
        let smoothed = Spline::smooth(&s, heights, noise_m);
        keeps_relief(&smoothed, &s, heights, &survey, Path::new("track.yaml"))
    }

    /// A track with crests of 1 m: with 3 mm of noise it stays, with 10 m it would be a straight line.
    #[test]
    fn smoothing_that_flattens_a_track_is_told() {
        let heights: Vec<f64> = (0..100).map(|i| libm::sin(0.2 * f64::from(i))).collect();
        assert!(judged(0.0, &heights).is_ok());
        assert!(judged(0.003, &heights).is_ok());
        let told = judged(10.0, &heights).unwrap_err().to_string();
        assert!(told.contains("relief") && told.contains("0.003"), "{told}");
        // a straight incline has no relief to lose
        let straight: Vec<f64> = (0..100).map(|i| 0.1 * f64::from(i)).collect();
        assert!(judged(10.0, &straight).is_ok());
    }

    #[test]
    fn headings_do_not_jump_at_north() {
        let h = unwrapped(vec![350.0, 359.0, 3.0, 12.0, 355.0, -20.0]);
        for w in h.windows(2) {
            assert!((w[1] - w[0]).abs() < 0.5);
        }
    }
}
