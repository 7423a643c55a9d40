//! The loss of a trial from the metrics of all runs: 1 is as good as the defaults, less is better.
//!
//! A metric's own loss is 0 at its best value ([`crate::metrics::Best::loss`]): the value itself for an error, 1 − x
//! for a share, |ln x| for a normalised square, the distance from 0.95 for the share in a 95 % band. It is averaged
//! over the seeds of a scenario and divided by what the defaults have there, so that kilograms and degrees, easy and
//! hard scenarios have the weights of the study, whatever their units.

use crate::metrics;
use crate::tuning::space::digits;
use crate::tuning::study::{Combine, RunGroup, TuningFile};
use monorig_sim::config::checked::Positive;

/// Least loss that can be a divisor; a smaller loss counts as zero.
const MIN_LOSS: f64 = 1e-9;

/// Scores the trials of a study.
#[derive(Clone, Debug)]
pub(crate) struct Judge {
    combine: Combine,
    terms: Vec<(String, f64)>,
    constraints: Vec<(Option<f64>, Option<f64>)>,
    weights: Vec<f64>,
    keep_valid: f64,
    /// Per group and term: the loss of the defaults.
    reference: Vec<Vec<f64>>,
    /// Per group: the valid shares of the defaults.
    valid: Vec<[f64; 2]>,
}

/// The verdict on a trial.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TrialVerdict {
    /// One loss, or one per metric for a front; empty if the trial failed.
    pub(crate) losses: Vec<f64>,
    /// Violation of the constraints, as a share of their bounds; 0 = all held.
    pub(crate) violation: f64,
    /// Reason why there is no loss.
    pub(crate) failed: Option<String>,
}

/// A metric over a window of time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MetricWindow {
    /// Its name.
    pub(crate) metric: String,
    /// Begin of the window, s.
    pub(crate) after_s: f64,
    /// End of the window, s.
    pub(crate) until_s: f64,
}

/// Metrics of one run in the requested order, or the reason why there are none.
#[derive(Clone, Debug, PartialEq)]
pub struct RunMetrics {
    /// Index of the group.
    pub(crate) group: usize,
    pub(crate) seed: u64,
    /// The metrics.
    pub values: Result<Vec<f64>, String>,
}

/// Metrics whose samples count, and metrics that guard them.
const VALID: [&str; 2] = ["mass_availability", "slope_availability"];

/// Metrics to measure in every run: those of the objective, those of the constraints, the valid shares.
pub(crate) fn metric_windows(file: &TuningFile) -> Vec<MetricWindow> {
    let window = |metric: &str, after_s: f64, until_s: Option<Positive>| MetricWindow {
        metric: metric.to_owned(),
        after_s,
        until_s: until_s.map_or(f64::INFINITY, f64::from),
    };
    let terms = file.objective.metrics.iter();
    let terms = terms.map(|t| window(&t.metric, t.after_s.get(), t.until_s));
    let constraints = file.constraints.iter();
    let constraints = constraints.map(|c| window(&c.metric, c.after_s.get(), c.until_s));
    let valid = VALID.iter();
    let valid = valid.map(|metric| window(metric, crate::verdicts::summary::AFTER_S, None));
    terms.chain(constraints).chain(valid).collect()
}

impl Judge {
    /// Makes the scorer for a study and some of its groups, with the results of the defaults there.
    pub(crate) fn new(file: &TuningFile, groups: &[RunGroup], defaults: &[RunMetrics]) -> Self {
        let mut judge = Self {
            combine: file.objective.combine,
            terms: file
                .objective
                .metrics
                .iter()
                .map(|t| (t.metric.clone(), t.weight.get()))
                .collect(),
            constraints: file
                .constraints
                .iter()
                .map(|c| (c.at_least.map(f64::from), c.at_most.map(f64::from)))
                .collect(),
            weights: groups.iter().map(|g| g.weight).collect(),
            keep_valid: file.keep_valid.get(),
            reference: Vec::new(),
            valid: Vec::new(),
        };
        let first_valid = judge.terms.len() + judge.constraints.len();
        for group in 0..groups.len() {
            let of = |i: usize| judge.mean(defaults, group, i);
            // Defaults that are perfect are no baseline: then the unit itself is.
            let reference_loss = |x: f64| if x > MIN_LOSS { x } else { 1.0 };
            judge.reference.push(
                (0..judge.terms.len())
                    .map(|i| reference_loss(of(i)))
                    .collect(),
            );
            judge.valid.push([0, 1].map(|i| {
                let share = judge.raw_mean(defaults, group, first_valid + i);
                if share.is_finite() { share } else { 0.0 }
            }));
        }
        judge
    }

    /// Judges a trial. All numbers are rounded to 12 digits, so that a number read back from the store is the one that
    /// the optimiser was given.
    pub(crate) fn judge(&self, measured: &[RunMetrics]) -> TrialVerdict {
        let failed = |why: String| TrialVerdict {
            losses: Vec::new(),
            violation: 0.0,
            failed: Some(why),
        };
        if let Some(why) = measured.iter().find_map(|s| {
            let why = s.values.as_ref().err()?;
            Some(format!("seed {}: {why}", s.seed))
        }) {
            return failed(why);
        }
        let mut ratios = Vec::new();
        for (group, reference) in self.reference.iter().enumerate() {
            let mut row = Vec::new();
            for (i, (reference_loss, (metric, _))) in reference.iter().zip(&self.terms).enumerate()
            {
                let loss = self.mean(measured, group, i) / reference_loss;
                if !loss.is_finite() {
                    return failed(format!("{metric} is not a number"));
                }
                row.push(loss);
            }
            ratios.push(row);
        }
        let violation = self.violation(measured);
        TrialVerdict {
            losses: self
                .combine(&ratios)
                .iter()
                .map(|x| digits(*x, 12))
                .collect(),
            violation: digits(violation, 12),
            failed: None,
        }
    }

    /// Per term: metric, weight and the loss of the defaults in a group.
    pub(crate) fn reference_losses(
        &self,
        group: usize,
    ) -> Option<impl Iterator<Item = (&str, f64, f64)>> {
        let reference = self.reference.get(group)?;
        let terms = self.terms.iter().zip(reference);
        Some(
            terms.map(|((metric, weight), reference_loss)| {
                (metric.as_str(), *weight, *reference_loss)
            }),
        )
    }

    fn combine(&self, ratios: &[Vec<f64>]) -> Vec<f64> {
        let in_scenario =
            |row: &Vec<f64>| weighted(row.iter().zip(&self.terms).map(|(x, t)| (*x, t.1)));
        let weights = self.weights.iter().copied();
        match self.combine {
            Combine::Weighted => vec![weighted(ratios.iter().map(in_scenario).zip(weights))],
            Combine::Worst => vec![ratios.iter().map(in_scenario).fold(0.0, f64::max)],
            Combine::Pareto => (0..self.terms.len())
                .map(|i| {
                    let of = ratios
                        .iter()
                        .map(|row| row.get(i).copied().unwrap_or(f64::NAN));
                    weighted(of.zip(self.weights.iter().copied()))
                })
                .collect(),
        }
    }

    fn violation(&self, measured: &[RunMetrics]) -> f64 {
        let first = self.terms.len();
        let mut all = 0.0;
        for (group, valid) in self.valid.iter().enumerate() {
            for (i, (least, most)) in self.constraints.iter().enumerate() {
                all += broken(self.raw_mean(measured, group, first + i), *least, *most);
            }
            for (i, share) in valid.iter().enumerate() {
                let now = self.raw_mean(measured, group, first + self.constraints.len() + i);
                all += broken(now, Some(self.keep_valid * share), None);
            }
        }
        all
    }

    /// Mean loss of a term over the seeds of a group.
    fn mean(&self, measured: &[RunMetrics], group: usize, term: usize) -> f64 {
        let metric = self.terms.get(term).map_or("", |t| t.0.as_str());
        mean(values(measured, group, term).map(|x| own_loss(metric, x)))
    }

    fn raw_mean(&self, measured: &[RunMetrics], group: usize, i: usize) -> f64 {
        mean(values(measured, group, i))
    }
}

/// The loss of a metric's value: 0 at its best one.
pub(crate) fn own_loss(metric: &str, x: f64) -> f64 {
    metrics::find(metric).map_or(x, |m| m.best.loss(x))
}

fn values(measured: &[RunMetrics], group: usize, i: usize) -> impl Iterator<Item = f64> {
    let of = measured.iter().filter(move |s| s.group == group);
    of.map(move |s| match &s.values {
        Ok(values) => values.get(i).copied().unwrap_or(f64::NAN),
        Err(_) => f64::NAN,
    })
}

fn mean(x: impl Iterator<Item = f64>) -> f64 {
    weighted(x.map(|x| (x, 1.0)))
}

fn weighted(x: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for (x, w) in x {
        sum += w * x;
        weights += w;
    }
    sum / weights
}

/// Violation of a bound, as a share of the bound; NaN violates it by 1.
fn broken(x: f64, least: Option<f64>, most: Option<f64>) -> f64 {
    if x.is_nan() {
        return 1.0;
    }
    let share = |over: f64, bound: f64| over.max(0.0) / bound.abs().max(MIN_LOSS.sqrt());
    least.map_or(0.0, |b| share(b - x, b)) + most.map_or(0.0, |b| share(x - b, b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judge(combine: Combine) -> Judge {
        Judge {
            combine,
            terms: vec![("slope_rmse_deg".into(), 1.0), ("mass_rmse_kg".into(), 3.0)],
            constraints: vec![(None, Some(10.0))],
            weights: vec![1.0, 1.0],
            keep_valid: 0.9,
            reference: vec![vec![0.5, 100.0], vec![1.0, 200.0]],
            valid: vec![[0.8, 1.0]; 2],
        }
    }

    /// Slope, mass, constrained metric, valid shares of mass and slope.
    fn measured(group: usize, values: [f64; 5]) -> RunMetrics {
        RunMetrics {
            group,
            seed: 1,
            values: Ok(values.to_vec()),
        }
    }

    #[test]
    fn losses_are_shares_of_the_defaults() {
        let runs = [
            measured(0, [0.25, 100.0, 5.0, 0.8, 1.0]),
            measured(0, [0.75, 100.0, 5.0, 0.8, 1.0]),
            measured(1, [2.0, 100.0, 5.0, 0.8, 1.0]),
        ];
        // group 0: slope 1, mass 1; group 1: slope 2, mass 0.5
        let loss = |combine| judge(combine).judge(&runs).losses;
        let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(near(&loss(Combine::Weighted), &[(1.0 + 0.875) / 2.0]));
        assert!(near(&loss(Combine::Worst), &[1.0]));
        assert!(near(&loss(Combine::Pareto), &[1.5, 0.75]));
    }

    #[test]
    fn what_is_broken_is_said() {
        let v = judge(Combine::Weighted).judge(&[
            measured(0, [0.5, 100.0, 15.0, 0.8, 1.0]),
            measured(1, [0.5, 100.0, 5.0, 0.36, 1.0]),
        ]);
        assert!((v.violation - 1.0).abs() < 1e-9, "{v:?}"); // half of 10 over, half of 0.72 missing
        let not_a_number = judge(Combine::Weighted).judge(&[
            measured(0, [f64::NAN, 100.0, 5.0, 0.0, 0.0]),
            measured(1, [0.5, 100.0, 5.0, 0.8, 1.0]),
        ]);
        assert!(not_a_number.failed.is_some() && not_a_number.losses.is_empty());
    }

    #[test]
    fn a_metric_loses_nothing_at_its_best_value() {
        for (metric, best) in [
            ("slope_availability", 1.0),
            ("mass_nees_mean", 1.0),
            ("nis_in_band", 0.95),
            ("slope_rmse_deg", 0.0),
        ] {
            assert_eq!(own_loss(metric, best), 0.0, "{metric}");
            assert!(own_loss(metric, 0.5) > 0.0, "{metric}");
        }
    }
}
