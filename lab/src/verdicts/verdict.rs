//! A scenario judged over its seeds: did every run finish, did every estimator have valid samples, did what was expected hold?

use crate::batch::RunResult;
use crate::verdicts::summary::{ExpectationVerdict, Summary};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A scenario and what became of its runs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ScenarioVerdict {
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
    /// What, such as `dffrls_aekf_robust mass_error_rel_max from 10 s`.
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

impl ScenarioVerdict {
    /// Judge the runs of one scenario.
    pub fn new(scenario: &str, runs: Vec<RunResult>) -> Self {
        let mut tally = Tally::default();
        for run in &runs {
            tally.add(run);
        }
        let checks = tally.checks();
        Self {
            scenario: scenario.to_owned(),
            held: checks.iter().all(|c| c.held),
            checks,
            runs,
        }
    }
}

/// Runs judged one after the other; what it holds does not grow with those that are good.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    finishes: Count,
    /// By estimator.
    valid: BTreeMap<String, Count>,
    /// The expectations of the scenario, each with its count.
    expected: Vec<(ExpectationVerdict, Count)>,
    /// Seeds of runs that broke down.
    broken: Vec<u64>,
}

/// How many seeds hold something.
#[derive(Clone, Debug, Default)]
struct Count {
    holding: usize,
    failing: Vec<u64>,
    worst: Option<(f64, String)>,
}

impl Count {
    /// `wrong`: how bad it is and what happened, if it does not hold.
    fn add(&mut self, seed: u64, wrong: Option<(f64, String)>) {
        let Some((size, text)) = wrong else {
            self.holding += 1;
            return;
        };
        self.failing.push(seed);
        if self.worst.as_ref().is_none_or(|(most, _)| size > *most) {
            self.worst = Some((size, format!("{text} (seed {seed})")));
        }
    }

    fn check(&self, what: String, bound: String, quantile: f64) -> Check {
        let all = self.holding + self.failing.len();
        Check {
            what,
            bound,
            quantile,
            holding: self.holding,
            // a rounding error of the share must not ask for one seed more; the least share asks for one seed
            held: self.holding as f64 >= (quantile * all as f64 - 1e-9).max(1.0),
            failing: self.failing.clone(),
            worst: self.worst.as_ref().map(|(_, text)| text.clone()),
        }
    }
}

impl Tally {
    /// One more run.
    pub fn add(&mut self, run: &RunResult) {
        self.finishes.add(run.seed, unfinished(run));
        let Some(summary) = &run.summary else {
            for (_, count) in &mut self.expected {
                count.add(run.seed, Some(broke_down()));
            }
            self.broken.push(run.seed);
            return;
        };
        for name in summary.estimators.keys() {
            let never_valid =
                summary.never_valid.contains(name) && !judged_otherwise(summary, name);
            let text = "its estimates were invalid all through".to_owned();
            let count = self.valid.entry(name.clone()).or_default();
            count.add(run.seed, never_valid.then_some((0.0, text)));
        }
        for (i, v) in summary.expectations.iter().enumerate() {
            if i == self.expected.len() {
                let mut count = Count::default();
                for seed in &self.broken {
                    count.add(*seed, Some(broke_down()));
                }
                self.expected.push((v.clone(), count));
            }
            if let Some((_, count)) = self.expected.get_mut(i) {
                let wrong = (!v.held).then(|| (v.excess(), wrong_words(v)));
                count.add(run.seed, wrong);
            }
        }
    }

    /// What was asked of all runs. Without any run the first of them fails.
    pub fn checks(&self) -> Vec<Check> {
        let mut checks = vec![
            self.finishes
                .check("the run".into(), "finishes".into(), 1.0),
        ];
        for (name, count) in &self.valid {
            checks.push(count.check(name.clone(), "is valid at least once".into(), 1.0));
        }
        for (v, count) in &self.expected {
            checks.push(count.check(v.what(), v.bound(), v.quantile.unwrap_or(1.0)));
        }
        checks
    }
}

impl Check {
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

fn broke_down() -> (f64, String) {
    (f64::INFINITY, "the run broke down".to_owned())
}

fn unfinished(run: &RunResult) -> Option<(f64, String)> {
    match (&run.error, &run.summary) {
        (Some(error), _) => Some((f64::INFINITY, error.clone())),
        (None, Some(s)) if s.finished => None,
        (None, Some(s)) => Some((
            -s.simulated_s,
            format!("did not come to its end in {:.1} s", s.simulated_s),
        )),
        (None, None) => Some((f64::INFINITY, "has no result".to_owned())),
    }
}

/// An estimator without a single valid sample fails, unless the scenario bounds its share of valid samples itself.
fn judged_otherwise(summary: &Summary, name: &str) -> bool {
    summary
        .expectations
        .iter()
        .any(|v| v.estimator.as_deref() == Some(name) && v.metric.ends_with("_valid_share"))
}

fn wrong_words(v: &ExpectationVerdict) -> String {
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

    fn run(seed: u64, value: Option<f64>, finished: bool, quantile: Option<f64>) -> RunResult {
        let verdict = ExpectationVerdict {
            estimator: Some("joint_ekf_robust".into()),
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
                never_valid: Vec::new(),
                simulated_s: 60.0,
                steps: 1,
                after_s: 5.0,
                estimators: BTreeMap::from([("joint_ekf_robust".to_owned(), BTreeMap::new())]),
                run: BTreeMap::new(),
                refusals: Vec::new(),
                expectations: vec![verdict],
            }),
        }
    }

    fn reasons(j: &ScenarioVerdict) -> Vec<String> {
        let failed = j.checks.iter().filter(|c| !c.held);
        failed.map(Check::reason).collect()
    }

    #[test]
    fn the_worst_seed_is_named() {
        let runs = [0.5, 3.25, 1.5].into_iter().zip(1..);
        let runs = runs.map(|(x, seed)| run(seed, Some(x), true, None));
        let judged = ScenarioVerdict::new("hill", runs.collect());
        assert!(!judged.held);
        assert_eq!(
            reasons(&judged),
            [
                "joint_ekf_robust slope_rmse_deg from 5 s: 3.2500 is not ≤ 1 (seed 2); 1 of 3 seeds hold"
            ]
        );
    }

    #[test]
    fn a_quantile_asks_for_its_share_of_the_seeds_and_no_more() {
        for (share, held) in [(0.5, true), (0.7, true), (0.71, false), (1.0, false)] {
            let runs =
                (0..10).map(|i| run(i, Some(if i < 7 { 0.5 } else { 2.0 }), true, Some(share)));
            assert_eq!(
                ScenarioVerdict::new("hill", runs.collect()).held,
                held,
                "{share}"
            );
        }
    }

    #[test]
    fn what_cannot_be_measured_did_not_finish_or_is_not_there_fails() {
        assert!(ScenarioVerdict::new("hill", vec![run(1, Some(0.5), true, None)]).held);
        for runs in [
            vec![run(1, None, true, None)],
            vec![run(1, Some(0.5), false, None)],
            vec![],
        ] {
            assert!(!ScenarioVerdict::new("hill", runs).held);
        }
    }

    #[test]
    fn a_run_that_breaks_down_fails_every_expectation() {
        let mut broken = run(2, Some(0.5), true, None);
        broken.summary = None;
        broken.error = Some("the run broke down at t = 3 s".into());
        let judged = ScenarioVerdict::new("hill", vec![run(1, Some(0.5), true, None), broken]);
        let reasons = reasons(&judged);
        assert_eq!(reasons.len(), 2, "{reasons:?}");
        assert!(reasons[0].contains("t = 3 s") && reasons[1].contains("broke down"));
    }

    #[test]
    fn an_estimator_that_is_never_valid_fails() {
        let mut invalid = run(1, Some(0.5), true, None);
        invalid.summary.as_mut().unwrap().never_valid = vec!["joint_ekf_robust".into()];
        let judged = ScenarioVerdict::new("hill", vec![invalid]);
        assert!(reasons(&judged)[0].contains("joint_ekf_robust: its estimates were invalid"));
    }
}
