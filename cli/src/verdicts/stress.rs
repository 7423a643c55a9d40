//! The matrix of a stress battery on the terminal.

use crate::ui::errors::CliError;
use crate::ui::output;
use crate::ui::prose::counted;
use crate::ui::tables::{lines, right, shown, table};
use monorig_lab::stress::{Figures, MatrixCell, SHARE_TOLERANCE, StressFile, differences};

/// Cells that are printed unless all are asked for.
const SHOWN: usize = 15;

/// Prints the nominal cells and the worst others, or all.
pub(crate) fn print_matrix(file: &StressFile, all: bool) -> Result<(), CliError> {
    let nominal = file.estimators.len();
    let shown = match all {
        true => file.cells.len(),
        false => nominal + SHOWN,
    };
    let several = nominal > 1;
    let mut titles = vec!["condition"];
    titles.extend(several.then_some("estimator"));
    titles.extend([
        "misled %",
        ">3 sd %",
        "valid %",
        "error",
        "told sd",
        "recovered s",
    ]);
    let numbers = titles.len() - 6;
    let mut text = table(titles);
    for cell in file.cells.iter().take(shown) {
        let mut row = vec![cell.condition.clone()];
        row.extend(several.then(|| cell.estimator.clone()));
        if cell.broken > 0 {
            row.push(format!("{} broke down", counted(cell.broken, "run")));
            text.add_row(row);
            continue;
        }
        row.extend([
            three(cell, |f, _| percent(f.misleading)),
            three(cell, |f, _| percent(f.overconfident)),
            three(cell, |f, _| percent(f.valid)),
            three(cell, |f, factor| value(f.error, factor)),
            three(cell, |f, factor| value(f.sd, factor)),
            three(cell, |f, _| {
                f.recovery_s.map_or("never".into(), |s| format!("{s:.0}"))
            }),
        ]);
        text.add_row(row);
    }
    right(&mut text, numbers..numbers + 6);
    let rest = file.cells.len().saturating_sub(shown);
    let rest = match rest {
        0 => String::new(),
        n => format!("; {n} better ones with -v"),
    };
    output::print(&format!(
        "{}\n\nmass/slope/effective slope; error and sd of the mass in %, of slopes in °, of valid samples{rest}\n",
        lines(&text)
    ))
}

/// A figure of the three quantities, and the factor of its unit.
fn three(cell: &MatrixCell, of: impl Fn(&Figures, f64) -> String) -> String {
    let all = cell.quantities().into_iter().zip([100.0, 1.0, 1.0]);
    let all: Vec<String> = all.map(|(f, factor)| of(f, factor)).collect();
    all.join("/")
}

fn percent(share: Option<f64>) -> String {
    match share.map(|x| 100.0 * x) {
        None => "-".into(),
        Some(0.0) => "0".into(),
        Some(x) if x < 0.95 => format!("{x:.1}"),
        Some(x) => format!("{x:.0}"),
    }
}

fn value(x: Option<f64>, factor: f64) -> String {
    match x.map(|x| x * factor) {
        None => "-".into(),
        Some(x) if x < 9.95 => format!("{x:.2}"),
        Some(x) => format!("{x:.0}"),
    }
}

/// Prints the figures that have changed since an earlier matrix; true if one has become worse.
pub(crate) fn compared(
    old: &StressFile,
    new: &StressFile,
    tolerance: f64,
) -> Result<bool, CliError> {
    let all = differences(old, new, tolerance);
    let mut text = table(["", "condition", "estimator", "figure", "before", "now"]);
    for d in &all {
        text.add_row([
            if d.worse { "WORSE" } else { "better" }.to_owned(),
            d.condition.clone(),
            d.estimator.clone(),
            d.figure.clone(),
            shown(d.old),
            shown(d.new),
        ]);
    }
    right(&mut text, 4..6);
    if !all.is_empty() {
        output::print(&format!("\n{}\n", lines(&text)))?;
    }
    let worse = all.iter().filter(|d| d.worse).count();
    output::print(&format!(
        "{} worse, {} better: errors by more than {} %, shares by more than {} %\n",
        counted(worse, "figure"),
        all.len() - worse,
        100.0 * tolerance,
        100.0 * SHARE_TOLERANCE
    ))?;
    Ok(worse > 0)
}
