//! `monorig report`: write results as an HTML file to read and to pass on.

use crate::command::{Command, CommandOutcome, Program};
use crate::files::report::{link, of_pair};
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::output;
use monorig_lab::reports::pair::Pair;
use monorig_lab::reports::{run, study};
use monorig_lab::verdicts::signals::SignalTolerance;
use monorig_sim::record::manifest::Manifest;
use std::path::{Path, PathBuf};

const REPORT_EXAMPLES: &str = "\
Examples:
  monorig run scenarios/minimal.yaml   leaves the folder runs/minimal/1
  monorig report runs/minimal/1   writes runs/minimal/1/report.html
  monorig run scenarios/minimal.yaml --set load.mass_kg=5000 --name 5t
  monorig report runs/minimal/1 runs/minimal@5t/1
      two runs compared: runs/minimal/1/against_minimal@5t-1.html
  monorig test scenarios/minimal.yaml --json verdicts.json
  monorig report verdicts.json   writes verdicts.html
  monorig compare scenarios/minimal.yaml --seeds 1..5 --json compared.json
  monorig report compared.json   writes compared.html

Of a test of several scenarios verdicts.html is an index, with a page for
each scenario in the folder verdicts. In the same way the results of a study, such as
runs/vehicle_test_spread/results.jsonl; `monorig tune` writes its report by
itself. The report is one file that needs nothing else: open it in any browser,
offline, on a phone or on paper.";

/// Write a report as one HTML file.
#[derive(Debug, clap::Parser)]
#[command(name = "report", after_help = REPORT_EXAMPLES)]
pub struct ReportArgs {
    /// Folder of a run, or of two runs to compare; or results of `monorig test --json`, `monorig compare --json` or a
    /// study
    #[arg(required = true, num_args = 1..=2, value_name = "PATH")]
    pub paths: Vec<PathBuf>,
    /// Write the report here instead of beside the results
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

impl Command for ReportArgs {
    fn run(&self, _: &Program<'_>) -> Result<CommandOutcome, CliError> {
        report(self)
    }
}

/// Writes a report. The exit code is 0 once the report is written, even if an expectation of the run failed.
fn report(task: &ReportArgs) -> Result<CommandOutcome, CliError> {
    let (html, out) = match task.paths.as_slice() {
        [path] if path.is_dir() => {
            let out = task.out.clone().unwrap_or(path.join("report.html"));
            (
                run::page(path, &link(folder_of(&out), path))?.to_html(),
                out,
            )
        }
        [path] => {
            let out = task.out.clone().unwrap_or(path.with_extension("html"));
            let folder = out.with_extension("");
            let name = folder.file_name().unwrap_or_default().to_string_lossy();
            let (index, pages) = study::pages(path, &name)?;
            for (name, page) in pages {
                output::write_in(&folder, name, &page.to_html())?;
            }
            (index.to_html(), out)
        }
        [a, b, ..] => {
            let pair = Pair::read(a, b)?;
            let other = Manifest::of_run(b)?;
            let name = format!("against_{}-{}.html", other.scenario, other.seed);
            let out = task.out.clone().unwrap_or(a.join(name));
            let signals = pair.signals(SignalTolerance::default(), |_| true)?;
            (of_pair(&pair, [a, b], &out, &signals)?, out)
        }
        [] => return Ok(CommandOutcome::Held),
    };
    output::write(&out, &html)?;
    note(&format!("report in {}", out.display()));
    Ok(CommandOutcome::Held)
}

/// The folder that a file is in.
fn folder_of(file: &Path) -> &Path {
    file.parent().unwrap_or(Path::new(""))
}
