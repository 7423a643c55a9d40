//! The worst runs of a study, each with the command that repeats it.

use crate::batch::StudyFile;
use crate::campaign::Campaign;
use crate::metrics::with_unit;
use crate::reports::page::Section;
use crate::reports::study::values::{estimators, value};
use crate::reports::table::{Cell, Table};
use crate::text::quoted;
use crate::verdicts::run_result::RunResult;

/// Errors by which runs are ranked.
const METRICS: [&str; 3] = [
    "mass_error_rel_max",
    "slope_rmse_deg",
    "effective_slope_rmse_deg",
];
/// Runs shown for each estimator and error.
const SHOWN: usize = 3;

/// A table of the worst runs; `None` if the campaign does not name the runs.
pub(crate) fn section(campaign: &Campaign, runs: &[RunResult]) -> Option<Section> {
    let study = campaign.resolved.get("study")?.clone();
    let study: StudyFile = serde_json::from_value(study).ok()?;
    let mut table = Table::new(&["estimator", "metric", "again with"], &["value", "seed"]);
    for estimator in estimators(runs) {
        for metric in METRICS {
            let of = |run| Some((value(run, Some(&estimator), metric)?, run));
            let mut all: Vec<(f64, &RunResult)> = runs.iter().filter_map(of).collect();
            all.sort_by(|a, b| b.0.total_cmp(&a.0));
            for (x, run) in all.into_iter().take(SHOWN) {
                table.row([
                    estimator.clone().into(),
                    with_unit(metric).into(),
                    command(&study, run).into(),
                    Cell::number(x),
                    run.seed.to_string().into(),
                ]);
            }
        }
    }
    if table.rows.is_empty() {
        return None;
    }
    Some(
        Section::new("Worst runs")
            .text("The runs with the largest errors. Start the commands in the folder of the study file.")
            .table(table),
    )
}

/// Command that repeats a run of a study, in the folder of the study file.
fn command(study: &StudyFile, run: &RunResult) -> String {
    let mut words = vec![format!(
        "monorig run {} --seed {}",
        quoted(&study.scenario),
        run.seed
    )];
    let fixed = study.set.iter();
    let drawn = study.vary.iter().flat_map(|vary| {
        let value = run.draws.get(&vary.path);
        vary.paths().filter_map(move |path| Some((path, value?)))
    });
    words.extend(fixed.chain(drawn).map(|(path, value)| {
        let value = match value {
            serde_json::Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        format!("--set {}", quoted(&format!("{path}={value}")))
    }));
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn the_command_has_everything_that_was_set_and_drawn() {
        let study = json!({
            "version": 1, "why": "w", "scenario": "../hill.yaml", "runs": 3, "set": {"stop.after_s": 20},
            "vary": [{"path": "load.mass_kg", "uniform": [0, 9]}, {"path": "drive.speed[1].mps", "also": ["a.b"], "uniform": [0, 9]}]
        });
        let run = json!({
            "index": 0, "scenario": "hill", "seed": 7, "draws": {"load.mass_kg": 4.5, "drive.speed[1].mps": 1.25}
        });
        let study: StudyFile = serde_json::from_value(study).unwrap();
        let run: RunResult = serde_json::from_value(run).unwrap();
        let expected = "monorig run ../hill.yaml --seed 7 --set stop.after_s=20 --set load.mass_kg=4.5 \
                        --set 'drive.speed[1].mps=1.25' --set a.b=1.25";
        assert_eq!(command(&study, &run), expected);
        assert_eq!(quoted("it's"), "'it'\\''s'");
    }
}
