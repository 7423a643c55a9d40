//! The matrix of a stress battery on the terminal.

use super::drawn::print_summary;
use crate::ui::errors::CliError;
use crate::ui::output;
use crate::ui::prose::{counted, paragraph};
use crate::ui::tables::{lines, narrow, percent, right, shown, table};
use monorig_lab::stress::{MatrixCell, SHARE_TOLERANCE, StressFile, differences};

/// Number of conditions that are printed without -v.
const SHOWN: usize = 15;

/// Prints the share of the valid samples that misleads in the worst conditions, or in all; for drawn faults a summary.
pub(crate) fn print_matrix(file: &StressFile, all: bool) -> Result<(), CliError> {
    if all || file.summary.is_none() {
        print_misled(file, if all { usize::MAX - 1 } else { SHOWN })?;
    }
    file.summary.iter().try_for_each(|s| print_summary(file, s))
}

/// Prints a row for each of the worst conditions, with a figure for each estimator.
fn print_misled(file: &StressFile, shown: usize) -> Result<(), CliError> {
    let mut conditions: Vec<&str> = Vec::new();
    for cell in &file.cells {
        if !conditions.contains(&cell.condition.as_str()) {
            conditions.push(&cell.condition);
        }
    }
    let names: Vec<String> = file.estimators.iter().map(|name| narrow(name)).collect();
    let mut text = table(
        ["misled %"]
            .into_iter()
            .chain(names.iter().map(String::as_str)),
    );
    for condition in conditions.iter().take(1 + shown) {
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
    let rest = match conditions.len().saturating_sub(1 + shown) {
        0 => String::new(),
        n => format!("\n{n} better conditions: -v; all figures: --html or --json"),
    };
    output::print(&format!(
        "{}\n\nvalid samples that mislead, the largest of mass, slope, effective slope{rest}\n",
        lines(&text)
    ))
}

/// Judges each cell by the share that may mislead and, unless `silent`, prints how many conditions mislead each
/// estimator; returns true if no cell exceeds the share, and the verdict.
pub(crate) fn judge_matrix(
    file: &StressFile,
    most: Option<f64>,
    silent: bool,
) -> Result<(bool, String), CliError> {
    let misled = |c: &MatrixCell| c.misled().unwrap_or(0.0);
    let (mut text, mut unjudged) = (String::new(), 0);
    for name in &file.estimators {
        let mut cells = file.cells.iter().filter(|c| c.estimator == *name);
        if cells.all(|c| c.misled().is_none()) {
            text += &format!("FAILED: no run has a valid sample of {name} to judge\n");
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
            None => format!("{name}: misled in 0 of {of}\n"),
            Some(worst) => format!(
                "{name}: misled in {} of {of}, at most {} % of its valid samples ({})\n",
                cells().filter(|c| misled(c) > 0.0).count(),
                percent(worst.misled()),
                worst.condition
            ),
        };
    }
    for name in file.idle() {
        text += &format!("not judged: {name} changes no input of an estimator in any run\n");
    }
    let bad = |c: &&MatrixCell| most.is_some_and(|most| !c.is_good(most));
    let beyond = file.cells.iter().filter(bad).count();
    if !silent {
        let lines = text.lines().map(|line| paragraph(line, "") + "\n");
        output::print(&lines.collect::<String>())?;
    }
    let limit = most.map(|most| (1e5 * most).round() / 1e3); // 7 % is not 7.000000000000001 %
    let verdict = match (limit, beyond, unjudged) {
        (None, _, 0) => "nothing was expected: --max-misled sets what may mislead".to_owned(),
        (Some(limit), 0, 0) => format!("held: misled at most {limit} %"),
        (Some(limit), n, _) if n > 0 => {
            let cells = counted(n, "cell");
            format!("FAILED: {cells} misled more than {limit} % or broke down")
        }
        (.., n) => format!("FAILED: {} had nothing to judge", counted(n, "estimator")),
    };
    Ok((beyond + unjudged == 0, verdict))
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
            "use a file that `monorig stress --json` wrote for the same battery",
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
