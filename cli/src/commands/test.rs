//! `monorig test`: scenarios over their seeds, judged.

mod files;
pub mod junit;

use crate::CommandOutcome;
use crate::commands::shared::{Jobs, seeds};
use crate::identity::identity;
use crate::ui::errors::{self, CliError};
use crate::ui::interrupt;
use crate::ui::note::note;
use crate::ui::output;
use monorig_lab::batch::{RunResult, RunSpec, in_order, run_one};
use monorig_lab::verdicts::verdict::{Check, ScenarioVerdict};
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::file::Sets;
use monorig_sim::config::input_files::InputFiles;
use monorig_sim::error::Error;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const TEST_EXAMPLES: &str = "\
Examples:
  monorig test                                           every scenario in scenarios/, each over its seeds
  monorig test scenarios/liu2023_section1.yaml --seeds 1..50
  monorig test scenarios --filter liu2023 --junit report.xml --json report.json

A scenario fails when a run does not finish, when an estimator never marks anything valid or marks misleading values valid, when an
expectation does not hold for as many seeds as it asks for (`quantile`; all without it), or when a known failure holds.
Findings, worst first, stand above the checks that fail.";

/// `monorig test`
#[derive(Debug, clap::Args)]
#[command(after_help = TEST_EXAMPLES)]
pub struct TestArgs {
    /// Scenario files, or folders of them
    #[arg(default_value = "scenarios")]
    pub paths: Vec<PathBuf>,
    #[command(flatten)]
    pub jobs: Jobs,
    /// Only scenarios with this text in their name
    #[arg(long, value_name = "TEXT")]
    pub filter: Option<String>,
    /// Run these seeds instead of the scenarios' own: `7`, `1..50` or `1,5,9`
    #[arg(long, value_name = "SEEDS", value_parser = seeds)]
    pub seeds: Option<String>,
    /// Write the verdicts as JUnit XML, as CI servers read it
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Write verdicts and metrics of every run as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

/// Findings shown for each scenario; the others are counted.
const FINDINGS_SHOWN: usize = 5;

/// A scenario to test.
struct Case {
    path: PathBuf,
    name: String,
    seeds: Vec<u64>,
    /// Its files, as they were when it was checked.
    inputs: InputFiles,
}

/// A scenario tested.
pub struct TestedScenario {
    /// Its verdicts.
    pub judged: ScenarioVerdict,
    /// Why it could not be used, if it could not.
    pub unusable: Option<String>,
    /// Time its runs took together.
    pub took: Duration,
}

/// Run every scenario over its seeds. A file that cannot be used does not keep the others from being tested.
pub fn test(task: &TestArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let overrides: Vec<_> = task
        .seeds
        .iter()
        .map(|seeds| ("seeds".to_owned(), seeds.clone()))
        .collect();
    let changes = Sets::new(&overrides).written_in("--seeds");
    let paths = files::scenarios(&task.paths, task.filter.as_deref())?;
    // what is interrupted must not leave the reports of an earlier test behind
    for path in task.junit.iter().chain(&task.json) {
        output::clear(path)?;
    }
    let (mut cases, mut unusable) = (Vec::new(), Vec::new());
    for path in &paths {
        match case(path, &changes, registry) {
            Ok(case) => cases.push(case),
            Err(e) => {
                unusable.push(TestedScenario::unusable(path, e.to_string()));
                errors::show(&CliError::Sim(e));
            }
        }
    }
    interrupt::listen();
    let mut tested = run(task, &cases, &changes, registry)?;
    let failed = tested.iter().filter(|t| !t.judged.held).count();
    let held = tested.len() - failed;
    let bad = unusable.len();
    tested.extend(unusable);
    if let Some(path) = &task.junit {
        output::write(path, &junit::xml(&tested)?)?;
    }
    if let Some(path) = &task.json {
        output::write(path, &json(&tested)?)?;
    }
    let usable = tested.iter().filter(|t| t.unusable.is_none());
    let runs: usize = usable.map(|t| t.judged.runs.len()).sum();
    let checks = tested.iter().flat_map(|t| &t.judged.checks);
    let known = match checks.filter(|c| c.fails_as_known()).count() {
        0 => String::new(),
        n => format!("; {n} known failures"),
    };
    let unusable = match bad {
        0 => String::new(),
        n => format!(", {n} could not be used"),
    };
    output::print(&format!(
        "{} scenarios, {runs} runs: {held} held, {failed} failed{unusable}{known}\n",
        tested.len()
    ))?;
    match (bad, failed) {
        (0, 0) => Ok(CommandOutcome::Held),
        (0, _) => Ok(CommandOutcome::Failed),
        _ => Err(CliError::BadFiles {
            bad,
            all: paths.len(),
        }),
    }
}

impl TestedScenario {
    /// A scenario that cannot be used: it fails, and has no run.
    fn unusable(path: &Path, why: String) -> Self {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let mut judged = ScenarioVerdict::new(&name, Vec::new());
        for check in &mut judged.checks {
            check.what = "the scenario".into();
            check.bound = "can be used".into();
            check.worst = Some(why.clone());
        }
        Self {
            judged,
            unusable: Some(why),
            took: Duration::ZERO,
        }
    }
}

/// Everything about a scenario that can be found wrong without running it is found here.
fn case(path: &Path, changes: &Sets, registry: &Registry) -> Result<Case, Error> {
    let simulation = crate::files::prepare::changed(path, changes, registry)?;
    let scenario = &simulation.scenario;
    scenario.inputs().seal();
    Ok(Case {
        path: path.into(),
        name: scenario.name.clone(),
        seeds: scenario.seeds().to_vec(),
        inputs: scenario.inputs().clone(),
    })
}

fn run(
    task: &TestArgs,
    cases: &[Case],
    changes: &Sets,
    registry: &Registry,
) -> Result<Vec<TestedScenario>, CliError> {
    let width = cases.iter().map(|c| c.name.chars().count()).max();
    let specs = cases.iter().flat_map(|case| {
        (0..).zip(&case.seeds).map(|(index, seed)| RunSpec {
            index,
            scenario: case.path.clone(),
            changes: changes.clone(),
            inputs: case.inputs.clone(),
            seed: *seed,
            draws: Default::default(),
            reference: None,
        })
    });
    let work = |spec: RunSpec| {
        let begun = Instant::now();
        let result = run_one(&spec, registry, &interrupt::go_on);
        result.map(|result| (result, begun.elapsed()))
    };
    let mut tested = Vec::new();
    let mut waiting: (Vec<RunResult>, Duration) = Default::default();
    in_order(task.jobs.get(), specs, work, |done| {
        let (result, took) = done.map_err(|_| CliError::Interrupted)?;
        waiting.0.push(result);
        waiting.1 += took;
        if let Some(case) = cases.get(tested.len())
            && waiting.0.len() == case.seeds.len()
        {
            let (runs, took) = std::mem::take(&mut waiting);
            let judged = ScenarioVerdict::new(&case.name, runs);
            let unusable = None;
            let one = TestedScenario {
                judged,
                unusable,
                took,
            };
            output::print(&line(&one, case, width.unwrap_or(0)))?;
            tested.push(one);
        }
        Ok::<(), CliError>(())
    })?;
    Ok(tested)
}

/// The verdict in a line, and a line for everything that does not hold.
fn line(tested: &TestedScenario, case: &Case, width: usize) -> String {
    let word = if tested.judged.held {
        "held  "
    } else {
        "FAILED"
    };
    let seeds = match case.seeds.as_slice() {
        [one] => format!("seed {one}"),
        many => format!("{} seeds", many.len()),
    };
    let took = tested.took.as_secs_f64();
    let mut text = format!("{word}  {:width$}  {seeds:>9}  {took:6.1} s\n", case.name);
    let findings = tested.judged.findings();
    for finding in findings.iter().take(FINDINGS_SHOWN) {
        text += &format!("        finding: {}\n", finding.text);
    }
    match findings.len().saturating_sub(FINDINGS_SHOWN) {
        0 => {}
        more => text += &format!("        … and {more} findings more, in --json and its report\n"),
    }
    // what a finding says already is not said again, unless it is listed as known
    let said = |c: &&Check| !(c.is_finding && c.known_failure.is_none());
    for check in tested.judged.checks.iter().filter(|c| !c.held).filter(said) {
        text += &format!("        {}\n", check.reason());
    }
    for check in tested.judged.checks.iter().filter(|c| c.fails_as_known()) {
        let why = check.known_failure.as_deref().unwrap_or_default();
        text += &format!("        known failure: {} ({why})\n", check.reason());
    }
    for run in &tested.judged.runs {
        for (name, times, reason) in run.summary.iter().flat_map(|s| &s.refusals) {
            note(&format!(
                "{} seed {}: {name} refused {times} steps, the first because {reason}",
                case.name, run.seed
            ));
        }
    }
    text
}

fn json(tested: &[TestedScenario]) -> Result<String, CliError> {
    let scenarios: Vec<&ScenarioVerdict> = tested.iter().map(|t| &t.judged).collect();
    let all = json!({ "version": 1, "kind": "test", "monorig": identity().to_string(), "scenarios": scenarios });
    let text = serde_json::to_string_pretty(&all).map_err(CliError::Json)?;
    Ok(text + "\n")
}
