//! Results of a run as text, on one screen: a row for each estimator, failures, hints, and the verdict as the last
//! line.

use crate::ui::prose::paragraph;
use crate::ui::tables::{grouped, lines, number, right, table, whole, within_terminal};
use crate::ui::terminal;
use monorig_lab::verdicts::findings::of_summaries;
use monorig_lab::verdicts::overview;
use monorig_lab::verdicts::summary::Summary;
use monorig_lab::verdicts::verdict::{Check, ScenarioVerdict};
use std::collections::BTreeMap;

/// Row of the table: title, beginning of the names of its metrics, metrics of RMSE, bias and largest error, factor of
/// the errors.
type Row = (&'static str, &'static str, [&'static str; 3], f64);

const ROWS: [Row; 3] = [
    (
        "mass %",
        "mass",
        ["rmse_rel", "bias", "error_rel_max"],
        100.0,
    ),
    ("slope °", "slope", DEGREES, 1.0),
    ("effective °", "effective_slope", DEGREES, 1.0),
];
const DEGREES: [&str; 3] = ["rmse_deg", "bias_deg", "error_max_deg"];

/// Largest number of failures that are shown; the others are counted.
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
    /// True if the run was stopped from outside: then nothing is judged.
    pub(crate) interrupted: bool,
}

/// Writes a run: its estimators, its failures, and the verdict.
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

/// Part below the table of estimators: failures, time, hints, and the verdict as the last line.
fn tail(summary: &Summary, about: &About) -> Vec<String> {
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
    let mut table = table(overview::OVERVIEW_TITLES);
    let names = summary.estimators.keys().map(String::as_str);
    table.add_rows(overview::rows(summary, names, about.in_loop.as_deref()));
    within_terminal(&mut table);
    whole(&mut table, 0);
    right(&mut table, 1..=4);
    let values = summary.estimators.values().flatten();
    let shares = values.filter(|(metric, _)| metric.ends_with("_reference_share"));
    let shares: Vec<f64> = shares.filter_map(|(_, share)| *share).collect();
    let mut below = vec![overview::legend(summary, about.in_loop.as_deref())];
    if !shares.is_empty() && shares.iter().all(|share| *share == 0.0) {
        below.push("this log has no reference: errors are not known".to_owned());
    }
    below.retain(|line| !line.is_empty());
    let below: String = below.iter().map(|line| format!("\n {line}")).collect();
    format!("{}\n{}{below}", about.title, lines(&table))
}

/// A line for the name of each estimator, then a line for each quantity with a reference, so that long names fit a
/// terminal.
fn details(summary: &Summary) -> String {
    let title = format!("from {} s on", summary.after_s);
    let titles = [
        title.as_str(),
        "RMSE",
        "bias",
        "max",
        "NEES",
        "misled %",
        "valid %",
        "known %",
    ];
    let group = |(name, values): (&String, &BTreeMap<String, Option<f64>>)| {
        let of = |metric: &str| values.get(metric).copied().flatten();
        let shown = |x: Option<f64>, factor: f64| x.map_or("-".to_owned(), |x| number(x * factor));
        let row = |(what, quantity, [rmse, bias, max], factor): &Row| {
            let of = |metric: &str| of(&format!("{quantity}_{metric}"));
            let reference = of("reference_share").unwrap_or(0.0);
            (reference > 0.0 && of(rmse).is_some()).then(|| {
                vec![
                    (*what).to_owned(),
                    shown(of(rmse), *factor),
                    shown(of(bias), *factor),
                    shown(of(max), *factor),
                    shown(of("nees_mean"), 1.0),
                    shown(of("misleading_share"), 100.0),
                    shown(of("availability"), 100.0),
                    shown(Some(reference), 100.0),
                ]
            })
        };
        let mut rows: Vec<Vec<String>> = ROWS.iter().filter_map(row).collect();
        if rows.is_empty() {
            let marked = |q: &str| shown(of(&format!("{q}_availability")), 100.0);
            let (mass, slope) = (marked("mass"), marked("slope"));
            rows.push(vec![format!(
                "no reference; valid: mass {mass} %, slope {slope} %"
            )]);
        }
        (name.clone(), rows)
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

/// Everything that did not hold, each in a line: failures, undecided checks, weakened limits, known failures.
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

/// All checks: the checks of every run, and the scenario's expectations.
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

    /// A row of slopes with all it should have, none of what has no reference, and the word for what was done.
    #[test]
    fn a_replay_is_told_as_one() {
        let values = [
            ("slope_rmse_deg", 0.25),
            ("slope_bias_deg", -0.125),
            ("slope_error_max_deg", 0.75),
            ("slope_nees_mean", 1.5),
            ("slope_misleading_share", 0.027),
            ("slope_availability", 0.9),
            ("slope_reference_share", 0.46),
            ("mass_reference_share", 0.0),
        ];
        let values = values.map(|(name, x)| (name.to_owned(), Some(x)));
        let summary = Summary {
            version: 1,
            scenario: "drive".into(),
            seed: 1,
            finished: true,
            never_valid: Vec::new(),
            simulated_s: 60.0,
            steps: 6000,
            after_s: 5.0,
            estimators: BTreeMap::from([("attitude".to_owned(), values.into())]),
            run: BTreeMap::new(),
            refusals: Vec::new(),
            expectations: Vec::new(),
            limits: Default::default(),
            integrity: Vec::new(),
            weakened: Vec::new(),
            common: BTreeMap::new(),
        };
        let about = About {
            title: "drive".into(),
            in_loop: None,
            took: "60.0 s replayed in 0.50 s, 120 times real time".into(),
            hints: Vec::new(),
            interrupted: false,
        };
        let short = text(&summary, &about);
        let row = short.lines().find(|l| l.contains("attitude")).unwrap();
        let words: Vec<&str> = row.split_whitespace().collect();
        assert_eq!(
            words,
            ["attitude", "-", "0.25", "-/90", "-/-", "-"],
            "{short}"
        );
        let text = details(&summary) + "\n" + &short;
        let row = text.lines().find(|l| l.contains("slope °")).unwrap();
        let words: Vec<&str> = row.split_whitespace().collect();
        let expected = [
            "slope", "°", "0.250", "-0.125", "0.750", "1.500", "2.700", "90.0", "46.0",
        ];
        assert_eq!(words, expected, "{text}");
        assert!(
            !text.contains("mass %") && !text.contains("simulated"),
            "{text}"
        );
        assert!(text.contains("60.0 s replayed in 0.50 s, 120 times real time"));
        assert!(text.lines().all(|l| l.chars().count() <= 80), "{text}");
    }
}
