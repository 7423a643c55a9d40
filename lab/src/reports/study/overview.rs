//! Verdicts over scenarios and seeds.

use crate::reports::page::Section;
use crate::reports::table::{Cell, Table};
use crate::verdicts::verdict::ScenarioVerdict;

/// A row for each scenario, then what failed.
pub(crate) fn section(all: &[ScenarioVerdict]) -> Section {
    let mut table = Table::new(&["", "scenario", "what failed"], &["seeds", "checks held"]);
    for scenario in all {
        let held = scenario.checks.iter().filter(|c| c.held).count();
        let failed = scenario.checks.iter().filter(|c| !c.held);
        let reasons: Vec<String> = failed.map(|c| c.reason()).collect();
        let known = scenario
            .checks
            .iter()
            .filter(|c| c.fails_as_known())
            .count();
        let reasons = match (reasons.join("; "), known) {
            (text, 0) => text,
            (text, n) if text.is_empty() => format!("{n} known failures"),
            (text, n) => format!("{text}; {n} known failures"),
        };
        let reasons = match scenario.weakened.is_empty() {
            true => reasons,
            false => format!(
                "{reasons} [weakened limits: {}]",
                scenario.weakened.join("; ")
            ),
        };
        let verdict = Cell::from(scenario.word());
        table.row([
            verdict.judged(scenario.held),
            scenario.scenario.clone().into(),
            reasons.into(),
            scenario.runs.len().to_string().into(),
            format!("{} of {}", held - known, scenario.checks.len()).into(),
        ]);
    }
    Section::new("Verdicts").table(table)
}
