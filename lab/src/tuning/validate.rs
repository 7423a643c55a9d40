//! The winner on runs that the optimiser did not use, compared with the defaults and the published constants, run by
//! run.

use crate::tuning::baseline::Baseline;
use crate::tuning::evaluate::{Evaluator, RunMetrics};
use crate::tuning::loss::{Judge, own_loss};
use crate::tuning::study::Values;
use crate::tuning::study::{RunGroup, TuningStudy};
use crate::verdicts::interval::Interval;
use serde::Serialize;

/// Results of the validation.
#[derive(Clone, Debug, Serialize)]
pub struct Validation {
    /// Loss of the winner over the tuning runs; the loss of the defaults is 1; none for a failure.
    pub tuning_loss: Option<f64>,
    /// Loss of the winner over the validation runs.
    pub validation_loss: Option<f64>,
    /// The winner against the defaults, then against the published constants.
    pub comparisons: Vec<PairedComparison>,
}

/// The winner against another parameter set, over pairs of runs with the same scenario and seed.
#[derive(Clone, Debug, Serialize)]
pub struct PairedComparison {
    /// `default` or `published`.
    pub against: String,
    /// Loss of the winner minus loss of the other, per run, over all runs; the loss of the defaults is 1.
    pub loss: Option<Interval>,
    /// Verdict of the interval.
    pub verdict: ComparisonVerdict,
    /// Per metric and scenario.
    pub rows: Vec<MetricComparison>,
}

/// A metric in a scenario.
#[derive(Clone, Debug, Serialize)]
pub struct MetricComparison {
    /// Metric.
    pub metric: String,
    /// Scenario.
    pub scenario: String,
    /// Mean over the seeds, of the winner.
    pub winner: f64,
    /// Mean of the other parameters.
    pub other: f64,
    /// Winner minus other, seed by seed.
    pub difference: Interval,
}

/// Verdict of an interval of differences.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ComparisonVerdict {
    /// The whole interval is below zero.
    Better,
    /// The interval contains zero, or there is no interval.
    NoDifference,
    /// The whole interval is above zero.
    Worse,
}

impl ComparisonVerdict {
    /// Verdict in words.
    pub fn words(self) -> &'static str {
        match self {
            ComparisonVerdict::Better => "better",
            ComparisonVerdict::NoDifference => "no difference",
            ComparisonVerdict::Worse => "worse",
        }
    }

    /// Judges an interval of differences of a value for which less is better.
    pub(crate) fn of(interval: Option<&Interval>) -> Self {
        match interval {
            Some(i) if i.high < 0.0 => ComparisonVerdict::Better,
            Some(i) if i.low > 0.0 => ComparisonVerdict::Worse,
            _ => ComparisonVerdict::NoDifference,
        }
    }
}

impl Validation {
    /// Sentence with the result and its runs; it says if these have only other seeds of a tuning scenario.
    pub fn sentence(&self, study: &TuningStudy) -> String {
        let on = unseen(study);
        let runs = runs(study);
        let Some(first) = self.comparisons.first() else {
            return "not shown: no comparison was made".to_owned();
        };
        let interval = first.loss.as_ref().map_or(String::new(), |i| {
            format!(
                " (loss {:+.3}, 95 % interval {:+.3} to {:+.3}; the loss of the defaults is 1)",
                i.mean, i.low, i.high
            )
        });
        match (first.verdict, &first.loss) {
            (_, None) => {
                format!("not shown: a run of the validation could not be measured, on {on}")
            }
            (ComparisonVerdict::Better, _) => {
                format!("the winner is better than the defaults on {on}{interval}")
            }
            (ComparisonVerdict::Worse, _) => {
                format!("the winner is WORSE than the defaults on {on}{interval}")
            }
            (ComparisonVerdict::NoDifference, _) => format!(
                "not shown with {runs} runs: no difference between winner and defaults on {on}{interval}"
            ),
        }
    }

    /// The verdict against the defaults.
    pub(crate) fn verdict(&self) -> ComparisonVerdict {
        let first = self.comparisons.first();
        first.map_or(ComparisonVerdict::NoDifference, |c| c.verdict)
    }
}

/// Runs of the validation.
fn runs(study: &TuningStudy) -> usize {
    study.validation.iter().map(|g| g.seeds.len()).sum()
}

/// The runs of the validation in words, such as `6 other seeds of the same scenario`.
fn unseen(study: &TuningStudy) -> String {
    let seen = |g: &&RunGroup| {
        let mut tuned = study.tuning.iter();
        tuned.any(|t| t.scenario.name == g.scenario.name)
    };
    let known = study.validation.iter().filter(seen).count();
    let scenarios = study.validation.len();
    let runs = runs(study);
    match (known, scenarios) {
        (1, 1) => format!("{runs} other seeds of the same scenario"),
        (known, all) if known == all => format!("{runs} other seeds of the same {all} scenarios"),
        (0, 1) => format!("{runs} runs of a scenario that the search did not use"),
        (0, all) => format!("{runs} runs of {all} scenarios that the search did not use"),
        (known, all) => format!(
            "{runs} runs of {all} scenarios, {} of which the search did not use",
            all - known
        ),
    }
}

/// Runs the winner and the parameters to compare with over the validation runs.
pub(crate) fn validate(
    study: &TuningStudy,
    evaluator: &Evaluator<'_>,
    Baseline { judge, defaults }: &Baseline,
    winner: &Values,
    tuning_loss: f64,
) -> Validation {
    let winners = evaluator.evaluate(winner);
    let mut comparisons = vec![compare(study, judge, "default", &winners, defaults)];
    if let Some(published) = study.published() {
        comparisons.push(compare(
            study,
            judge,
            "published",
            &winners,
            &evaluator.evaluate(&published),
        ));
    }
    let verdict = judge.judge(&winners);
    let loss = verdict.losses.iter().sum::<f64>() / verdict.losses.len() as f64;
    Validation {
        tuning_loss: Some(tuning_loss).filter(|x| x.is_finite()),
        validation_loss: Some(loss).filter(|x| x.is_finite()),
        comparisons,
    }
}

fn compare(
    study: &TuningStudy,
    judge: &Judge,
    against: &str,
    winner: &[RunMetrics],
    other: &[RunMetrics],
) -> PairedComparison {
    let pairs = || winner.iter().zip(other);
    let differences: Option<Vec<f64>> = pairs()
        .map(|(w, o)| Some(judge.run_loss(w)? - judge.run_loss(o)?))
        .collect();
    let loss = differences.map(|d| Interval::student(&d));
    let mut rows = Vec::new();
    for (i, term) in study.file.objective.metrics.iter().enumerate() {
        for (g, group) in study.validation.iter().enumerate() {
            let of = |s: &RunMetrics| s.values.as_ref().ok().and_then(|v| v.get(i).copied());
            let values: Vec<(f64, f64)> = pairs()
                .filter(|(w, _)| w.group == g)
                .filter_map(|(w, o)| Some((of(w)?, of(o)?)))
                .collect();
            let column = |f: fn(&(f64, f64)) -> f64| values.iter().map(f).collect::<Vec<_>>();
            rows.push(MetricComparison {
                metric: term.metric.clone(),
                scenario: name(group),
                winner: Interval::student(&column(|p| p.0)).mean,
                other: Interval::student(&column(|p| p.1)).mean,
                difference: Interval::student(&column(|p| p.0 - p.1)),
            });
        }
    }
    PairedComparison {
        against: against.to_owned(),
        verdict: ComparisonVerdict::of(loss.as_ref()),
        loss,
        rows,
    }
}

fn name(group: &RunGroup) -> String {
    group.scenario.name.clone()
}

impl Judge {
    /// Loss of a single run; `None` if it failed.
    fn run_loss(&self, measured: &RunMetrics) -> Option<f64> {
        let values = measured.values.as_ref().ok()?;
        let reference_losses = self.reference_losses(measured.group)?;
        let (mut sum, mut weights) = (0.0, 0.0);
        for ((metric, weight, reference_loss), x) in reference_losses.zip(values) {
            sum += weight * own_loss(metric, *x) / reference_loss;
            weights += weight;
        }
        Some(sum / weights).filter(|x| x.is_finite())
    }
}
