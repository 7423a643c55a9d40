//! `monorig study`: many runs with drawn values, results line by line, whole or in shards.

use crate::CommandOutcome;
use crate::commands::shared::{Expect, Jobs, Out, shard};
use crate::identity::identity;
use crate::ui::errors::CliError;
use crate::ui::interrupt;
use crate::ui::note::note;
use crate::ui::output;
use crate::ui::progress::ProgressDisplay;
use crate::ui::prose::paragraph;
use crate::ui::tables::{grouped, number};
use monorig_lab::batch::lines::Lines;
use monorig_lab::batch::{Plan, ResultStore, Shard, in_order, run_one};
use monorig_lab::verdicts::run_result::RunResult;
use monorig_lab::verdicts::verdict::{Check, Tally};
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::record::inputs;
use std::path::Path;
use std::path::PathBuf;

const STUDY_EXAMPLES: &str = "\
Examples:
  monorig study scenarios/studies/vehicle_test_spread.yaml
      results go to runs/vehicle_test_spread/results.jsonl
  monorig study scenarios/studies/vehicle_test_spread.yaml --shard 2/5
      every fifth run, for one of five machines
  monorig study spread.yaml --shard 2/5 --expect merge
      the same for a scheduler: exit code 0 once its runs are made
  monorig merge runs/vehicle_test_spread/results.*-of-5.jsonl --into all.jsonl

Stopped or killed, it goes on where it was when it is started again, if program
and input files are the same (copies of these are kept in OUT/<study>/inputs).
The results are the same bytes whatever --jobs, whether it was interrupted or
not, and whether it was run whole or in shards and merged.";

/// `monorig study`
#[derive(Debug, clap::Args)]
#[command(after_help = STUDY_EXAMPLES)]
pub struct StudyArgs {
    /// Study file
    pub file: PathBuf,
    #[command(flatten)]
    pub jobs: Jobs,
    /// Make only part K of N of the runs
    #[arg(long, value_name = "K/N", value_parser = shard)]
    pub shard: Option<Shard>,
    /// Who judges the expectations
    #[arg(long, value_name = "WHO", value_enum, default_value_t)]
    pub expect: Expect,
    #[command(flatten)]
    pub out: Out,
}

/// Make the runs that are not there yet, then print what all of them have come to.
pub fn study(task: &StudyArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let plan = Plan::load(&task.file, registry)?;
    let shard = task.shard.unwrap_or(Shard::WHOLE);
    let name = match shard {
        Shard::WHOLE => "results.jsonl".to_owned(),
        Shard { part, of } => format!("results.{part}-of-{of}.jsonl"),
    };
    let folder = task.out.get().join(&plan.name);
    std::fs::create_dir_all(&folder).map_err(|source| CliError::Out {
        path: folder.clone(),
        source,
    })?;
    let header = plan.header(shard, &identity());
    let mut store = ResultStore::resume(&folder.join(name), &header)?;
    inputs::keep(plan.inputs(), &folder.join("inputs"))?;
    let all = shard.runs(plan.runs());
    if store.rows() > 0 {
        note(&format!("{} of {all} runs are there already", store.rows()));
    }
    interrupt::listen();
    make(&plan, shard, all, task, registry, &mut store)?;
    note(&format!("results in {}", store.path().display()));
    print_results(store.path()).map(|judged| task.expect.outcome(judged))
}

fn make(
    plan: &Plan,
    shard: Shard,
    all: u64,
    task: &StudyArgs,
    registry: &Registry,
    store: &mut ResultStore,
) -> Result<(), CliError> {
    let mut progress = ProgressDisplay::new(&plan.name);
    let rest = (store.rows()..all).map(|n| shard.index(n));
    let work = |index| run_one(&plan.spec(index), registry, &interrupt::go_on);
    in_order(task.jobs.get(), rest, work, |done| {
        let result = done.map_err(|_| CliError::Interrupted)?;
        store.append(&result)?;
        progress.at(store.rows() as f64 / all as f64);
        Ok::<(), CliError>(())
    })
}

/// Metrics printed of each estimator.
const SHOWN: &[&str] = &[
    "mass_rmse_kg",
    "mass_error_converged_rel_max",
    "slope_rmse_deg",
    "slope_error_p95_deg",
];

/// A metric of an estimator over the runs read so far.
struct Column {
    estimator: String,
    metric: &'static str,
    values: Vec<f64>,
}

/// Read the results back and print what they have come to.
pub fn print_results(path: &Path) -> Result<CommandOutcome, CliError> {
    let (mut tally, mut runs) = (Tally::default(), 0);
    let mut columns: Vec<Column> = Vec::new();
    for line in Lines::open(path)?.skip(1) {
        let result: RunResult = serde_json::from_str(&line?).map_err(CliError::Json)?;
        runs += 1;
        tally.add(&result);
        for (name, values) in result.summary.iter().flat_map(|s| &s.estimators) {
            for metric in SHOWN {
                let value = values.get(*metric).copied().flatten();
                push(&mut columns, name, metric, value);
            }
        }
    }
    output::print(&format!("{}\n\n", spread(&columns, runs)))?;
    let checks = tally.checks();
    let failing: Vec<&Check> = checks.iter().filter(|c| !c.held).collect();
    for check in &failing {
        output::verdicts(&format!(
            "{}\n",
            paragraph(&format!("FAILED  {}", check.reason()), "")
        ))?;
    }
    output::print(&format!(
        "{runs} runs: {} of {} checks held\n",
        checks.len() - failing.len(),
        checks.len()
    ))?;
    Ok(match failing.len() {
        0 => CommandOutcome::Held,
        _ => CommandOutcome::Failed,
    })
}

fn push(columns: &mut Vec<Column>, estimator: &str, metric: &'static str, value: Option<f64>) {
    let known = columns
        .iter()
        .position(|c| c.estimator == estimator && c.metric == metric);
    let place = known.unwrap_or_else(|| {
        columns.push(Column {
            estimator: estimator.to_owned(),
            metric,
            values: Vec::new(),
        });
        columns.len() - 1
    });
    if let (Some(column), Some(value)) = (columns.get_mut(place), value) {
        column.values.push(value);
    }
}

/// Median and tails of each column.
fn spread(columns: &[Column], runs: u64) -> String {
    let title = format!("over {runs} runs");
    let titles = [&title, "measured", "5 %", "median", "95 %", "worst"];
    let mut groups: Vec<(String, Vec<Vec<String>>)> = Vec::new();
    for column in columns {
        let mut x = column.values.clone();
        x.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| {
            let place = (x.len().saturating_sub(1) as f64 * share).round() as usize;
            x.get(place).map_or("-".to_owned(), |x| number(*x))
        };
        let mut row = vec![column.metric.to_owned(), x.len().to_string()];
        row.extend([0.05, 0.5, 0.95, 1.0].map(at));
        match groups
            .iter_mut()
            .find(|(name, _)| *name == column.estimator)
        {
            Some((_, rows)) => rows.push(row),
            None => groups.push((column.estimator.clone(), vec![row])),
        }
    }
    grouped(&titles, &groups)
}
