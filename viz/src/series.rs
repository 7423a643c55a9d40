//! Which lines are drawn from the channels: each as it is, and some again for the eye (degrees, ±2σ).

use crate::stream::entity;
use monorig_sim::record::Channel;
use re_sdk_types::archetypes::SeriesLines;
use rerun::EntityPath;

const DEG_PER_RAD: f64 = 180.0 / std::f64::consts::PI;
const TRUTH: [u8; 3] = [235, 235, 235];
const REFERENCE: [u8; 3] = [255, 190, 60];
/// Colours of estimators and of other lines, distinguished by people with red-green weakness too (Okabe and Ito, 2008).
const PALETTE: [[u8; 3]; 7] = [
    [86, 180, 233],
    [230, 159, 0],
    [0, 190, 140],
    [240, 228, 66],
    [213, 94, 0],
    [204, 121, 167],
    [120, 140, 255],
];

/// How values of a chunk become scalars of an entity.
#[derive(Clone, Debug, PartialEq)]
pub enum ScalarSource {
    /// `scale` × the channel.
    Value {
        /// Index of the channel.
        channel: usize,
        /// Factor, such as 180/π.
        scale: f64,
        /// Index of the channel that is 1 where the value is valid; without it, it always is.
        valid: Option<usize>,
    },
    /// Two scalars a row: `scale` × (value − 2 sd) and `scale` × (value + 2 sd).
    Band {
        /// Index of the value's channel.
        channel: usize,
        /// Index of its standard deviation's channel.
        sd: usize,
        /// Factor.
        scale: f64,
        /// As above.
        valid: Option<usize>,
    },
}

/// A line, or a pair, in plots.
#[derive(Clone, Debug)]
pub struct PlottedSeries {
    /// Where it is recorded.
    pub entity: EntityPath,
    /// Path of its channel.
    pub path: String,
    /// Unit of what is drawn.
    pub unit: String,
    /// Where its values come from.
    pub line: ScalarSource,
    colour: [u8; 3],
}

/// All lines of these channels.
pub fn plan(channels: &[Channel]) -> Vec<PlottedSeries> {
    let estimators = estimators(channels);
    let mut all = Vec::new();
    for (channel, c) in channels.iter().enumerate() {
        let colour = colour(&c.path, channel, &estimators);
        let mut add = |prefix: &str, suffix: &str, unit: &str, line| {
            let parts = [prefix]
                .into_iter()
                .chain(c.path.split('/'))
                .chain([suffix]);
            all.push(PlottedSeries {
                entity: entity(parts.filter(|p| !p.is_empty())),
                path: c.path.clone(),
                unit: unit.into(),
                line,
                colour,
            });
        };
        add(
            "",
            "",
            c.unit,
            ScalarSource::Value {
                channel,
                scale: 1.0,
                valid: None,
            },
        );
        if c.path.ends_with("_sd") {
            continue;
        }
        let (unit, scale) = match c.unit {
            "rad" => ("°", DEG_PER_RAD),
            unit => (unit, 1.0),
        };
        let beside = |what: &str| {
            let path = format!("{}_{what}", c.path);
            channels.iter().position(|d| d.path == path)
        };
        let valid = beside("valid");
        if unit != c.unit || valid.is_some() {
            let line = ScalarSource::Value {
                channel,
                scale,
                valid,
            };
            add("display", "", unit, line);
        }
        if let Some(sd) = beside("sd") {
            let line = ScalarSource::Band {
                channel,
                sd,
                scale,
                valid,
            };
            add("display", "two_sigma", unit, line);
        }
    }
    all
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

    /// What stands between the two: the estimator, the sensor.
    pub fn owner(&self) -> &str {
        let inner = self.path.split_once('/').map_or("", |(_, rest)| rest);
        inner.rsplit_once('/').map_or("", |(owner, _)| owner)
    }

    /// Whether it is of a car, and of nothing else that moves.
    pub fn is_of_car(&self) -> bool {
        self.path.starts_with("truth/road/")
    }

    /// Whether it is the unchanged channel.
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

    /// Name, colour and width in plots.
    pub fn style(&self) -> SeriesLines {
        let who = match self.owner() {
            "" => self.group(),
            owner => owner,
        };
        let name = format!("{who} {} [{}]", self.leaf(), self.unit);
        let [r, g, b] = self.colour;
        if let ScalarSource::Band { .. } = self.line {
            // Same name and colour as the estimate's: one entry in the legend for the three lines.
            return SeriesLines::new()
                .with_names([name.clone(), name])
                .with_colors([[r, g, b, 255]; 2])
                .with_widths([0.6, 0.6]);
        }
        let width = match self.group() {
            "truth" if self.owner().is_empty() => 2.5,
            "estimates" => 1.8,
            _ => 1.2,
        };
        SeriesLines::new()
            .with_names([name])
            .with_colors([[r, g, b, 255]])
            .with_widths([width])
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

fn colour(path: &str, index: usize, estimators: &[String]) -> [u8; 3] {
    let mut parts = path.split('/');
    match (parts.next(), parts.next(), parts.next()) {
        // The primary truth is white; others of the same unit must differ from it.
        (Some("truth"), Some("pitch_at_imu"), None) => [170, 170, 200],
        (Some("truth"), Some("grade_effective"), None) => [150, 130, 110],
        (Some("truth"), Some(leaf), None)
            if !["resistance", "brake", "load_mass"].contains(&leaf)
                && !leaf.starts_with("sway") =>
        {
            TRUTH
        }
        (Some("control"), Some(leaf), None) if leaf.starts_with("reference") => REFERENCE,
        (Some("estimates"), Some(name), _) => {
            let k = estimators.iter().position(|e| e == name).unwrap_or(0);
            PALETTE[k % PALETTE.len()]
        }
        _ => PALETTE[index % PALETTE.len()],
    }
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
    fn every_channel_once_as_it_is_and_radians_again_in_degrees() {
        let channels = [
            channel("truth/grade_at_imu", "rad"),
            channel("estimates/jekf/grade", "rad"),
            channel("estimates/jekf/grade_sd", "rad"),
            channel("sensors/imu/specific_force_x", "m/s²"),
        ];
        let all = plan(&channels);
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
        assert_eq!(all.len(), 4 + 2 + 1);
    }
}
