//! Results of a run as text, on one screen: a row for each estimator, what did not hold, where to look next, and the
//! verdict as the last line.

use crate::ui::prose::paragraph;
use crate::ui::tables::{grouped, lines, number, right, table, whole, within_terminal};
use crate::ui::terminal;
use monorig_lab::metrics::{VALID, told_sd};
use monorig_lab::verdicts::findings::of_summaries;
use monorig_lab::verdicts::summary::Summary;
use monorig_lab::verdicts::verdict::{Check, ScenarioVerdict};
use std::collections::BTreeMap;

/// A row of an estimator in the details: what it is about, the metric of all samples, its factor from the metric's
/// unit, its availability.
const ROWS: &[(&str, &str, f64, &str)] = &[
    (
        "mass error max %",
        "mass_error_rel_max",
        100.0,
        "mass_availability",
    ),
    ("slope RMSE °", "slope_rmse_deg", 1.0, "slope_availability"),
    (
        "effective slope RMSE °",
        "effective_slope_rmse_deg",
        1.0,
        "effective_slope_availability",
    ),
];
const CONVERGENCE: &str = "mass_convergence_s";
/// Steps of estimators are not longer, s.
const STEP_S: f64 = 0.1;
/// Failures that are shown; the others are counted.
const SHOWN: usize = 5;

/// Title, time and hints of a run.
pub(crate) struct About {
    /// Its name.
    pub(crate) title: String,
    /// The estimator that the controller uses.
    pub(crate) in_loop: Option<String>,
    /// The time it took.
    pub(crate) took: String,
    /// Commands that show more.
    pub(crate) hints: Vec<String>,
    /// True if it was stopped from outside: then nothing is judged.
    pub(crate) interrupted: bool,
}

/// Writes a run: its estimators, what did not hold, and the verdict.
pub(crate) fn text(summary: &Summary, about: &About) -> String {
    let mut parts = Vec::new();
    if !summary.estimators.is_empty() {
        parts.push(estimators(summary, about));
        if terminal::verbose() {
            parts.push(details(summary));
        }
    }
    parts.extend(tail(summary, about));
    parts.join("\n\n") + "\n"
}

/// The part below the table of estimators: what did not hold, time, hints, and the verdict as the last line.
pub(crate) fn tail(summary: &Summary, about: &About) -> Vec<String> {
    let verdict = summary.verdict();
    let mut parts = Vec::new();
    if !about.interrupted {
        if terminal::verbose() {
            parts.extend(findings(summary));
            parts.push(checks(&verdict, summary));
        }
        parts.extend(not_held(&verdict));
    }
    let mut end = vec![about.took.clone()];
    let hints = about.hints.join("   ");
    match hints.chars().count() <= usize::from(terminal::width()) {
        true if hints.is_empty() => {}
        true => end.push(hints),
        false => end.extend(about.hints.iter().cloned()),
    }
    if !about.interrupted {
        end.push(paragraph(&verdict.judgement().words(), ""));
    }
    parts.push(end.join("\n"));
    parts
}

/// A row for each estimator.
fn estimators(summary: &Summary, about: &About) -> String {
    let titles = [
        "",
        "mass\n% at\nend ±2σ",
        "slope °\nRMSE\n±2σ",
        "valid\nmass/\nslope %",
        "beyond\nlimit %\n",
        "misled\n%",
    ];
    let mut table = table(titles);
    for (name, values) in &summary.estimators {
        let value = |metric: &str| values.get(metric).copied().flatten();
        let of = |metric: &str, sd: &str, factor: f64| {
            let told =
                value(sd).map_or(String::new(), |sd| format!("±{}", short(2.0 * sd * factor)));
            value(metric).map_or("-".to_owned(), |x| short(x * factor) + &told)
        };
        let share =
            |metric: &str| value(metric).map_or("-".to_owned(), |x| format!("{:.0}", 100.0 * x));
        let pair = |what: &str| {
            format!(
                "{}/{}",
                share(&format!("mass_{what}")),
                share(&format!("slope_{what}"))
            )
        };
        table.add_row([
            marked(summary, name, about.in_loop.as_deref()),
            of("mass_error_rel_end", "mass_sd_rel_mean_valid", 100.0),
            of("slope_rmse_deg", "slope_sd_mean_deg_valid", 1.0),
            pair("availability"),
            pair("beyond_limit_share"),
            summary.misleading(name),
        ]);
    }
    within_terminal(&mut table);
    whole(&mut table, 0);
    right(&mut table, 1..=4);
    let legend = legend(summary, about.in_loop.as_deref());
    format!("{}\n{}{legend}", about.title, lines(&table))
}

/// Two digits that count, for a column that must be narrow.
fn short(x: f64) -> String {
    match x.abs() {
        a if a >= 9.95 => format!("{x:.0}"),
        a if a >= 0.995 => format!("{x:.1}"),
        a if a >= 0.0995 => format!("{x:.2}"),
        _ => format!("{x:.3}"),
    }
}

/// The time of convergence; of one that is there when counting begins nothing is known but that.
fn converged(t_s: Option<f64>, after_s: f64) -> String {
    match t_s {
        None => "never".to_owned(),
        Some(t_s) if t_s <= after_s + STEP_S => format!("≤ {after_s}"),
        Some(t_s) => format!("{t_s:.1}"),
    }
}

/// The name of an estimator with its marks.
pub(crate) fn marked(summary: &Summary, name: &str, in_loop: Option<&str>) -> String {
    let mark = match (in_loop == Some(name), summary.is_for_reference(name)) {
        (true, true) => " * †",
        (true, false) => " *",
        (false, true) => " †",
        (false, false) => "",
    };
    format!("{name}{mark}")
}

/// The marks that stand behind names, on a line of its own; nothing without any.
pub(crate) fn legend(summary: &Summary, in_loop: Option<&str>) -> String {
    let names = || summary.estimators.keys();
    let used = names().any(|name| in_loop == Some(name.as_str()));
    let reference = names().any(|name| summary.is_for_reference(name));
    let marks = [
        (used, "* used by the controller"),
        (reference, "† for reference, not judged"),
    ];
    let shown = marks
        .into_iter()
        .filter(|(is, _)| *is)
        .map(|(_, what)| what);
    match shown.collect::<Vec<_>>().join("   ") {
        none if none.is_empty() => none,
        marks => format!("\n {marks}"),
    }
}

/// A line for the name, then one for each quantity: so it fits a terminal however long names are.
fn details(summary: &Summary) -> String {
    let title = format!("from {} s on", summary.after_s);
    let titles = [
        "all",
        "valid ones",
        "± 2 σ",
        "valid %",
        "beyond %",
        "converged s",
    ];
    let titles: Vec<&str> = std::iter::once(title.as_str()).chain(titles).collect();
    let group = |(name, values): (&String, &BTreeMap<String, Option<f64>>)| {
        let of = |metric: &str, factor: f64| {
            let value = values.get(metric).copied().flatten();
            value.map(|x| number(x * factor))
        };
        let row = |(what, metric, factor, availability): &(&str, &str, f64, &str)| {
            let converged = match metric.starts_with("mass") {
                true => converged(values.get(CONVERGENCE).copied().flatten(), summary.after_s),
                false => String::new(),
            };
            let told = told_sd(metric).map(|sd| format!("{sd}{VALID}"));
            let beyond = availability.replace("availability", "beyond_limit_share");
            let without = || "-".to_owned();
            vec![
                (*what).to_owned(),
                of(metric, *factor).unwrap_or_else(without),
                of(&format!("{metric}_valid"), *factor).unwrap_or_else(without),
                told.and_then(|sd| of(&sd, 2.0 * factor))
                    .unwrap_or_else(without),
                of(availability, 100.0).unwrap_or_else(without),
                of(&beyond, 100.0).unwrap_or_else(without),
                converged,
            ]
        };
        (name.clone(), ROWS.iter().map(row).collect())
    };
    let groups: Vec<_> = summary.estimators.iter().map(group).collect();
    grouped(&titles, &groups)
}

/// The findings, worst first.
fn findings(summary: &Summary) -> Option<String> {
    let findings = of_summaries([summary]);
    let lines = findings
        .iter()
        .map(|f| paragraph(&format!("finding: {}", f.text), ""));
    (!findings.is_empty()).then(|| lines.collect::<Vec<_>>().join("\n"))
}

/// Everything that did not hold, each in a line: failures, what nothing could decide, weakened limits, known failures.
fn not_held(verdict: &ScenarioVerdict) -> Option<String> {
    let mut said = Vec::new();
    let failed: Vec<&Check> = verdict.checks.iter().filter(|c| !c.held).collect();
    let shown = match terminal::verbose() {
        true => failed.len(),
        false => SHOWN,
    };
    let each = failed.iter().take(shown);
    said.extend(each.map(|c| format!("FAILED: {}", c.reason())));
    if let Some(more) = failed.len().checked_sub(shown).filter(|n| *n > 0) {
        said.push(format!("FAILED: and {more} more, see -v or the report"));
    }
    let open = verdict.checks.iter().filter(|c| c.not_judged);
    said.extend(open.map(|c| format!("not judged: {}", c.reason())));
    if !verdict.weakened.is_empty() {
        said.push(format!("weakened limits: {}", verdict.weakened.join("; ")));
    }
    let known = verdict.checks.iter().filter(|c| c.fails_as_known());
    if terminal::verbose() {
        said.extend(known.map(|c| {
            let why = c.known_failure.as_deref().unwrap_or_default();
            format!("known failure: {} ({why})", c.reason())
        }));
    } else {
        let known: Vec<&str> = known.map(|c| c.what.as_str()).collect();
        if !known.is_empty() {
            let why = "reasons: -v";
            said.push(format!("known failure: {}; {why}", known.join("; ")));
        }
    }
    let said: Vec<String> = said.iter().map(|line| paragraph(line, "")).collect();
    (!said.is_empty()).then(|| said.join("\n"))
}

/// Everything that was asked, the bounds of every run like those that the scenario states.
fn checks(verdict: &ScenarioVerdict, summary: &Summary) -> String {
    let mut table = table(["expected", "bound", "measured", ""]);
    for check in &verdict.checks {
        let stated = summary.expectations.iter().find(|v| v.what() == check.what);
        let value = match stated {
            Some(v) => v.value.map_or("not measured".to_owned(), number),
            None => String::new(),
        };
        let word = match check {
            c if c.fails_as_known() => "known failure",
            c if c.not_judged => "not judged",
            c if c.held => "held",
            _ => "FAILED",
        };
        table.add_row([check.what.as_str(), &check.bound, &value, word]);
    }
    within_terminal(&mut table);
    right(&mut table, 1..=2);
    lines(&table)
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorig_lab::verdicts::summary::ExpectationVerdict;

    fn summary(held: bool, value: Option<f64>) -> Summary {
        let values = BTreeMap::from([
            ("mass_error_rel_end".to_owned(), Some(0.0763)),
            ("mass_convergence_s".to_owned(), None),
            ("slope_rmse_deg".to_owned(), value),
            ("slope_sd_mean_deg_valid".to_owned(), Some(0.11)),
        ]);
        Summary {
            version: 1,
            scenario: "hill".into(),
            seed: 1,
            finished: true,
            never_valid: Vec::new(),
            simulated_s: 60.0,
            steps: 30000,
            after_s: 5.0,
            estimators: BTreeMap::from([("dffrls_aekf_robust".to_owned(), values)]),
            run: BTreeMap::new(),
            refusals: Vec::new(),
            expectations: vec![ExpectationVerdict {
                estimator: Some("dffrls_aekf_robust".into()),
                metric: "slope_rmse_deg".into(),
                window: String::new(),
                after_s: None,
                until_s: None,
                at_most: Some(1.0),
                at_least: None,
                quantile: None,
                mean: false,
                value,
                held,
                known_failure: None,
                no_worse_than: None,
            }],
            limits: Default::default(),
            integrity: Vec::new(),
            weakened: Vec::new(),
            common: BTreeMap::new(),
        }
    }

    fn about() -> About {
        About {
            title: "hill seed 1".into(),
            in_loop: Some("dffrls_aekf_robust".into()),
            took: "60.0 s simulated in 0.12 s, 500 times real time".into(),
            hints: vec!["look: rerun runs/hill/1/run.rrd".into()],
            interrupted: false,
        }
    }

    #[test]
    fn a_row_for_each_estimator_and_the_verdict_at_the_end() {
        let text = text(&summary(true, Some(0.5)), &about());
        let lines: Vec<&str> = text.lines().filter(|l| !l.is_empty()).collect();
        assert_eq!(lines.len(), 10, "{text}");
        assert_eq!(lines[0], "hill seed 1");
        let words: Vec<&str> = lines[5].split_whitespace().collect();
        let row = [
            "dffrls_aekf_robust",
            "*",
            "7.6",
            "0.50±0.22",
            "-/-",
            "-/-",
            "-",
        ];
        assert_eq!(words, row, "{text}");
        assert_eq!(lines[7], "60.0 s simulated in 0.12 s, 500 times real time");
        assert_eq!(lines[9], "held: all 3 checks");
        let stopped = About {
            interrupted: true,
            ..about()
        };
        let text = super::text(&summary(false, None), &stopped);
        assert!(!text.contains("FAILED") && !text.contains("held"), "{text}");
    }

    /// Long names of estimators and windows are broken, not the terminal's lines.
    #[test]
    fn it_fits_80_columns() {
        let mut long = summary(false, Some(0.5));
        let name = "dffrls_aekf_inclination".to_owned();
        let values = long.estimators.remove("dffrls_aekf_robust").unwrap();
        long.estimators.insert(name.clone(), values);
        long.expectations[0].estimator = Some(name);
        long.expectations[0].window = " from where the front leaves second_sag to the end".into();
        let text = text(&long, &about()) + &checks(&long.verdict(), &long);
        assert!(text.lines().all(|l| l.chars().count() <= 80), "{text}");
    }

    #[test]
    fn a_failed_expectation_shows_with_its_reason() {
        for (value, why) in [
            (None, "could not be measured"),
            (Some(2.0), "2.0000 is not ≤ 1"),
        ] {
            let text = text(&summary(false, value), &about());
            assert!(text.ends_with("FAILED: 1 of 3 checks\n"), "{text}");
            let told = "FAILED: dffrls_aekf_robust slope_rmse_deg: ";
            assert!(text.contains(told) && text.contains(why), "{text}");
        }
        let mut known = summary(false, Some(2.0));
        known.expectations[0].known_failure = Some("physics".into());
        let text = text(&known, &about());
        assert!(text.contains("known failure: dffrls_aekf_robust slope_rmse_deg; "));
        assert!(text.ends_with("held but for 1 known failure: 2 of 3 checks hold\n"));
    }
}
