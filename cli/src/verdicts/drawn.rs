//! The summary of drawn faults on the terminal.

use crate::ui::errors::CliError;
use crate::ui::output;
use crate::ui::prose::paragraph;
use crate::ui::tables::{lines, percent, right, table, within_terminal};
use monorig_lab::stress::{
    ClassRow, DrawnSummary, EstimatorSummary, MISLED, MatrixCell, StressFile,
};
use std::collections::BTreeSet;

/// Number of faults that are printed one by one.
const WORST: usize = 10;

/// Prints the results of drawn faults: over all faults, by class, and the worst faults.
pub(super) fn print_summary(file: &StressFile, summary: &DrawnSummary) -> Result<(), CliError> {
    let by = |of: &str| summary.classes.get(of).map(Vec::as_slice);
    let mut text = overall(&summary.estimators);
    for of in ["kind", "size"] {
        text += &by(of).map_or(String::new(), |rows| classes(of, rows, &file.estimators));
    }
    text += &worst(file);
    output::print(&text)
}

/// A line for each estimator.
fn overall(estimators: &[EstimatorSummary]) -> String {
    let mut text = table([
        "does it mislead?",
        "misled %",
        ">3 sd",
        "beyond",
        "valid",
        "faults",
        "recovered s",
    ]);
    for e in estimators {
        let seconds = |s: Option<f64>| s.map_or("never".into(), |s| format!("{s:.0}"));
        text.add_row([
            e.all.estimator.clone(),
            percent(e.all.misled()),
            percent(e.all.largest(|f| f.overconfident)),
            percent(e.all.largest(|f| f.beyond)),
            percent(e.all.least_valid()),
            e.misled_in.to_string(),
            format!(
                "{}/{}",
                seconds(e.recovery_median_s),
                seconds(e.recovery_90_s)
            ),
        ]);
    }
    right(&mut text, 1..7);
    let of = estimators.first().map_or(0, |e| e.conditions);
    format!(
        "{}\n\nshares in %, the worst of mass, slope, effective slope; faults: how many of {of}\n\
         mislead more than {} %; beyond: beyond the alert limit, whatever the sd;\n\
         recovered: time after the end of the fault, median and 90 %\n",
        lines(&text),
        100.0 * MISLED
    )
}

/// Table with a line for each class and a figure for each estimator.
fn classes(of: &str, rows: &[ClassRow], estimators: &[String]) -> String {
    let title = format!("misled %, by {of}");
    let names = estimators.iter().map(String::as_str);
    let titles = [title.as_str()].into_iter().chain(names);
    let mut text = table(titles.chain(["faults"]));
    for row in rows {
        let figures = row.misled.iter().map(|share| percent(*share));
        let cells = [row.class.clone()].into_iter().chain(figures);
        text.add_row(cells.chain([row.conditions.to_string()]));
    }
    right(&mut text, 1..estimators.len() + 2);
    format!("\n{}\n", lines(&text))
}

/// Faults that mislead most, with the command that repeats one of them, and faults whose run broke down.
fn worst(file: &StressFile) -> String {
    let mut seen: Vec<&MatrixCell> = Vec::new();
    let mut broken = BTreeSet::new();
    for cell in &file.cells {
        if cell.broken > 0 {
            broken.insert(cell.condition.as_str());
        } else if seen.len() < WORST && seen.iter().all(|c| c.condition != cell.condition) {
            seen.push(cell);
        }
    }
    let mut text = table(["worst", "misled %", "fault"]);
    for cell in &seen {
        let words = file.row(&cell.condition).map_or("", |r| r.words.as_str());
        text.add_row([
            cell.condition.clone(),
            percent(cell.misled()),
            words.to_owned(),
        ]);
    }
    right(&mut text, 1..2);
    within_terminal(&mut text);
    let seed = seen.first().and_then(|c| c.condition.rsplit_once('_'));
    let again = seed.map_or(String::new(), |(_, seed)| {
        let names = file.estimators.join(",");
        format!(
            "\nthe first again:\n  monorig stress --drawn 1 --seed {seed} --estimators {names}\n"
        )
    });
    let broken: Vec<&str> = broken.into_iter().collect();
    let broken = match broken.is_empty() {
        true => String::new(),
        false => paragraph(&format!("broke down: {}", broken.join(", ")), "") + "\n",
    };
    format!("\n{}\n{broken}{again}", lines(&text))
}
