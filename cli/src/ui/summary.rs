//! What a run has come to, as text.

use crate::ui::tables::{lines, number, right, table};
use monorig_lab::verdicts::findings::of_summaries;
use monorig_lab::verdicts::summary::Summary;

/// A column of the estimators' table: title, metric, factor from the metric's unit, what stands for "could not be measured".
const COLUMNS: &[(&str, &str, f64, &str)] = &[
    ("mass error max %", "mass_error_rel_max", 100.0, "-"),
    ("of valid %", "mass_error_rel_max_valid", 100.0, "-"),
    ("valid %", "mass_availability", 100.0, "-"),
    ("converged s", "mass_convergence_s", 1.0, "never"),
    ("slope RMSE °", "slope_rmse_deg", 1.0, "-"),
    ("of valid °", "slope_rmse_deg_valid", 1.0, "-"),
    ("valid %", "slope_availability", 100.0, "-"),
    (
        "effective slope RMSE °",
        "effective_slope_rmse_deg",
        1.0,
        "-",
    ),
    ("valid %", "effective_slope_availability", 100.0, "-"),
];

/// What misleads, then estimators, expectations and the time it took.
pub fn text(summary: &Summary, wall_s: f64) -> String {
    let mut parts = Vec::new();
    let findings = of_summaries([summary]);
    if !findings.is_empty() {
        let lines: Vec<String> = findings
            .iter()
            .map(|f| format!("finding: {}", f.text))
            .collect();
        parts.push(lines.join("\n"));
    }
    if !summary.estimators.is_empty() {
        parts.push(estimators(summary));
    }
    if !summary.expectations.is_empty() {
        parts.push(expectations(summary));
    }
    let t_s = summary.simulated_s;
    let speed = match wall_s {
        w if w > 0.0 => format!(", {:.0} times real time", t_s / w),
        _ => String::new(),
    };
    parts.push(format!("{t_s:.1} s simulated in {wall_s:.2} s{speed}"));
    parts.join("\n\n") + "\n"
}

fn estimators(summary: &Summary) -> String {
    let title = format!("from {} s on", summary.after_s);
    let titles = COLUMNS.iter().map(|c| c.0);
    let mut table = table(std::iter::once(title.as_str()).chain(titles));
    for (name, values) in &summary.estimators {
        let numbers = COLUMNS.iter().map(|(_, metric, factor, without)| {
            let value = values.get(*metric).copied().flatten();
            value.map_or((*without).to_owned(), |x| number(x * factor))
        });
        table.add_row(std::iter::once(name.clone()).chain(numbers));
    }
    right(&mut table, 1..=COLUMNS.len());
    lines(&table)
}

fn expectations(summary: &Summary) -> String {
    let mut table = table(["expected", "bound", "measured", ""]);
    for v in &summary.expectations {
        let value = v.value.map_or("not measured".to_owned(), number);
        let verdict = match (v.held, &v.known_failure) {
            (true, _) => "held",
            (false, Some(_)) => "known failure",
            (false, None) => "FAILED",
        };
        table.add_row([v.what(), v.bound(), value, verdict.to_owned()]);
    }
    right(&mut table, 1..=2);
    lines(&table)
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorig_lab::verdicts::summary::ExpectationVerdict;
    use std::collections::BTreeMap;

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
            estimators: BTreeMap::from([("joint_ekf_robust".to_owned(), values)]),
            run: BTreeMap::new(),
            refusals: Vec::new(),
            expectations: vec![ExpectationVerdict {
                estimator: Some("joint_ekf_robust".into()),
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
            }],
            limits: Default::default(),
            integrity: Vec::new(),
            common: BTreeMap::new(),
        }
    }

    #[test]
    fn one_line_an_estimator_one_an_expectation_and_one_for_the_time() {
        let text = text(&summary(true, Some(0.5)), 0.12);
        let lines: Vec<&str> = text.lines().filter(|l| !l.is_empty()).collect();
        assert_eq!(lines.len(), 7, "{text}");
        let row: Vec<&str> = lines[2].split_whitespace().collect();
        assert_eq!(
            row,
            [
                "joint_ekf_robust",
                "7.630",
                "-",
                "-",
                "never",
                "0.500",
                "-",
                "-",
                "-",
                "-"
            ]
        );
        assert!(lines[5].ends_with("held"), "{text}");
        assert_eq!(lines[6], "60.0 s simulated in 0.12 s, 500 times real time");
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
