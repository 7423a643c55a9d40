//! `monorig test`: scenarios over their seeds, judged.

mod baseline;
mod figures;
mod keep;
mod select;

use crate::arguments::{Changes, Expect, Jobs, Json, metric, shard, share};
use crate::command::{Command, CommandOutcome, Program};
use crate::files::out::prepare_out;
use crate::files::prepare;
use crate::files::scenarios::{nothing, scenarios};
use crate::files::share;
use crate::identity::identity;
use crate::recording::many::many;
use crate::ui::errors::{self, CliError};
use crate::ui::interrupt;
use crate::ui::note::note;
use crate::ui::output;
use crate::ui::prose::counted;
use crate::verdicts::{self, TestedScenario, junit, lines};
use baseline::Baseline;
use monorig_lab::batch::{RunSpec, run_one};
use monorig_lab::campaign::{self, Campaign, CampaignKind, RunList, Shard};
use monorig_lab::verdicts::run_result::RunResult;
use monorig_lab::verdicts::verdict::ScenarioVerdict;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::resolved;
use monorig_sim::config::file::{Sets, input_error};
use monorig_sim::config::input_files::InputFiles;
use monorig_sim::error::Error;
use monorig_sim::guarded::guarded;
use monorig_sim::record::manifest;
use select::{LastFailed, NameFilter};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

const TEST_EXAMPLES: &str = "\
Examples:
  monorig test   every scenario in scenarios/, each over its seeds
  monorig test scenarios/liu2023_section1.yaml --seeds 1..50
  monorig test scenarios --seeds-from 4711
      as many runs with other seeds: does the verdict hold?
  monorig test scenarios -k 'liu2023 and not vehicle' --junit report.xml
  monorig test --lf -x   the scenarios that failed, until one fails again
  monorig test scenarios --baseline verdicts.json --worse-than 5%
      fail also if a metric has become worse
  monorig test scenarios --shard 2/4 --json 2.jsonl --expect merge
      every fourth run, for one of four machines
  monorig merge 1.jsonl 2.jsonl 3.jsonl 4.jsonl --into all.json   judge them all
  monorig test scenarios --keep-failed failed
      recording and report of the worst seed of each failed scenario
  monorig test drawn --metrics slope_rmse_deg,mass_error_rel_end
      figures over all runs, by estimator

A scenario fails when a run does not finish, when an estimator never marks
anything valid or marks misleading values valid, when an expectation does not
hold in as many runs as it requires (`quantile`: 0.6 without the key; 1 for the
train and the controller), or when a known failure is worse than
known or all of ten runs hold it. During the test each scenario prints a line;
then follow the reasons of failures, known failures by estimator, and the
verdict. -v adds every finding, every known failure and its reason.";

/// Run scenarios over their seeds and judge what they expect.
#[derive(Debug, clap::Parser)]
#[command(name = "test", after_help = TEST_EXAMPLES)]
pub struct TestArgs {
    /// Scenario files, or folders of them
    #[arg(default_value = "scenarios", value_parser = share::named())]
    pub paths: Vec<PathBuf>,
    #[command(flatten)]
    pub jobs: Jobs,
    /// Test only scenarios whose names fit: texts in the name, with `and`, `or`, `not`
    #[arg(short = 'k', long, value_name = "EXPR")]
    pub filter: Option<NameFilter>,
    /// Test only scenarios that failed in their last test; all scenarios if none failed
    #[arg(long, visible_alias = "last-failed")]
    pub lf: bool,
    /// Stop after the first scenario that fails
    #[arg(short = 'x', long, conflicts_with = "shard")]
    pub exitfirst: bool,
    /// Print the N scenarios that took longest; 0 prints all
    #[arg(long, hide_short_help = true, value_name = "N")]
    pub durations: Option<usize>,
    #[command(flatten)]
    pub changes: Changes,
    /// Run as many seeds as each scenario has, beginning with SEED: does the verdict hold on seeds nobody chose?
    #[arg(
        long,
        hide_short_help = true,
        value_name = "SEED",
        conflicts_with = "seeds"
    )]
    pub seeds_from: Option<u32>,
    /// Record the worst seed of every scenario that fails into this folder, with a report
    #[arg(long, value_name = "DIR")]
    pub keep_failed: Option<PathBuf>,
    /// Compare with the --json file of an earlier test; a metric that has become worse fails
    #[arg(long, value_name = "FILE")]
    pub baseline: Option<PathBuf>,
    /// Share by which the mean over the seeds may be worse than the baseline
    #[arg(long, hide_short_help = true, value_name = "SHARE", value_parser = share, default_value = "5%", requires = "baseline")]
    pub worse_than: f64,
    /// Print these metrics of every estimator over all runs: median, 95th percentile, largest
    #[arg(long, hide_short_help = true, value_name = "NAMES", value_delimiter = ',', value_parser = metric)]
    pub metrics: Vec<String>,
    /// Make only part K of N of the runs; `monorig merge` judges all parts together
    #[arg(long, hide_short_help = true, value_name = "K/N", value_parser = shard, requires = "json", conflicts_with_all = ["keep_failed", "baseline", "junit"])]
    pub shard: Option<Shard>,
    /// Who judges the expectations
    #[arg(
        long,
        hide_short_help = true,
        value_name = "WHO",
        value_enum,
        default_value_t,
        requires_if("merge", "shard")
    )]
    pub expect: Expect,
    /// Write the verdicts as JUnit XML, for CI servers
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    #[command(flatten)]
    pub json: Json,
}

/// A scenario to test.
struct Case {
    path: PathBuf,
    name: String,
    /// Runs of the scenario that are made here: place among all of its runs, and seed.
    runs: Vec<(u64, u64)>,
    /// Number of the scenario's runs in all shards.
    list: RunList,
    /// Files of the scenario with the content that was checked.
    inputs: InputFiles,
}

impl Command for TestArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        test(self, program.registry)
    }
}

/// Run every scenario over its seeds. A file that cannot be used does not stop the test of the others.
fn test(task: &TestArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let overrides = task.changes.all();
    let changes = match task.changes.sets.is_empty() {
        true => Sets::new(&overrides).written_in("--seeds"),
        false => Sets::new(&overrides),
    };
    let baseline = task.baseline.as_deref().map(Baseline::read).transpose()?;
    if let Some(folder) = &task.keep_failed {
        prepare_out(folder)?;
    }
    let begun = Instant::now();
    let last_failed = LastFailed::read();
    let paths = chosen(task, &last_failed)?;
    let (mut cases, mut unusable) = (Vec::new(), Vec::new());
    for path in &paths {
        // a panic on one file must not keep the others from their reports
        let made = guarded(|| case(path, &changes, task, registry)).unwrap_or_else(|told| {
            let help = "use physically possible values; please report this file";
            let message = format!("monorig panicked while it built this scenario: {told}");
            Err(input_error(path, "", message, help))
        });
        match made {
            Ok(case) => cases.push(case),
            Err(e) => {
                unusable.push(TestedScenario::unusable(path, e.to_string()));
                errors::show(&CliError::Sim(e));
            }
        }
    }
    output::begin()?;
    let mut names = BTreeMap::new();
    for case in &cases {
        if let Some(other) = names.insert(&case.name, &case.path) {
            let message = format!(
                "{} and {} have the same name",
                other.display(),
                case.path.display()
            );
            return Err(CliError::refused(message, "rename one of the two files"));
        }
    }
    if let Some(shard) = task.shard {
        if !unusable.is_empty() {
            let (bad, all) = (unusable.len(), paths.len());
            return Err(CliError::BadFiles { bad, all });
        }
        keep_part(&mut cases, shard);
    }
    if let Some(baseline) = &baseline {
        baseline.shares(cases.iter().map(|c| (c.name.as_str(), c.runs.as_slice())))?;
    }
    let against = baseline
        .as_ref()
        .map(|baseline| (baseline, task.worse_than));
    let (mut tested, compared) = run(task, &cases, &changes, against, registry)?;
    if let Some(folder) = &task.keep_failed {
        for (one, case) in tested.iter().zip(&cases) {
            keep::worst_run(one, &case.path, &task.changes.sets, folder, registry)?;
        }
    }
    let elsewhere = tested.iter().filter(|t| t.judged.runs.is_empty()).count();
    let held = tested.iter().filter(|t| t.judged.held).count();
    let failed = tested.len() - elsewhere - held;
    let pairs = tested.iter().zip(&cases);
    let details: Vec<String> = pairs
        .filter(|(t, _)| !t.judged.runs.is_empty())
        .map(|(t, case)| lines::detail(&t.judged, Some(&case.path), &task.changes.sets))
        .filter(|detail| !detail.is_empty())
        .collect();
    let bad = unusable.len();
    if task.shard.is_none() {
        let judged = tested.iter().zip(&cases);
        last_failed.update(judged.map(|(t, case)| (case.path.as_path(), t.judged.held)));
    }
    let untested = cases.len() - tested.len();
    tested.extend(unusable);
    if let Some(path) = &task.junit {
        output::write(path, &junit::xml(&tested)?)?;
    }
    match task.shard {
        Some(shard) => task
            .json
            .write_text(|| Ok(shard_text(&cases, &tested, shard)))?,
        None => task
            .json
            .write(|| verdicts::json(tested.iter().map(|t| &t.judged)))?,
    }
    let programs = [task.json.path(), task.junit.as_deref()];
    let usable = tested.iter().filter(|t| t.unusable.is_none());
    let runs: usize = usable.map(|t| t.judged.runs.len()).sum();
    if !task.metrics.is_empty() {
        let text = format!("\n{}\n", figures::text(&tested, &task.metrics));
        output::result(&text, &programs)?;
    }
    if baseline.is_some() {
        let text = format!(
            "\n{} metrics against the baseline: {} worse by more than {} %\n",
            compared.0,
            compared.1,
            100.0 * task.worse_than
        );
        output::result(&text, &programs)?;
    }
    if let Some(first) = task.seeds_from {
        let made = || tested.iter().filter(|t| !t.judged.runs.is_empty());
        let checks = || made().flat_map(|t| &t.judged.checks);
        let (hold, all) = (checks().filter(|c| c.held).count(), checks().count());
        let share = 100.0 * hold as f64 / all.max(1) as f64;
        let text = format!("\nseeds from {first}: {hold} of {all} checks hold, {share:.1} %\n");
        output::result(&text, &programs)?;
    }
    if let Some(most) = task.durations {
        output::result(&durations(&tested, most), &programs)?;
    }
    if untested > 0 {
        let text = format!(
            "\nstopped at the first failure: {} not tested\n",
            counted(untested, "scenario")
        );
        output::result(&text, &programs)?;
    }
    let judged = tested.iter().filter(|t| t.unusable.is_none());
    let judged: Vec<&ScenarioVerdict> = judged
        .map(|t| &t.judged)
        .filter(|v| !v.runs.is_empty())
        .collect();
    // the verdict is the last line
    let took = begun.elapsed().as_secs_f64();
    note(&format!("{} in {took:.1} s", counted(runs, "run")));
    output::result(&lines::end(&judged, &details.join("\n"), bad), &programs)?;
    match (bad, failed) {
        (0, 0) => Ok(CommandOutcome::Held),
        (0, _) => Ok(task.expect.outcome(CommandOutcome::Failed)),
        _ => Err(CliError::BadFiles {
            bad,
            all: paths.len(),
        }),
    }
}

/// Scenarios that the command line selects. An empty selection is an error.
fn chosen(task: &TestArgs, last_failed: &LastFailed) -> Result<Vec<PathBuf>, CliError> {
    let mut paths = scenarios(&task.paths)?;
    if let Some(filter) = &task.filter {
        let all = paths.len();
        paths.retain(|path| filter.fits(path));
        if paths.is_empty() {
            let first = task.paths.first().map_or(Path::new(""), PathBuf::as_path);
            let text = filter.text();
            let message = format!("`{text}` fits no name of the {all} scenarios");
            return Err(nothing(first, message));
        }
    }
    if task.lf {
        let failed: Vec<PathBuf> = (paths.iter().filter(|p| last_failed.has(p)).cloned()).collect();
        match failed.len() {
            0 => note("none of these scenarios failed the last time: all are tested"),
            n => {
                note(&format!(
                    "{n} of {} failed the last time",
                    counted(paths.len(), "scenario")
                ));
                paths = failed;
            }
        }
    }
    Ok(paths)
}

/// The scenarios that took longest, slowest first.
fn durations(tested: &[TestedScenario], most: usize) -> String {
    let mut slowest: Vec<&TestedScenario> = tested.iter().collect();
    slowest.sort_by_key(|one| std::cmp::Reverse(one.took));
    let shown = slowest
        .iter()
        .take(if most == 0 { usize::MAX } else { most });
    let line = |one: &&TestedScenario| {
        let (took, name) = (one.took.as_secs_f64(), &one.judged.scenario);
        format!("{took:8.1} s  {name}\n")
    };
    format!(
        "\nslowest scenarios\n{}",
        shown.map(line).collect::<String>()
    )
}

/// Finds every mistake in a scenario that can be found without running it.
fn case(path: &Path, changes: &Sets, task: &TestArgs, registry: &Registry) -> Result<Case, Error> {
    let simulation = prepare::changed(path, changes, registry)?;
    let scenario = &simulation.scenario;
    scenario.inputs().seal();
    let seeds: Vec<u64> = match task.seeds_from {
        Some(first) => (u64::from(first)..).take(scenario.seeds().len()).collect(),
        None => scenario.seeds().to_vec(),
    };
    let mut list = RunList::new(&scenario.name, seeds.iter().copied());
    // only shards carry it: it needs the hash of the program's file, which takes time
    if task.shard.is_some() {
        let inputs = scenario.input_digests();
        list = list.hashed(manifest::hash(
            &identity(),
            &inputs,
            &resolved(scenario, registry),
        ));
    }
    Ok(Case {
        path: path.into(),
        name: scenario.name.clone(),
        list,
        runs: (0..).zip(seeds).collect(),
        inputs: scenario.inputs().clone(),
    })
}

/// The file of a shard: every run that was made here.
fn shard_text(cases: &[Case], tested: &[TestedScenario], shard: Shard) -> String {
    let list = cases.iter().map(|case| case.list.clone()).collect();
    let (inputs, values) = Default::default();
    let all = Campaign::new(
        CampaignKind::Test,
        "test",
        list,
        &identity(),
        inputs,
        values,
    );
    let runs = tested.iter().flat_map(|t| t.judged.runs.clone());
    campaign::text(&all.part(Some(shard)), &runs.collect::<Vec<_>>())
}

/// Keeps a shard's part of all runs: every n-th run, counted over all scenarios.
fn keep_part(cases: &mut [Case], shard: Shard) {
    let mut count = 0;
    for case in cases {
        case.runs.retain(|_| {
            count += 1;
            (count - 1) % shard.of == shard.part - 1
        });
    }
}

fn run(
    task: &TestArgs,
    cases: &[Case],
    changes: &Sets,
    against: Option<(&Baseline, f64)>,
    registry: &Registry,
) -> Result<(Vec<TestedScenario>, (usize, usize)), CliError> {
    let width = cases.iter().map(|c| c.name.chars().count()).max();
    let specs = cases.iter().flat_map(|case| {
        let of =
            |&(index, seed)| RunSpec::new(index, &case.path, seed, changes.clone(), &case.inputs);
        case.runs.iter().map(of)
    });
    let stop = AtomicBool::new(false);
    let specs = specs.take_while(|_| !stop.load(Ordering::Relaxed));
    let work = |spec: RunSpec| {
        let begun = Instant::now();
        let result = run_one(&spec, registry, &interrupt::go_on);
        result.map(|result| (result, begun.elapsed()))
    };
    let mut tested = Vec::new();
    let mut waiting: (Vec<RunResult>, Duration) = Default::default();
    let all: usize = cases.iter().map(|case| case.runs.len()).sum();
    let mut compared = (0, 0);
    let mut runs_done = 0;
    skip_empty(&mut tested, cases);
    let (jobs, all_runs) = (task.jobs, (0, all as u64));
    many(
        "test",
        jobs,
        all_runs,
        specs,
        work,
        |(result, took), progress| {
            if stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            waiting.0.push(result);
            waiting.1 += took;
            runs_done += 1;
            progress.rename(&format!("run {runs_done} of {all}"));
            if let Some(case) = cases.get(tested.len())
                && waiting.0.len() == case.runs.len()
            {
                let (runs, took) = std::mem::take(&mut waiting);
                let mut judged = ScenarioVerdict::new(&case.name, runs);
                if let Some((baseline, worse_than)) = against {
                    let (metrics, worse) = baseline.judge(&mut judged, worse_than);
                    compared = (compared.0 + metrics, compared.1 + worse);
                }
                let one = TestedScenario::new(judged, took);
                refusals(&one, case);
                let text = lines::line(&one.judged, Some(took), width.unwrap_or(0));
                let programs = [task.json.path(), task.junit.as_deref()];
                progress.aside(|| output::result(&text, &programs))?;
                stop.fetch_or(task.exitfirst && !one.judged.held, Ordering::Relaxed);
                tested.push(one);
                skip_empty(&mut tested, cases);
            }
            Ok(())
        },
    )?;
    Ok((tested, compared))
}

/// Scenarios without a run in this shard.
fn skip_empty(tested: &mut Vec<TestedScenario>, cases: &[Case]) {
    while let Some(case) = cases.get(tested.len()).filter(|c| c.runs.is_empty()) {
        let judged = ScenarioVerdict::new(&case.name, Vec::new());
        tested.push(TestedScenario::new(judged, Duration::ZERO));
    }
}

/// Shows a note for each estimator that refused steps.
fn refusals(tested: &TestedScenario, case: &Case) {
    for run in &tested.judged.runs {
        for (name, times, reason) in run.summary.iter().flat_map(|s| &s.refusals) {
            note(&format!(
                "{} seed {}: {name} refused {times} steps, the first because {reason}",
                case.name, run.seed
            ));
        }
    }
}
