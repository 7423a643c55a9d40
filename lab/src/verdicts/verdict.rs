//! A scenario judged over its seeds: did every run finish, did every estimator have valid samples, did what was
//! expected hold?

use crate::metrics::{Marks, mark};
use crate::verdicts::findings::{self, Finding};
use crate::verdicts::integrity::{Integrity, Outcome, percent};
use crate::verdicts::run_result::RunResult;
use crate::verdicts::summary::{ExpectationVerdict, Summary};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Number of runs without a failure after which a known failure must be removed: what fails in one run of three holds
/// in all of ten once in sixty times.
const ENOUGH_RUNS: usize = 10;

/// Largest ratio of the floor of a known failure to the measured value.
const DEEP: f64 = 2.0;

/// A scenario and the results of its runs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ScenarioVerdict {
    /// Scenario name.
    pub scenario: String,
    /// True if all checks held.
    pub held: bool,
    /// Checks of the scenario.
    pub checks: Vec<Check>,
    /// Limits that are weaker than usual, in words: what held, held with these.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub weakened: Vec<String>,
    /// Its runs, one for each seed.
    pub runs: Vec<RunResult>,
}

/// One check of all runs of a scenario.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// Name, such as `dffrls_aekf_robust mass_error_rel_max from 10 s`.
    pub what: String,
    /// The bound, such as `≤ 0.032`; empty without a bound.
    pub bound: String,
    /// Share of the seeds that must hold the check.
    pub(crate) quantile: f64,
    /// Seeds that hold the check.
    pub(crate) holding: usize,
    /// Seeds that do not hold the check.
    pub failing: Vec<u64>,
    /// Description of the worst failing seed.
    pub worst: Option<String>,
    /// Worst failing seed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub worst_seed: Option<u64>,
    /// True if enough seeds hold the check, or if its failure is known.
    pub held: bool,
    /// Reason of its known failure, if it has one. A known failure that never fails is not as it should be.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub known_failure: Option<String>,
    /// True for a check of integrity: a finding covers it too.
    #[serde(default)]
    pub is_finding: bool,
    /// True if the check could not be decided: there is no reference. It fails nothing, and is shown as such.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub not_judged: bool,
    /// True for a known failure that could not be measured, or is worse than known.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    beyond_known: bool,
    /// True for a check that other code added, such as a comparison with a baseline.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    added: bool,
}

impl Summary {
    /// The verdict over this run: what its exit code, its report and every list say of it.
    pub fn verdict(&self) -> ScenarioVerdict {
        ScenarioVerdict::of_run(self)
    }

    /// True for a good run, by its verdict.
    pub fn good(&self) -> bool {
        self.verdict().held
    }
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
            weakened: tally.weakened().collect(),
            runs,
        }
    }

    /// Judge one run by itself.
    pub(crate) fn of_run(summary: &Summary) -> Self {
        let run = RunResult::new(&summary.scenario, summary.seed, Ok(summary.clone()));
        Self::new(&summary.scenario, vec![run])
    }

    /// Adds a check of other code, such as a comparison with a baseline.
    pub fn add(&mut self, check: Check) {
        self.held &= check.held;
        self.checks.push(check);
    }

    /// Checks that a verdict from a file follows from its runs. The error says what does not.
    pub fn check(&self) -> Result<(), String> {
        for run in &self.runs {
            run.check()?;
        }
        let again = Self::new(&self.scenario, self.runs.clone());
        let same =
            |a: &Check, b: &Check| (&a.what, &a.bound, a.held) == (&b.what, &b.bound, b.held);
        let missing = |c: &&Check| !self.checks.iter().any(|other| same(c, other));
        let mut checks = again.checks.iter().filter(|_| !self.runs.is_empty());
        if let Some(check) = checks.find(missing) {
            return Err(format!(
                "{}: the verdict on {} does not follow from its runs",
                self.scenario, check.what
            ));
        }
        match self.held == self.checks.iter().all(|c| c.held) && again.weakened == self.weakened {
            true => Ok(()),
            false => Err(format!(
                "{}: the verdict does not follow from its checks",
                self.scenario
            )),
        }
    }

    /// Findings of misleading estimates in these runs, worst first.
    pub fn findings(&self) -> Vec<Finding> {
        findings::of_runs(&self.runs)
    }
}

/// Runs judged one after the other; its memory does not grow with good runs.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    finishes: Count,
    /// Counts of the runs with a valid sample, by estimator.
    valid: BTreeMap<String, Count>,
    /// The expectations of the scenario.
    expected: Vec<Expected>,
    /// Integrity of the judged estimators over all runs, with the number of runs within the limit.
    integrity: Vec<(Integrity, Count)>,
    /// Seeds of runs that broke down.
    broken: Vec<u64>,
    /// Limits that are weaker than usual.
    weakened: BTreeSet<String>,
}

/// An expectation over the runs.
#[derive(Clone, Debug)]
struct Expected {
    verdict: ExpectationVerdict,
    count: Count,
    /// Count of the runs that do not fail worse than known.
    beyond: Count,
    /// Sum of the measured values.
    sum: f64,
    /// The worst measured value by the bound.
    worst: Option<f64>,
}

impl Expected {
    /// Its known failure, if the floor is far beyond the measured value.
    fn deep(&self) -> Option<String> {
        let (v, worst) = (&self.verdict, self.worst?);
        let (floor, from_above) = (v.no_worse_than?, v.at_most.is_some());
        let deep = match from_above {
            true => floor > DEEP * worst,
            false => worst > DEEP * floor,
        };
        let failed = !self.count.failing.is_empty();
        (deep && failed).then(|| deep_words(&v.what(), floor, worst))
    }

    fn check(&self) -> Check {
        let (v, runs) = (&self.verdict, self.count.holding);
        let judged = |count: &Count| count.check(v.what(), v.bound(), v.quantile.unwrap_or(1.0));
        let mut check = match &v.known_failure {
            Some(why) if !v.mean => judged(&self.count).known(why, judged(&self.beyond)),
            _ => judged(&self.count),
        };
        if !v.mean || !check.held {
            return check;
        }
        let mean = self.sum / runs as f64;
        check.not_judged = runs < ENOUGH_RUNS;
        check.held = check.not_judged || v.is_within(mean);
        if check.not_judged {
            check.worst = Some(format!("{ENOUGH_RUNS} runs are needed for a mean"));
        } else if !check.held {
            check.worst = Some(format!("{mean:.4} is not {}", v.bound()));
        }
        check
    }
}

/// Number of seeds that hold a check.
#[derive(Clone, Debug, Default)]
struct Count {
    holding: usize,
    failing: Vec<u64>,
    /// Severity, description and seed of the worst.
    worst: Option<(f64, String, u64)>,
}

impl Count {
    /// `wrong`: how bad it is and what happened, if it does not hold.
    fn add(&mut self, seed: u64, wrong: Option<(f64, String)>) {
        let Some((size, text)) = wrong else {
            self.holding += 1;
            return;
        };
        self.failing.push(seed);
        if self.worst.as_ref().is_none_or(|(most, ..)| size > *most) {
            self.worst = Some((size, format!("{text} (seed {seed})"), seed));
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
            worst: self.worst.as_ref().map(|(_, text, _)| text.clone()),
            worst_seed: self.worst.as_ref().map(|(.., seed)| *seed),
            ..Check::default()
        }
    }
}

impl Tally {
    /// Limits that are weaker than usual, in words: those of the runs, and floors of known failures.
    pub fn weakened(&self) -> impl Iterator<Item = String> {
        let of_integrity = |(sum, _): &(Integrity, Count)| {
            let (floor, share) = (sum.no_worse_than?, sum.share());
            let what = || format!("{} {}", sum.estimator, mark(sum.quantity, Marks::Integrity));
            (sum.misleading > 0 && floor > DEEP * share).then(|| deep_words(&what(), floor, share))
        };
        let of_bounds = self.expected.iter().filter_map(Expected::deep);
        let floors = of_bounds.chain(self.integrity.iter().filter_map(of_integrity));
        self.weakened.iter().cloned().chain(floors)
    }

    /// Number of bounds in the scenario, including bounds that follow from these.
    pub(crate) fn stated(&self) -> usize {
        self.expected.len()
    }

    /// One more run.
    pub fn add(&mut self, run: &RunResult) {
        self.finishes.add(run.seed, unfinished(run));
        let Some(summary) = &run.summary else {
            for expected in &mut self.expected {
                expected.count.add(run.seed, Some(broke_down()));
                expected.beyond.add(run.seed, Some(broke_down()));
            }
            self.broken.push(run.seed);
            return;
        };
        self.weakened.extend(summary.weakened.iter().cloned());
        let judged = |name: &&String| !summary.is_for_reference(name);
        for name in summary.estimators.keys().filter(judged) {
            let never_valid =
                summary.never_valid.contains(name) && !judged_otherwise(summary, name);
            let text = "all its estimates were invalid".to_owned();
            let count = self.valid.entry(name.clone()).or_default();
            count.add(run.seed, never_valid.then_some((0.0, text)));
        }
        for (i, v) in summary.expectations.iter().enumerate() {
            if i == self.expected.len() {
                let mut count = Count::default();
                for seed in &self.broken {
                    count.add(*seed, Some(broke_down()));
                }
                self.expected.push(Expected {
                    verdict: v.clone(),
                    beyond: count.clone(),
                    count,
                    sum: 0.0,
                    worst: None,
                });
            }
            if let Some(expected) = self.expected.get_mut(i) {
                let wrong = (!v.held).then(|| (v.excess(), wrong_words(v)));
                expected.count.add(run.seed, wrong);
                let beyond = v.beyond_known().map(|words| (v.excess(), words));
                expected.beyond.add(run.seed, beyond);
                expected.sum += v.value.unwrap_or(f64::NAN);
                let worse = if v.at_most.is_some() {
                    f64::max
                } else {
                    f64::min
                };
                let both = expected.worst.into_iter().chain(v.value);
                expected.worst = both.reduce(worse);
            }
        }
        for new in summary.integrity.iter().filter(|i| i.at_most.is_some()) {
            self.add_integrity(run.seed, new);
        }
    }

    fn add_integrity(&mut self, seed: u64, new: &Integrity) {
        let wrong = match new.words() {
            Some(words) if Some(new.share()) > new.at_most => Some((new.severity(), words)),
            _ => None,
        };
        let mut there = self.integrity.iter_mut();
        match there.find(|(sum, _)| sum.is_of_same(new)) {
            Some((sum, count)) => {
                sum.add(new);
                count.add(seed, wrong);
            }
            None => {
                let mut count = Count::default();
                count.add(seed, wrong);
                self.integrity.push((new.clone(), count));
            }
        }
    }

    /// The checks of all runs. Without any run the first of them fails.
    pub fn checks(&self) -> Vec<Check> {
        let mut checks = vec![
            self.finishes
                .check("the run".into(), "finishes".into(), 1.0),
        ];
        for (name, count) in &self.valid {
            checks.push(count.check(name.clone(), "is valid at least once".into(), 1.0));
        }
        checks.extend(self.expected.iter().map(Expected::check));
        for (sum, count) in &self.integrity {
            checks.extend(self.integrity(sum, count));
        }
        checks
    }

    /// The check of an integrity; `None` if no sample is ever valid.
    fn integrity(&self, sum: &Integrity, count: &Count) -> Option<Check> {
        let outcome = sum.outcome();
        if matches!(outcome, Outcome::NothingValid | Outcome::ForReference) {
            return None;
        }
        let most = sum.at_most.unwrap_or(0.0);
        let what = format!("{} {}", sum.estimator, mark(sum.quantity, Marks::Integrity));
        let mut check = count.check(what, format!("≤ {most} over all seeds"), 1.0);
        check.is_finding = true;
        check.not_judged = outcome == Outcome::NoReference;
        if check.not_judged {
            check.held = true;
            check.worst = Some("the reference is too coarse for all valid samples".into());
            return Some(check);
        }
        let fails = outcome != Outcome::Holds;
        if fails && let Some(worst) = &mut check.worst {
            *worst += &format!("; {} % of the valid samples", percent(sum.share()));
        }
        check.held = !fails;
        let Some(why) = &sum.known_failure else {
            return Some(check);
        };
        check.beyond_known = outcome == Outcome::Fails;
        check.held = !check.beyond_known && !check.never_fails();
        check.known_failure = Some(why.clone());
        Some(check)
    }
}

impl Check {
    /// Turns the check into a check of a known failure: it holds unless the failure is worse than known, as `beyond`
    /// judges by the same quantile, or never happens any more.
    fn known(mut self, why: &str, beyond: Self) -> Self {
        self.known_failure = Some(why.to_owned());
        self.beyond_known = !beyond.held;
        self.held = beyond.held && !self.never_fails();
        if self.beyond_known {
            self.worst = beyond.worst;
            self.worst_seed = beyond.worst_seed;
        }
        self
    }

    /// True if every run holds the check, and the number of runs is sufficient.
    fn never_fails(&self) -> bool {
        self.failing.is_empty() && self.holding >= ENOUGH_RUNS
    }

    /// A check of other code: its name, its bound, the words for its failure if it does not hold.
    pub fn made_elsewhere(what: String, bound: String, failure: Option<String>) -> Self {
        let count = Count {
            holding: usize::from(failure.is_none()),
            ..Count::default()
        };
        let mut check = count.check(what, bound, 1.0);
        check.held = failure.is_none();
        check.worst = failure;
        check.added = true;
        check
    }

    /// True for a check of other code.
    pub(crate) fn is_added(&self) -> bool {
        self.added
    }

    /// True if the check fails as a known failure.
    pub fn fails_as_known(&self) -> bool {
        self.held && self.known_failure.is_some() && !self.failing.is_empty()
    }

    /// The failure in one line.
    pub fn reason(&self) -> String {
        let all = self.holding + self.failing.len();
        let mut text = self.what.clone();
        if self.beyond_known {
            let (worst, why) = (self.worst.as_deref(), self.known_failure.as_deref());
            return format!(
                "{text} {}: {}: this is not the known failure ({})",
                self.bound,
                worst.unwrap_or_default(),
                why.unwrap_or_default()
            );
        }
        if let Some(why) = &self.known_failure
            && !self.held
        {
            return format!(
                "{text} {}: holds in {} of {all} seeds, but is a known failure ({why}); remove it from `known_failures`",
                self.bound, self.holding
            );
        }
        match &self.worst {
            Some(worst) => text += &format!(": {worst}"),
            None => text += ": no run",
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

fn deep_words(what: &str, floor: f64, worst: f64) -> String {
    format!(
        "{what}: a known failure of {worst:.4} with a floor of {floor}, more than {DEEP} times the failure"
    )
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
            format!("did not finish in {:.1} s", s.simulated_s),
        )),
        (None, None) => Some((f64::INFINITY, "has no result".to_owned())),
    }
}

/// True if the scenario bounds the estimator's availability from below, which replaces the check for a valid sample.
fn judged_otherwise(summary: &Summary, name: &str) -> bool {
    summary.expectations.iter().any(|v| {
        v.estimator.as_deref() == Some(name)
            && v.metric.ends_with("_availability")
            && v.at_least.is_some()
    })
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
    use crate::metrics::Quantity;
    use crate::verdicts::integrity::Misleading;

    fn run(seed: u64, value: Option<f64>, finished: bool, quantile: Option<f64>) -> RunResult {
        let verdict = ExpectationVerdict {
            estimator: Some("dffrls_aekf_robust".into()),
            metric: "slope_rmse_deg".into(),
            window: " from 5 s".into(),
            after_s: Some(5.0),
            until_s: None,
            at_most: Some(1.0),
            at_least: None,
            quantile,
            mean: false,
            value,
            held: finished && value.is_some_and(|x| x <= 1.0),
            known_failure: None,
            no_worse_than: None,
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
                estimators: BTreeMap::from([("dffrls_aekf_robust".to_owned(), BTreeMap::new())]),
                run: BTreeMap::new(),
                refusals: Vec::new(),
                expectations: vec![verdict],
                limits: Default::default(),
                integrity: Vec::new(),
                weakened: Vec::new(),
                common: BTreeMap::new(),
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
                "dffrls_aekf_robust slope_rmse_deg from 5 s: 3.2500 is not ≤ 1 (seed 2); 1 of 3 seeds hold"
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

    /// One run of ten is far beyond the bound, and the mean decides; of fewer runs nothing does.
    #[test]
    fn a_mean_is_judged_over_ten_runs_or_more() {
        let judged = |values: &[f64]| {
            let runs = values.iter().zip(1..).map(|(value, seed)| {
                let mut run = run(seed, Some(*value), true, None);
                let verdict = &mut run.summary.as_mut().unwrap().expectations[0];
                (verdict.mean, verdict.held) = (true, true);
                run
            });
            ScenarioVerdict::new("hill", runs.collect())
        };
        let (mut held, mut failed) = ([0.1; 10], [0.1; 10]);
        (held[3], failed[3]) = (9.0, 9.2);
        assert!(judged(&held).held);
        let failed = judged(&failed);
        assert_eq!(
            reasons(&failed),
            [
                "dffrls_aekf_robust slope_rmse_deg from 5 s, mean of seeds: 1.0100 is not ≤ 1; 10 of 10 seeds hold"
            ]
        );
        let few = judged(&[9.0; 9]);
        assert!(few.held && few.checks.iter().any(|c| c.not_judged));
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
        invalid.summary.as_mut().unwrap().never_valid = vec!["dffrls_aekf_robust".into()];
        let judged = ScenarioVerdict::new("hill", vec![invalid]);
        assert!(reasons(&judged)[0].contains("dffrls_aekf_robust: all its estimates were invalid"));
    }

    fn misleading(seed: u64, valid: u64, misleading: u64, error: f64) -> RunResult {
        let mut run = run(seed, Some(0.5), true, None);
        run.summary.as_mut().unwrap().integrity = vec![Integrity {
            estimator: "dffrls_aekf_robust".into(),
            quantity: Quantity::Mass,
            samples: 12_000,
            valid,
            judged: valid,
            coarse: 0,
            misleading,
            overconfident: misleading,
            alert: 0.1,
            worst: (misleading > 0).then_some(Misleading {
                t_s: 12.1,
                error,
                nees: Some(215.0),
            }),
            at_most: Some(0.001),
            known_failure: None,
            no_worse_than: None,
        }];
        run
    }

    /// 0.1 % over all seeds together: what one seed has too much another may have too little.
    #[test]
    fn an_estimator_that_misleads_fails_whatever_is_expected() {
        let held = ScenarioVerdict::new(
            "hill",
            vec![misleading(1, 4000, 5, 0.3), misleading(2, 4000, 0, 0.0)],
        );
        assert!(held.held, "{:?}", reasons(&held));
        let failed = ScenarioVerdict::new(
            "hill",
            vec![misleading(1, 4000, 9, 0.3), misleading(2, 4000, 0, 0.0)],
        );
        assert_eq!(
            reasons(&failed),
            [
                "dffrls_aekf_robust mass_misleading_share: dffrls_aekf_robust marks a mass valid that is 30 % off: NEES 215 (seed 1); \
              0.11 % of the valid samples; 1 of 2 seeds hold"
            ]
        );
        let never = ScenarioVerdict::new("hill", vec![misleading(1, 0, 0, 0.0)]);
        assert!(never.held);
        let mut reference = misleading(1, 4000, 4000, 0.59);
        reference.summary.as_mut().unwrap().integrity[0].at_most = None;
        let reference = ScenarioVerdict::new("hill", vec![reference]);
        assert!(reference.held);
        assert_eq!(reference.findings().len(), 1);
    }

    /// A coarse reference shows that an estimate is wrong, and not that it is right.
    #[test]
    fn a_coarse_reference_judges_one_way() {
        for (coarse, wrong, not_judged, held) in [
            (4000, 0, true, true),
            (3999, 0, false, true),
            (4000, 40, false, false),
            (0, 40, false, false),
        ] {
            let error = if wrong > 0 { 0.3 } else { 0.0 };
            let mut run = misleading(1, 4000, wrong, error);
            run.summary.as_mut().unwrap().integrity[0].coarse = coarse;
            let judged = ScenarioVerdict::new("hill", vec![run]);
            let open = judged.checks.iter().any(|c| c.not_judged);
            assert_eq!((open, judged.held), (not_judged, held), "{coarse} {wrong}");
        }
    }

    #[test]
    fn findings_are_named_worst_first() {
        let mut mild = misleading(3, 4000, 4000, 0.2);
        mild.summary.as_mut().unwrap().integrity[0].estimator = "rail_fusion".into();
        let mut reference = misleading(4, 4000, 4000, 5.0);
        let integrity = &mut reference.summary.as_mut().unwrap().integrity[0];
        integrity.estimator = "ffrls".into();
        integrity.at_most = None;
        let judged = ScenarioVerdict::new(
            "hill",
            vec![
                mild,
                reference,
                misleading(1, 4000, 40, 0.3),
                misleading(2, 4000, 40, -0.59),
            ],
        );
        let texts: Vec<String> = judged.findings().into_iter().map(|f| f.text).collect();
        assert_eq!(
            texts,
            [
                "dffrls_aekf_robust marks a mass valid that is 59 % off: NEES 215 (seed 2, t = 12.1 s); 1.0 % of its valid samples are \
                 misleading",
                "rail_fusion marks a mass valid that is 20 % off: NEES 215 (seed 3, t = 12.1 s); 100 % of its valid samples are \
                 misleading",
                "ffrls marks a mass valid that is 500 % off: NEES 215 (seed 4, t = 12.1 s); 100 % of its valid samples are misleading \
                 [for reference only]",
            ]
        );
    }

    #[test]
    fn a_known_failure_is_not_red_unless_it_is_worse_or_never_fails() {
        let known = |values: &[f64]| {
            let runs = values.iter().zip(1..).map(|(value, seed)| {
                let mut run = run(seed, Some(*value), true, Some(0.5));
                let verdict = &mut run.summary.as_mut().unwrap().expectations[0];
                verdict.known_failure = Some("the grade turns faster than the filter".into());
                verdict.no_worse_than = Some(3.0);
                run
            });
            ScenarioVerdict::new("hill", runs.collect())
        };
        for fails in [&[2.0][..], &[2.0, 0.5], &[2.0, 9.0]] {
            let judged = known(fails);
            assert!(judged.held && judged.checks.iter().any(Check::fails_as_known));
        }
        let worse = known(&[2.0, 9.0, 9.0]);
        assert!(!worse.held);
        assert!(
            reasons(&worse)[0].contains("not the known failure"),
            "{:?}",
            reasons(&worse)
        );
        assert!(known(&[0.5; 9]).held);
        let holds = known(&[0.5; 10]);
        assert!(!holds.held);
        assert!(
            reasons(&holds)[0].contains("remove it from `known_failures`"),
            "{:?}",
            reasons(&holds)
        );
    }
}
