//! Findings and integrity, for pages of any kind.

use crate::reports::page::Section;
use crate::reports::table::{Cell, Table};
use crate::text::number;
use crate::verdicts::findings::Finding;
use crate::verdicts::integrity::{Integrity, Outcome};
use crate::verdicts::summary::Summary;

/// Findings about misleading estimates, worst first, with findings about baselines folded; `None` without findings.
/// Each may begin with a name, such as that of its scenario.
pub(crate) fn section(all: &[(String, Finding)]) -> Option<Section> {
    if all.is_empty() {
        return None;
    }
    let (others, judged): (Vec<_>, Vec<_>) = all.iter().partition(|(_, f)| f.for_reference);
    let section = Section::new("Findings");
    let section = match judged.is_empty() {
        true => section,
        false => section.table(table(&judged)),
    };
    Some(match others.len() {
        0 => section,
        n => section.folded(
            format!("Findings of baselines, which are not judged: {n}"),
            table(&others),
        ),
    })
}

fn table(all: &[&(String, Finding)]) -> Table {
    let mut table = Table::new(&["", "finding"], &["error over alert limit"]);
    for (of, finding) in all {
        let mark = match finding.fails {
            true => Cell::from("MISLEADING").judged(false),
            false => Cell::from("noted"),
        };
        let text = match of.as_str() {
            "" => finding.text.clone(),
            of => format!("{of}: {}", finding.text),
        };
        table.row([mark, text.into(), Cell::number(finding.severity)]);
    }
    table
}

/// The findings of one scenario.
pub(crate) fn of_one(all: Vec<Finding>) -> Option<Section> {
    let named = all.into_iter().map(|f| (String::new(), f));
    section(&named.collect::<Vec<_>>())
}

/// Numbers of misleading estimates in words; `None` without misleading estimates.
pub(crate) fn told(all: &[Finding]) -> Option<String> {
    let count = |which: fn(&&Finding) -> bool| all.iter().filter(which).count();
    let (fails, reference) = (count(|f| f.fails), count(|f| f.for_reference));
    let of = |n: usize, what: &str| match n {
        0 => None,
        1 => Some(format!("1 estimate {what}")),
        n => Some(format!("{n} estimates {what}")),
    };
    let fails = of(fails, "MISLEADING");
    let reference = of(reference, "shown for reference only and misleading");
    let all: Vec<String> = fails.into_iter().chain(reference).collect();
    (!all.is_empty()).then(|| all.join("; "))
}

/// Availability, integrity and continuity of every estimator and quantity over runs of one scenario; `None` without an
/// estimator.
pub(crate) fn integrity<'a>(runs: impl IntoIterator<Item = &'a Summary>) -> Option<Table> {
    let mut sums: Vec<Integrity> = Vec::new();
    for new in runs.into_iter().flat_map(|s| &s.integrity) {
        match sums.iter_mut().find(|sum| sum.is_of_same(new)) {
            Some(sum) => sum.add(new),
            None => sums.push(new.clone()),
        }
    }
    sums.sort_by_key(|sum| sum.at_most.is_none());
    let mut table = Table::new(
        &["estimator", "quantity", "judged"],
        &[
            "valid, % of all",
            "misleading, % of valid",
            "overconfident, % of valid",
            "alert limit",
            "worst error",
            "its NEES",
        ],
    );
    table.caption = "Availability and integrity, from the start of every run".into();
    for i in &sums {
        let (unit, factor) = i.quantity.unit();
        let with_unit = |x: f64| format!("{} {unit}", number(x * factor));
        let share = Cell::number(100.0 * i.share());
        let (share, judged) = match i.outcome() {
            Outcome::ForReference => (share, "for reference only"),
            Outcome::NoReference => (share, "no: the log has no reference"),
            Outcome::NothingValid => (share, "yes"),
            Outcome::KnownFailure => (share.judged(false), "known failure"),
            Outcome::Holds => (share.judged(true), "yes"),
            Outcome::Fails => (share.judged(false), "yes"),
        };
        table.row([
            i.estimator.clone().into(),
            i.quantity.words().into(),
            judged.into(),
            Cell::number(100.0 * i.valid as f64 / i.samples as f64),
            share,
            Cell::number(100.0 * i.overconfident as f64 / i.judged as f64),
            with_unit(i.alert).into(),
            i.worst
                .map_or("–".to_owned(), |w| with_unit(w.error.abs()))
                .into(),
            Cell::number(i.worst.and_then(|w| w.nees)),
        ]);
    }
    (!sums.is_empty()).then_some(table)
}
