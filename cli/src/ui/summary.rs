//! Results of a run as text.

use crate::ui::prose::paragraph;
use crate::ui::tables::{grouped, lines, number, right, table, within_terminal};
use monorig_lab::verdicts::findings::of_summaries;
use monorig_lab::verdicts::summary::Summary;
use monorig_lab::verdicts::verdict::Check;
use std::collections::BTreeMap;

/// A row of an estimator: what it is about, the metric of all samples, its factor from the metric's unit, its
/// availability.
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

/// Writes misleading marks, estimators, expectations and the time the run took.
pub fn text(summary: &Summary, wall_s: f64) -> String {
    let mut parts = Vec::new();
    let findings = of_summaries([summary]);
    if !findings.is_empty() {
        let lines: Vec<String> = findings
            .iter()
            .map(|f| paragraph(&format!("finding: {}", f.text), ""))
            .collect();
        parts.push(lines.join("\n"));
    }
    if !summary.estimators.is_empty() {
        parts.push(estimators(summary));
    }
    if !summary.expectations.is_empty() {
        parts.push(expectations(summary));
    }
    parts.extend(judgement(summary));
    let t_s = summary.simulated_s;
    let speed = match wall_s {
        w if w > 0.0 => format!(", {:.0} times real time", t_s / w),
        _ => String::new(),
    };
    parts.push(format!("{t_s:.1} s simulated in {wall_s:.2} s{speed}"));
    parts.join("\n\n") + "\n"
}

/// A line for the name, then one for each quantity: so it fits a terminal however long names are.
fn estimators(summary: &Summary) -> String {
    let title = format!("from {} s on", summary.after_s);
    let titles = ["all", "valid ones", "valid %", "converged s"];
    let titles: Vec<&str> = std::iter::once(title.as_str()).chain(titles).collect();
    let group = |(name, values): (&String, &BTreeMap<String, Option<f64>>)| {
        let of = |metric: &str, factor: f64| {
            let value = values.get(metric).copied().flatten();
            value.map(|x| number(x * factor))
        };
        let row = |(what, metric, factor, availability): &(&str, &str, f64, &str)| {
            let converged = match metric.starts_with("mass") {
                true => of(CONVERGENCE, 1.0).unwrap_or_else(|| "never".to_owned()),
                false => String::new(),
            };
            let without = || "-".to_owned();
            vec![
                (*what).to_owned(),
                of(metric, *factor).unwrap_or_else(without),
                of(&format!("{metric}_valid"), *factor).unwrap_or_else(without),
                of(availability, 100.0).unwrap_or_else(without),
                converged,
            ]
        };
        (name.clone(), ROWS.iter().map(row).collect())
    };
    let groups: Vec<_> = summary.estimators.iter().map(group).collect();
    grouped(&titles, &groups)
}

/// Writes what the tables do not show of the verdict: what failed, what was not judged, and limits that are weakened.
pub(crate) fn judgement(summary: &Summary) -> Option<String> {
    let verdict = summary.verdict();
    let mut said = Vec::new();
    // what stands in the table or among the findings is said already
    let told = |c: &Check| summary.expectations.iter().any(|v| v.what() == c.what) || c.is_finding;
    for check in &verdict.checks {
        if check.not_judged {
            said.push(format!("not judged: {}", check.reason()));
        } else if !check.held && !told(check) {
            said.push(format!("FAILED: {}", check.reason()));
        }
    }
    if !verdict.weakened.is_empty() {
        said.push(format!("weakened limits: {}", verdict.weakened.join("; ")));
    }
    let said: Vec<String> = said.iter().map(|line| paragraph(line, "")).collect();
    (!said.is_empty()).then(|| said.join("\n"))
}

pub(super) fn expectations(summary: &Summary) -> String {
    let mut table = table(["expected", "bound", "measured", ""]);
    for v in &summary.expectations {
        let value = v.value.map_or("not measured".to_owned(), number);
        table.add_row([v.what(), v.bound(), value, v.word().to_owned()]);
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
            ("mass_error_rel_max".to_owned(), Some(0.0763)),
            ("mass_convergence_s".to_owned(), None),
            ("slope_rmse_deg".to_owned(), value),
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
            estimators: BTreeMap::from([("mmrls_sh_stf_robust".to_owned(), values)]),
            run: BTreeMap::new(),
            refusals: Vec::new(),
            expectations: vec![ExpectationVerdict {
                estimator: Some("mmrls_sh_stf_robust".into()),
                metric: "slope_rmse_deg".into(),
                window: String::new(),
                after_s: None,
                until_s: None,
                at_most: Some(1.0),
                at_least: None,
                quantile: None,
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

    #[test]
    fn lines_for_each_estimator_one_an_expectation_and_one_for_the_time() {
        let text = text(&summary(true, Some(0.5)), 0.12);
        let lines: Vec<&str> = text.lines().filter(|l| !l.is_empty()).collect();
        assert_eq!(lines.len(), 10, "{text}");
        assert_eq!(lines[2].trim(), "mmrls_sh_stf_robust");
        let words = |i: usize| lines[i].split_whitespace().collect::<Vec<_>>();
        assert_eq!(
            words(3),
            ["mass", "error", "max", "%", "7.630", "-", "-", "never"]
        );
        assert_eq!(words(4), ["slope", "RMSE", "°", "0.500", "-", "-"]);
        assert!(lines[8].ends_with("held"), "{text}");
        assert_eq!(lines[9], "60.0 s simulated in 0.12 s, 500 times real time");
    }

    /// Long names of estimators and windows are broken, not the terminal's lines.
    #[test]
    fn tables_fit_80_columns() {
        let mut long = summary(true, Some(0.5));
        let name = "dffrls_aekf_inclination".to_owned();
        let values = long.estimators.remove("mmrls_sh_stf_robust").unwrap();
        long.estimators.insert(name.clone(), values);
        long.expectations[0].estimator = Some(name);
        long.expectations[0].window = " from where the front leaves second_sag to the end".into();
        let text = text(&long, 1.0);
        assert!(text.lines().all(|l| l.chars().count() <= 80), "{text}");
    }

    #[test]
    fn a_failed_expectation_shows() {
        for value in [None, Some(2.0)] {
            let summary = summary(false, value);
            assert!(!summary.good());
            assert!(text(&summary, 1.0).contains("FAILED"));
        }
        assert!(summary(true, Some(0.5)).good());
        let mut known = summary(false, Some(2.0));
        known.expectations[0].known_failure = Some("physics".into());
        assert!(known.good() && text(&known, 1.0).contains("known failure"));
    }
}
