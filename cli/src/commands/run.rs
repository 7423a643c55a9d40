//! `monorig run`: simulate a scenario and report.

use crate::arguments::{Json, Out, VIEWER, address, assignment, seeds};
use crate::command::{Command, CommandOutcome, Program};
use crate::files::out::prepare_out;
use crate::files::prepare;
use crate::files::share;
use crate::identity::identity;
use crate::recording::pace;
use crate::recording::simulate::{RecordOptions, simulate};
use crate::recording::variant::{self, Variant};
use crate::ui::errors::{self, CliError};
use crate::ui::interrupt;
use crate::ui::note::note;
use crate::ui::output;
use crate::ui::progress::ProgressDisplay;
use crate::ui::prose::paragraph;
use crate::ui::summary;
use clap::ValueEnum;
use monorig_lab::verdicts::judgement::Totals;
use monorig_lab::verdicts::run_result::RunResult;
use monorig_lab::verdicts::verdict::ScenarioVerdict;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::{Simulation, WallClock};
use monorig_sim::config::scenario::Seeds;
use monorig_sim::error::Error;
use serde_json::json;
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const RUN_EXAMPLES: &str = "\
Examples:
  monorig run scenarios/liu2023_section1.yaml
  monorig run scenarios/minimal.yaml --seed 7 --set 'drive.speed[2].mps=0.5' \\
      --set 'estimators.rls_ekf={}'
  monorig run scenarios/minimal.yaml scenarios/adhesion_loss.yaml --seed 1..2
      several scenarios, several seeds
  monorig run scenarios/minimal.yaml --live --pace 20
      watch it at 20 times real time in a Rerun viewer that is open
  monorig run scenarios/minimal.yaml --plant point-mass --no-rerun
      fast: a point on the rail, no 3-D recording

Results: OUT/<scenario>/<seed>/ with manifest.json (what was run),
channels.parquet (every signal), metrics.json, and, with the viewer built in,
run.rrd to open in Rerun. With --set or --plant the folder is
OUT/<scenario>@<variant>/<seed>/, where the variant is --name or a short hash of
the changes.";

/// Key of a scenario's seeds.
const SEEDS: &str = "seeds";

/// Simulate a scenario: train, instruments and estimators in closed loop.
#[derive(Debug, clap::Parser)]
#[command(name = "run", after_help = RUN_EXAMPLES)]
pub struct RunArgs {
    /// Scenario files, or names of those that come with monorig
    #[arg(required = true, value_name = "FILE", value_parser = share::named())]
    pub files: Vec<PathBuf>,
    /// Run these seeds instead of the first seed: `7`, `1..3` or `1,5,9`
    #[arg(long, value_name = "SEEDS", value_parser = seeds)]
    pub seed: Option<String>,
    /// Name of the variant that --set and --plant make, instead of a short hash
    #[arg(long, hide_short_help = true, value_name = "NAME", value_parser = variant::parse)]
    pub name: Option<String>,
    #[command(flatten)]
    pub out: Out,
    /// Also stream to a Rerun viewer; without an address to the open viewer on this machine
    #[arg(long, value_name = "HOST:PORT", conflicts_with = "no_rerun", num_args = 0..=1, require_equals = true,
        default_missing_value = VIEWER, value_parser = address)]
    pub live: Option<SocketAddr>,
    /// Simulate no faster than this multiple of real time; without this option as fast as possible. With --pace
    /// external estimators must answer in time
    #[arg(long, value_name = "TIMES", value_parser = pace::parse)]
    pub pace: Option<f64>,
    /// Do not write run.rrd
    #[arg(long)]
    pub no_rerun: bool,
    /// Draw the lines of run.rrd through every row instead of about ten a second, and record long runs at the full rate
    /// too, instead of half the rate after two hours (360 000 rows), a quarter after four …
    #[arg(long, hide_short_help = true)]
    pub full_rate: bool,
    /// Keep every sample with stamp and arrival in samples.parquet: `monorig log export` makes a log from this file
    #[arg(long)]
    pub keep_samples: bool,
    /// Move the train with this plant instead of the scenario's
    #[arg(long, value_name = "PLANT")]
    pub plant: Option<PlantChoice>,
    /// Change a value of the scenario; may be given several times
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = assignment)]
    pub sets: Vec<(String, String)>,
    #[command(flatten)]
    pub json: Json,
}

impl RunArgs {
    /// All changes to the scenario as `(path, value)`.
    pub fn overrides(&self) -> Vec<(String, String)> {
        let mut all = self.sets.clone();
        if let Some(seeds) = &self.seed {
            all.push((SEEDS.into(), seeds.clone()));
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

/// Plant that moves the train.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PlantChoice {
    /// Rigid bodies in rapier
    Rapier,
    /// A point on the rail
    PointMass,
}

impl Command for RunArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        run(self, program.registry)
    }
}

/// Simulate each scenario with the user's seeds, else with its first seed; tests and comparisons use all its seeds.
/// Nothing is written before the whole input is checked.
fn run(task: &RunArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let clock = task.pace.map(|times| Arc::new(WallClock::new(times)));
    let registry = &registry.clone().on_clock(clock.clone());
    let overrides = task.overrides();
    let variant = Variant::new(&overrides, task.name.as_deref());
    let mut simulations = Vec::new();
    for file in &task.files {
        let first = prepare::simulation(file, &overrides, registry)?;
        let asked = match task.seed {
            Some(_) => first.scenario.seeds().to_vec(),
            None => vec![first.seed],
        };
        let mut built = Some(first);
        simulations.extend(asked.into_iter().map(|seed| (file, seed, built.take())));
    }
    let out = task.out.get();
    prepare_out(&out)?;
    output::begin()?;
    let options = RecordOptions {
        out: &out,
        live: task.live,
        pace: clock,
        no_rerun: task.no_rerun,
        full_rate: task.full_rate,
        keep_samples: task.keep_samples,
        changes: &variant.changes,
        registry,
    };
    let many = simulations.len() > 1;
    let mut shown = Shown::default();
    for (file, seed, built) in simulations {
        let mut simulation = match built {
            Some(first) => first,
            None => {
                let mut own = overrides.clone();
                own.push((SEEDS.into(), seed.to_string()));
                prepare::simulation(file, &own, registry)?
            }
        };
        simulation.scenario.file.seeds = Seeds::one(seed);
        simulation.scenario.name = variant.run_name(&simulation.scenario.name);
        let name = simulation.scenario.name.clone();
        match one(simulation, &options, task.json.path(), &mut shown) {
            Err(CliError::Sim(e @ (Error::Estimator { .. } | Error::Controller { .. }))) => {
                shown.broke_down(name, seed, e)
            }
            done => done?,
        }
    }
    task.json.write(|| {
        let monorig = identity().to_string();
        json!({ "version": 1, "kind": "run", "monorig": monorig, "runs": shown.json })
    })?;
    if many || shown.broken {
        output::result(&format!("\n{}\n", shown.words()), &[task.json.path()])?;
    }
    Ok(CommandOutcome::of(shown.verdicts.iter().all(|v| v.held)))
}

/// The runs shown so far.
#[derive(Default)]
struct Shown {
    verdicts: Vec<ScenarioVerdict>,
    json: Vec<serde_json::Value>,
    /// True if an estimator broke down.
    broken: bool,
}

impl Shown {
    /// A run in which an estimator broke down has failed, and has no numbers. The others go on.
    fn broke_down(&mut self, scenario: String, seed: u64, e: Error) {
        let run = RunResult::new(&scenario, seed, Err(e.to_string()));
        errors::show(&CliError::Sim(e));
        let verdict = ScenarioVerdict::new(&scenario, vec![run]);
        self.json.push(json!({
            "held": verdict.held,
            "verdict": verdict.judgement().words(),
            "checks": verdict.checks,
        }));
        self.verdicts.push(verdict);
        self.broken = true;
    }

    /// Verdict on all runs in a line, with the names of the failed runs.
    fn words(&self) -> String {
        let all = self.verdicts.len();
        let failed = self.verdicts.iter().filter(|v| !v.held);
        let seeds = |v: &ScenarioVerdict| {
            v.runs
                .iter()
                .map(|r| r.seed.to_string())
                .collect::<String>()
        };
        let failed: Vec<String> = failed
            .map(|v| format!("{} seed {}", v.scenario, seeds(v)))
            .collect();
        let totals = Totals::of(&self.verdicts);
        let text = match (failed.len(), totals.known) {
            (0, 0) if totals.unasked == all => format!("nothing was expected of {all} runs"),
            (0, 0) => format!("held: {all} runs"),
            (0, 1) => format!("held but for 1 known failure: {all} runs"),
            (0, known) => format!("held but for {known} known failures: {all} runs"),
            (n, _) => format!("FAILED: {n} of {all} runs: {}", failed.join(", ")),
        };
        paragraph(&text, "")
    }
}

/// One run: simulated, recorded, and shown.
fn one(
    simulation: Simulation,
    options: &RecordOptions<'_>,
    json: Option<&Path>,
    shown: &mut Shown,
) -> Result<(), CliError> {
    let title = format!("{} seed {}", simulation.scenario.name, simulation.seed);
    let mut progress = ProgressDisplay::new(&title);
    let run = simulate(simulation, options, &mut |share| {
        progress.at(share);
        interrupt::go_on()
    })?;
    drop(progress);
    note(&format!("results in {}", run.folder.display()));
    let text = summary::text(&run.summary, &run.about(title, "simulated"));
    output::result(&text, &[json])?;
    if run.interrupted {
        return Err(CliError::Interrupted);
    }
    if !run.summary.finished {
        note("the train did not reach the end of the scenario (`stop.at_m`)");
    }
    shown.json.push(run.json());
    shown.verdicts.push(run.summary.verdict());
    let is_late = |metrics: &BTreeMap<String, Option<f64>>| {
        metrics.get("rig_late_share").copied().flatten() > Some(0.0)
    };
    let late = run
        .summary
        .estimators
        .iter()
        .find(|(_, metrics)| is_late(metrics));
    match late {
        Some((late, _)) => Err(CliError::refused(
            format!("this program missed its own deadlines: the run does not judge {late}"),
            "use an idle machine, `--no-rerun`, or a slower `--pace`; the channel `rig_late` counts the steps that were sent too late",
        )),
        None => Ok(()),
    }
}
