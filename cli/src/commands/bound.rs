//! `monorig bound`: the posterior Cramér-Rao bound of a scenario, and the errors of its estimators beside it.

use crate::arguments::{Changes, Jobs};
use crate::command::{Command, CommandOutcome, Program};
use crate::files::{csv, prepare};
use crate::recording::many::all_of;
use crate::ui::errors::CliError;
use crate::ui::interrupt;
use crate::ui::note::note;
use crate::ui::output;
use crate::ui::prose::{counted, paragraph};
use crate::ui::tables::{grouped, number};
use monorig_lab::bound::{AFTER_S, BoundObserver, MeanSquares, RunBound, SheetNoise};
use monorig_sim::closed_loop::builder::SimulationBuilder;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::{Simulation, run};
use monorig_sim::config::scenario::Scenario;
use monorig_sim::error::Error;
use std::path::PathBuf;

const BOUND_EXAMPLES: &str = "\
Examples:
  monorig bound scenarios/minimal.yaml
  monorig bound scenarios/liu2023_section1.yaml \\
      --set estimators.rail_fusion={} --csv bound.csv

The bound is the least root mean square over runs that is possible with the
white noise, biases and scale errors of the sensor sheet on this motion, the
models being right; slip, sway, rail ahead that was not read, vibration, faults
and delays are not in it. Errors are those of all samples from 5 s on, of the
mass in the last second.";

/// Compare the estimators of a scenario with the Cramér-Rao bound.
#[derive(Debug, clap::Parser)]
#[command(name = "bound", after_help = BOUND_EXAMPLES)]
pub struct BoundArgs {
    /// Scenario file
    pub file: PathBuf,
    #[command(flatten)]
    pub changes: Changes,
    #[command(flatten)]
    pub jobs: Jobs,
    /// Write the bound of the first seed over time as CSV
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
}

impl Command for BoundArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        bound(self, program.registry)
    }
}

/// Run the scenario over its seeds, and print bound and errors.
fn bound(task: &BoundArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let scenario = prepare::simulation(&task.file, &task.changes.all(), registry)?.scenario;
    bounded(&scenario)?;
    interrupt::listen();
    scenario.inputs().seal();
    let one = |seed: &u64| of_seed(&scenario, registry, *seed);
    let runs = all_of(&scenario.name, task.jobs, scenario.seeds().iter(), one)?;
    if let (Some(path), Some(first)) = (&task.csv, runs.first()) {
        output::write(path, &csv_text(first)?)?;
        note(&format!("bound over time in {}", path.display()));
    }
    output::print(&text(&runs))?;
    Ok(CommandOutcome::Held)
}

/// Refuses a scenario whose sheet has no accelerometer or no wheel speed: it has no bound.
fn bounded(scenario: &Scenario) -> Result<(), Error> {
    let builder = SimulationBuilder::from_scenario(scenario.clone())?;
    let noise = builder
        .instruments()
        .map(SheetNoise::of)
        .unwrap_or_default();
    match noise.accelerometer.and(noise.wheel_speed) {
        Some(_) => Ok(()),
        None => Err(scenario.error(
            "sensors",
            "there is no bound without an accelerometer and wheel speeds",
            "a sheet that has both",
        )),
    }
}

/// The bound of a run.
fn of_seed(scenario: &Scenario, registry: &Registry, seed: u64) -> Result<RunBound, CliError> {
    let mut simulation = Simulation::build(scenario.clone(), registry, seed)?;
    let mut observer = BoundObserver::default();
    let outcome = run::run(&mut simulation, &mut [&mut observer], &mut |_| {
        interrupt::go_on()
    })?;
    match outcome.interrupted {
        true => Err(CliError::Interrupted),
        false => Ok(observer.into_run()),
    }
}

/// Root mean squares over the runs: of each estimator, beside the bound, and their ratio.
fn text(runs: &[RunBound]) -> String {
    let figures = |of: MeanSquares| {
        [
            ("slope °", of.slope.sqrt().to_degrees()),
            ("effective slope °", of.effective.sqrt().to_degrees()),
            ("mass at end %", 100.0 * of.mass_at_end.sqrt()),
        ]
    };
    let bounds = figures(mean(runs.iter().map(|r| r.bound)));
    let estimators = runs
        .first()
        .into_iter()
        .flat_map(|r| &r.estimators)
        .enumerate();
    let mut groups: Vec<(String, Vec<Vec<String>>)> = estimators
        .map(|(i, (name, _))| {
            let all = runs.iter().filter_map(|r| r.estimators.get(i));
            let of = figures(mean(all.map(|(_, sums)| *sums)));
            let rows = of.iter().zip(bounds).map(|((what, x), (_, bound))| {
                let ratio = match bound > 0.0 {
                    true => format!("{:.2}", x / bound),
                    false => String::new(),
                };
                vec![(*what).to_owned(), shown(bound), shown(*x), ratio]
            });
            (name.clone(), rows.collect())
        })
        .collect();
    if groups.is_empty() {
        let rows = bounds.map(|(what, bound)| vec![what.to_owned(), shown(bound)]);
        groups.push(("no estimator".to_owned(), rows.into()));
    }
    let runs = runs.len();
    let runs = counted(runs, "run");
    let about = format!("root mean squares over {runs}, all samples from {AFTER_S} s on");
    format!(
        "{}\n\n{}\n",
        paragraph(&about, ""),
        grouped(&["", "bound", "error", "error / bound"], &groups)
    )
}

fn shown(x: f64) -> String {
    match x.is_finite() {
        true => number(x),
        false => "–".into(),
    }
}

fn mean(all: impl Iterator<Item = MeanSquares>) -> MeanSquares {
    let mut n = 0.0;
    let mut sum = MeanSquares::default();
    for one in all {
        n += 1.0;
        sum.slope += one.slope;
        sum.effective += one.effective;
        sum.mass_at_end += one.mass_at_end;
    }
    MeanSquares {
        slope: sum.slope / n,
        effective: sum.effective / n,
        mass_at_end: sum.mass_at_end / n,
    }
}

/// The bound over time as CSV.
fn csv_text(run: &RunBound) -> Result<String, CliError> {
    let titles = [
        "t_s",
        "slope_sd_deg",
        "effective_slope_sd_deg",
        "mass_sd_rel",
    ];
    let rows = run.samples.iter().map(|s| {
        let (slope, effective) = (s.slope_rad.to_degrees(), s.effective_rad.to_degrees());
        let [slope, effective, mass] = [slope, effective, s.mass_rel].map(|x| format!("{x:.6}"));
        [format!("{:.3}", s.t_s), slope, effective, mass]
    });
    csv::text(&titles, rows)
}
