//! `monorig stress`: try estimators under a battery of conditions, one condition at a time.

use crate::arguments::{Changes, Jobs, NamedEstimator, Out, RANGES, named, shard, share};
use crate::command::{Command, CommandOutcome, Program};
use crate::files::out;
use crate::files::scenarios::scenarios;
use crate::files::share;
use crate::identity::identity;
use crate::recording::many::resumed;
use crate::ui::errors::CliError;
use crate::ui::interrupt;
use crate::ui::note::note;
use crate::ui::output;
use crate::ui::terminal;
use crate::verdicts::stress::{compared, judge_matrix, print_matrix};
use monorig_lab::batch::Interrupted;
use monorig_lab::campaign::{self, Shard};
use monorig_lab::draw::{self, RangesFile};
use monorig_lab::reports::stress::report;
use monorig_lab::stress::{
    Battery, Condition, Pairing, StressFile, WantedEstimator, fault, fault_name,
};
use monorig_sim::closed_loop::registry::Registry;
use std::path::PathBuf;
use std::time::Instant;

const STRESS_EXAMPLES: &str = "\
Examples:
  monorig stress --estimators rail_fusion
      every condition in assets/conditions over the scenarios in scenarios/stress
  monorig stress --estimators rail_fusion,mine --html stress.html --json stress.json
  monorig stress --estimators mine --conditions my_conditions --only oil
      also the conditions of your folder; only conditions with `oil` in the name
  monorig stress my_scenario.yaml --estimators mine --seeds 1..5
  monorig stress --estimators mine --against stress.json
      exit code 1 if a cell has become worse
  monorig stress --drawn 100 --seed 1 --estimators mine
      100 drawn faults, which nobody chose, each on a drawn course
  monorig stress --shard 2/4 --json 2.jsonl
      every fourth run; `monorig merge 1.jsonl … --into stress.json` joins

Each condition is applied by itself, and all estimators of a run see the same
measurements: no estimator is in the loop. A stopped battery continues when it
is started again.";

/// Try estimators under a battery of conditions.
#[derive(Debug, clap::Parser)]
#[command(name = "stress", after_help = STRESS_EXAMPLES)]
pub struct StressArgs {
    /// Scenario files, or folders of them
    #[arg(default_value = "scenarios/stress", value_parser = share::named())]
    pub scenarios: Vec<PathBuf>,
    /// Estimators to try, by name or as NAME=TYPE; without this option the scenarios'
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = named)]
    pub estimators: Vec<NamedEstimator>,
    /// Folder of further conditions, beside monorig's; may be given several times
    #[arg(long, value_name = "DIR")]
    pub conditions: Vec<PathBuf>,
    /// Only conditions with one of these texts in the name or group
    #[arg(long, value_name = "TEXTS", value_delimiter = ',')]
    pub only: Vec<String>,
    /// Draw N sensor faults instead, each on a drawn course
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000), conflicts_with_all = ["scenarios", "conditions", "only", "seeds"])]
    pub drawn: Option<u64>,
    /// Seed of the first drawn fault; each further fault has the next seed
    #[arg(long, value_name = "N", default_value_t = 1, requires = "drawn")]
    pub seed: u64,
    /// File of the ranges for the courses
    #[arg(long, hide_short_help = true, value_name = "FILE", default_value = RANGES, value_parser = share::named(), requires = "drawn")]
    pub ranges: PathBuf,
    #[command(flatten)]
    pub changes: Changes,
    #[command(flatten)]
    pub jobs: Jobs,
    /// Make only part K of N of the runs, for `monorig merge` to join with the others
    #[arg(long, hide_short_help = true, value_name = "K/N", value_parser = shard, requires = "json", conflicts_with_all = ["html", "against"])]
    pub shard: Option<Shard>,
    /// Write matrix and runs as JSON; `-` is standard output
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write the matrix as a page
    #[arg(long, hide_short_help = true, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Compare with an earlier file of --json; a cell that has become worse fails
    #[arg(long, value_name = "FILE")]
    pub against: Option<PathBuf>,
    /// Share by which an error may grow; shares of samples may grow by one percentage point
    #[arg(long, hide_short_help = true, value_name = "SHARE", value_parser = share, default_value = "5%", requires = "against")]
    pub worse_than: f64,
    /// Largest share of valid samples that may mislead; if a condition exceeds this share the exit code is 1
    #[arg(long, value_name = "SHARE", value_parser = part, conflicts_with = "shard")]
    pub max_misled: Option<f64>,
    #[command(flatten)]
    pub out: Out,
}

/// Reads the share for --max-misled: a limit above one half would judge nothing.
fn part(text: &str) -> Result<f64, String> {
    let share = share(text)?;
    let wrong = "write at most 50%: a larger share judges nothing";
    (share <= 0.5)
        .then_some(share)
        .ok_or_else(|| wrong.to_owned())
}

/// Folder of monorig's conditions.
const CONDITIONS: &str = "assets/conditions";

impl Command for StressArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        stress(self, program.registry)
    }
}

/// Make the missing runs, and join the results.
fn stress(task: &StressArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let before = task.against.as_deref().map(StressFile::read).transpose()?;
    let begun = Instant::now();
    let battery = match task.drawn {
        Some(count) => drawn(task, count, registry)?,
        None => battery(task, registry)?,
    };
    output::begin()?;
    let campaign = battery.campaign(&identity()).part(task.shard);
    let short_hash = campaign.hash.get(..12).unwrap_or_default();
    let folder = task.out.get().join("stress").join(short_hash);
    let work = |index| {
        let run = battery.run(index, registry, &interrupt::go_on)?;
        run.ok_or(Interrupted) // a campaign has every run of its list
    };
    let mut runs = Vec::new();
    let take = |run| runs.push(run);
    resumed(&campaign, &folder, battery.inputs(), task.jobs, work, take)?;
    for run in runs.iter().filter(|r| r.error.is_some()) {
        let why = run.error.as_deref().unwrap_or_default();
        note(&format!("{} broke down: {why}", run.words()));
    }
    let took = begun.elapsed().as_secs_f64();
    let made = runs.len();
    let end = format!("{made} runs in {took:.1} s");
    if let (Some(_), Some(path)) = (task.shard, &task.json) {
        output::write(path, &campaign::text(&campaign, &runs))?;
        note(&end);
        return Ok(CommandOutcome::Held);
    }
    let file = StressFile::new(&campaign, runs);
    if let Some(path) = &task.html {
        output::write(path, &report(&file).to_html())?;
    }
    if let Some(path) = &task.json {
        output::write(path, &file.to_json())?;
    }
    note(&end);
    let silent = task.json.as_deref().is_some_and(output::is_standard);
    if !silent {
        print_matrix(&file, terminal::verbose())?;
    }
    let (good, mut verdict) = judge_matrix(&file, task.max_misled, silent)?;
    let worse = match &before {
        Some(before) => compared(before, &file, task.worse_than)?,
        None => false,
    };
    verdict = match (worse, before) {
        (true, _) if good => "FAILED: figures have become worse".to_owned(),
        (true, _) => format!("{verdict}; figures have become worse"),
        (_, Some(_)) if task.max_misled.is_none() && good => "held: no figure is worse".to_owned(),
        _ => verdict,
    };
    if !silent {
        output::verdicts(&format!("{verdict}\n"))?;
    }
    Ok(CommandOutcome::of(good && !worse))
}

/// Reads scenarios and conditions, and checks them against each other.
fn battery(task: &StressArgs, registry: &Registry) -> Result<Battery, CliError> {
    let mut folders = vec![share::find(CONDITIONS.into())];
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
                format!("use a part of a name in {CONDITIONS}"),
            ));
        }
    }
    let scenarios = scenarios(&task.scenarios)?;
    let battery = task.load(&scenarios, conditions, Pairing::Every, registry)?;
    for left_out in battery.left_out() {
        note(&format!("left out: {left_out}"));
    }
    Ok(battery)
}

/// Draws courses and faults, writes their files into the folder for results, and reads these files as any others.
fn drawn(task: &StressArgs, count: u64, registry: &Registry) -> Result<Battery, CliError> {
    let ranges = RangesFile::load(&task.ranges)?;
    ranges.check(&task.ranges, registry)?;
    let folder = task.out.get().join("stress").join("drawn");
    out::make(&folder)?;
    let (mut scenarios, mut conditions) = (Vec::new(), Vec::new());
    for seed in (task.seed..=u64::MAX).take(count as usize) {
        let course = draw::course(&ranges, &task.ranges, &folder, seed)?;
        for file in &course.files {
            output::write_in(&folder, &file.path, &file.text)?;
        }
        scenarios.extend(course.files.last().map(|file| folder.join(&file.path)));
        let name = fault_name(seed);
        let path = format!("{name}/{name}.yaml");
        output::write_in(&folder, &path, &fault(&course, seed).to_yaml())?;
        let path = folder.join(path);
        conditions.push(Condition::load(&path)?);
    }
    task.load(&scenarios, conditions, Pairing::OneByOne, registry)
}

impl StressArgs {
    /// Checks scenarios and conditions against each other.
    fn load(
        &self,
        scenarios: &[PathBuf],
        conditions: Vec<Condition>,
        pairing: Pairing,
        registry: &Registry,
    ) -> Result<Battery, CliError> {
        let wanted = self.estimators.iter();
        let wanted: Vec<WantedEstimator> = wanted.map(|e| (e.name.clone(), e.is.clone())).collect();
        let sets = self.changes.all();
        Ok(Battery::load(
            scenarios, conditions, pairing, &wanted, &sets, registry,
        )?)
    }
}
