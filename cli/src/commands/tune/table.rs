//! Results of a tuning study as text.

use crate::ui::tables::{lines, number, right, table};
use monorig_lab::tuning::result::TuningResult;
use monorig_lab::tuning::study::TuningStudy;
use monorig_lab::tuning::validate::{PairedComparison, Validation};
use monorig_lab::verdicts::interval::Interval;
use monorig_sim::config::scenario::ParameterValue;

/// Writes the winner's parameters, then the figures of the validation.
pub fn text(study: &TuningStudy, result: &TuningResult) -> String {
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
        "{} trials, {failed} failed, {broke} broke a constraint",
        result.search.trials.len()
    );
    let Some(validation) = &result.validation else {
        return format!(
            "{trials}\nno winner: no trial could be measured and kept all constraints\n"
        );
    };
    let mut parts = vec![parameters(study, result), losses(validation)];
    parts.extend(validation.comparisons.iter().map(comparison));
    parts.push(trials);
    parts.join("\n\n") + "\n"
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
    let verdict = if v.generalises() {
        "the winner generalises: better than the defaults where nothing was tuned"
    } else {
        "THE WINNER DOES NOT GENERALISE: no better than the defaults where nothing was tuned"
    };
    format!(
        "loss (defaults = 1): {} in tuning, {} in validation\n{verdict}",
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
        "{}\nloss minus that of {}: {all}: {}",
        lines(&table),
        c.against,
        c.verdict.words()
    )
}

fn interval(i: &Interval) -> String {
    format!("{} [{}, {}]", number(i.mean), number(i.low), number(i.high))
}
