//! Two folders of runs, compared signal by signal.

use crate::arguments::Json;
use crate::command::CommandOutcome;
use crate::files::report::of_pair;
use crate::ui::errors::CliError;
use crate::ui::output;
use crate::ui::prose::paragraph;
use crate::ui::tables::{grouped, markdown, right, shown, table};
use crate::ui::terminal;
use monorig_lab::reports::pair::Pair;
use monorig_lab::text::quoted;
use monorig_lab::verdicts::signals::{DifferentSignal, SignalComparison, SignalTolerance};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Largest number of differing signals that are shown; the others are counted.
const SHOWN: usize = 8;

/// Tolerances and results of a comparison of two runs.
#[derive(Clone, Debug, clap::Args)]
pub struct TwoRuns {
    /// Two runs: largest difference that is allowed, in the unit of the signal
    #[arg(long, hide_short_help = true, value_name = "X", value_parser = tolerance, default_value = "0")]
    pub atol: f64,
    /// Two runs: the same as a share of the value in the first run
    #[arg(long, hide_short_help = true, value_name = "X", value_parser = tolerance, default_value = "0")]
    pub rtol: f64,
    /// Two runs: a sample may come this much earlier or later in the second run, s
    #[arg(long, hide_short_help = true, value_name = "S", value_parser = tolerance, default_value = "0")]
    pub within_s: f64,
    /// Two runs: compare only signals with one of these texts in their names
    #[arg(
        long,
        hide_short_help = true,
        value_name = "TEXTS",
        value_delimiter = ','
    )]
    pub signals: Vec<String>,
    /// Two runs: write a page with plots of the signals that differ most
    #[arg(long, hide_short_help = true, value_name = "FILE")]
    pub html: Option<PathBuf>,
}

/// Reads a tolerance: a number, zero or above.
fn tolerance(text: &str) -> Result<f64, String> {
    let number = text
        .parse()
        .ok()
        .filter(|x: &f64| x.is_finite() && *x >= 0.0);
    number.ok_or_else(|| "write a number, zero or above".to_owned())
}

/// Compares the runs in two folders; the comparison fails if a sample lies beyond the tolerance.
pub(super) fn compare(
    two: &TwoRuns,
    [a, b]: [&Path; 2],
    json: &Json,
    pull_request: Option<&Path>,
) -> Result<CommandOutcome, CliError> {
    let tolerance = SignalTolerance {
        absolute: two.atol,
        relative: two.rtol,
        time_s: two.within_s,
    };
    let pair = Pair::read(a, b)?;
    let wanted =
        |name: &str| two.signals.is_empty() || two.signals.iter().any(|text| name.contains(text));
    let found = pair.signals(tolerance, wanted)?;
    if found.signals == 0 {
        let message = format!(
            "no signal of both runs has {} in its name",
            two.signals.join(" or ")
        );
        let help = "the names are those of the columns of channels.parquet, such as truth/speed";
        return Err(CliError::refused(message, help));
    }
    output::begin()?;
    json.write(|| {
        json!({
            "version": 1, "kind": "compare_runs", "runs": [a, b], "made_from": pair.sentence(),
            "held": found.held(), "verdict": found.sentence(), "signals": found,
        })
    })?;
    if let Some(path) = &two.html {
        output::write(path, &of_pair(&pair, [a, b], path, &found)?)?;
    }
    if let Some(path) = pull_request {
        output::write(path, &for_pull_request(&pair, &found))?;
    }
    let mut parts = vec![paragraph(&format!("{}.", pair.sentence()), "")];
    let most = if terminal::verbose() {
        usize::MAX
    } else {
        SHOWN
    };
    if !found.differ.is_empty() {
        let shown = found.differ.iter().take(most).cloned();
        let more = found.differ.len().saturating_sub(most);
        let more = (more > 0).then(|| format!("\n … and {more} more signals: -v"));
        parts.push(for_terminal(&shown.collect::<Vec<_>>()) + &more.unwrap_or_default());
    }
    for (letter, only) in ["A", "B"]
        .iter()
        .zip(&found.only)
        .filter(|(_, o)| !o.is_empty())
    {
        parts.push(paragraph(
            &format!("only in {letter}: {}", only.join(", ")),
            "",
        ));
    }
    let [a, b] = [a, b].map(|folder| quoted(&folder.to_string_lossy()));
    let report = (!found.held()).then(|| format!("plots: monorig report {a} {b}\n"));
    parts.push(report.unwrap_or_default() + &paragraph(&found.sentence(), ""));
    let programs = [json.path(), pull_request];
    output::result(&(parts.join("\n\n") + "\n"), &programs)?;
    Ok(CommandOutcome::of(found.held()))
}

const TITLES: [&str; 4] = ["A then", "B then", "largest", "samples"];

/// The first sample of a signal that differs, the largest difference, and the number of samples.
fn cells(signal: &DifferentSignal) -> [String; 5] {
    let [a, b] = signal.first;
    let [a, b, largest] = [a, b, signal.largest].map(|x| shown(Some(x).filter(|x| x.is_finite())));
    let first = format!("from {:.2} s on", signal.first_s);
    [first, a, b, largest, signal.beyond.to_string()]
}

/// A line for the name of each signal and a line for its numbers, so that long names fit a terminal.
fn for_terminal(of: &[DifferentSignal]) -> String {
    let titles: Vec<&str> = std::iter::once("differ").chain(TITLES).collect();
    let groups = of
        .iter()
        .map(|one| (one.name.clone(), vec![cells(one).to_vec()]));
    grouped(&titles, &groups.collect::<Vec<_>>())
}

/// The table of the signals as Markdown.
fn for_markdown(of: &[DifferentSignal]) -> String {
    let mut table = table(["signal", "differs"].into_iter().chain(TITLES));
    for signal in of {
        table.add_row(std::iter::once(signal.name.clone()).chain(cells(signal)));
    }
    right(&mut table, 2..6);
    markdown(table)
}

/// The comparison for a pull request: the outcome, the first signals, and the others folded.
fn for_pull_request(pair: &Pair, found: &SignalComparison) -> String {
    let mut parts = vec![
        format!("**{}**", found.sentence()),
        format!("{}.", pair.sentence()),
    ];
    let (open, folded) = found.differ.split_at(found.differ.len().min(SHOWN));
    if !open.is_empty() {
        parts.push(for_markdown(open));
    }
    if !folded.is_empty() {
        let rest = for_markdown(folded);
        let n = folded.len();
        parts.push(format!(
            "<details><summary>{n} more signals</summary>\n\n{rest}\n\n</details>"
        ));
    }
    parts.join("\n\n") + "\n"
}
