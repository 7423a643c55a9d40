//! Verdicts as lines for people.

use crate::ui::prose::paragraph;
use monorig_lab::verdicts::verdict::{Check, ScenarioVerdict};
use std::path::Path;
use std::time::Duration;

/// Findings shown for each scenario; the others are counted.
const FINDINGS_SHOWN: usize = 5;
/// Values shown of a check; the others are counted.
const VALUES_SHOWN: usize = 8;
/// Before everything that belongs to a scenario.
const INDENT: &str = "        ";

/// Runs that were made here.
pub(crate) struct Made<'a> {
    /// File of the scenario.
    pub(crate) path: &'a Path,
    /// Time they took together.
    pub(crate) took: Duration,
}

/// The verdict in a line, a line for everything that does not hold with its values by seed, and, of runs that were made
/// here, how to repeat the worst of them.
pub(crate) fn judged(
    verdict: &ScenarioVerdict,
    made: Option<Made<'_>>,
    width: usize,
    sets: &[(String, String)],
) -> String {
    let word = match verdict.held {
        true => "held  ",
        false => "FAILED",
    };
    let weakened = verdict.weakened.join("; ");
    let seeds = match verdict.runs.as_slice() {
        [one] => format!("seed {}", one.seed),
        many => format!("{} seeds", many.len()),
    };
    let took = made.as_ref().map_or(String::new(), |made| {
        format!("  {:6.1} s", made.took.as_secs_f64())
    });
    let mut text = format!("{word}  {:width$}  {seeds:>9}{took}\n", verdict.scenario);
    let mut add = |line: &str| text += &format!("{}\n", paragraph(line, INDENT));
    // those that are known stand below, with their reason
    let mut findings = verdict.findings();
    findings.retain(|f| !f.known);
    for finding in findings.iter().take(FINDINGS_SHOWN) {
        add(&format!("finding: {}", finding.text));
    }
    match findings.len().saturating_sub(FINDINGS_SHOWN) {
        0 => {}
        more => add(&format!(
            "… and {more} findings more, in --json and its report"
        )),
    }
    // a check that has a finding is left out, unless it is listed as known
    let shown = |c: &&Check| !(c.is_finding && c.known_failure.is_none());
    for check in verdict.checks.iter().filter(|c| !c.held).filter(shown) {
        add(&check.reason());
        if let Some(values) = by_seed(verdict, check) {
            add(&values);
        }
    }
    for check in verdict.checks.iter().filter(|c| c.not_judged) {
        add(&format!("not judged: {}", check.reason()));
    }
    if !weakened.is_empty() {
        add(&format!("weakened limits: {weakened}"));
    }
    text += &known(verdict);
    if let (Some(seed), Some(made)) = (worst_seed(verdict), made) {
        // in one line, however long: it is to be copied
        text += &format!("{INDENT}again: {}\n", command(made.path, seed, sets));
    }
    text
}

/// Known failures, each reason once, with all that fails for it.
fn known(verdict: &ScenarioVerdict) -> String {
    let known = verdict.checks.iter().filter(|c| c.fails_as_known());
    let mut reasons: Vec<(&str, Vec<&Check>)> = Vec::new();
    for check in known {
        let why = check.known_failure.as_deref().unwrap_or_default();
        match reasons.iter_mut().find(|(reason, _)| *reason == why) {
            Some((_, checks)) => checks.push(check),
            None => reasons.push((why, vec![check])),
        }
    }
    let mut text = String::new();
    for (why, checks) in reasons {
        text += &format!("{}\n", paragraph(&format!("known failure: {why}"), INDENT));
        for check in checks {
            text += &format!("{}\n", paragraph(&check.reason(), &format!("{INDENT}  ")));
        }
    }
    text
}

/// The values of an expectation, seed by seed; none if there is only one, or it is no expectation.
fn by_seed(verdict: &ScenarioVerdict, check: &Check) -> Option<String> {
    let runs = &verdict.runs;
    let values: Vec<String> = runs
        .iter()
        .filter_map(|run| {
            let summary = run.summary.as_ref()?;
            let found = summary
                .expectations
                .iter()
                .find(|v| v.what() == check.what)?;
            let value = found.value.map_or("-".to_owned(), |x| format!("{x:.4}"));
            Some(format!("{}: {value}", run.seed))
        })
        .collect();
    if values.len() < 2 {
        return None;
    }
    let more = match values.len().saturating_sub(VALUES_SHOWN) {
        0 => String::new(),
        more => format!(" … and {more} more in --json"),
    };
    let shown: Vec<_> = values.into_iter().take(VALUES_SHOWN).collect();
    Some(format!("  by seed  {}{more}", shown.join("  ")))
}

/// The seed to look at first: the worst of the first check that does not hold.
pub(crate) fn worst_seed(verdict: &ScenarioVerdict) -> Option<u64> {
    let failed = verdict.checks.iter().filter(|c| !c.held);
    failed.filter_map(|c| c.worst_seed).next()
}

/// The command that repeats a run.
fn command(path: &Path, seed: u64, sets: &[(String, String)]) -> String {
    let mut command = format!(
        "monorig run {} --seed {seed}",
        quoted(&path.to_string_lossy())
    );
    for (key, value) in sets {
        command += &format!(" --set {}", quoted(&format!("{key}={value}")));
    }
    command
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "._-/=@:+,".contains(c);
    match word.chars().all(plain) && !word.is_empty() {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_survives_a_shell() {
        let sets = [("estimators.x".to_owned(), "{is: a, b: 'c'}".to_owned())];
        let line = command(Path::new("my scenarios/a.yaml"), 3, &sets);
        assert_eq!(
            line,
            r"monorig run 'my scenarios/a.yaml' --seed 3 --set 'estimators.x={is: a, b: '\''c'\''}'"
        );
        assert_eq!(
            command(Path::new("a.yaml"), 1, &[]),
            "monorig run a.yaml --seed 1"
        );
    }
}
