//! `monorig explain`: the share of each source of error in a run's errors.

use crate::arguments::{Foreign, Jobs, seeds};
use crate::command::{Command, CommandOutcome, Program};
use crate::files::scenarios::{of_run, scenario_name};
use crate::files::{prepare, report, share};
use crate::identity::identity;
use crate::recording::many::all_of;
use crate::ui::errors::CliError;
use crate::ui::interrupt;
use crate::ui::note::{detail, note};
use crate::ui::output;
use crate::ui::prose::paragraph;
use crate::ui::tables::{lines, right, table};
use monorig_lab::batch::{RunSpec, run_one};
use monorig_lab::explain::{self, Budget, METRICS, Source};
use monorig_lab::verdicts::run_result::RunResult;
use monorig_lab::verdicts::summary::AFTER_S;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::resolved;
use monorig_sim::config::file::{Sets, input_error};
use monorig_sim::config::scenario::{Scenario, Seeds};
use monorig_sim::record::manifest::{self, Manifest};
use std::path::PathBuf;

const EXPLAIN_EXAMPLES: &str = "\
Examples:
  monorig run scenarios/liu2023_section1.yaml
      leaves the folder runs/liu2023_section1/1
  monorig explain runs/liu2023_section1/1   where do its errors come from?
  monorig explain runs/minimal/1 --scenario my/minimal.yaml --seeds 1..20

The run is made again over several seeds: as it was, and without noise, biases,
errors of scale, late and lost samples, and errors of the model, one at a time
and all at once; then with more excitation. The terminal has the three sources
that make most of the errors of the estimator in the loop. The folder of the run
gets explain.json, and its report.html every table and plot.";

/// Show how much each source of error adds to a run's errors.
#[derive(Debug, clap::Parser)]
#[command(name = "explain", after_help = EXPLAIN_EXAMPLES)]
pub struct ExplainArgs {
    /// Folder of a run
    pub run: PathBuf,
    /// Scenario file of the run; without this option the file with the run's name and content, here or in the folder
    /// scenarios
    #[arg(long, value_name = "FILE", value_parser = share::named())]
    pub scenario: Option<PathBuf>,
    /// Seeds to run; without this option five, beginning with the run's seed
    #[arg(long, value_name = "SEEDS", value_parser = seeds)]
    pub seeds: Option<String>,
    #[command(flatten)]
    pub jobs: Jobs,
    #[command(flatten)]
    pub foreign: Foreign,
}

/// Seeds without `--seeds`.
const SEEDS: u64 = 5;

impl Command for ExplainArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        explain(self, &self.foreign.registry(program.registry, []))
    }
}

/// Make the runs, and show the share of each source in the errors.
fn explain(task: &ExplainArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let manifest = Manifest::of_run(&task.run)?;
    let file = scenario_file(task, &manifest)?;
    let changes = changes(task, &manifest)?;
    let simulation = prepare::simulation(&file, &changes, registry)?;
    let scenario = &simulation.scenario;
    if scenario.name != scenario_name(&manifest) {
        let message = format!(
            "this is a run of {}, not of {}",
            scenario_name(&manifest),
            scenario.name
        );
        let help = "name the scenario file of the run, or a run of this scenario";
        return Err(CliError::Sim(input_error(
            scenario.path(),
            "",
            message,
            help,
        )));
    }
    let changed = scenario.input_digests() != manifest.inputs;
    if changed {
        note("files of this run were changed later: the changed files are explained");
    }
    let mut same_run = scenario.clone();
    same_run.name.clone_from(&manifest.scenario);
    same_run.file.seeds = Seeds::one(manifest.seed);
    let program = manifest.monorig.differs(&identity());
    if !changed && program.is_none() && resolved(&same_run, registry) != manifest.resolved {
        let message = "scenario file and changes do not give the scenario in the run's manifest";
        let help = "make the run again with `monorig run`";
        let path = task.run.join(manifest::NAME);
        return Err(CliError::Sim(input_error(&path, "changes", message, help)));
    }
    if let Some(what) = program {
        note(&format!("another program made this run: {what}"));
    }
    let seeds = asked_seeds(task, manifest.seed)?;
    let sources = explain::sources(scenario)?;
    output::begin()?;
    let runs = runs(task, scenario, &changes, &seeds, &sources, registry)?;
    let name = manifest.scenario.clone();
    let mut budget = Budget::new(identity().to_string(), name, seeds, &sources, &runs);
    budget.changed = changed;
    if budget.errors.is_empty() {
        return Err(nothing(task, &runs));
    }
    let json = serde_json::to_string_pretty(&budget).map_err(CliError::json)?;
    output::write(&task.run.join(explain::NAME), &(json + "\n"))?;
    let page = report::of_run(&task.run)?;
    let in_loop = manifest.resolved["in_loop"].as_str();
    output::print(&text(&budget, in_loop))?;
    note(&format!("report in {}", page.display()));
    Ok(CommandOutcome::Held)
}

/// Reason why there is no error to explain.
fn nothing(task: &ExplainArgs, runs: &[RunResult]) -> CliError {
    let run = task.run.display();
    let broken = runs.iter().find_map(|r| r.error.as_ref());
    let longest = runs
        .iter()
        .filter_map(|r| Some(r.summary.as_ref()?.simulated_s));
    let longest = longest.fold(0.0, f64::max);
    let (message, help) = match broken {
        Some(error) => (error.clone(), "use a run that finishes"),
        None if longest <= AFTER_S => (
            format!(
                "the run ends after {longest:.1} s, and errors are measured from {AFTER_S} s on"
            ),
            "a longer run",
        ),
        None => (
            "the run has no estimator with an error".to_owned(),
            "use a run of a scenario with `estimators`",
        ),
    };
    let message = format!("{run}: there is no error to explain: {message}");
    CliError::refused(message, help)
}

/// Changes to the scenario file in this run.
fn changes(task: &ExplainArgs, manifest: &Manifest) -> Result<Vec<(String, String)>, CliError> {
    let pairs = manifest.changes.iter().map(|change| {
        let pair = change.split_once('=');
        let pair = pair.map(|(path, value)| (path.to_owned(), value.to_owned()));
        pair.ok_or_else(|| {
            let path = task.run.join(manifest::NAME);
            let message = format!("`{change}` is not path=value");
            CliError::Sim(input_error(
                &path,
                "changes",
                message,
                "run the scenario again",
            ))
        })
    });
    pairs.collect()
}

fn asked_seeds(task: &ExplainArgs, first: u64) -> Result<Vec<u64>, CliError> {
    let Some(text) = &task.seeds else {
        return Ok((first..first.saturating_add(SEEDS)).collect());
    };
    let help = "--seeds 7, 1..20 or 1,5,9";
    let parsed = Seeds::parse(text).map_err(|message| CliError::refused(message, help))?;
    Ok(parsed.as_slice().to_vec())
}

/// Scenario file of a run: the file that the user names, or a file with the run's name and, byte for byte, its content.
fn scenario_file(task: &ExplainArgs, manifest: &Manifest) -> Result<PathBuf, CliError> {
    if !manifest.resolved["log"].is_null() {
        return Err(CliError::Sim(input_error(
            &task.run,
            "",
            "this run is a replay of a recorded log: sources of error cannot be switched off",
            "name the folder of a run of `monorig run`",
        )));
    }
    if let Some(file) = &task.scenario {
        return Ok(file.clone());
    }
    let found = of_run(manifest).ok_or_else(|| {
        let name = scenario_name(manifest);
        let message = format!(
            "no {name}.yaml with the content of this run is here or in the folder scenarios"
        );
        CliError::refused(message, "name the scenario file with --scenario")
    })?;
    detail(&format!("the scenario is {}", found.display()));
    Ok(found)
}

/// All runs: with everything, then without each of the sources.
fn runs(
    task: &ExplainArgs,
    scenario: &Scenario,
    changes: &[(String, String)],
    seeds: &[u64],
    sources: &[Source],
    registry: &Registry,
) -> Result<Vec<RunResult>, CliError> {
    let nothing = Vec::new();
    let off = std::iter::once(&nothing).chain(sources.iter().map(|s| &s.changes));
    let specs = off.flat_map(|off| {
        let all = Sets::new(&[changes, off.as_slice()].concat());
        seeds.iter().map(move |seed| (all.clone(), *seed))
    });
    let specs = (0..).zip(specs).map(|(index, (changes, seed))| {
        RunSpec::new(index, scenario.path(), seed, changes, scenario.inputs())
    });
    let specs: Vec<RunSpec> = specs.collect();
    scenario.inputs().seal();
    let work = |spec: RunSpec| run_one(&spec, registry, &interrupt::go_on);
    all_of(&scenario.name, task.jobs, specs.into_iter(), work)
}

/// A sentence, and the three largest sources of the errors of one estimator, with 95 % intervals.
fn text(budget: &Budget, in_loop: Option<&str>) -> String {
    let (name, sentence) = budget.sentence(in_loop);
    let errors: Vec<_> = METRICS
        .iter()
        .filter_map(|metric| budget.of(metric).find(|e| e.estimator == name))
        .collect();
    let titles = errors
        .iter()
        .map(|e| e.metric.strip_suffix("_deg").unwrap_or(&e.metric));
    let mut table = table(std::iter::once("share of").chain(titles));
    for source in budget.greatest(name) {
        let title = budget.sources.get(source).map_or("", |s| s.name.as_str());
        let cells = errors.iter().map(|e| e.share_words(source));
        table.add_row(std::iter::once(title.to_owned()).chain(cells));
    }
    right(&mut table, 1..=errors.len());
    let failed = budget.sources.iter();
    let failed =
        failed.filter_map(|s| Some(format!("without {}: {}\n", s.name, s.failed.as_ref()?)));
    let failed: String = failed.collect();
    let end = "in brackets the 95 % interval; every source and estimator: the report";
    format!(
        "{}\n\n{}\n\n{failed}{}\n",
        paragraph(&sentence, ""),
        lines(&table),
        paragraph(end, "")
    )
}
