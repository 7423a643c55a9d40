//! Signals that differ between two runs: a table, and plots of those that differ most.

use super::Pair;
use super::curves::chart;
use crate::reports::page::Section;
use crate::reports::table::{Cell, Table};
use crate::verdicts::signals::{DifferentSignal, SignalComparison, SignalTolerance};
use monorig_sim::error::Error;
use monorig_sim::record::readback;

/// Number of rows of the table that are shown unfolded.
const OPEN: usize = 12;
/// Number of signals that are drawn.
const DRAWN: usize = 6;

impl Pair {
    /// Compares the channels of the two runs whose names `wanted` accepts.
    pub fn signals(
        &self,
        tolerance: SignalTolerance,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<SignalComparison, Error> {
        let [a, b] = self.channels();
        SignalComparison::of([&a, &b], tolerance, wanted)
    }
}

/// Table and plots.
pub(crate) fn section(pair: &Pair, all: &SignalComparison) -> Result<Section, Error> {
    let SignalTolerance {
        absolute,
        relative,
        time_s,
    } = all.tolerance;
    let section = Section::new("Signals").text(format!(
        "{}. Two samples count as equal within {absolute} + {relative} · |value in A|, at most {time_s} s apart.",
        all.sentence()
    ));
    let (open, folded) = all.differ.split_at(all.differ.len().min(OPEN));
    let table = |of: &[DifferentSignal]| {
        let mut table = Table::new(
            &["signal"],
            &["differ", "first at, s", "A then", "B then", "largest"],
        );
        for one in of {
            let [a, b] = one.first;
            let numbers = [one.first_s, a, b, one.largest].map(Cell::number);
            let texts = [one.name.clone().into(), one.beyond.to_string().into()];
            table.row(texts.into_iter().chain(numbers));
        }
        table
    };
    if open.is_empty() {
        return Ok(section);
    }
    let mut section = section.table(table(open));
    if !folded.is_empty() {
        section = section.folded(
            format!("{} more signals that differ", folded.len()),
            table(folded),
        );
    }
    let mut most: Vec<_> = all.differ.iter().collect();
    most.sort_by(|x, y| y.of_span.total_cmp(&x.of_span));
    most.truncate(DRAWN);
    let shown = |name: &str| most.iter().any(|signal| signal.name == name);
    let mut columns = Vec::new();
    for file in pair.channels() {
        columns.push(readback::columns(&file, shown)?.1);
    }
    for signal in most {
        let mut lines = Vec::new();
        for (i, of) in columns.iter().enumerate() {
            let rows = of.get("time")?.iter().zip(of.get(&signal.name)?);
            lines.push((i, rows.map(|(t, x)| (*t, *x)).collect::<Vec<_>>()));
        }
        section = section.figure(chart(&signal.name, "", lines, Vec::new()));
    }
    Ok(section)
}
