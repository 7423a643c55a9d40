//! A scenario judged over its seeds: did every run finish, did every estimator speak, did what was expected hold?

use crate::study::RunResult;
use crate::summary::{Summary, Verdict};
use serde::{Deserialize, Serialize};

/// A scenario and what became of its runs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Judged {
    /// Scenario name.
    pub scenario: String,
    /// Whether everything held.
    pub held: bool,
    /// Everything that was asked of it.
    pub checks: Vec<Check>,
    /// Its runs, one for each seed.
    pub runs: Vec<RunResult>,
}

/// One thing asked of all runs of a scenario.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// What, such as `dffrls_aekf mass_error_rel_max from 10 s`.
    pub what: String,
    /// The bound, such as `≤ 0.032`; empty where there is none.
    pub bound: String,
    /// Share of the seeds that must hold it.
    pub quantile: f64,
    /// Seeds that hold it.
    pub holding: usize,
    /// Seeds that do not.
    pub failing: Vec<u64>,
    /// What happened with the worst of these.
    pub worst: Option<String>,
    /// Whether enough seeds hold it.
    pub held: bool,
}

impl Judged {
    /// Judge the runs of one scenario.
    pub fn new(scenario: &str, runs: Vec<RunResult>) -> Self {
        let mut checks = vec![finishes(&runs)];
        checks.extend(voices(&runs));
        checks.extend(expectations(&runs));
        Self {
            scenario: scenario.to_owned(),
            held: checks.iter().all(|c| c.held),
            checks,
            runs,
        }
    }
}

impl Check {
    /// `told`: for each seed what happened if it does not hold, and how bad that is.
    fn new(
        what: String,
        bound: String,
        quantile: f64,
        told: Vec<(u64, Option<(f64, String)>)>,
    ) -> Self {
        let all = told.len();
        let mut failing = Vec::new();
        let mut worst: Option<(f64, String)> = None;
        for (seed, wrong) in told {
            if let Some((size, text)) = wrong {
                failing.push(seed);
                if worst.as_ref().is_none_or(|(most, _)| size > *most) {
                    worst = Some((size, format!("{text} (seed {seed})")));
                }
            }
        }
        let holding = all - failing.len();
        Self {
            what,
            bound,
            quantile,
            holding,
            // a rounding error of the share must not ask for one seed more
            held: all > 0 && holding as f64 >= quantile * all as f64 - 1e-9,
            failing,
            worst: worst.map(|(_, text)| text),
        }
    }

    /// What went wrong, in a line.
    pub fn reason(&self) -> String {
        let all = self.holding + self.failing.len();
        let mut text = self.what.clone();
        match &self.worst {
            Some(worst) => text += &format!(": {worst}"),
            None => text += ": there is no run",
        }
        if all > 1 {
            text += &format!("; {} of {all} seeds hold", self.holding);
            if self.quantile < 1.0 {
                text += &format!(", {} % must", self.quantile * 100.0);
            }
        }
        text
    }
}

/// A scenario without a run does not finish.
fn finishes(runs: &[RunResult]) -> Check {
    let told = runs.iter().map(|run| {
        let wrong = match (&run.error, &run.summary) {
            (Some(error), _) => Some((f64::INFINITY, error.clone())),
            (None, Some(s)) if s.finished => None,
            (None, Some(s)) => Some((
                -s.simulated_s,
                format!("did not come to its end in {:.1} s", s.simulated_s),
            )),
            (None, None) => Some((f64::INFINITY, "has no result".to_owned())),
        };
        (run.seed, wrong)
    });
    Check::new("the run".into(), "finishes".into(), 1.0, told.collect())
}

fn summaries(runs: &[RunResult]) -> impl Iterator<Item = (u64, &Summary)> {
    runs.iter()
        .filter_map(|run| Some((run.seed, run.summary.as_ref()?)))
}

/// An estimator that never vouches for anything fails, unless the scenario bounds its share of valid samples itself.
fn voices(runs: &[RunResult]) -> Vec<Check> {
    let Some((_, first)) = summaries(runs).next() else {
        return Vec::new();
    };
    let judged_otherwise = |name: &str| {
        first
            .expectations
            .iter()
            .any(|v| v.estimator.as_deref() == Some(name) && v.metric.ends_with("_valid_share"))
    };
    let names = first.estimators.keys();
    names
        .filter(|name| !judged_otherwise(name))
        .map(|name| {
            let told = summaries(runs).map(|(seed, s)| {
                let silent = s.silent.contains(name);
                let text = "its estimates were invalid all through".to_owned();
                (seed, silent.then_some((0.0, text)))
            });
            Check::new(name.clone(), "vouches".into(), 1.0, told.collect())
        })
        .collect()
}

/// Every expectation of the scenario over all runs; one that broke down holds nothing.
fn expectations(runs: &[RunResult]) -> Vec<Check> {
    let Some((_, first)) = summaries(runs).next() else {
        return Vec::new();
    };
    let check = |(i, pattern): (usize, &Verdict)| {
        let told = runs.iter().map(|run| {
            let verdict = run.summary.as_ref().and_then(|s| s.expectations.get(i));
            let wrong = match verdict {
                Some(v) if v.held => None,
                Some(v) => Some((v.excess(), wrong_words(v))),
                None => Some((f64::INFINITY, "the run broke down".to_owned())),
            };
            (run.seed, wrong)
        });
        Check::new(
            pattern.what(),
            pattern.bound(),
            pattern.quantile.unwrap_or(1.0),
            told.collect(),
        )
    };
    first.expectations.iter().enumerate().map(check).collect()
}

fn wrong_words(v: &Verdict) -> String {
    match v.value {
        Some(_) if v.excess() <= 0.0 => "the run did not finish".to_owned(),
        Some(value) => format!("{value:.4} is not {}", v.bound()),
        None => format!(
            "could not be measured (never valid, or never reached), so it is not {}",
            v.bound()
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn run(seed: u64, value: Option<f64>, finished: bool, quantile: Option<f64>) -> RunResult {
        let verdict = Verdict {
            estimator: Some("joint_ekf".into()),
            metric: "slope_rmse_deg".into(),
            after_s: Some(5.0),
            until_s: None,
            at_most: Some(1.0),
            at_least: None,
            quantile,
            value,
            held: finished && value.is_some_and(|x| x <= 1.0),
        };
        RunResult {
            index: seed,
            scenario: "hill".into(),
            seed,
            draws: BTreeMap::new(),
            error: None,
            summary: Some(Summary {
                version: 1,
                scenario: "hill".into(),
                seed,
                finished,
                silent: Vec::new(),
                simulated_s: 60.0,
                steps: 1,
                after_s: 5.0,
                estimators: BTreeMap::from([("joint_ekf".to_owned(), BTreeMap::new())]),
                run: BTreeMap::new(),
                refusals: Vec::new(),
                expectations: vec![verdict],
            }),
        }
    }

    fn reasons(j: &Judged) -> Vec<String> {
        let failed = j.checks.iter().filter(|c| !c.held);
        failed.map(Check::reason).collect()
    }

    #[test]
    fn the_worst_seed_is_named() {
        let runs = [0.5, 3.25, 1.5].into_iter().zip(1..);
        let runs = runs.map(|(x, seed)| run(seed, Some(x), true, None));
        let judged = Judged::new("hill", runs.collect());
        assert!(!judged.held);
        assert_eq!(
            reasons(&judged),
            ["joint_ekf slope_rmse_deg from 5 s: 3.2500 is not ≤ 1 (seed 2); 1 of 3 seeds hold"]
        );
    }

    #[test]
    fn a_quantile_asks_for_its_share_of_the_seeds_and_no_more() {
        for (share, held) in [(0.5, true), (0.7, true), (0.71, false), (1.0, false)] {
            let runs =
                (0..10).map(|i| run(i, Some(if i < 7 { 0.5 } else { 2.0 }), true, Some(share)));
            assert_eq!(Judged::new("hill", runs.collect()).held, held, "{share}");
        }
    }

    #[test]
    fn what_cannot_be_measured_did_not_finish_or_is_not_there_fails() {
        assert!(Judged::new("hill", vec![run(1, Some(0.5), true, None)]).held);
        for runs in [
            vec![run(1, None, true, None)],
            vec![run(1, Some(0.5), false, None)],
            vec![],
        ] {
            assert!(!Judged::new("hill", runs).held);
        }
    }

    #[test]
    fn a_run_that_breaks_down_fails_every_expectation() {
        let mut broken = run(2, Some(0.5), true, None);
        broken.summary = None;
        broken.error = Some("the run broke down at t = 3 s".into());
        let judged = Judged::new("hill", vec![run(1, Some(0.5), true, None), broken]);
        let reasons = reasons(&judged);
        assert_eq!(reasons.len(), 2, "{reasons:?}");
        assert!(reasons[0].contains("t = 3 s") && reasons[1].contains("broke down"));
    }

    #[test]
    fn an_estimator_that_never_speaks_fails() {
        let mut silent = run(1, Some(0.5), true, None);
        silent.summary.as_mut().unwrap().silent = vec!["joint_ekf".into()];
        let judged = Judged::new("hill", vec![silent]);
        assert!(reasons(&judged)[0].contains("joint_ekf: its estimates were invalid"));
    }
}
