//! `monorig report`: write results as an HTML file to read and to pass on.

mod view;
mod web_viewer;

use crate::command::{Command, CommandOutcome, Program};
use crate::files::report::{link, of_pair};
use crate::files::results;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::output;
use monorig_lab::reports::pair::Pair;
use monorig_lab::reports::{run, study};
use monorig_lab::verdicts::signals::SignalTolerance;
use monorig_sim::config::file::{input_error, read_large, regular};
use monorig_sim::record::manifest::Manifest;
use std::path::{Path, PathBuf};
use view::Recording;

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
each scenario in the folder verdicts. The results of a study have a report too:
runs/vehicle_test_spread/results.jsonl; `monorig tune` writes its own
report. A report is one file that needs nothing else: open it in any browser,
offline, on a phone or on paper. With --view it is a page with the Rerun viewer
and the recordings inside, runs/minimal/1/view.html, for a current browser on a
computer; the viewer is taken from the Python package rerun-sdk, which must be
installed.";

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
    /// Write a page with the Rerun viewer and the recordings instead
    #[arg(long)]
    pub view: bool,
    /// Take the viewer from this program `rerun` instead of the installed one
    #[arg(long, value_name = "FILE", requires = "view")]
    pub viewer: Option<PathBuf>,
}

impl Command for ReportArgs {
    fn run(&self, _: &Program<'_>) -> Result<CommandOutcome, CliError> {
        report(self)
    }
}

/// Writes a report. The exit code is 0 once the report is written, even if an expectation of the run failed.
fn report(task: &ReportArgs) -> Result<CommandOutcome, CliError> {
    let (html, out) = match task.paths.as_slice() {
        _ if task.view => view(task)?,
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
            let name = format!("against_{}.html", recording_name(b)?);
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

/// Page with the viewer and the recordings of the runs, and the path of this page.
fn view(task: &ReportArgs) -> Result<(String, PathBuf), CliError> {
    let recordings = task.paths.iter().map(|folder| recording(folder));
    let recordings = recordings.collect::<Result<Vec<_>, CliError>>()?;
    if let [a, b] = recordings.as_slice()
        && a.name == b.name
    {
        return Err(CliError::Refused {
            message: format!(
                "both recordings are called {}: the viewer would show them as one recording",
                a.name
            ),
            help: "run one of them again with --name".into(),
        });
    }
    let names: Vec<&str> = recordings.iter().map(|r| r.name.as_str()).collect();
    let file = match names.as_slice() {
        [_, b] => format!("against_{b}_view.html"),
        _ => "view.html".into(),
    };
    let beside = task.paths.first().map(|run| run.join(file));
    let out = task.out.clone().or(beside).unwrap_or_default();
    let viewer = web_viewer::find(task.viewer.as_deref())?;
    let page = view::page(&names.join(" and "), &viewer, &recordings)?;
    Ok((page, out))
}

/// The recording of a run, as the run left it.
fn recording(run: &Path) -> Result<Recording, CliError> {
    let path = run.join("run.rrd");
    if !path.is_file() {
        let message = "this folder has no recording for the viewer (run.rrd)";
        let help = "use the folder of a run made by a `monorig` with the viewer built in, without --no-rerun";
        return Err(CliError::Sim(input_error(run, "", message, help)));
    }
    regular(&path)?;
    results::verify(&path)?;
    let bytes = read_large(&path)?;
    Ok(Recording {
        name: recording_name(run)?,
        bytes,
    })
}

/// Name of the recording of a run: scenario with variant, and seed.
fn recording_name(run: &Path) -> Result<String, CliError> {
    let manifest = Manifest::of_run(run)?;
    Ok(format!("{}-{}", manifest.scenario, manifest.seed))
}

/// Folder of a file.
fn folder_of(file: &Path) -> &Path {
    file.parent().unwrap_or(Path::new(""))
}
