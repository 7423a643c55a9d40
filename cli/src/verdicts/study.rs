//! Results of a study over all its runs.

use crate::arguments::Json;
use crate::command::CommandOutcome;
use crate::ui::errors::CliError;
use crate::ui::output;
use crate::ui::prose::paragraph;
use crate::ui::tables::{grouped, narrow, shown};
use monorig_lab::campaign::{Campaign, CampaignKind, Rows};
use monorig_lab::text::quoted;
use monorig_lab::verdicts::judgement::Grade;
use monorig_lab::verdicts::run_result::RunResult;
use monorig_lab::verdicts::verdict::Tally;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Metrics printed of each estimator.
const SHOWN: &[&str] = &[
    "mass_rmse_kg",
    "mass_error_converged_rel_max",
    "slope_rmse_deg",
    "slope_error_p95_deg",
];

/// A metric of an estimator over the runs read so far.
struct Column {
    estimator: String,
    metric: &'static str,
    values: Vec<f64>,
}

/// Point of a grid of values.
struct GridPoint {
    values: BTreeMap<String, Value>,
    columns: Vec<Column>,
}

/// Columns with the grid point of a run.
fn at<'a>(
    points: &'a mut Vec<GridPoint>,
    swept: &[String],
    run: &RunResult,
) -> &'a mut Vec<Column> {
    let mut values = run.draws.clone();
    values.retain(|path, _| swept.contains(path));
    let known = points.iter().position(|point| point.values == values);
    let place = known.unwrap_or(points.len());
    if known.is_none() {
        let columns = Vec::new();
        points.push(GridPoint { values, columns });
    }
    &mut points[place].columns
}

/// The median over the seeds of each metric, by estimator and point of the grid.
fn over_grid(points: &[GridPoint], swept: &[String]) -> String {
    let names: Vec<&str> = swept
        .iter()
        .map(|path| path.rsplit_once('.').map_or(path.as_str(), |p| p.1))
        .collect();
    let mut titles = vec![format!("medians, over\n{}", names.join(", "))];
    titles.extend(SHOWN.iter().map(|metric| narrow(metric)));
    let titles: Vec<&str> = titles.iter().map(String::as_str).collect();
    let mut groups: Vec<(String, Vec<Vec<String>>)> = Vec::new();
    for point in points {
        let place = point.values.values().map(|value| match value.as_f64() {
            // six significant digits, without zeros behind them
            Some(x) => format!("{x:.5e}").parse().unwrap_or(x).to_string(),
            None => value.to_string(),
        });
        let place = place.collect::<Vec<_>>().join(", ");
        let estimators: BTreeSet<&String> = point.columns.iter().map(|c| &c.estimator).collect();
        for estimator in estimators {
            let of = |metric: &&str| {
                let mut all = point.columns.iter();
                let column = all.find(|c| c.estimator == *estimator && c.metric == *metric)?;
                column.quantiles()[1]
            };
            let values = SHOWN.iter().map(|metric| shown(of(metric)));
            let row = std::iter::once(place.clone()).chain(values).collect();
            match groups.iter_mut().find(|(name, _)| name == estimator) {
                Some((_, rows)) => rows.push(row),
                None => groups.push((estimator.clone(), vec![row])),
            }
        }
    }
    grouped(&titles, &groups)
}

/// Reads the results back and prints their summary.
pub(crate) fn print_results(path: &Path, json: &Json) -> Result<CommandOutcome, CliError> {
    let (mut tally, mut runs) = (Tally::default(), 0);
    let swept = Campaign::read(path)?.swept();
    let mut columns: Vec<Column> = Vec::new();
    let mut points: Vec<GridPoint> = Vec::new();
    for row in Rows::<RunResult>::open(path, &[CampaignKind::Study])? {
        let (_, result) = row?;
        runs += 1;
        tally.add(&result);
        for (name, values) in result.summary.iter().flat_map(|s| &s.estimators) {
            for metric in SHOWN {
                let value = values.get(*metric).copied().flatten();
                push(&mut columns, name, metric, value);
                if !swept.is_empty() {
                    push(at(&mut points, &swept, &result), name, metric, value);
                }
            }
        }
    }
    let (checks, judged) = (tally.checks(), tally.judgement());
    json.write(|| {
        json!({
            "version": 1,
            "kind": "study",
            "results": path,
            "runs": runs,
            "held": judged.grade() != Grade::Failed,
            "verdict": judged.words(),
            "checks": checks,
            "estimators": spreads(&columns),
            "points": points.iter().map(|p| json!({"values": p.values, "estimators": spreads(&p.columns)})).collect::<Vec<_>>(),
        })
    })?;
    let mut said: Vec<String> = Vec::new();
    let failing = checks.iter().filter(|c| !c.held);
    said.extend(failing.map(|c| format!("FAILED: {}", c.reason())));
    let open = checks.iter().filter(|c| c.not_judged);
    said.extend(open.map(|c| format!("not judged: {}", c.reason())));
    let known = checks.iter().filter(|c| c.fails_as_known());
    said.extend(known.map(|c| format!("known failure: {}", c.what)));
    let weakened: Vec<String> = tally.weakened().collect();
    if !weakened.is_empty() {
        said.push(format!("weakened limits: {}", weakened.join("; ")));
    }
    let file = quoted(&path.to_string_lossy());
    said.push(format!("report: monorig report {file}"));
    said.push(format!("{}, {runs} runs", judged.words()));
    let said: Vec<String> = said.iter().map(|line| paragraph(line, "")).collect();
    let table = match swept.is_empty() {
        true => spread(&columns, runs),
        false => over_grid(&points, &swept),
    };
    let text = format!("{table}\n\n{}\n", said.join("\n"));
    output::result(&text, &[json.path()])?;
    Ok(CommandOutcome::of(judged.grade() != Grade::Failed))
}

/// 5 %, median, 95 % and greatest value of each metric, by estimator.
fn spreads(columns: &[Column]) -> serde_json::Value {
    let mut all = serde_json::Map::new();
    for column in columns {
        let of = all
            .entry(column.estimator.clone())
            .or_insert_with(|| json!({}));
        let [low, median, high, worst] = column.quantiles();
        of[column.metric] = json!({
            "measured": column.values.len(), "p5": low, "median": median, "p95": high, "greatest": worst,
        });
    }
    all.into()
}

impl Column {
    fn quantiles(&self) -> [Option<f64>; 4] {
        let mut x = self.values.clone();
        x.sort_unstable_by(f64::total_cmp);
        [0.05, 0.5, 0.95, 1.0].map(|share: f64| {
            let place = (x.len().saturating_sub(1) as f64 * share).round() as usize;
            x.get(place).copied()
        })
    }
}

fn push(columns: &mut Vec<Column>, estimator: &str, metric: &'static str, value: Option<f64>) {
    let known = columns
        .iter()
        .position(|c| c.estimator == estimator && c.metric == metric);
    let place = known.unwrap_or_else(|| {
        columns.push(Column {
            estimator: estimator.to_owned(),
            metric,
            values: Vec::new(),
        });
        columns.len() - 1
    });
    if let (Some(column), Some(value)) = (columns.get_mut(place), value) {
        column.values.push(value);
    }
}

/// Median and tails of each column.
fn spread(columns: &[Column], runs: u64) -> String {
    let title = format!("over {runs} runs");
    let titles = [&title, "measured", "5 %", "median", "95 %", "worst"];
    let mut groups: Vec<(String, Vec<Vec<String>>)> = Vec::new();
    for column in columns {
        let mut row = vec![column.metric.to_owned(), column.values.len().to_string()];
        row.extend(column.quantiles().map(shown));
        match groups
            .iter_mut()
            .find(|(name, _)| *name == column.estimator)
        {
            Some((_, rows)) => rows.push(row),
            None => groups.push((column.estimator.clone(), vec![row])),
        }
    }
    grouped(&titles, &groups)
}
