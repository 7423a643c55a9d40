//! Checks of a study beyond the type of each value.

use crate::metrics::{Marks, Metric, find, mark};
use crate::tuning::name_check;
use crate::tuning::sensitivity;
use crate::tuning::study::{
    Combine, Evaluation, Optimiser, Range, RunGroup, Scale, TuningFile, TuningStudy,
};
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::registry::{Refusal, Registry};
use monorig_sim::config::input_files::InputFiles;
use monorig_sim::config::scenario::FeedForward;
use monorig_sim::error::Error;
use std::path::Path;

/// Largest number of trials; a larger number counts as a typing error.
const MAX_TRIALS: u32 = 1_000_000;

impl TuningStudy {
    /// Reads and checks a study and every scenario it names by building each simulation; its estimator must be in the
    /// registry. Every file is read here and never again.
    pub fn load(path: &Path, registry: &Registry) -> Result<Self, Error> {
        let inputs = InputFiles::default();
        inputs.during(|| {
            let study = Self::read(path, registry, &inputs)?;
            check(&study)?;
            for group in study.tuning.iter().chain(&study.validation) {
                let seed = group.seeds.first().copied().unwrap_or(1);
                Simulation::build(group.scenario.clone(), registry, seed)?;
            }
            inputs.seal();
            Ok(study)
        })
    }
}

/// Largest number of trials around a winner: a hundred times those of the usual one.
const MAX_SENSITIVITY_TRIALS: u64 = 20_000;

fn check(study: &TuningStudy) -> Result<(), Error> {
    let file = &study.file;
    if file.why.trim().is_empty() {
        return Err(study.wrong("why", "a study needs a purpose", "write a sentence"));
    }
    parameters(study)?;
    metrics(study)?;
    runs(study)?;
    let least = 2 + u32::from(!file.published.is_empty());
    if !(least..=MAX_TRIALS).contains(&file.budget) {
        return Err(study.wrong(
            "budget",
            format!("{} trials are too few for a search", file.budget),
            format!("a number from {least} to {MAX_TRIALS}"),
        ));
    }
    let trials = sensitivity::trials(file);
    if trials > MAX_SENSITIVITY_TRIALS {
        return Err(study.wrong(
            "sensitivity",
            format!("the curves around the winner would need {trials} trials"),
            format!("use a smaller `curve`, for at most {MAX_SENSITIVITY_TRIALS} trials"),
        ));
    }
    let pareto = file.objective.combine == Combine::Pareto;
    let many = matches!(
        file.optimiser,
        Optimiser::Nsga2 | Optimiser::Grid | Optimiser::Random
    );
    if pareto && !many {
        return Err(study.wrong(
            "optimiser",
            "this optimiser cannot search for a front",
            "`nsga2`, `grid` or `random` for `combine: pareto`",
        ));
    }
    if file.optimiser == Optimiser::Nsga2 && !pareto {
        return Err(study.wrong(
            "optimiser",
            "nsga2 searches for a front, but this objective is one number",
            "another optimiser, or `combine: pareto`",
        ));
    }
    Ok(())
}

fn wrong(message: impl Into<String>, help: impl Into<String>) -> Refusal {
    Refusal {
        message: message.into(),
        help: help.into(),
    }
}

fn parameters(study: &TuningStudy) -> Result<(), Error> {
    let file = &study.file;
    if file.parameters.is_empty() {
        return Err(study.wrong(
            "parameters",
            "nothing varies",
            "name a parameter and its range",
        ));
    }
    for (key, r) in &file.parameters {
        let at = format!("parameters.{key}");
        let refused = |(part, w): (&str, Refusal)| study.error(format!("{at}{part}"), w);
        study.of.key(key).map_err(|w| refused(("", w)))?;
        range(r).map_err(refused)?;
        name_check::range(&study.of, key, r).map_err(refused)?;
    }
    for (key, x) in &file.published {
        let at = format!("published.{key}");
        study
            .of
            .check(key, x.setting())
            .map_err(|w| study.error(at, w))?;
    }
    for (key, x) in &file.fixed {
        let at = format!("fixed.{key}");
        study
            .of
            .check(key, x.setting())
            .map_err(|w| study.error(&at, w))?;
        if file.parameters.contains_key(key) {
            return Err(study.wrong(
                at,
                format!("`{key}` is also a varied parameter"),
                "remove one of the two entries",
            ));
        }
    }
    Ok(())
}

/// Checks a range by itself; the error names the key below it.
fn range(r: &Range) -> Result<(), (&'static str, Refusal)> {
    if let Some(choices) = &r.choices {
        if r.from.is_some() || r.to.is_some() || r.integer || r.scale != Scale::Linear {
            return Err((
                "",
                wrong(
                    "`choices` cannot be combined with `from`, `to`, `scale` or `integer`",
                    "keep only one of the two",
                ),
            ));
        }
        if choices.len() < 2 {
            return Err((
                ".choices",
                wrong("these choices are too few", "give two values or more"),
            ));
        }
        return Ok(());
    }
    let (Some(from), Some(to)) = (r.from, r.to) else {
        return Err((
            "",
            wrong("this range has no ends", "`from` and `to`, or `choices`"),
        ));
    };
    let (from, to) = (from.get(), to.get());
    if from >= to {
        return Err((
            ".to",
            wrong(
                format!("the range ends at {to}, but starts at {from}"),
                "a value above `from`",
            ),
        ));
    }
    match r.scale {
        Scale::Log if from <= 0.0 => Err((
            ".from",
            wrong(
                format!("{from} has no logarithm"),
                "a value above 0, or `scale: linear`",
            ),
        )),
        Scale::Memory if from < 0.0 || to >= 1.0 => Err((
            ".scale",
            wrong(
                "the memory 1/(1 − x) needs 0 ≤ x < 1",
                "ends such as 0.9 and 0.9999, or `scale: linear`",
            ),
        )),
        _ if r.integer && (from.fract() != 0.0 || to.fract() != 0.0) => Err((
            ".integer",
            wrong(
                "the ends of this range are not whole numbers",
                "whole numbers for `from` and `to`",
            ),
        )),
        _ => Ok(()),
    }
}

fn metrics(study: &TuningStudy) -> Result<(), Error> {
    let file = &study.file;
    if file.objective.metrics.is_empty() {
        return Err(study.wrong(
            "objective.metrics",
            "the objective has no metric",
            "for example [{metric: slope_rmse_deg}]",
        ));
    }
    if file.objective.combine == Combine::Pareto && file.objective.metrics.len() < 2 {
        return Err(study.wrong(
            "objective.combine",
            "a front needs two metrics",
            "`weighted`, or another metric",
        ));
    }
    let window = |key: &str, after: f64, until: Option<f64>| match until {
        Some(until) if until <= after => Err(study.wrong(
            format!("{key}.until_s"),
            format!("no sample lies between {after} s and {until} s"),
            "a later time",
        )),
        _ => Ok(()),
    };
    let moves = file.evaluation == Evaluation::ClosedLoop;
    for (i, term) in file.objective.metrics.iter().enumerate() {
        let at = format!("objective.metrics[{i}]");
        name_check::metric(&term.metric, moves)
            .map_err(|w| study.error(format!("{at}.metric"), w))?;
        window(&at, term.after_s.get(), term.until_s.map(f64::from))?;
    }
    for (i, term) in file.objective.metrics.iter().enumerate() {
        accompanied(file, &term.metric)
            .map_err(|w| study.error(format!("objective.metrics[{i}].metric"), w))?;
    }
    for (i, c) in file.constraints.iter().enumerate() {
        let at = format!("constraints[{i}]");
        name_check::metric(&c.metric, moves).map_err(|w| study.error(format!("{at}.metric"), w))?;
        window(&at, c.after_s.get(), c.until_s.map(f64::from))?;
        match (c.at_least, c.at_most) {
            (None, None) => {
                return Err(study.wrong(
                    at,
                    "this bound has no limit",
                    "`at_most`, `at_least`, or both",
                ));
            }
            (Some(least), Some(most)) if least > most => {
                return Err(study.wrong(at, "no value lies between these bounds", "swap the two"));
            }
            _ => {}
        }
    }
    Ok(())
}

/// A loss that counts only samples marked valid needs the availability beside it: else the optimiser gains by marking
/// less valid.
fn accompanied(file: &TuningFile, name: &str) -> Result<(), Refusal> {
    let Some(quantity) = find(name)
        .filter(|m| m.is_of_valid())
        .and_then(Metric::error_of)
    else {
        return Ok(());
    };
    let metric = mark(quantity, Marks::Availability);
    let term = file.objective.metrics.iter().any(|t| t.metric == metric);
    let mut constraints = file.constraints.iter();
    if term || constraints.any(|c| c.metric == metric && c.at_least.is_some_and(|x| x.get() > 0.0))
    {
        return Ok(());
    }
    Err(wrong(
        format!("`{name}` counts only samples marked valid, but no bound sets their least share"),
        format!(
            "add `{metric}` to the metrics, or `{{metric: {metric}, at_least: 0.9}}` to the constraints"
        ),
    ))
}

fn runs(study: &TuningStudy) -> Result<(), Error> {
    let file = &study.file;
    for (key, groups) in [("tuning", &study.tuning), ("validation", &study.validation)] {
        if groups.is_empty() {
            return Err(study.wrong(
                key,
                "the list has no runs",
                "for example [{scenario: winding.yaml, seeds: 1..4}]",
            ));
        }
        for (i, group) in groups.iter().enumerate() {
            loop_fits(study, group).map_err(|w| study.error(format!("{key}[{i}].scenario"), w))?;
        }
    }
    for (i, v) in study.validation.iter().enumerate() {
        for t in &study.tuning {
            let same = v.scenario.path() == t.scenario.path()
                && file.validation.get(i).map(|r| &r.set)
                    == file
                        .tuning
                        .iter()
                        .zip(&study.tuning)
                        .find(|(_, g)| std::ptr::eq(*g, t))
                        .map(|(r, _)| &r.set);
            if let Some(seed) = v.seeds.iter().find(|s| same && t.seeds.contains(s)) {
                return Err(study.wrong(
                    format!("validation[{i}].seeds"),
                    format!("seed {seed} of this scenario is a tuning run, so it cannot validate"),
                    "other seeds, or another scenario",
                ));
            }
        }
    }
    Ok(())
}

/// Checks the evaluation: replay is for estimators outside the loop, the closed loop is for estimators in it. A replay
/// has no restarts.
fn loop_fits(study: &TuningStudy, group: &RunGroup) -> Result<(), Refusal> {
    let s = &group.scenario.file;
    let drives = s.in_loop.as_ref() == Some(&study.file.estimator)
        && s.drive.controller.feedforward == FeedForward::Estimate;
    if drives && study.file.evaluation == Evaluation::Replay {
        return Err(wrong(
            format!(
                "{} is in the loop here: with other parameters the train would not move as recorded",
                study.file.estimator
            ),
            "`evaluation: closed_loop`, or `set: {drive.controller.feedforward: truth}` for these runs",
        ));
    }
    if study.file.evaluation == Evaluation::Replay && s.restarts() {
        return Err(wrong(
            "the estimators restart here, which a replay of their samples cannot show".to_owned(),
            "`evaluation: closed_loop`, or a scenario without `restart_s`",
        ));
    }
    Ok(())
}
