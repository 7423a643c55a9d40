//! Page of a stress battery: the matrix at a glance, then every figure of each quantity.

use crate::reports::page::{Page, Section};
use crate::reports::table::{Cell, Table};
use crate::stress::{DrawnSummary, Figures, MISLED, MatrixCell, StressFile};
use crate::verdicts::judgement::Grade;
use monorig_sim::config::scenario::IntegrityLimits;
use std::collections::BTreeSet;

/// Makes the page.
pub fn report(file: &StressFile) -> Page {
    let mut page = Page::new("Stress battery");
    let scenarios = file.scenarios.iter();
    let scenarios: Vec<String> = scenarios
        .map(|(name, seeds)| format!("{name} ({} seeds)", seeds.len()))
        .collect();
    page.subtitle = format!(
        "monorig {}; {}; {} runs",
        file.monorig,
        scenarios.join(", "),
        file.runs.len()
    );
    let most = IntegrityLimits::default().max_share;
    let bad = file.cells.iter().filter(|c| !c.is_good(most)).count();
    page.banner = Some((
        match bad {
            0 => "No cell has misleading samples.".to_owned(),
            n => format!("{n} of {} cells have misleading samples.", file.cells.len()),
        },
        match bad {
            0 => Grade::Held,
            _ => Grade::Failed,
        },
    ));
    page.sections
        .extend(file.summary.iter().map(|s| summary(file, s)));
    page.sections.push(glance(file, most));
    for (title, of) in [
        ("Mass", QuantityTable::of(|c| &c.mass, 100.0, "%")),
        ("Slope", QuantityTable::of(|c| &c.slope, 1.0, "°")),
        (
            "Effective slope",
            QuantityTable::of(|c| &c.effective_slope, 1.0, "°"),
        ),
    ] {
        page.sections
            .push(Section::new(title).table(of.table(file, most)));
    }
    page
}

/// Results over all drawn conditions, then by class.
fn summary(file: &StressFile, summary: &DrawnSummary) -> Section {
    let numbers = [
        "misleading, %",
        "overconfident, %",
        "beyond the limit, %",
        "valid, %",
        "misled in",
        "recovered after, median, s",
        "90 %, s",
    ];
    let share = |x: Option<f64>| Cell::number(x.map(|x| 100.0 * x));
    let mut table = Table::new(&["estimator"], &numbers);
    table.caption = format!(
        "The worst of mass, slope and effective slope; misled in: conditions with more than {} % of the valid samples",
        100.0 * MISLED
    );
    for e in &summary.estimators {
        let seconds = |s: Option<f64>| s.map_or(Cell::from("never"), Cell::number);
        table.row([
            e.all.estimator.as_str().into(),
            share(e.all.misled()),
            share(e.all.largest(|f| f.overconfident)),
            share(e.all.largest(|f| f.beyond)),
            share(e.all.least_valid()),
            format!("{} of {}", e.misled_in, e.conditions).into(),
            seconds(e.recovery_median_s),
            seconds(e.recovery_90_s),
        ]);
    }
    let mut section = Section::new("All conditions together").table(table);
    for (of, rows) in &summary.classes {
        let names = file.estimators.iter().map(String::as_str);
        let numbers: Vec<&str> = ["conditions"].into_iter().chain(names).collect();
        let mut table = Table::new(&[of.as_str()], &numbers);
        table.caption = format!("Misleading share of the valid samples, %, by {of}");
        for row in rows {
            let conditions = Cell::number(row.conditions as f64);
            let figures = row.misled.iter().map(|x| share(*x));
            let cells = [row.class.as_str().into(), conditions].into_iter();
            table.row(cells.chain(figures));
        }
        section = section.table(table);
    }
    section
}

/// Conditions in the order of their worst cell.
fn conditions(file: &StressFile) -> Vec<&str> {
    let mut seen = BTreeSet::new();
    let all = file.cells.iter().map(|c| c.condition.as_str());
    all.filter(|c| seen.insert(*c)).collect()
}

fn glance(file: &StressFile, most: f64) -> Section {
    let mut titles = vec!["condition", "description"];
    titles.extend(file.estimators.iter().map(String::as_str));
    let mut table = Table::new(&titles, &[]);
    table.caption = "Misleading share of the valid samples, %: mass / slope / effective slope; – if no sample is valid".into();
    let idle = file.idle();
    for condition in conditions(file) {
        let words = match idle.contains(&condition) {
            true => "not judged: the condition changes no input of an estimator",
            false => file.row(condition).map_or("", |r| r.words.as_str()),
        };
        let mut row: Vec<Cell> = vec![condition.into(), words.into()];
        for estimator in &file.estimators {
            let cell = find(file, condition, estimator);
            row.push(cell.map_or_else(
                || "–".into(),
                |c| {
                    let text = match c.broken {
                        0 => three(c, |f| percent(f.misleading)),
                        n => format!("{n} runs broke down"),
                    };
                    Cell::from(text).judged(c.is_good(most))
                },
            ));
        }
        table.row(row);
    }
    Section::new("At a glance").table(table)
}

fn find<'a>(file: &'a StressFile, condition: &str, estimator: &str) -> Option<&'a MatrixCell> {
    let mut all = file.cells.iter();
    all.find(|c| c.condition == condition && c.estimator == estimator)
}

/// A figure of the three quantities.
fn three(cell: &MatrixCell, of: impl Fn(&Figures) -> String) -> String {
    cell.quantities().map(of).join(" / ")
}

fn percent(share: Option<f64>) -> String {
    share.map_or("–".into(), |x| format!("{:.1}", 100.0 * x))
}

/// One quantity of all cells, and its shown unit.
struct QuantityTable {
    of: fn(&MatrixCell) -> &Figures,
    factor: f64,
    unit: &'static str,
}

impl QuantityTable {
    fn of(of: fn(&MatrixCell) -> &Figures, factor: f64, unit: &'static str) -> Self {
        Self { of, factor, unit }
    }

    fn table(&self, file: &StressFile, most: f64) -> Table {
        let error = format!("RMSE, {}", self.unit);
        let sd = format!("told sd, {}", self.unit);
        let numbers = [
            error.as_str(),
            &sd,
            "valid, %",
            "misleading, %",
            "overconfident, %",
            "beyond the limit, %",
            "recovered after, s",
        ];
        let mut table = Table::new(&["condition", "estimator"], &numbers);
        for cell in &file.cells {
            let f = (self.of)(cell);
            let number = |x: Option<f64>, factor: f64| Cell::number(x.map(|x| x * factor));
            let judged = |x: Option<f64>| {
                let shown = number(x, 100.0);
                match x {
                    Some(share) => shown.judged(share <= most),
                    None => shown,
                }
            };
            let recovery = f.recovery_s.map_or(Cell::from("never"), Cell::number);
            table.row([
                cell.condition.clone().into(),
                cell.estimator.clone().into(),
                number(f.error, self.factor),
                number(f.sd, self.factor),
                number(f.valid, 100.0),
                judged(f.misleading),
                judged(f.overconfident),
                number(f.beyond, 100.0),
                recovery,
            ]);
        }
        table
    }
}
