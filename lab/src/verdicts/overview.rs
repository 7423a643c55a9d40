//! The first table of a run on the terminal and in the report: a row for each estimator.

use crate::verdicts::summary::Summary;

/// Titles of the columns, each in up to three lines.
pub const OVERVIEW_TITLES: [&str; 6] = [
    "",
    "mass\n% at\nend ±2σ",
    "slope °\nRMSE\n±2σ",
    "valid\nmass/\nslope %",
    "beyond\nlimit %\n",
    "misled\n%",
];

/// Rows with a cell for each title, in the order of `names`.
pub fn rows<'a>(
    summary: &Summary,
    names: impl IntoIterator<Item = &'a str>,
    in_loop: Option<&str>,
) -> Vec<[String; 6]> {
    let row = |name: &str| {
        let values = summary.estimators.get(name);
        let value = |metric: &str| values?.get(metric).copied().flatten();
        let of = |metric: &str, sd: &str, factor: f64| {
            let told =
                value(sd).map_or(String::new(), |sd| format!("±{}", short(2.0 * sd * factor)));
            value(metric).map_or("-".to_owned(), |x| short(x * factor) + &told)
        };
        let share =
            |metric: &str| value(metric).map_or("-".to_owned(), |x| format!("{:.0}", 100.0 * x));
        let pair = |what: &str| {
            let [mass, slope] = ["mass", "slope"].map(|q| share(&format!("{q}_{what}")));
            format!("{mass}/{slope}")
        };
        [
            marked(summary, name, in_loop),
            of("mass_error_rel_end", "mass_sd_rel_mean_valid", 100.0),
            of("slope_rmse_deg", "slope_sd_mean_deg_valid", 1.0),
            pair("availability"),
            pair("beyond_limit_share"),
            summary.misleading(name),
        ]
    };
    names.into_iter().map(row).collect()
}

/// Two significant digits, for a narrow column.
fn short(x: f64) -> String {
    match x.abs() {
        a if a >= 9.95 => format!("{x:.0}"),
        a if a >= 0.995 => format!("{x:.1}"),
        a if a >= 0.0995 => format!("{x:.2}"),
        _ => format!("{x:.3}"),
    }
}

/// The name of an estimator with its marks.
pub fn marked(summary: &Summary, name: &str, in_loop: Option<&str>) -> String {
    let mark = match (in_loop == Some(name), summary.is_for_reference(name)) {
        (true, true) => " * †",
        (true, false) => " *",
        (false, true) => " †",
        (false, false) => "",
    };
    format!("{name}{mark}")
}

/// Explanation of the marks after names; empty without marks.
pub fn legend(summary: &Summary, in_loop: Option<&str>) -> String {
    let names = || summary.estimators.keys();
    let used = names().any(|name| in_loop == Some(name.as_str()));
    let reference = names().any(|name| summary.is_for_reference(name));
    let marks = [
        (used, "* used by the controller"),
        (reference, "† for reference, not judged"),
    ];
    let shown = marks.into_iter().filter(|(is, _)| *is);
    shown.map(|(_, what)| what).collect::<Vec<_>>().join("   ")
}
