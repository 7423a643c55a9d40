//! Results of a tuning study as text.

use crate::ui::prose::paragraph;
use crate::ui::tables::{lines, number, right, table};
use crate::ui::terminal;
use monorig_lab::tuning::result::TuningResult;
use monorig_lab::tuning::study::TuningStudy;
use monorig_lab::tuning::validate::{PairedComparison, Validation};
use monorig_lab::verdicts::interval::Interval;
use monorig_sim::config::scenario::ParameterValue;
use serde_json::json;
use std::path::Path;

/// Writes the winner's parameters, and at the end the result of the validation.
pub fn text(study: &TuningStudy, result: &TuningResult, folder: &Path) -> String {
    let failed = result
        .search
        .trials
        .iter()
        .filter(|t| t.failed.is_some())
        .count();
    let broke = result
        .search
        .trials
        .iter()
        .filter(|t| t.violation > 0.0)
        .count();
    let trials = format!(
        "{} trials, of which {failed} failed and {broke} broke a constraint",
        result.search.trials.len()
    );
    let Some(validation) = &result.validation else {
        return format!(
            "{trials}\nFAILED: no winner: no trial could be measured and kept all constraints\n"
        );
    };
    let mut parts = vec![parameters(study, result)];
    if terminal::verbose() {
        parts.extend(validation.comparisons.iter().map(comparison));
    }
    let mut end = vec![trials, losses(validation)];
    end.extend(
        ends(study, result).map(|name| {
            format!("{name} is at the end of its range: a better value may lie beyond")
        }),
    );
    let report = folder.join("report.html");
    end.push(format!("report: {}", report.display()));
    end.push(validation.sentence(study));
    let end: Vec<String> = end.iter().map(|line| paragraph(line, "")).collect();
    parts.push(end.join("\n"));
    parts.join("\n\n") + "\n"
}

/// The result for programs.
pub fn json(study: &TuningStudy, result: &TuningResult, folder: &Path) -> serde_json::Value {
    let winner = result.best().map(|t| &t.parameters);
    let sentence = match &result.validation {
        Some(validation) => validation.sentence(study),
        None => "FAILED: no winner".to_owned(),
    };
    json!({
        "version": 1,
        "kind": "tune",
        "study": study.name,
        "folder": folder,
        "trials": result.search.trials.len(),
        "winner": winner,
        "at_end_of_range": ends(study, result).collect::<Vec<_>>(),
        "validation": result.validation,
        "verdict": sentence,
    })
}

/// Parameters whose winner lies at an end of its range.
fn ends<'a>(study: &'a TuningStudy, result: &'a TuningResult) -> impl Iterator<Item = &'a str> {
    let winner = result.best().into_iter().flat_map(|t| &t.parameters);
    winner
        .filter(|(name, x)| study.is_at_end(name, x))
        .map(|(name, _)| name.as_str())
}

fn parameters(study: &TuningStudy, result: &TuningResult) -> String {
    let mut table = table(["parameter", "default", "published", "winner"]);
    let defaults = study.defaults();
    let winner = result.best();
    for (name, x) in winner.iter().flat_map(|t| &t.parameters) {
        let text = |x: Option<&ParameterValue>| x.map_or("-".into(), |x| x.setting().to_string());
        table.add_row([
            name.clone(),
            text(defaults.get(name)),
            text(study.file.published.get(name)),
            text(Some(x)),
        ]);
    }
    right(&mut table, 1..=3);
    lines(&table)
}

fn losses(v: &Validation) -> String {
    let loss = |x: Option<f64>| x.map_or("not measured".to_owned(), number);
    format!(
        "loss (defaults = 1): {} in tuning, {} in validation",
        loss(v.tuning_loss),
        loss(v.validation_loss)
    )
}

fn comparison(c: &PairedComparison) -> String {
    let title = format!("against {}", c.against);
    let mut table = table([
        title.as_str(),
        "scenario",
        "winner",
        "other",
        "difference, 95 %",
    ]);
    for row in &c.rows {
        table.add_row([
            row.metric.clone(),
            row.scenario.clone(),
            number(row.winner),
            number(row.other),
            interval(&row.difference),
        ]);
    }
    right(&mut table, 2..=4);
    let all = c.loss.as_ref().map_or("not measured".to_owned(), interval);
    format!(
        "{}\nloss minus the loss of {}: {all}: {}",
        lines(&table),
        c.against,
        c.verdict.words()
    )
}

fn interval(i: &Interval) -> String {
    format!("{} [{}, {}]", number(i.mean), number(i.low), number(i.high))
}
