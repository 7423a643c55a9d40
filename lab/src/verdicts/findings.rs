//! Findings: reasons not to trust an estimate, worst first.

use crate::verdicts::integrity::{Integrity, Outcome, percent};
use crate::verdicts::run_result::RunResult;
use crate::verdicts::summary::Summary;

/// A misleading estimate: the worst sample of one estimator and quantity over all runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// In a line: estimator, error, NEES, seed, instant, share.
    pub text: String,
    /// Error over alert limit.
    pub(crate) severity: f64,
    /// True if the finding makes the verdict fail: not for a published method shown for reference, nor a known failure,
    /// nor one within what is allowed.
    pub fails: bool,
    /// True for a known failure.
    pub known: bool,
    /// The estimator.
    pub(crate) estimator: String,
    /// True for an estimator that is shown for reference only.
    pub(crate) for_reference: bool,
}

impl Finding {
    /// The estimator, if it is shown for reference only.
    pub fn for_reference(&self) -> Option<&str> {
        self.for_reference.then_some(self.estimator.as_str())
    }
}

/// The findings of these runs of one scenario, worst first: those that fail, then the others, each by error over
/// alert limit.
pub(crate) fn of_runs<'a>(runs: impl IntoIterator<Item = &'a RunResult>) -> Vec<Finding> {
    of_summaries(runs.into_iter().filter_map(|r| r.summary.as_ref()))
}

/// Findings of summaries.
pub fn of_summaries<'a>(runs: impl IntoIterator<Item = &'a Summary>) -> Vec<Finding> {
    let mut all: Vec<(Integrity, u64)> = Vec::new();
    for run in runs {
        for new in &run.integrity {
            match all.iter_mut().find(|(sum, _)| sum.is_of_same(new)) {
                Some((sum, seed)) => {
                    if new.severity() > sum.severity() {
                        *seed = run.seed;
                    }
                    sum.add(new);
                }
                None => all.push((new.clone(), run.seed)),
            }
        }
    }
    let mut findings: Vec<Finding> = all
        .iter()
        .filter_map(|(i, seed)| finding(i, *seed))
        .collect();
    findings.sort_by(|a, b| {
        let order = b.fails.cmp(&a.fails);
        order.then(b.severity.total_cmp(&a.severity))
    });
    findings
}

fn finding(of: &Integrity, seed: u64) -> Option<Finding> {
    let (words, worst) = (of.words()?, of.worst?);
    let share = of.share();
    let (fails, mark) = match of.outcome() {
        Outcome::ForReference => (false, " [for reference only]"),
        Outcome::KnownFailure => (false, " [known failure]"),
        Outcome::Fails if of.known_failure.is_some() => (true, " [worse than what is known]"),
        Outcome::Fails => (true, ""),
        _ => (false, " [within what is allowed]"),
    };
    Some(Finding {
        text: format!(
            "{words} (seed {seed}, t = {:.1} s); {} % of its valid samples are misleading{mark}",
            worst.t_s,
            percent(share)
        ),
        severity: of.severity(),
        fails,
        known: of.outcome() == Outcome::KnownFailure,
        estimator: of.estimator.clone(),
        for_reference: of.outcome() == Outcome::ForReference,
    })
}
