//! `monorig stress`: a battery of conditions for estimators, one at a time.

use crate::arguments::{Jobs, NamedEstimator, Out, assignment, named, seeds, shard, share};
use crate::command::{Command, CommandOutcome, Program};
use crate::files::scenarios::scenarios;
use crate::identity::identity;
use crate::ui::errors::CliError;
use crate::ui::interrupt;
use crate::ui::note::note;
use crate::ui::output;
use crate::ui::progress::ProgressDisplay;
use crate::ui::terminal;
use crate::verdicts::stress::{compared, print_matrix};
use monorig_lab::batch::{Shard, in_order};
use monorig_lab::reports::stress::report;
use monorig_lab::stress::{
    Battery, Condition, StressFile, StressHeader, StressRun, StressStore, WantedEstimator,
};
use monorig_sim::closed_loop::registry::Registry;
use std::path::{Path, PathBuf};
use std::time::Instant;

const STRESS_EXAMPLES: &str = "\
Examples:
  monorig stress --estimators rail_fusion
      every condition in assets/conditions over the scenarios in scenarios/stress
  monorig stress --estimators rail_fusion,mine --html stress.html --json stress.json
  monorig stress --estimators mine --conditions my_conditions --only oil
      also the conditions of a folder of yours; only those with `oil` in the name
  monorig stress my_scenario.yaml --estimators mine --seeds 1..5
  monorig stress --estimators mine --against stress.json
      exit code 1 if a cell has become worse
  monorig stress --shard 2/4 --json 2.json
      every fourth run; `monorig merge 1.json … --into stress.json` joins them

Each condition is applied by itself, and all estimators of a run see the same
measurements: none of them is in the loop. Stopped, it goes on where it was when
it is started again.";

/// Try estimators under a battery of conditions: told values, instruments, delivery, rail, train.
#[derive(Debug, clap::Parser)]
#[command(name = "stress", after_help = STRESS_EXAMPLES)]
pub struct StressArgs {
    /// Scenario files, or folders of them
    #[arg(default_value = "scenarios/stress")]
    pub scenarios: Vec<PathBuf>,
    /// Estimators to try, by name or as NAME=TYPE; without it those of the scenarios
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = named)]
    pub estimators: Vec<NamedEstimator>,
    /// Folder of conditions beside those of monorig; may be given several times
    #[arg(long, value_name = "DIR")]
    pub conditions: Vec<PathBuf>,
    /// Only conditions with one of these texts in their name or group
    #[arg(long, value_name = "TEXTS", value_delimiter = ',')]
    pub only: Vec<String>,
    /// Run these seeds instead of the scenarios' own: `7`, `1..50` or `1,5,9`
    #[arg(long, value_name = "SEEDS", value_parser = seeds)]
    pub seeds: Option<String>,
    /// Change a value of every scenario; may be given several times
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = assignment)]
    pub sets: Vec<(String, String)>,
    #[command(flatten)]
    pub jobs: Jobs,
    /// Make only part K of N of the runs, for `monorig merge` to join with the others
    #[arg(long, value_name = "K/N", value_parser = shard, requires = "json", conflicts_with_all = ["html", "against"])]
    pub shard: Option<Shard>,
    /// Write matrix and runs as JSON; `-` is standard output
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write the matrix as a page
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Compare with what --json wrote earlier; a cell that has become worse fails
    #[arg(long, value_name = "FILE")]
    pub against: Option<PathBuf>,
    /// Share by which an error may be worse; shares of samples may be worse by 1 %
    #[arg(long, value_name = "SHARE", value_parser = share, default_value = "5%", requires = "against")]
    pub worse_than: f64,
    #[command(flatten)]
    pub out: Out,
}

/// Folder of monorig's conditions.
const CONDITIONS: &str = "assets/conditions";

impl Command for StressArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        stress(self, program.registry)
    }
}

/// Make the runs that are not there yet, and put them together.
fn stress(task: &StressArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let before = task.against.as_deref().map(StressFile::read).transpose()?;
    let begun = Instant::now();
    let battery = battery(task, registry)?;
    interrupt::listen();
    for path in task
        .html
        .iter()
        .chain(task.json.iter().filter(|p| !is_stdout(p)))
    {
        output::clear(path)?;
    }
    let shard = task.shard.unwrap_or(Shard::WHOLE);
    let header = battery.header(shard, &identity());
    let (store, runs) = resume(task, &header, &battery)?;
    let runs = make(task, &battery, shard, store, runs, registry)?;
    for run in runs.iter().filter(|r| r.error.is_some()) {
        let why = run.error.as_deref().unwrap_or_default();
        note(&format!("{} broke down: {why}", run.words()));
    }
    let took = begun.elapsed().as_secs_f64();
    let made = runs.len();
    let file = StressFile::new(&battery, &header, runs);
    if let Some(path) = &task.html {
        output::write(path, &report(&file).to_html())?;
    }
    match &task.json {
        Some(path) if is_stdout(path) => output::print(&file.to_json())?,
        Some(path) => output::write(path, &file.to_json())?,
        None => {}
    }
    if task.shard.is_none() && !task.json.as_deref().is_some_and(is_stdout) {
        print_matrix(&file, terminal::verbose())?;
    }
    note(&format!("{made} runs in {took:.1} s"));
    let worse = match before {
        Some(before) => compared(&before, &file, task.worse_than)?,
        None => false,
    };
    Ok(match worse {
        true => CommandOutcome::Failed,
        false => CommandOutcome::Held,
    })
}

fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Reads scenarios and conditions, and checks them against each other.
fn battery(task: &StressArgs, registry: &Registry) -> Result<Battery, CliError> {
    let mut folders = vec![PathBuf::from(CONDITIONS)];
    folders.retain(|ours| task.conditions.is_empty() || ours.is_dir());
    folders.extend(task.conditions.iter().cloned());
    let mut conditions = Condition::load_all(&folders)?;
    if !task.only.is_empty() {
        conditions.retain(|c| task.only.iter().any(|text| c.is_called(text)));
        if conditions.is_empty() {
            let message = format!(
                "no condition has `{}` in its name",
                task.only.join("` or `")
            );
            return Err(CliError::refused(
                message,
                format!("a part of a name in {CONDITIONS}"),
            ));
        }
    }
    let mut sets = task.sets.clone();
    sets.extend(task.seeds.iter().map(|s| ("seeds".to_owned(), s.clone())));
    let wanted: Vec<WantedEstimator> = task
        .estimators
        .iter()
        .map(|e| (e.name.clone(), e.is.clone()))
        .collect();
    let scenarios = scenarios(&task.scenarios, None)?;
    let battery = Battery::load(&scenarios, conditions, &wanted, &sets, registry)?;
    for left_out in battery.left_out() {
        note(&format!("left out: {left_out}"));
    }
    Ok(battery)
}

/// Opens the results of an earlier start of this battery, or begins them.
fn resume(
    task: &StressArgs,
    header: &StressHeader,
    battery: &Battery,
) -> Result<(StressStore, Vec<StressRun>), CliError> {
    let folder = task.out.get().join("stress").join(header.short_hash());
    std::fs::create_dir_all(&folder).map_err(|source| CliError::Out {
        path: folder.clone(),
        source,
    })?;
    let name = match task.shard {
        None => "results.jsonl".to_owned(),
        Some(Shard { part, of }) => format!("results.{part}-of-{of}.jsonl"),
    };
    Ok(StressStore::resume_battery(
        &folder.join(name),
        header,
        battery,
    )?)
}

/// Makes the runs that are not there.
fn make(
    task: &StressArgs,
    battery: &Battery,
    shard: Shard,
    mut store: StressStore,
    mut runs: Vec<StressRun>,
    registry: &Registry,
) -> Result<Vec<StressRun>, CliError> {
    let all = shard.runs(battery.runs());
    if !runs.is_empty() {
        note(&format!("{} of {all} runs are there already", runs.len()));
    }
    let mut progress = ProgressDisplay::new("stress");
    let rest = (store.rows()..all).map(|n| shard.index(n));
    let work = |index| battery.run(index, registry, &interrupt::go_on);
    in_order(task.jobs.get(), rest, work, |done| {
        if let Some(run) = done.map_err(|_| CliError::Interrupted)? {
            store.append(&run)?;
            runs.push(run);
        }
        progress.at(store.rows() as f64 / all.max(1) as f64);
        Ok::<(), CliError>(())
    })?;
    Ok(runs)
}
