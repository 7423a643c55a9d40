//! Lines drawn from the channels: each as it is, and some again for the eye (degrees, ±2σ, errors against the truth).

use crate::colours;
use crate::source::{ErrorScale, ScalarSource};
use crate::stream::entity;
use monorig_sim::record::{Channel, Emphasis};
use re_sdk_types::archetypes::SeriesLines;
use rerun::EntityPath;

const DEG_PER_RAD: f64 = 180.0 / std::f64::consts::PI;

/// Estimates with a truth: channel of the estimate, channel of the truth, unit of the error and its scale.
const ERRORS: [(&str, &str, &str, ErrorScale); 3] = [
    (
        "total_mass",
        "truth/total_mass",
        "%",
        ErrorScale::PercentOfTruth,
    ),
    (
        "grade",
        "truth/grade_at_imu",
        "°",
        ErrorScale::Factor(DEG_PER_RAD),
    ),
    (
        "effective_grade",
        "truth/grade_effective",
        "°",
        ErrorScale::Factor(DEG_PER_RAD),
    ),
];
/// Limits that are drawn into the plots of consistency: name and value. χ²₁ is below 3.84 in 95 % and below 10.83 in
/// 99.9 % of all cases; a test ratio above 1 is outside of the gate.
const LIMITS: [(&str, f64); 3] = [
    ("nis_95", 3.841_458_820_694_124),
    ("nis_999", 10.827_566_170_662_733),
    ("gate", 1.0),
];

/// A line, or a pair, in plots.
#[derive(Clone, Debug)]
pub struct PlottedSeries {
    /// Entity of the recording.
    pub entity: EntityPath,
    /// Path of its channel.
    pub path: String,
    /// Unit of what is drawn.
    pub unit: String,
    /// Source of its values.
    pub line: ScalarSource,
    colour: [u8; 3],
    /// True for the estimator in the loop.
    in_loop: bool,
}

/// Returns all lines of these channels, the estimator in the loop with a stronger line over the others; then the
/// limits.
pub fn plan(channels: &[Channel], emphasis: &Emphasis<'_>) -> Vec<PlottedSeries> {
    let mut all = Vec::new();
    for (index, c) in channels.iter().enumerate() {
        let colour = colours::line(&c.path, index);
        let of = c.path.strip_prefix("estimates/");
        let of = of.and_then(|rest| rest.split('/').next());
        let in_loop = of.is_some() && of == emphasis.in_loop;
        let mut add = |prefix: &str, suffix: &str, unit: &str, line| {
            // a viewer draws in the order of the names: this one comes after `estimates`, and is drawn over the others
            let mut parts: Vec<&str> = c.path.split('/').collect();
            if in_loop && !prefix.is_empty() {
                parts[0] = "in_loop";
            }
            let parts = [prefix].into_iter().chain(parts).chain([suffix]);
            all.push(PlottedSeries {
                entity: entity(parts.filter(|p| !p.is_empty())),
                path: c.path.clone(),
                unit: unit.into(),
                line,
                colour,
                in_loop,
            });
        };
        let as_it_is = ScalarSource::Value {
            channel: index,
            scale: 1.0,
            valid: None,
        };
        add("", "", c.unit, as_it_is);
        if let Some((bound, unit)) = bound(channels, index) {
            add("display", "two_sigma", unit, bound);
        } else if !c.path.ends_with("_sd") && !c.path.ends_with("_protection") {
            for_the_eye(channels, index, &mut add);
        }
    }
    all.extend(LIMITS.map(|(name, limit)| PlottedSeries {
        entity: entity(["limits", name]),
        path: format!("limits/{name}"),
        unit: "1".into(),
        line: ScalarSource::Limit(limit),
        colour: colours::LIMIT,
        in_loop: false,
    }));
    all
}

/// The band of a Cramér-Rao bound round zero, and its unit: in the plots of the errors that it bounds.
fn bound(channels: &[Channel], sd: usize) -> Option<(ScalarSource, &'static str)> {
    let of = channels[sd].path.strip_prefix("bound/")?;
    let (_, truth, unit, scale) = ERRORS.iter().find(|e| e.0 == of)?;
    let line = ScalarSource::ErrorBand {
        level: None,
        sd,
        truth: channels.iter().position(|c| c.path == *truth)?,
        scale: *scale,
        valid: None,
    };
    Some((line, unit))
}

/// The lines of a channel beside the unchanged one: `add` gets a prefix and a suffix of the path, the unit, and where
/// the values are from.
fn for_the_eye(
    channels: &[Channel],
    index: usize,
    add: &mut impl FnMut(&str, &str, &str, ScalarSource),
) {
    let c = &channels[index];
    let find = |path: &str| channels.iter().position(|d| d.path == path);
    let beside = |what: &str| find(&format!("{}_{what}", c.path));
    let (unit, scale) = match c.unit {
        "rad" => ("°", DEG_PER_RAD),
        unit => (unit, 1.0),
    };
    let (valid, sd) = (beside("valid"), beside("sd"));
    let channel = index;
    if unit != c.unit || valid.is_some() {
        let line = ScalarSource::Value {
            channel,
            scale,
            valid,
        };
        add("display", "", unit, line);
    }
    if let Some(sd) = sd {
        let line = ScalarSource::Band {
            channel,
            sd,
            scale,
            valid,
        };
        add("display", "two_sigma", unit, line);
    }
    let of_estimator = |leaf: &str| {
        let inner = c.path.strip_prefix("estimates/")?;
        inner.strip_suffix(leaf)?.strip_suffix('/')
    };
    let error = ERRORS.iter().find(|e| of_estimator(e.0).is_some());
    let Some((_, truth, unit, scale)) = error else {
        return;
    };
    let (Some(truth), scale) = (find(truth), *scale) else {
        return;
    };
    let line = ScalarSource::Error {
        channel,
        truth,
        scale,
        valid,
    };
    add("display", "error", unit, line);
    if let Some(sd) = sd {
        let line = ScalarSource::ErrorBand {
            level: beside("protection"),
            sd,
            truth,
            scale,
            valid,
        };
        add("display", "error_band", unit, line);
    }
}

impl PlottedSeries {
    /// First part of the channel's path: `truth`, `sensors`, `estimates`, `internals`, `control`.
    pub fn group(&self) -> &str {
        self.path.split('/').next().unwrap_or_default()
    }

    /// Last part of the channel's path.
    pub fn leaf(&self) -> &str {
        self.path.rsplit('/').next().unwrap_or_default()
    }

    /// The part of the path between the two: the estimator, the sensor.
    pub fn owner(&self) -> &str {
        let inner = self.path.split_once('/').map_or("", |(_, rest)| rest);
        inner.rsplit_once('/').map_or("", |(owner, _)| owner)
    }

    /// True for lines that only a car has.
    pub fn is_of_car(&self) -> bool {
        self.path.starts_with("truth/road/")
    }

    /// True for an unchanged channel.
    pub fn is_raw(&self) -> bool {
        matches!(
            self.line,
            ScalarSource::Value {
                scale: 1.0,
                valid: None,
                ..
            }
        )
    }

    /// True for an error against the truth, or the band of one.
    pub fn is_error(&self) -> bool {
        matches!(
            self.line,
            ScalarSource::Error { .. } | ScalarSource::ErrorBand { .. }
        )
    }

    /// True for the error of an estimator, without its band.
    pub fn is_estimators_error(&self) -> bool {
        matches!(self.line, ScalarSource::Error { .. })
    }

    /// True if rows without a value are normal: an instrument has its own rate.
    pub fn is_sampled(&self) -> bool {
        matches!(self.group(), "sensors" | "aid" | "internals")
            || matches!(self.leaf(), "innovation" | "nis")
    }

    /// The estimator it is of, if it is of one.
    pub fn estimator(&self) -> Option<&str> {
        match self.group() {
            "estimates" | "internals" | "aid" => self.path.split('/').nth(1),
            _ => None,
        }
    }

    /// Name, colour and width in plots.
    pub fn style(&self) -> SeriesLines {
        let name = self.name();
        let [r, g, b] = self.colour;
        if self.line.width() == 2 {
            // Same name and colour as the estimate's: one entry in the legend for the three lines.
            return SeriesLines::new()
                .with_names([name.clone(), name])
                .with_colors([[r, g, b, 255]; 2])
                .with_widths(
                    [if self.group() == "bound" || self.in_loop {
                        1.2
                    } else {
                        0.6
                    }; 2],
                );
        }
        let width = match self.group() {
            "truth" if self.owner().is_empty() => 2.5,
            "estimates" if self.in_loop => 3.0,
            "estimates" => 1.8,
            "limits" => 0.8,
            _ => 1.2,
        };
        SeriesLines::new()
            .with_names([name])
            .with_colors([[r, g, b, 255]])
            .with_widths([width])
    }

    /// Name in legends. An error has the estimator's name only: the title of the plot has the quantity.
    pub fn name(&self) -> String {
        let (owner, leaf, unit) = (self.owner(), self.leaf(), &self.unit);
        match (self.group(), owner) {
            ("estimates", name) if self.is_error() => format!("{name} [{unit}]"),
            ("limits", _) => leaf.replace('_', " "),
            ("bound", _) if self.is_error() => format!("Cramér-Rao bound ±2σ [{unit}]"),
            (group, "") => format!("{group} {leaf} [{unit}]"),
            (_, owner) => format!("{owner} {leaf} [{unit}]"),
        }
    }
}

/// Names of the estimators, in the order of their channels.
pub fn estimators(channels: &[Channel]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for c in channels {
        let mut parts = c.path.split('/');
        if let (Some("estimates"), Some(name), Some(_)) = (parts.next(), parts.next(), parts.next())
            && !names.iter().any(|n| n == name)
        {
            names.push(name.into());
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(path: &str, unit: &'static str) -> Channel {
        Channel {
            path: path.into(),
            unit,
        }
    }

    #[test]
    fn limits_are_quantiles_of_chi_squared_and_the_gate() {
        // χ²₁ is the square of a standard normal: 1.96 and 3.29 sigma
        let roots = LIMITS.map(|(_, limit)| limit.sqrt());
        assert!((roots[0] - 1.959_964).abs() < 1e-6);
        assert!((roots[1] - 3.290_527).abs() < 1e-6);
        assert_eq!(roots[2], 1.0);
    }

    #[test]
    fn every_channel_once_as_it_is_and_radians_again_in_degrees() {
        let channels = [
            channel("truth/grade_at_imu", "rad"),
            channel("estimates/jekf/grade", "rad"),
            channel("estimates/jekf/grade_sd", "rad"),
            channel("sensors/imu/specific_force_x", "m/s²"),
        ];
        let all = plan(&channels, &Emphasis::default());
        let of = |path: &str| all.iter().find(|s| s.entity == path.into()).unwrap();
        for (i, c) in channels.iter().enumerate() {
            let raw = of(&c.path);
            assert_eq!(
                raw.line,
                ScalarSource::Value {
                    channel: i,
                    scale: 1.0,
                    valid: None
                }
            );
            assert_eq!(raw.unit, c.unit);
        }
        let scale = 180.0 / std::f64::consts::PI;
        let degrees = of("display/truth/grade_at_imu");
        let line = ScalarSource::Value {
            channel: 0,
            scale,
            valid: None,
        };
        assert_eq!(degrees.line, line);
        let band = of("display/estimates/jekf/grade/two_sigma");
        assert_eq!(
            band.line,
            ScalarSource::Band {
                channel: 1,
                sd: 2,
                scale,
                valid: None
            }
        );
        let error = of("display/estimates/jekf/grade/error");
        let line = ScalarSource::Error {
            channel: 1,
            truth: 0,
            scale: ErrorScale::Factor(scale),
            valid: None,
        };
        assert_eq!((&error.line, error.unit.as_str()), (&line, "°"));
        assert!(of("display/estimates/jekf/grade/error_band").is_error());
        assert_eq!(all.len(), 4 + 2 + 1 + 2 + LIMITS.len());
    }

    /// A viewer draws lines in the order of their names, and later ones over earlier ones.
    #[test]
    fn the_estimator_in_the_loop_comes_last() {
        let channels = [
            channel("truth/total_mass", "kg"),
            channel("estimates/a/total_mass", "kg"),
            channel("estimates/z/total_mass", "kg"),
        ];
        let emphasis = Emphasis {
            in_loop: Some("a"),
            ..Emphasis::default()
        };
        let all = plan(&channels, &emphasis);
        let mut errors: Vec<_> = all.iter().filter(|s| s.is_error()).collect();
        errors.sort_by_key(|s| s.entity.clone());
        let names: Vec<_> = errors.iter().map(|s| s.estimator()).collect();
        assert_eq!(names, [Some("z"), Some("a")]);
    }
}
