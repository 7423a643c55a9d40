//! Results of a replay as text: errors against the reference, what the marks are worth, and how much of the drive the
//! reference covers.

use crate::ui::summary::{About, legend, marked, tail};
use crate::ui::tables::{grouped, lines, number, right, shown, table, whole, within_terminal};
use crate::ui::terminal;
use monorig_lab::verdicts::summary::Summary;
use std::collections::BTreeMap;

/// A row: title, beginning of the names of its metrics, metrics of RMSE, bias and largest error, factor of the errors.
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

/// Writes a replay: its estimators, what did not hold, and the verdict.
pub(crate) fn text(summary: &Summary, about: &About) -> String {
    let mut parts = Vec::new();
    if !summary.estimators.is_empty() {
        parts.push(overview(summary, about));
        if terminal::verbose() {
            parts.push(estimators(summary));
        }
    }
    parts.extend(tail(summary, about));
    parts.join("\n\n") + "\n"
}

/// A row for each estimator; a quantity without a reference has no column of errors.
fn overview(summary: &Summary, about: &About) -> String {
    let of = |values: &BTreeMap<String, Option<f64>>, metric: &str| {
        values.get(metric).copied().flatten()
    };
    let known = |metric: &str| {
        let mut all = summary.estimators.values();
        all.any(|values| of(values, metric).is_some_and(|x| x > 0.0))
    };
    let titles = [
        (
            "mass %\nRMSE",
            "mass_rmse_rel",
            "mass_reference_share",
            100.0,
        ),
        (
            "slope °\nRMSE",
            "slope_rmse_deg",
            "slope_reference_share",
            1.0,
        ),
        (
            "effective °\nRMSE",
            "effective_slope_rmse_deg",
            "effective_slope_reference_share",
            1.0,
        ),
    ];
    let errors: Vec<_> = titles.into_iter().filter(|t| known(t.2)).collect();
    let mut columns = vec![""];
    columns.extend(errors.iter().map(|t| t.0));
    columns.extend(["valid\nmass/\nslope %", "misleading\n%"]);
    let numbers = 1..columns.len() - 1;
    let mut table = table(columns);
    for (name, values) in &summary.estimators {
        let share = |metric: &str| {
            of(values, metric).map_or("-".to_owned(), |x| format!("{:.0}", 100.0 * x))
        };
        let mut row = vec![marked(summary, name, about.in_loop.as_deref())];
        row.extend(
            errors
                .iter()
                .map(|(_, metric, _, factor)| shown(of(values, metric).map(|x| x * factor))),
        );
        row.push(format!(
            "{}/{}",
            share("mass_availability"),
            share("slope_availability")
        ));
        row.push(summary.misleading(name));
        table.add_row(row);
    }
    within_terminal(&mut table);
    whole(&mut table, 0);
    right(&mut table, numbers);
    let without = match errors.is_empty() {
        true => "\n no reference in this log: errors are not known",
        false => "",
    };
    let legend = legend(summary, about.in_loop.as_deref());
    format!("{}\n{}{legend}{without}", about.title, lines(&table))
}

fn estimators(summary: &Summary) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(words, ["attitude", "0.250", "-/90", "-"], "{short}");
        let text = estimators(&summary) + "\n" + &short;
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
