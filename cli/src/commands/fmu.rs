//! `monorig fmu`: an estimator, or the plant of a scenario, as an FMU for another tool.

use crate::arguments::{assignment, value_of};
use crate::command::{Command, CommandOutcome, Program};
use crate::files::share;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use monorig_fmu::{Fmi, Package};
use monorig_sim::config::scenario::Settings;
use monorig_sim::record::whole;
use std::path::PathBuf;

const FMU_EXAMPLES: &str = "\
Examples:
  monorig fmu estimator rail_fusion --scenario scenarios/minimal.yaml \\
      --out rail_fusion.fmu
  monorig fmu estimator dffrls_aekf --scenario scenarios/minimal.yaml --fmi 3 \\
      --set lambda0=0.98 --out dffrls_aekf.fmu
  monorig fmu estimator two_state --library ./two_state.so \\
      --scenario scenarios/minimal.yaml --out two_state.fmu
      a library with monorig_estimator.h as an FMU, without FMI in it
  monorig fmu plant scenarios/minimal.yaml --out plant.fmu

FMUs for co-simulation, for Simulink and other tools. They have a binary for
the system that this program runs on, and those of --binary.";

/// Write an estimator or the plant of a scenario as an FMU.
#[derive(Debug, clap::Parser)]
#[command(name = "fmu", after_help = FMU_EXAMPLES)]
pub struct FmuArgs {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// An estimator: samples and commands in, mass, slope and speed out
    Estimator(EstimatorArgs),
    /// The plant of a scenario with its instruments: commands in, samples and truth out
    Plant(PlantArgs),
}

#[derive(Debug, clap::Args)]
struct EstimatorArgs {
    /// Name of the estimator (`monorig list estimators`); for a library its name there
    name: String,
    /// Scenario with the estimator's vehicle and its instruments
    #[arg(long, value_name = "SCENARIO", value_parser = share::named())]
    scenario: PathBuf,
    /// Shared library with the functions of monorig_estimator.h
    #[arg(long, value_name = "LIBRARY", conflicts_with = "binary")]
    library: Option<PathBuf>,
    /// Set a parameter to another value than its default; may be given several times
    #[arg(long = "set", value_name = "PARAMETER=VALUE", value_parser = assignment)]
    sets: Vec<(String, String)>,
    #[command(flatten)]
    out: OutArgs,
}

#[derive(Debug, clap::Args)]
struct PlantArgs {
    /// The scenario; its estimators and its controller are left out
    #[arg(value_parser = share::named())]
    scenario: PathBuf,
    /// Change a value of the scenario; may be given several times
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = assignment)]
    sets: Vec<(String, String)>,
    #[command(flatten)]
    out: OutArgs,
}

#[derive(Debug, clap::Args)]
struct OutArgs {
    /// The FMU to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Library of monorig for another machine, from its archive, such as `win64=monorig_fmu.dll`; may be given several
    /// times
    #[arg(long, value_name = "FOLDER=FILE", value_parser = monorig_fmu::binary)]
    binary: Vec<(String, PathBuf)>,
    /// Version of the standard
    #[arg(long, value_parser = ["2", "3"], default_value = "2")]
    fmi: String,
}

impl Command for FmuArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        match &self.what {
            What::Estimator(task) => {
                let mut settings = Settings::of_type(&task.name);
                for (key, value) in &task.sets {
                    settings = settings.set(key, value_of(value));
                }
                if let Some(library) = &task.library {
                    let file = std::fs::canonicalize(library).unwrap_or(library.clone());
                    settings = settings.in_library(&file.display().to_string(), file.clone());
                }
                let registry = program.registry;
                let fmu = monorig_fmu::estimator(&task.name, &settings, registry, &task.scenario);
                write(&fmu?, &task.out)
            }
            What::Plant(task) => write(&monorig_fmu::plant(&task.scenario, &task.sets)?, &task.out),
        }
    }
}

fn write(fmu: &Package, task: &OutArgs) -> Result<CommandOutcome, CliError> {
    let three = task.fmi == "3";
    let fmi = if three { Fmi::Three } else { Fmi::Two };
    let bytes = fmu.bytes(fmi, &monorig_fmu::library()?, &task.binary)?;
    whole::write(&task.out, &bytes)?;
    note(&format!("{} is in {}", fmu.name(), task.out.display()));
    Ok(CommandOutcome::Held)
}
