//! `monorig compare`: estimators side by side on the same runs, or two runs signal by signal.

mod runs;

use crate::arguments::{Changes, Jobs, Json, NamedEstimator, metric, named};
use crate::command::{Command, CommandOutcome, Program};
use crate::files::{csv, prepare, share};
use crate::identity::identity;
use crate::recording::many::all_of;
use crate::ui::errors::CliError;
use crate::ui::interrupt;
use crate::ui::output;
use crate::ui::prose::paragraph;
use crate::ui::tables::{TITLE, lines, markdown, narrow, number, right, shown, table};
use crate::ui::terminal;
use clap::CommandFactory;
use comfy_table::Table;
use monorig_lab::batch::{RunSpec, run_one};
use monorig_lab::metrics;
use monorig_lab::verdicts::compare::{
    ComparedMetric, Comparison, ErrorRatio, OnSamples, compare as cells, sentences, usual_metrics,
};
use monorig_lab::verdicts::interval::Interval;
use monorig_lab::verdicts::run_result::RunResult;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::file::Sets;
use monorig_sim::config::scenario::Scenario;
use monorig_sim::error::Error;
use serde_json::json;
use std::path::{Path, PathBuf};

const COMPARE_EXAMPLES: &str = "\
Examples:
  monorig compare scenarios/liu2023_section1.yaml \\
      --estimators dffrls_aekf_robust,rls_ekf,joint_ekf \\
      --seeds 1..50
  monorig compare scenarios/liu2023_section1.yaml \\
      --estimators dffrls_aekf_robust,tuned=dffrls_aekf_robust \\
      --set estimators.tuned.delta=0.9
  monorig compare scenarios/liu2023_section1.yaml \\
      --metrics mass_rmse_kg,slope_rmse_deg --csv table.csv
  monorig compare runs/minimal/1 new/minimal/1 --rtol 1e-6
      two runs signal by signal: exit code 1 if one differs by more
  monorig compare runs/minimal/1 new/minimal/1 --within-s 0.02 --markdown -
      the same for a pull request; a sample may be 0.02 s early or late

All estimators run in the same runs on the same measurements; `in_loop` stays
as in the scenario. Differences to the reference are computed run by run; for
errors only on the samples that both estimators mark valid.
After an error ± is twice the mean reported standard deviation, after a ratio
half of its 95 % interval (percentile bootstrap over seeds). Medians, intervals, shares of samples and published figures are in --csv and --json, and
`monorig report` makes a page of the JSON file.";

/// Compare estimators on the same runs, or two runs signal by signal.
#[derive(Debug, clap::Parser)]
#[command(name = "compare", after_help = COMPARE_EXAMPLES)]
pub struct CompareArgs {
    /// Scenario file, or the folders of two runs
    #[arg(required = true, num_args = 1..=2, value_name = "FILE|RUN RUN", value_parser = share::named())]
    pub paths: Vec<PathBuf>,
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = named, help = ESTIMATORS)]
    pub estimators: Vec<NamedEstimator>,
    #[command(flatten)]
    pub changes: Changes,
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = metric, help = METRICS)]
    pub metrics: Vec<String>,
    /// Estimator to compare the others with; without this option the first
    #[arg(long, value_name = "NAME")]
    pub reference: Option<String>,
    #[command(flatten)]
    pub jobs: Jobs,
    #[command(flatten)]
    pub json: Json,
    /// Write the table as CSV
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Write the table as Markdown for a pull request; `-` is standard output
    #[arg(long, value_name = "FILE")]
    pub markdown: Option<PathBuf>,
    #[command(flatten)]
    pub two: runs::TwoRuns,
}

/// Columns of the table as CSV.
const CSV_TITLES: &str = "estimator metric measured runs mean mean_low mean_high median valid_mean valid_share common_mean \
    common_share difference difference_low difference_high published source";

/// Help of `--metrics`.
const METRICS: &str = "Metrics to compare; without this option mass_rmse_kg, mass_error_converged_rel_max, slope_rmse_deg, slope_mae_deg, mass_misleading_share, \
     mass_overconfident_share, slope_misleading_share, slope_overconfident_share and, where the runs have a Cramér-Rao bound, slope_rmse_over_bound, effective_slope_rmse_over_bound, mass_rmse_over_bound";

/// Help of `--estimators`.
const ESTIMATORS: &str =
    "Estimators to compare, by name or as NAME=TYPE; without this option the scenario's";

/// Changes that add the missing estimators to the scenario. An estimator that the scenario has with another type is an
/// error.
fn additions(
    scenario: &Scenario,
    wanted: &[NamedEstimator],
) -> Result<Vec<(String, String)>, Error> {
    let mut changes = Vec::new();
    for NamedEstimator { name, is } in wanted {
        let Some(there) = scenario.file.estimators.get(name) else {
            changes.push((format!("estimators.{name}"), "{}".into()));
            if let Some(is) = is {
                changes.push((format!("estimators.{name}.is"), is.clone()));
            }
            continue;
        };
        let there = there.type_name(name);
        if is.as_ref().is_some_and(|is| is != there) {
            return Err(scenario.error(
                format!("estimators.{name}"),
                format!("`{name}` is {there} in this scenario"),
                "another name before the `=`",
            ));
        }
    }
    Ok(changes)
}

impl Command for CompareArgs {
    /// Adds the names of all estimators to the help.
    fn args(registry: &Registry) -> clap::Command {
        let names: Vec<&str> = registry.estimators().iter().map(|t| t.name()).collect();
        let long = format!("{ESTIMATORS}\n\nTypes: {}", names.join(", "));
        Self::command().mut_arg("estimators", |argument| argument.long_help(long))
    }

    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        let of_scenario = [
            !self.estimators.is_empty(),
            !self.changes.all().is_empty(),
            !self.metrics.is_empty(),
            self.reference.is_some(),
            self.csv.is_some(),
        ];
        let two = &self.two;
        let of_runs = two.html.is_some() || !two.signals.is_empty();
        let tolerances = [two.atol, two.rtol, two.within_s].iter().any(|x| *x > 0.0);
        match self.paths.as_slice() {
            [a, b] if of_scenario == [false; 5] => {
                runs::compare(two, [a, b], &self.json, self.markdown.as_deref())
            }
            [file] if !of_runs && !tolerances && !file.is_dir() => {
                compare(self, file, program.registry)
            }
            [_] => Err(CliError::refused(
                "a folder, tolerances, --signals and --html need two runs, but only one path is given",
                "monorig compare RUN RUN: two folders that `monorig run` has written",
            )),
            _ => Err(CliError::refused(
                "--estimators, --seeds, --set, --metrics, --reference and --csv need a scenario, but two paths are given",
                "use monorig compare FILE for estimators; --signals and tolerances for two runs",
            )),
        }
    }
}

/// Run a scenario over its seeds with all estimators side by side, and print their metrics beside each other.
fn compare(
    task: &CompareArgs,
    file: &Path,
    registry: &Registry,
) -> Result<CommandOutcome, CliError> {
    let mut overrides = additions(&Scenario::load(file, &[])?, &task.estimators)?;
    overrides.extend(task.changes.all());
    let simulation = prepare::simulation(file, &overrides, registry)?;
    let scenario = &simulation.scenario;
    let shown: Vec<String> = match task.estimators.as_slice() {
        [] => scenario.file.estimators.keys().cloned().collect(),
        named => named.iter().map(|e| e.name.clone()).collect(),
    };
    let reference = task.reference.clone().or_else(|| shown.first().cloned());
    let reference = reference
        .filter(|name| shown.contains(name))
        .ok_or_else(|| {
            scenario.error(
                "estimators",
                "the comparison has no estimator of this name",
                format!("use --reference with one of: {}", shown.join(", ")),
            )
        })?;
    output::begin()?;
    scenario.inputs().seal();
    let runs = run(task, file, &overrides, scenario, &reference, registry)?;
    let metrics = match task.metrics.as_slice() {
        [] => usual_metrics(&runs),
        asked => asked.to_vec(),
    };
    let cells = cells(
        &runs,
        &shown,
        &metrics,
        &reference,
        &scenario.file.published,
    );
    let sentences = sentences(&runs, &shown, &metrics, &reference);
    task.json.write(|| {
        let all = Comparison {
            version: 1,
            kind: "compare".into(),
            monorig: identity().to_string(),
            scenario: scenario.name.clone(),
            estimators: scenario.file.estimators.clone(),
            reference: reference.clone(),
            table: cells.clone(),
            runs: runs.clone(),
        };
        json!(all)
    })?;
    if let Some(path) = &task.csv {
        output::write(path, &csv_text(&cells)?)?;
    }
    let unfinished: Vec<&RunResult> = runs.iter().filter(|r| !r.finished()).collect();
    let mut parts = Vec::new();
    let asked = match task.metrics.as_slice() {
        [] => MAIN.map(str::to_owned).to_vec(),
        asked => asked.to_vec(),
    };
    let overview = |width| overview(&runs, &cells, &asked, &shown, &reference, width);
    let tables: Vec<String> = overview(usize::from(terminal::width()))
        .iter()
        .map(lines)
        .collect();
    parts.push(tables.join("\n\n"));
    let mut end: Vec<String> = Vec::new();
    end.extend(unfinished.iter().map(|run| {
        let why = run.error.as_deref().unwrap_or("the run did not finish");
        format!("seed {} is left out: {why}", run.seed)
    }));
    end.extend(sentences);
    if !unfinished.is_empty() {
        end.push(format!(
            "FAILED: {} of {} runs did not finish",
            unfinished.len(),
            runs.len()
        ));
    }
    if let Some(path) = &task.markdown {
        let mut text: Vec<String> = overview(usize::MAX).into_iter().map(markdown).collect();
        text.push(end.join("  \n"));
        output::write(path, &(text.join("\n\n") + "\n"))?;
    }
    let end: Vec<String> = end.iter().map(|line| paragraph(line, "")).collect();
    parts.push(end.join("\n"));
    let programs = [
        task.json.path(),
        task.csv.as_deref(),
        task.markdown.as_deref(),
    ];
    output::result(&(parts.join("\n\n") + "\n"), &programs)?;
    Ok(CommandOutcome::of(unfinished.is_empty()))
}

fn run(
    task: &CompareArgs,
    file: &Path,
    overrides: &[(String, String)],
    scenario: &Scenario,
    reference: &str,
    registry: &Registry,
) -> Result<Vec<RunResult>, CliError> {
    let (changes, reference) = (Sets::new(overrides), Some(reference.to_owned()));
    let specs = scenario
        .seeds()
        .iter()
        .enumerate()
        .map(|(index, seed)| RunSpec {
            reference: reference.clone(),
            ..RunSpec::new(
                index as u64,
                file,
                *seed,
                changes.clone(),
                scenario.inputs(),
            )
        });
    let work = |spec: RunSpec| run_one(&spec, registry, &interrupt::go_on);
    all_of(&scenario.name, task.jobs, specs, work)
}

/// Metrics of the overview unless the user asks for others.
const MAIN: [&str; 2] = ["mass_rmse_kg", "slope_rmse_deg"];
/// Metrics whose largest value is the share of misleading values of an estimator.
const MISLEADING: [&str; 3] = [
    "mass_misleading_share",
    "slope_misleading_share",
    "effective_slope_misleading_share",
];
/// Columns of the standard deviation beside an error, such as ` ± 0.456`.
const TOLD: usize = 8;
/// Columns of a multiple, such as `0.16 ± 0.02`.
const MULTIPLE: usize = 11;

/// A row for each estimator: the means of these metrics, each error also as a multiple of the reference's error on the
/// samples that both mark valid. Columns that do not fit into `width` stand in further tables.
fn overview(
    runs: &[RunResult],
    cells: &[ComparedMetric],
    metrics: &[String],
    estimators: &[String],
    reference: &str,
    width: usize,
) -> Vec<Table> {
    let of = |estimator: &str, metric: &str| {
        let mut all = cells.iter();
        let of = all.find(|c| c.estimator == estimator && c.metric == metric)?;
        of.mean.map(|i| i.mean).or(of.median)
    };
    let is_error = |metric: &str| {
        let mut all = cells.iter();
        all.any(|c| c.metric == metric && c.valid.is_some())
    };
    // what misleads stands beside whatever is compared
    let mean = |estimator: &str, metric: &str| {
        let of = runs.iter().filter_map(|run| {
            let summary = run.summary.as_ref().filter(|s| s.finished)?;
            summary.estimators.get(estimator)?.get(metric).copied()?
        });
        let all: Vec<f64> = of.collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    };
    let misleads = |estimator: &str| {
        let shares = MISLEADING
            .iter()
            .filter_map(|metric| mean(estimator, metric));
        shares.fold(None, |most: Option<f64>, x| {
            Some(most.map_or(x, |m| m.max(x)))
        })
    };
    let mark = |name: &str| {
        if name == reference {
            MARK.chars().count()
        } else {
            0
        }
    };
    let names = estimators
        .iter()
        .map(|name| name.chars().count() + mark(name));
    let name_width = names.max().unwrap_or(0) + 2;
    let room = width.saturating_sub(name_width + TITLE + 2);
    let width = |metric: &String| match is_error(metric) {
        true => TITLE + 2 + TOLD + MULTIPLE + 2,
        false => TITLE + 2,
    };
    let mut chunks: Vec<Vec<&String>> = Vec::new();
    let mut left = 0;
    for metric in metrics {
        match chunks.last_mut() {
            Some(chunk) if left >= width(metric) => chunk.push(metric),
            _ => {
                chunks.push(vec![metric]);
                left = room;
            }
        }
        left = left.saturating_sub(width(metric));
    }
    let runs_told = match runs.len() {
        1 => "one run".to_owned(),
        n => format!("means of\n{n} runs"),
    };
    let tables = chunks.iter().enumerate().map(|(i, chunk)| {
        let mut titles = vec![runs_told.clone()];
        for metric in chunk {
            titles.push(narrow(metric));
            titles.extend(is_error(metric).then(|| "ratio\nto ¹".to_owned()));
        }
        titles.extend((i == 0).then(|| "misled\n%".to_owned()));
        let columns = titles.len();
        let mut table = table(titles.iter().map(String::as_str));
        for name in estimators {
            let mut row = vec![match name == reference {
                true => format!("{name}{MARK}"),
                false => name.clone(),
            }];
            for metric in chunk {
                let sd = metrics::told_sd(metric).and_then(|sd| mean(name, sd));
                let told = sd.map_or(String::new(), |sd| format!(" ± {}", number(2.0 * sd)));
                row.push(shown(of(name, metric)) + &told);
                if is_error(metric) {
                    let ratio = match name == reference {
                        true => Some("1".to_owned()),
                        false => ErrorRatio::of(runs, name, metric).map(|r| r.words()),
                    };
                    row.push(ratio.unwrap_or_else(|| "-".to_owned()));
                }
            }
            if i == 0 {
                row.push(shown(misleads(name).map(|x| 100.0 * x)));
            }
            table.add_row(row);
        }
        right(&mut table, 1..columns);
        table
    });
    tables.collect()
}

/// The mark behind the reference.
const MARK: &str = " ¹";

/// The table as CSV: a row for each estimator and metric, an empty cell where there is no value.
fn csv_text(cells: &[ComparedMetric]) -> Result<String, CliError> {
    let one = |x: Option<f64>| x.map_or(String::new(), |x| x.to_string());
    let three =
        |i: Option<Interval>| [i.map(|i| i.mean), i.map(|i| i.low), i.map(|i| i.high)].map(one);
    let on = |of: Option<&OnSamples>| {
        let mean = of.and_then(|of| of.mean).map(|i| i.mean);
        [mean, of.and_then(|of| of.share)].map(one)
    };
    let rows = cells.iter().map(|c| {
        let mut row = vec![c.estimator.clone(), c.metric.clone()];
        row.extend([c.measured.to_string(), c.runs.to_string()]);
        row.extend(three(c.mean));
        row.push(one(c.median));
        row.extend(on(c.valid.as_ref()));
        row.extend(on(c.common.as_ref()));
        row.extend(three(c.difference));
        let published = c.published.as_ref();
        row.push(one(published.map(|p| p.value.get())));
        row.push(published.map_or(String::new(), |p| p.source.clone()));
        row
    });
    csv::text(&CSV_TITLES.split(' ').collect::<Vec<_>>(), rows)
}
