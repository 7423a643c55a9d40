//! `monorig run`: simulate a scenario and report.

use crate::CommandOutcome;
use crate::commands::shared::assignment;
use crate::files::prepare;
use crate::simulate::{RecordOptions, simulate};
use crate::ui::errors::CliError;
use crate::ui::interrupt;
use crate::ui::note::note;
use crate::ui::output;
use crate::ui::progress::ProgressDisplay;
use crate::ui::summary;
use clap::ValueEnum;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::record::whole;
use std::path::Path;
use std::path::PathBuf;

const RUN_EXAMPLES: &str = "\
Examples:
  monorig run scenarios/liu2023_section1.yaml
  monorig run scenarios/minimal.yaml --seed 7 --set 'drive.speed[2].mps=0.5' --set 'estimators.joint_ekf_robust={}'
  monorig run scenarios/minimal.yaml --plant point-mass --no-rerun   fast: a point on the rail, no 3-D recording

Results: OUT/<scenario>/<seed>/ with manifest.json (what was run), channels.parquet (every signal),
metrics.json, and, with the viewer built in, run.rrd to open in Rerun.";

/// `monorig run`
#[derive(Debug, clap::Args)]
#[command(after_help = RUN_EXAMPLES)]
pub struct RunArgs {
    /// Scenario file
    pub file: PathBuf,
    /// Run this seed instead of the scenario's first
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Folder the results go to
    #[arg(long, value_name = "DIR", default_value = "runs")]
    pub out: PathBuf,
    /// Also stream to a Rerun viewer that is open on this machine
    #[arg(long, conflicts_with = "no_rerun")]
    pub live: bool,
    /// Do not write run.rrd
    #[arg(long)]
    pub no_rerun: bool,
    /// Record long runs at the full rate too, instead of at half of it after two hours (360 000 rows), a quarter after four …
    #[arg(long)]
    pub full_rate: bool,
    /// Move the train with this plant instead of the scenario's
    #[arg(long, value_name = "PLANT")]
    pub plant: Option<PlantChoice>,
    /// Change a value of the scenario; may be given several times
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = assignment)]
    pub sets: Vec<(String, String)>,
}

impl RunArgs {
    /// All changes to the scenario as `(path, value)`.
    pub fn overrides(&self) -> Vec<(String, String)> {
        let mut all = self.sets.clone();
        if let Some(seed) = self.seed {
            all.push(("seeds".into(), seed.to_string()));
        }
        if let Some(plant) = self.plant {
            let word = match plant {
                PlantChoice::Rapier => "rapier",
                PlantChoice::PointMass => "point-mass",
            };
            all.push(("physics.plant".into(), word.into()));
        }
        all
    }
}

/// What moves the train.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PlantChoice {
    /// Rigid bodies in rapier
    Rapier,
    /// A point on the rail
    PointMass,
}

/// Simulate a scenario with one seed: the one asked for, else the first of the scenario; all of them are for tests and
/// comparisons. Nothing is written before the whole input has been found good.
pub fn run(task: &RunArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let simulation = prepare::simulation(&task.file, &task.overrides(), registry)?;
    prepare_out(&task.out)?;
    interrupt::listen();
    let mut progress = ProgressDisplay::new(&format!(
        "{} seed {}",
        simulation.scenario.name, simulation.seed
    ));
    let options = RecordOptions {
        out: &task.out,
        live: task.live,
        no_rerun: task.no_rerun,
        full_rate: task.full_rate,
        registry,
    };
    let run = simulate(simulation, &options, &mut |share| {
        progress.at(share);
        interrupt::go_on()
    })?;
    drop(progress);
    note(&format!("results in {}", run.folder.display()));
    output::print(&summary::text(&run.summary, run.wall_s))?;
    if run.interrupted {
        return Err(CliError::Interrupted);
    }
    if !run.summary.finished {
        note("the train did not come to where the scenario ends (`stop.at_m`)");
        return Ok(CommandOutcome::Failed);
    }
    Ok(if run.summary.good() {
        CommandOutcome::Held
    } else {
        CommandOutcome::Failed
    })
}

/// The folder for results is there and can be written, found out before a long run and not after it.
pub fn prepare_out(out: &Path) -> Result<(), CliError> {
    let refused = |source| CliError::Out {
        path: out.into(),
        source,
    };
    std::fs::create_dir_all(out).map_err(refused)?;
    let probe = out.join(format!(".monorig-{}", whole::unique()));
    std::fs::write(&probe, b"can this be written?").map_err(refused)?;
    std::fs::remove_file(&probe).map_err(refused)
}
