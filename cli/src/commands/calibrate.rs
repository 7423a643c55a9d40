//! `monorig calibrate`: parameters of vehicle and instruments from a log.

use crate::arguments::assignment;
use crate::command::{Command, CommandOutcome, Program};
use crate::recording::standing_noise;
use crate::ui::errors::CliError;
use crate::ui::{output, tables};
use clap::ValueEnum;
use monorig_logs::identify::{Parameter, identify};
use monorig_logs::map::Map;
use std::path::PathBuf;

const CALIBRATE_EXAMPLES: &str = "\
Examples:
  monorig calibrate drive.mf4 --map crane.map.yaml --known mass,slope
  monorig calibrate --map drive.map.yaml --known mass,slope --json found.json

Finds torque gain, running resistance, lean and bias of the accelerometer, and
noise, each with its standard deviation; with `reference.speed` or
`reference.distance` in the map the radius of the wheels too; where the vehicle
stands for 12 s random walk and bias instability of the IMU. Mass and slope are
those under `reference` in the map.";

/// Find parameters of vehicle and instruments from a log whose mass and slope are known.
#[derive(Debug, clap::Parser)]
#[command(name = "calibrate", after_help = CALIBRATE_EXAMPLES)]
pub struct CalibrateArgs {
    /// The log: one file, or the folder in which the files of the map are; without it where the map says
    pub log: Option<PathBuf>,
    /// Map file: the quantities in the columns of the log
    #[arg(long, value_name = "MAP")]
    pub map: PathBuf,
    /// Quantities that are known of the drive
    #[arg(long, value_name = "WHAT,…", value_delimiter = ',', required = true)]
    pub known: Vec<Known>,
    /// Also write what was found as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Change a value of the map; may be given several times
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = assignment)]
    pub sets: Vec<(String, String)>,
}

/// Quantities of a drive that can be known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Known {
    /// The total mass
    Mass,
    /// The slope
    Slope,
}

impl Command for CalibrateArgs {
    fn run(&self, _: &Program<'_>) -> Result<CommandOutcome, CliError> {
        calibrate(self)
    }
}

/// Find the parameters.
fn calibrate(task: &CalibrateArgs) -> Result<CommandOutcome, CliError> {
    let map = Map::load_with(&task.map, task.log.as_deref(), &task.sets)?;
    for (what, key, is_there, why) in [
        (
            Known::Mass,
            "mass",
            map.has_mass(),
            "of mass and torque gain a drive tells no more than the ratio",
        ),
        (
            Known::Slope,
            "slope",
            map.has_slope(),
            "the bias of the accelerometer and the running resistance cannot be told apart without it",
        ),
    ] {
        if !task.known.contains(&what) || !is_there {
            let key = format!("reference.{key}");
            let help = format!("`--known mass,slope`, and `{key}` in the map");
            return Err(map.error(key, why, help).into());
        }
    }
    let mut found = identify(&map)?;
    found.extend(standing_noise::figures(&map)?);
    if let Some(path) = &task.json {
        // numbers and words: nothing that cannot be JSON
        let text = serde_json::to_string_pretty(&found).unwrap_or_default();
        output::write(path, &(text + "\n"))?;
    }
    output::print(&format!("{}\n", table(&found)))?;
    Ok(CommandOutcome::Held)
}

fn table(found: &[Parameter]) -> String {
    let mut table = tables::table(["parameter", "value", "sd", "unit", "is"]);
    for p in found {
        table.add_row([
            p.name.clone(),
            tables::number(p.value),
            tables::number(p.sd),
            p.unit.to_owned(),
            p.meaning.to_owned(),
        ]);
    }
    tables::lines(&table)
}
