//! `monorig study`: many runs with drawn values or over a grid of values, as a whole or in shards; each result is a
//! line.

use crate::arguments::{Changes, Expect, Jobs, Json, Out, assignment, shard};
use crate::command::{Command, CommandOutcome, Program};
use crate::files::prepare;
use crate::files::share;
use crate::identity::identity;
use crate::recording::many::resumed;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::{interrupt, output};
use crate::verdicts::study::print_results;
use monorig_lab::batch::{Plan, run_one};
use monorig_lab::campaign::Shard;
use monorig_sim::closed_loop::registry::Registry;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::PathBuf;

const STUDY_EXAMPLES: &str = "\
Examples:
  monorig study scenarios/minimal.yaml --vary load.mass_kg=5000..20000:4
      eight loads over the seeds of the scenario, as a table; two `--vary` make
      a grid; `drive.speed[1].mps=0.5,1,2` is a list
  monorig study scenarios/studies/vehicle_test_spread.yaml
      results go to runs/vehicle_test_spread/results.jsonl
  monorig study scenarios/studies/vehicle_test_spread.yaml --shard 2/5
      every fifth run, for one of five machines
  monorig study spread.yaml --shard 2/5 --expect merge
      the same for a scheduler: exit code 0 once its runs are made
  monorig merge runs/vehicle_test_spread/results.*-of-5.jsonl --into all.jsonl

A stopped or killed study continues when it is started again, if program and
input files are the same (copies of the files are kept in OUT/<study>/inputs).
The results are the same bytes for every --jobs, with or without interruptions,
and for a whole run or merged shards.";

/// Run a scenario many times, with drawn values or over a grid.
#[derive(Debug, clap::Parser)]
#[command(name = "study", after_help = STUDY_EXAMPLES)]
pub struct StudyArgs {
    /// Study file, or with --vary a scenario
    #[arg(value_parser = share::named())]
    pub file: PathBuf,
    /// Values of a key of the scenario: FROM..TO:COUNT or a list; may be given several times
    #[arg(long, value_name = "PATH=VALUES", value_parser = values)]
    pub vary: Vec<(String, Vec<Value>)>,
    #[command(flatten)]
    pub changes: Changes,
    #[command(flatten)]
    pub jobs: Jobs,
    /// Make only part K of N of the runs
    #[arg(long, value_name = "K/N", value_parser = shard)]
    pub shard: Option<Shard>,
    /// Who judges the expectations
    #[arg(
        long,
        value_name = "WHO",
        value_enum,
        default_value_t,
        requires_if("merge", "shard")
    )]
    pub expect: Expect,
    #[command(flatten)]
    pub out: Out,
    #[command(flatten)]
    pub json: Json,
}

impl Command for StudyArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        study(self, program.registry)
    }
}

/// Largest number of values of one key.
const MOST: usize = 10_000;

/// Reads values of a key, as `PATH=FROM..TO:COUNT` or `PATH=A,B,C`.
fn values(text: &str) -> Result<(String, Vec<Value>), String> {
    let wrong = || {
        "write PATH=FROM..TO:COUNT or a list, such as load.mass_kg=5000..20000:4 or physics.dt_ms=1,2".to_owned()
    };
    let (path, written) = assignment(text).map_err(|_| wrong())?;
    let Some((from, rest)) = written.split_once("..") else {
        // as YAML, so that a list in brackets is one value
        let list = serde_yaml::from_str(&format!("[{written}]"));
        let list: Option<Vec<Value>> = list.ok();
        let list = list.filter(|all| !all.is_empty() && !all.contains(&Value::Null));
        return Ok((path, list.ok_or_else(wrong)?));
    };
    let ends = rest.split_once(':').and_then(|(to, count)| {
        let number = |text: &str| text.trim().parse().ok().filter(|x: &f64| x.is_finite());
        let count = count.trim().parse().ok().filter(|n| (2..=MOST).contains(n));
        Some((number(from)?, number(to)?, count?))
    });
    let (from, to, count) = ends.ok_or_else(wrong)?;
    let step = (to - from) / (count - 1) as f64;
    let last = |i: usize| i + 1 == count;
    let number = |i| if last(i) { to } else { from + step * i as f64 };
    Ok((path, (0..count).map(|i| number(i).into()).collect()))
}

/// The runs of a study file, or of a scenario over a grid.
fn planned(task: &StudyArgs, registry: &Registry) -> Result<Plan, CliError> {
    let sets = task.changes.all();
    if task.vary.is_empty() {
        if sets.is_empty() {
            return Ok(prepare::study(&task.file, registry)?);
        }
        let message = "--set and --seeds need --vary; a study file has `set` and `first_seed`";
        return Err(CliError::refused(
            message,
            "write the values into the study file",
        ));
    }
    let mut grid = BTreeMap::new();
    for (path, values) in &task.vary {
        let set = sets.iter().any(|(other, _)| other == path);
        if grid.insert(path.clone(), values.clone()).is_some() || set {
            let message = format!("`{path}` is changed twice");
            return Err(CliError::refused(message, "name each path once"));
        }
    }
    let mut plan = prepare::sweep(&task.file, &sets, grid, registry)?;
    // in the name what was typed, so that another grid has another folder
    let plain = |c: char| match c {
        c if c.is_alphanumeric() || "._-=,".contains(c) => c,
        _ => '_',
    };
    let ends = task.vary.iter().map(|(path, values)| {
        let word = |value: Option<&Value>| match value.and_then(Value::as_f64) {
            Some(x) => x.to_string(),
            None => value.map_or(String::new(), Value::to_string),
        };
        let n = values.len();
        format!(
            "{path}={},{},{n}",
            word(values.first()),
            word(values.last())
        )
    });
    let ends: Vec<String> = ends.collect();
    let name: String = ends.join("+").chars().map(plain).take(LONGEST).collect();
    plan.name = format!("{}@{name}", plan.name);
    Ok(plan)
}

/// Largest number of characters for the grid in a sweep's folder name.
const LONGEST: usize = 120;

/// Make the missing runs, then print the results of all runs.
fn study(task: &StudyArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let plan = planned(task, registry)?;
    output::begin()?;
    let campaign = plan.campaign(&identity()).part(task.shard);
    let folder = task.out.get().join(&plan.name);
    let work = |index| run_one(&plan.spec(index), registry, &interrupt::go_on);
    let path = resumed(&campaign, &folder, plan.inputs(), task.jobs, work, |_| ())?;
    note(&format!("results in {}", path.display()));
    print_results(&path, &task.json).map(|judged| task.expect.outcome(judged))
}
