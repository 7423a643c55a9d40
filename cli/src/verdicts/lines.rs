//! Verdicts as lines for people.

use crate::ui::prose::{counted, paragraph};
use crate::ui::terminal;
use monorig_lab::text::quoted;
use monorig_lab::verdicts::judgement::{Grade, Totals};
use monorig_lab::verdicts::verdict::{Check, ScenarioVerdict};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;

/// Largest number of findings shown for each scenario; the others are counted.
const FINDINGS_SHOWN: usize = 5;
/// Largest number of values shown for a check; the others are counted.
const VALUES_SHOWN: usize = 8;
/// Indentation of the lines that belong to a scenario.
const INDENT: &str = "  ";

/// The verdict in a line: the word, the scenario, its seeds, the time of its runs, and what the word does not say.
pub(crate) fn line(verdict: &ScenarioVerdict, took: Option<Duration>, width: usize) -> String {
    let judged = verdict.judgement();
    let (word, told) = match judged.grade() {
        Grade::Failed => {
            let words = judged.words();
            let told = words.strip_prefix("FAILED: ").unwrap_or(&words);
            ("FAILED", told.to_owned())
        }
        Grade::Unasked => ("held", judged.word()),
        _ => {
            let word = judged.word();
            let told = word.strip_prefix("held").unwrap_or_default();
            ("held", told.trim_start().to_owned())
        }
    };
    let seeds = match verdict.runs.as_slice() {
        [one] => format!("seed {}", one.seed),
        many => format!("{} seeds", many.len()),
    };
    let took = took.map_or(String::new(), |took| {
        format!("  {:6.1} s", took.as_secs_f64())
    });
    let line = format!(
        "{word:6}  {:width$}  {seeds:>9}{took}  {told}",
        verdict.scenario
    );
    format!("{}\n", line.trim_end())
}

/// All failures of a scenario, with values by seed and, for runs that were made here, the command that repeats the
/// worst run; with -v also notes and known failures. The text may be empty.
pub(crate) fn detail(
    verdict: &ScenarioVerdict,
    path: Option<&Path>,
    sets: &[(String, String)],
) -> String {
    let all = terminal::verbose();
    if verdict.held && !all {
        return String::new();
    }
    let mut text = String::new();
    let mut add = |line: &str| text += &format!("{}\n", paragraph(line, INDENT));
    let mut findings = verdict.findings();
    findings.retain(|f| f.fails || all && !f.known);
    let shown = if all { findings.len() } else { FINDINGS_SHOWN };
    for finding in findings.iter().take(shown) {
        add(&format!("finding: {}", finding.text));
    }
    if let Some(more) = findings.len().checked_sub(shown).filter(|n| *n > 0) {
        add(&format!("… and {more} findings more: -v"));
    }
    // a check that has a finding is left out, unless it is listed as known
    let hidden = |c: &&Check| !(c.is_finding && c.known_failure.is_none());
    for check in verdict.checks.iter().filter(|c| !c.held).filter(hidden) {
        add(&check.reason());
        if let Some(values) = by_seed(verdict, check) {
            add(&values);
        }
    }
    if all {
        for check in verdict.checks.iter().filter(|c| c.not_judged) {
            add(&format!("not judged: {}", check.reason()));
        }
        if !verdict.weakened.is_empty() {
            add(&format!("weakened limits: {}", verdict.weakened.join("; ")));
        }
        text += &known(verdict);
    }
    if let (Some(seed), Some(path)) = (worst_seed(verdict), path) {
        // in one line, however long: it is to be copied
        text += &format!("{INDENT}again: {}\n", command(path, seed, sets));
    }
    match text.is_empty() {
        true => text,
        false => format!("{}:\n{text}", verdict.scenario),
    }
}

/// End of a test or a merge: failures, known failures by estimator, and the verdict as the last line. `details` are the
/// texts of [`detail`].
pub(crate) fn end(verdicts: &[&ScenarioVerdict], details: &str, unusable: usize) -> String {
    let mut parts: Vec<String> = Vec::new();
    parts.extend((!details.is_empty()).then(|| details.trim_end().to_owned()));
    parts.extend(known_by_estimator(verdicts));
    parts.extend(for_reference(verdicts));
    let totals = Totals::of(verdicts.iter().copied());
    let words = match (unusable, totals.failed) {
        (0, _) => totals.words(),
        (n, _) if verdicts.is_empty() => format!("FAILED: {n} could not be used"),
        (n, 0) => format!("FAILED: {n} could not be used; {}", totals.words()),
        (n, _) => format!("{}; {n} could not be used", totals.words()),
    };
    parts.push(paragraph(&words, ""));
    format!("\n{}\n", parts.join("\n\n"))
}

/// Known failures, a line for each estimator.
fn known_by_estimator(verdicts: &[&ScenarioVerdict]) -> Option<String> {
    let mut by: BTreeMap<&str, (usize, BTreeSet<&str>, BTreeSet<&str>)> = BTreeMap::new();
    for verdict in verdicts {
        for check in verdict.checks.iter().filter(|c| c.fails_as_known()) {
            // `ESTIMATOR METRIC from …`, or `METRIC` of the run
            let mut words = check.what.split(' ');
            let first = words.next().unwrap_or_default();
            let (name, metric) = match words.next() {
                Some(metric) if metric.contains('_') => (first, metric),
                _ => ("the run", first),
            };
            let (count, scenarios, metrics) = by.entry(name).or_default();
            *count += 1;
            scenarios.insert(&verdict.scenario);
            metrics.insert(metric);
        }
    }
    let width = by.keys().map(|name| name.chars().count()).max()?;
    let line =
        |(name, (count, scenarios, metrics)): (&&str, &(usize, BTreeSet<&str>, BTreeSet<&str>))| {
            let metrics: Vec<&str> = metrics.iter().copied().collect();
            let line = format!(
                "  {name:width$}  {count:3} in {}: {}",
                counted(scenarios.len(), "scenario"),
                metrics.join(", ")
            );
            cut(&line)
        };
    let lines: Vec<String> = by.iter().map(line).collect();
    Some(format!(
        "known failures (reasons: -v)\n{}",
        lines.join("\n")
    ))
}

/// Misleading estimators that are shown only for reference, in a line.
fn for_reference(verdicts: &[&ScenarioVerdict]) -> Option<String> {
    let all = verdicts.iter().flat_map(|v| v.findings());
    let names: BTreeSet<String> = all
        .filter_map(|f| f.for_reference().map(str::to_owned))
        .collect();
    let names: Vec<String> = names.into_iter().collect();
    (!names.is_empty()).then(|| {
        cut(&format!(
            "misleading, for reference only: {}",
            names.join(", ")
        ))
    })
}

/// A line, cut to the width of the terminal.
fn cut(line: &str) -> String {
    let width = usize::from(terminal::width());
    match line.chars().count() {
        n if n <= width => line.to_owned(),
        _ => line.chars().take(width - 1).chain(['…']).collect(),
    }
}

/// Known failures: each reason once, with all checks that fail for this reason.
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

/// Values of an expectation, seed by seed; `None` with only one seed, or if the check is not an expectation.
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

/// Seed to look at first: the worst seed of the first failed check.
pub(crate) fn worst_seed(verdict: &ScenarioVerdict) -> Option<u64> {
    let failed = verdict.checks.iter().filter(|c| !c.held);
    failed.filter_map(|c| c.worst_seed).next()
}

/// Command that repeats a run.
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
