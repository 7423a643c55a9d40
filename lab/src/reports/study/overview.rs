//! Verdicts over scenarios and seeds.

use crate::reports::page::Section;
use crate::reports::table::{Cell, Table};
use crate::verdicts::judgement::Grade;
use crate::verdicts::verdict::ScenarioVerdict;

/// Largest number of characters of a failure; the page of the scenario has the full text.
const SHOWN: usize = 400;

/// A row for each scenario: failed scenarios first, then scenarios with known failures or other exceptions. `links`
/// lead to their pages; empty without any.
pub(crate) fn section(all: &[ScenarioVerdict], links: &[String]) -> Section {
    let mut table = Table::new(&["", "scenario", "what failed"], &["seeds", "checks held"]);
    let mut rows: Vec<(usize, &ScenarioVerdict)> = all.iter().enumerate().collect();
    rows.sort_by_key(|(_, scenario)| match scenario.judgement().grade() {
        Grade::Failed => 0,
        Grade::HeldBut => 1,
        Grade::Unasked => 2,
        Grade::Held => 3,
    });
    for (i, scenario) in rows {
        let judged = scenario.judgement();
        let failed = scenario.checks.iter().filter(|c| !c.held);
        let reasons: Vec<String> = failed.map(|c| c.reason()).collect();
        let mut reasons = reasons.join("; ");
        if reasons.chars().count() > SHOWN {
            reasons = reasons.chars().take(SHOWN).chain(['…']).collect();
        }
        if !scenario.weakened.is_empty() {
            reasons += &format!(" [weakened limits: {}]", scenario.weakened.join("; "));
        }
        let name = Cell::from(scenario.scenario.clone());
        table.row([
            Cell::from(judged.word()).graded(judged.grade()),
            match links.get(i) {
                Some(to) => name.linked(to),
                None => name,
            },
            reasons.into(),
            scenario.runs.len().to_string().into(),
            format!(
                "{} of {}",
                judged.checks - judged.failed - judged.known,
                judged.checks
            )
            .into(),
        ]);
    }
    Section::new("Verdicts").table(table)
}
