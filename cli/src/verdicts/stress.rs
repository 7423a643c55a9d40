//! The matrix of a stress battery on the terminal.

use super::drawn::print_summary;
use crate::ui::errors::CliError;
use crate::ui::output;
use crate::ui::prose::counted;
use crate::ui::tables::{lines, percent, right, shown, table};
use monorig_lab::stress::{Figures, MatrixCell, SHARE_TOLERANCE, StressFile, differences};

/// Conditions that are printed unless all are asked for.
const SHOWN: usize = 15;

/// Prints the share of the valid samples that misleads in the worst conditions, or all figures of all conditions; of
/// drawn ones a summary before.
pub(crate) fn print_matrix(file: &StressFile, all: bool) -> Result<(), CliError> {
    match (all, &file.summary) {
        (true, _) => print_figures(file)?,
        (false, None) => print_misled(file)?,
        (false, Some(_)) => {}
    }
    file.summary.iter().try_for_each(|s| print_summary(file, s))
}

/// Prints a row for each of the worst conditions, with one figure for each estimator.
fn print_misled(file: &StressFile) -> Result<(), CliError> {
    let mut conditions: Vec<&str> = Vec::new();
    for cell in &file.cells {
        if !conditions.contains(&cell.condition.as_str()) {
            conditions.push(&cell.condition);
        }
    }
    let names = file.estimators.iter().map(String::as_str);
    let mut text = table(["misled %"].into_iter().chain(names).collect::<Vec<_>>());
    for condition in conditions.iter().take(1 + SHOWN) {
        let of = |estimator: &String| {
            let cell = file
                .cells
                .iter()
                .find(|c| (&c.condition, &c.estimator) == (&(*condition).to_owned(), estimator));
            match cell {
                Some(cell) if cell.broken > 0 => {
                    format!("{} broke down", counted(cell.broken, "run"))
                }
                Some(cell) => percent(cell.misled()),
                None => "-".to_owned(),
            }
        };
        let cells = file.estimators.iter().map(of);
        text.add_row(
            [(*condition).to_owned()]
                .into_iter()
                .chain(cells)
                .collect::<Vec<_>>(),
        );
    }
    right(&mut text, 1..1 + file.estimators.len());
    let rest = match conditions.len().saturating_sub(1 + SHOWN) {
        0 => String::new(),
        n => format!("\n{n} better conditions, and all figures: -v"),
    };
    output::print(&format!(
        "{}\n\nvalid samples that mislead, the largest of mass, slope, effective slope{rest}\n",
        lines(&text)
    ))
}

/// Judges each cell by the share that may mislead, and prints how many conditions mislead each estimator unless
/// `silent`; true if no cell is beyond the share.
pub(crate) fn judge_matrix(
    file: &StressFile,
    most: Option<f64>,
    silent: bool,
) -> Result<bool, CliError> {
    let misled = |c: &MatrixCell| c.misled().unwrap_or(0.0);
    let (mut text, mut unjudged) = (String::new(), 0);
    for name in &file.estimators {
        let mut cells = file.cells.iter().filter(|c| c.estimator == *name);
        if cells.all(|c| c.misled().is_none()) {
            text += &format!("FAILED: {name} has no valid sample to judge in any run\n");
            unjudged += 1;
        }
    }
    // a summary says it before
    let names = file.estimators.iter().filter(|_| file.summary.is_none());
    for name in names {
        let cells = || file.cells.iter().filter(|c| c.estimator == *name);
        let of = counted(cells().count(), "condition");
        let worst = cells().max_by(|a, b| misled(a).total_cmp(&misled(b)));
        text += &match worst.filter(|c| misled(c) > 0.0) {
            None if cells().all(|c| c.misled().is_none()) => String::new(),
            None => format!("{name}: misled in none of {of}\n"),
            Some(worst) => format!(
                "{name}: misled in {} of {of}, at most {} % of its valid samples ({})\n",
                cells().filter(|c| misled(c) > 0.0).count(),
                percent(worst.misled()),
                worst.condition
            ),
        };
    }
    for name in file.idle() {
        text +=
            &format!("not judged: {name} changes nothing that an estimator is given, in any run\n");
    }
    let bad = |c: &&MatrixCell| most.is_some_and(|most| !c.is_good(most));
    let beyond = file.cells.iter().filter(bad).count();
    if let Some(most) = most {
        let limit = (1e5 * most).round() / 1e3; // 7 % is not 7.000000000000001 %
        text += &match beyond {
            0 if unjudged > 0 => String::new(),
            0 => format!("held: misled at most {limit} %\n"),
            n => format!(
                "FAILED: {} misled more than {limit} % or broke down\n",
                counted(n, "cell")
            ),
        };
    }
    if !silent && !text.is_empty() {
        output::print(&text)?;
    }
    Ok(beyond + unjudged == 0)
}

/// Prints all figures of all conditions.
fn print_figures(file: &StressFile) -> Result<(), CliError> {
    let several = file.estimators.len() > 1;
    let mut titles = vec!["condition"];
    titles.extend(several.then_some("estimator"));
    titles.extend([
        "misled %",
        ">3 sd %",
        "beyond %",
        "valid %",
        "error",
        "told sd",
        "recovered s",
    ]);
    let numbers = titles.len() - 7;
    let mut text = table(titles);
    for cell in &file.cells {
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
            three(cell, |f, _| percent(f.beyond)),
            three(cell, |f, _| percent(f.valid)),
            three(cell, |f, factor| value(f.error, factor)),
            three(cell, |f, factor| value(f.sd, factor)),
            three(cell, |f, _| {
                f.recovery_s.map_or("never".into(), |s| format!("{s:.0}"))
            }),
        ]);
        text.add_row(row);
    }
    right(&mut text, numbers..numbers + 7);
    output::print(&format!(
        "{}\n\nmass/slope/effective slope; error and sd of the mass in %, of slopes in °, of valid samples\n",
        lines(&text)
    ))
}

/// A figure of the three quantities, and the factor of its unit.
fn three(cell: &MatrixCell, of: impl Fn(&Figures, f64) -> String) -> String {
    let all = cell.quantities().into_iter().zip([100.0, 1.0, 1.0]);
    let all: Vec<String> = all.map(|(f, factor)| of(f, factor)).collect();
    all.join("/")
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
    let (all, alone) = differences(old, new, tolerance).map_err(|why| {
        let message = format!("the earlier matrix cannot be compared with this one: {why}");
        CliError::refused(
            message,
            "what `monorig stress --json` wrote for the same battery",
        )
    })?;
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
    if alone > 0 {
        let cells = counted(alone, "cell");
        output::print(&format!(
            "not judged: {cells} that the earlier matrix does not have\n"
        ))?;
    }
    Ok(worse > 0)
}
