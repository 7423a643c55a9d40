//! `monorig log calibrate`: find parameters of vehicle and instruments from a log, and write them into its map.

use crate::arguments::{Foreign, assignment};
use crate::command::CommandOutcome;
use crate::recording::standing_noise;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::{output, tables};
use clap::ValueEnum;
use monorig_lab::verdicts::measure::SummaryObserver;
use monorig_lab::verdicts::summary::AFTER_S;
use monorig_logs::check::identify;
use monorig_logs::identify::{Applied, Parameter, apply, write};
use monorig_logs::map::Map;
use monorig_logs::replay::{ReplayOptions, simulation};
use monorig_sim::closed_loop::registry::Registry;
use std::collections::BTreeMap;
use std::path::PathBuf;

const CALIBRATE_EXAMPLES: &str = "\
Examples:
  monorig log calibrate drive.mf4 --map crane.map.yaml --known mass,slope
  monorig log calibrate --map drive.map.yaml --known slope
      bias and mount of the IMU, without traction or mass
  monorig log calibrate --map drive.map.yaml --known mass,slope --json found.json
  monorig log calibrate --map drive.map.yaml --known mass,slope --split 60
      values of the first 60 s, and the errors of the map's estimators on the
      rest, without and with these values
  monorig log calibrate --map drive.map.yaml --known mass,slope --split 60 --apply
      the same, and write the values into the map

Finds lean and bias of the accelerometer, pitch and roll of its box, bias of the
gyro, and noise, each with its standard deviation; with mass and traction torque
gain, running resistance and air drag of a road vehicle; with `reference.speed`
or `reference.distance` in the map the radius of the wheels; where the vehicle
stands for 12 s random walk and bias instability of the IMU. Mass and slope are
those under `reference` in the map.";

/// Find parameters of vehicle and instruments from a log with known slope, or with known mass and slope.
#[derive(Debug, clap::Args)]
#[command(after_help = CALIBRATE_EXAMPLES)]
pub struct CalibrateArgs {
    /// The log: one file, or the folder with the files of the map; without LOG the paths in the map
    pub log: Option<PathBuf>,
    /// Map file: the quantities in the columns of the log
    #[arg(long, value_name = "MAP")]
    pub map: PathBuf,
    /// Quantities of the drive that are known
    #[arg(long, value_name = "WHAT,…", value_delimiter = ',', required = true)]
    pub known: Vec<Known>,
    /// Write the values found into the map file: gains, running resistance, drag, lean, biases and mount, each with its
    /// standard deviation as a comment; other comments stay
    #[arg(long)]
    pub apply: bool,
    /// Find the values in the first S seconds, and judge the estimators of the map on the rest
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub split: Option<f64>,
    /// Also write the values found as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Change a value of the map; may be given several times
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = assignment)]
    pub sets: Vec<(String, String)>,
    #[command(flatten)]
    pub foreign: Foreign,
}

/// Quantities of a drive that can be known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Known {
    /// The total mass
    Mass,
    /// The slope
    Slope,
}

fn seconds(text: &str) -> Result<f64, String> {
    let number = text
        .parse::<f64>()
        .ok()
        .filter(|s| s.is_finite() && *s > 0.0);
    number.ok_or_else(|| "write a number of seconds above zero".to_owned())
}

/// Find the parameters.
pub fn run(task: &CalibrateArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let load = |more: &[(String, String)]| {
        let sets = [task.sets.as_slice(), more].concat();
        Map::load_with(&task.map, task.log.as_deref(), &sets)
    };
    let part = |key: &str| {
        let s = task.split.map(|s| (format!("trim.{key}"), s.to_string()));
        Vec::from_iter(s)
    };
    let mut sets = part("until_s");
    if !task.known.contains(&Known::Mass) {
        sets.push(("reference.mass".to_owned(), "null".to_owned()));
    }
    let map = load(&sets)?;
    for (what, key, is_there) in [
        (Known::Mass, "mass", map.has_mass()),
        (Known::Slope, "slope", map.has_slope()),
    ] {
        if task.known.contains(&what) != is_there {
            let why =
                "a calibration needs the slope of the drive, and torque gains need the mass too";
            let help = format!(
                "`--known slope` or `--known mass,slope`, and `reference.{key}` in the map"
            );
            return Err(map.error(format!("reference.{key}"), why, help).into());
        }
    }
    let (mut found, lacks) = identify(&map)?;
    found.extend(standing_noise::figures(&map)?);
    if let Some(path) = &task.json {
        // numbers and words: nothing that cannot be JSON
        let text = serde_json::to_string_pretty(&found).unwrap_or_default();
        output::write(path, &(text + "\n"))?;
    }
    output::print(&format!("{}\n", table(&found)))?;
    for lack in &lacks {
        note(&format!("not found: {lack}"));
    }
    let applied = apply(&map, &found);
    if let Some(from_s) = task.split {
        let rest = part("from_s");
        let sets: Vec<_> = applied
            .iter()
            .map(|a| (a.key.clone(), a.value.clone()))
            .collect();
        let before = judged(&load(&rest)?, registry)?;
        let after = judged(&load(&[rest, sets].concat())?, registry)?;
        output::print(&format!("\n{}\n", compared(&before, &after, from_s)))?;
    }
    match task.split {
        None => note(
            "values of the whole drive: an error on the same drive is in-sample; `--split S` judges on the rest",
        ),
        Some(s) => note(&format!("values of the first {s} s, judged on the rest")),
    }
    if task.apply {
        write(&map, &applied, &source(&map, task.split))?;
        let keys: Vec<&str> = applied.iter().map(|a| a.key.as_str()).collect();
        let at = task.map.display();
        note(&format!("{at} now has: {}", keys.join(", ")));
    } else {
        note(&format!(
            "`--apply` would write into the map: {}",
            settings(&applied)
        ));
    }
    Ok(CommandOutcome::Held)
}

/// Description of the drive on which the values were found, for the comments in a map.
fn source(map: &Map, split: Option<f64>) -> String {
    match split {
        None => format!("{} (in-sample)", map.log_names()),
        Some(s) => format!("{}, 0 to {s} s", map.log_names()),
    }
}

fn settings(applied: &[Applied]) -> String {
    let each = applied.iter().map(|a| format!("{}={}", a.key, a.value));
    each.collect::<Vec<_>>().join(" ")
}

/// Metrics that show the benefit of a calibration, with their factor.
const SHOWN: [(&str, f64); 6] = [
    ("slope_rmse_deg", 1.0),
    ("slope_bias_deg", 1.0),
    ("slope_availability", 100.0),
    ("mass_bias", 100.0),
    ("mass_error_rel_end", 100.0),
    ("mass_availability", 100.0),
];
/// Metrics of the estimators of a map over the part of the log that the map plays.
fn judged(map: &Map, registry: &Registry) -> Result<Vec<(String, Vec<f64>)>, CliError> {
    let mut simulation = simulation(map, &ReplayOptions::default(), registry)?;
    let mut observer = SummaryObserver::default();
    let outcome = simulation.run(&mut [&mut observer])?;
    let summary = observer.summary(&simulation.scenario, 0, &outcome);
    let of = |(name, values): (String, BTreeMap<String, Option<f64>>)| {
        let value = |(metric, factor): &(&str, f64)| {
            let x = values.get(*metric).copied().flatten();
            x.map_or(f64::NAN, |x| x * factor)
        };
        (name, SHOWN.iter().map(value).collect())
    };
    Ok(summary.estimators.into_iter().map(of).collect())
}

/// Errors before and after, side by side.
fn compared(before: &[(String, Vec<f64>)], after: &[(String, Vec<f64>)], from_s: f64) -> String {
    let title = format!("from {} s on", from_s + AFTER_S);
    let titles = [
        title.as_str(),
        "slope\nRMSE °",
        "bias °",
        "valid %",
        "mass\nbias %",
        "at end %",
        "valid %",
    ];
    let number = |x: &f64| match x.is_nan() {
        true => "-".to_owned(),
        false => tables::number(*x),
    };
    let row = |title: &str, values: &[f64]| {
        let numbers = values.iter().map(number);
        std::iter::once(title.to_owned()).chain(numbers).collect()
    };
    let groups: Vec<(String, Vec<Vec<String>>)> = before
        .iter()
        .zip(after)
        .map(|((name, a), (_, b))| (name.clone(), vec![row("before", a), row("after", b)]))
        .collect();
    tables::grouped(&titles, &groups)
}

/// A line for the name of each parameter and a line for its value; several wheels or motors have their root mean
/// square.
fn table(found: &[Parameter]) -> String {
    let mut rows = Vec::new();
    let numbered = |p: &Parameter| {
        let (name, number) = p.name.rsplit_once(' ')?;
        number.parse::<u32>().ok().map(|_| name.to_owned())
    };
    let mut groups: Vec<(Option<String>, Vec<&Parameter>)> = Vec::new();
    for p in found {
        let name = numbered(p);
        match groups.last_mut() {
            Some((of, group)) if name.is_some() && *of == name => group.push(p),
            _ => groups.push((name, vec![p])),
        }
    }
    for (name, group) in groups {
        let Some(first) = group.first() else {
            continue;
        };
        let n = group.len() as f64;
        let mean = |of: fn(&Parameter) -> f64| {
            (group.iter().map(|p| of(p).powi(2)).sum::<f64>() / n).sqrt()
        };
        let (name, value) = match name.filter(|_| group.len() > 1) {
            Some(name) => (format!("{name} 1 to {}", group.len()), mean(|p| p.value)),
            None => (first.name.clone(), first.value),
        };
        // the rest of the sentence is in the JSON
        let is = first.meaning.split([':', ';', ',']).next();
        let row = vec![
            is.unwrap_or_default().to_owned(),
            tables::number(value),
            tables::number(mean(|p| p.sd)),
            first.unit.to_owned(),
        ];
        rows.push((name, vec![row]));
    }
    tables::grouped(&["parameter", "value", "± sd", "unit"], &rows)
}
