//! The files in the folder of a run, read back.

use crate::reports::page::Section;
use crate::reports::plot::Figure;
use crate::reports::plot::axis::Axis;
use crate::reports::plot::line::{Happening, Line, LineChart, stretches_without};
use crate::reports::plot::theme::Ink;
use crate::verdicts::summary::Summary;
use monorig_estimators::registry::{Kind, kind};
use monorig_sim::config::file::{input_error, read_result};
use monorig_sim::config::scenario::Settings;
use monorig_sim::error::Error;
use monorig_sim::record::manifest::Manifest;
use monorig_sim::record::readback;
use monorig_sim::record::readback::Columns;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A run.
pub(crate) struct Recorded {
    pub(crate) folder: PathBuf,
    pub(crate) manifest: Manifest,
    /// Metrics and verdicts.
    pub(crate) summary: Summary,
    /// Events: time in s and text.
    pub(crate) events: Vec<(f64, String)>,
    columns: Columns,
}

/// Largest number of events that are drawn; later events are left out.
const MOST: usize = 60;

/// Radians as degrees.
pub(crate) const DEGREES: f64 = 180.0 / std::f64::consts::PI;

impl Recorded {
    /// Read it. A folder without one of its files, or with one that breaks off or is of another run, is an error.
    pub(crate) fn read(folder: &Path) -> Result<Self, Error> {
        let path = |name: &str| -> Result<PathBuf, Error> {
            let path = folder.join(name);
            match path.is_file() {
                true => Ok(path),
                false => Err(input_error(
                    folder,
                    "",
                    format!("this is not the folder of a run: it has no {name}"),
                    crate::reports::TAKES,
                )),
            }
        };
        let manifest = Manifest::read(&path("manifest.json")?)?;
        for needed in ["metrics.json", "channels.parquet"] {
            path(needed)?;
        }
        // a recording that was removed to save room is no damage to a report
        let needed = ["metrics.json", "channels.parquet"];
        let there = manifest.outputs.keys().map(String::as_str);
        let there = there.filter(|name| folder.join(name).is_file() && !needed.contains(name));
        for name in needed.into_iter().chain(there) {
            manifest.verify(folder, name)?;
        }
        let metrics = path("metrics.json")?;
        let summary = summary(&metrics)?;
        summary.check().map_err(|message| {
            input_error(
                &metrics,
                "",
                message,
                "make the run again with `monorig run`",
            )
        })?;
        let channels = path("channels.parquet")?;
        let replayed = manifest
            .resolved
            .get("log")
            .is_some_and(|log| !log.is_null());
        let wanted = |name: &str| is_shown(name) || (replayed && is_measured(name));
        let (contents, columns) = readback::columns(&channels, wanted)?;
        let seed = manifest.seed.to_string();
        if (contents.scenario.as_str(), contents.seed.as_str()) != (&manifest.scenario, &seed)
            || (&summary.scenario, summary.seed) != (&manifest.scenario, manifest.seed)
        {
            return Err(input_error(
                folder,
                "",
                format!(
                    "the files in this folder belong to different runs: manifest.json to {} seed {seed}, channels.parquet to {} \
                     seed {}, metrics.json to {} seed {}",
                    manifest.scenario,
                    contents.scenario,
                    contents.seed,
                    summary.scenario,
                    summary.seed
                ),
                "make the run again with `monorig run`",
            ));
        }
        let events = contents.events.into_iter();
        Ok(Self {
            folder: folder.into(),
            manifest,
            summary,
            events: events.map(|(ns, text)| (ns as f64 * 1e-9, text)).collect(),
            columns,
        })
    }

    /// True for a replayed log: its truth is a reference.
    pub(crate) fn is_replay(&self) -> bool {
        self.map().is_some()
    }

    /// The map of a replayed log.
    fn map(&self) -> Option<&serde_json::Value> {
        self.manifest.resolved.get("log")?.get("map")
    }

    /// Standard deviation of a reference in the map of a replayed log, in the unit of its key.
    pub(crate) fn reference_sd(&self, of: &str, key: &str) -> Option<f64> {
        self.map()?.get("reference")?.get(of)?.get(key)?.as_f64()
    }

    /// Purpose of the scenario.
    pub(crate) fn why(&self) -> &str {
        self.manifest.resolved["why"].as_str().unwrap_or_default()
    }

    /// Types and parameters of the estimators; empty if the manifest has no readable ones.
    pub(crate) fn estimator_settings(&self) -> BTreeMap<String, Settings> {
        let estimators = self.manifest.resolved["estimators"].clone();
        serde_json::from_value(estimators).unwrap_or_default()
    }

    /// Estimators with their colours: first those that are judged, ours and the one in the loop, then the others.
    pub(crate) fn estimators(&self) -> impl Iterator<Item = (&str, Ink)> {
        let names = || self.summary.estimators.keys().map(String::as_str);
        let of = |main: bool| names().filter(move |name| self.is_main(name) == main);
        let all: Vec<&str> = of(true).chain(of(false)).collect();
        all.into_iter().map(|name| (name, Ink::of_estimator(name)))
    }

    /// The estimator whose output the controller gets.
    pub(crate) fn in_loop(&self) -> Option<&str> {
        self.manifest.resolved["in_loop"].as_str()
    }

    /// True for an estimator that is never folded: one that is judged, one of ours, or the one in the loop. All are, if
    /// none is judged.
    pub(crate) fn is_main(&self, name: &str) -> bool {
        let settings = self.estimator_settings();
        let is = settings.get(name).map_or(name, |of| of.type_name(name));
        let ours = matches!(kind(is), Some(Kind::Ours | Kind::Supervised));
        self.summary.is_main(name) || ours || self.in_loop() == Some(name)
    }

    /// A section with the figures of the estimators that are never folded, and the folded figures of the others.
    pub(crate) fn folding(
        &self,
        section: Section,
        what: &str,
        figures: impl IntoIterator<Item = (String, Figure)>,
    ) -> Section {
        let figures = figures.into_iter();
        let (main, others): (Vec<_>, Vec<_>) = figures.partition(|(name, _)| self.is_main(name));
        let section = section.figures(main.into_iter().map(|(_, figure)| figure));
        let others: Vec<Figure> = others.into_iter().map(|(_, figure)| figure).collect();
        match others.len() {
            0 => section,
            n => section.folded_figures(
                format!("{what} of baselines, which are not judged: {n}"),
                others,
            ),
        }
    }

    /// An empty chart over time, with the events of the run.
    pub(crate) fn chart(&self, title: impl Into<String>, y: Axis) -> LineChart {
        let mut chart = LineChart::new(title, Axis::linear("time, s"), y);
        chart.happenings = self.happenings();
        chart
    }

    /// A figure of lines over time.
    pub(crate) fn figure(&self, title: &str, y: Axis, lines: Vec<Line>) -> Figure {
        let mut chart = self.chart(title, y);
        chart.lines = lines;
        chart.figure()
    }

    /// A column over time, times a factor, as a line.
    pub(crate) fn line(
        &self,
        (name, ink): (&str, Ink),
        column: &str,
        factor: f64,
    ) -> Result<Line, Error> {
        Ok(Line::new(name, ink, self.over_time(column, factor)?))
    }

    /// Faults, slippery stretches and events, each with the times at which it began and ended, s.
    pub(crate) fn happenings(&self) -> Vec<Happening> {
        let events = self.manifest.resolved.get("events");
        let events = events.and_then(|events| events.as_array());
        let mut all: Vec<Happening> = events
            .into_iter()
            .flatten()
            .flat_map(|e| self.happening(e))
            .collect();
        all.truncate(MOST);
        all
    }

    /// Time of an event of the scenario.
    fn happening(&self, event: &serde_json::Value) -> Vec<Happening> {
        let end_s = self.summary.simulated_s;
        let number = |key: &str| event.get(key).and_then(serde_json::Value::as_f64);
        let text = |key: &str| event.get(key).and_then(serde_json::Value::as_str);
        let with_unit = |key: &str, unit: &str| number(key).map(|x| format!("{x} {unit}"));
        let what = match (text("sensor"), text("fault")) {
            (Some(sensor), Some(fault)) => Some(format!("{sensor}: {fault}")),
            _ => None,
        };
        let what = what
            .or_else(|| with_unit("load_mass_kg", "kg of load"))
            .or_else(|| with_unit("clamp_mpa", "MPa of clamp pressure"))
            .or_else(|| number("brake").map(|x| format!("emergency brake, {:.0} %", 100.0 * x)))
            .or_else(|| number("adhesion").map(|x| format!("adhesion {x}")));
        let name = match (text("name"), what) {
            (Some(name), Some(what)) => format!("{name} ({what})"),
            (name, what) => name.map(str::to_owned).or(what).unwrap_or_default(),
        };
        let at = |from: f64, to: f64| Happening {
            name: name.clone(),
            from,
            to,
        };
        match (
            number("from_s"),
            number("at_s"),
            number("from_m"),
            number("to_m"),
        ) {
            (Some(from), ..) => vec![at(from, number("to_s").unwrap_or(end_s).min(end_s))],
            (_, Some(first), ..) => {
                let every = number("every_s").filter(|s| *s > 0.0);
                let times = (0..MOST).map_while(|i| match (i, every) {
                    (0, _) => Some(first),
                    (i, Some(every)) => Some(first + every * i as f64),
                    _ => None,
                });
                times
                    .take_while(|t| *t <= end_s)
                    .map(|t| at(t, t))
                    .collect()
            }
            (_, _, Some(from), Some(to)) => {
                let rows = self.times().ok().zip(self.find("truth/chainage"));
                let (times, chainage) = rows.unwrap_or_default();
                let rows = times.iter().zip(chainage);
                let inside = rows.map(|(t, s)| (*t, !(from..=to).contains(s)));
                let stretches = stretches_without(inside).into_iter();
                stretches.map(|(from, to)| at(from, to)).collect()
            }
            _ => Vec::new(),
        }
    }

    /// A column; a missing column is an error.
    pub(crate) fn column(&self, name: &str) -> Result<&[f64], Error> {
        self.columns.get(name)
    }

    /// A column that may be missing.
    pub(crate) fn find(&self, name: &str) -> Option<&[f64]> {
        self.columns.find(name)
    }

    /// Times of the rows, s.
    pub(crate) fn times(&self) -> Result<&[f64], Error> {
        self.column("time")
    }

    /// A column over time, times a factor.
    pub(crate) fn over_time(&self, name: &str, factor: f64) -> Result<Vec<(f64, f64)>, Error> {
        let rows = self.times()?.iter().zip(self.column(name)?);
        Ok(rows.map(|(t, x)| (*t, x * factor)).collect())
    }

    /// True if a column has a value beyond ± `limit`.
    pub(crate) fn exceeds(&self, name: &str, limit: f64) -> Result<bool, Error> {
        Ok(self.column(name)?.iter().any(|x| x.abs() > limit))
    }
}

/// True for a column that is drawn. Columns of a long run are many megabytes each, so the others are not read.
fn is_shown(name: &str) -> bool {
    let hidden = ["internals/", "sensors/", "aid/", "truth/balance/"];
    let of_drive = name.starts_with("truth/drive_") && !name.ends_with("/motor_torque");
    !of_drive && !hidden.iter().any(|start| name.starts_with(start))
}

/// True for a measurement of a replayed log that is drawn.
fn is_measured(name: &str) -> bool {
    let ends = ["/wheel_speed", "/motor_torque"];
    name.starts_with("sensors/")
        && (name.starts_with("sensors/imu/") || ends.iter().any(|end| name.ends_with(end)))
}

fn summary(path: &Path) -> Result<Summary, Error> {
    serde_json::from_str(&read_result(path)?).map_err(|e| {
        input_error(
            path,
            "",
            format!("these are not the metrics of a run: {e}"),
            "make the metrics again with `monorig run`",
        )
    })
}
