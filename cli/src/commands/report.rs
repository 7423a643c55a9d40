//! `monorig report`: what was run, as an HTML file to read and to hand on.

use crate::CommandOutcome;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::output;
use monorig_lab::report::{run, study};
use std::path::{Component, Path, PathBuf};

const REPORT_EXAMPLES: &str = "\
Examples:
  monorig run scenarios/minimal.yaml                     leaves the folder runs/minimal/1
  monorig report runs/minimal/1                          writes runs/minimal/1/report.html
  monorig test scenarios/minimal.yaml --json out/verdicts.json
  monorig report out/verdicts.json                       writes out/verdicts.html
  monorig compare scenarios/minimal.yaml --seeds 1..5 --json out/compared.json
  monorig report out/compared.json                       writes out/compared.html

In the same way the results of a study, such as runs/vehicle_test_spread/results.jsonl; `monorig tune` writes its report by itself.
The report is one file that needs nothing else: open it in any browser, offline, on a phone or on paper.";

/// `monorig report`
#[derive(Debug, clap::Args)]
#[command(after_help = REPORT_EXAMPLES)]
pub struct ReportArgs {
    /// Folder of a run, results of `monorig test --json`, of `monorig compare --json`, or of a study
    pub path: PathBuf,
    /// Write the report here instead of into or beside what it is about
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// Write a report. Its exit code says whether it could be written, not whether what it is about held.
pub fn report(task: &ReportArgs) -> Result<CommandOutcome, CliError> {
    let path = &task.path;
    let (page, out) = if path.is_dir() {
        let out = task.out.clone().unwrap_or(path.join("report.html"));
        let folder = out.parent().unwrap_or(Path::new(""));
        (run::page(path, &link(folder, path))?, out)
    } else {
        let out = task.out.clone().unwrap_or(path.with_extension("html"));
        (study::page(path)?, out)
    };
    output::write(&out, &page.to_html())?;
    note(&format!("report in {}", out.display()));
    Ok(CommandOutcome::Held)
}

/// Write the report of a run into its folder; returns where it is.
pub fn of_run(folder: &Path) -> Result<PathBuf, CliError> {
    let out = folder.join("report.html");
    output::write(&out, &run::page(folder, &link(folder, folder))?.to_html())?;
    Ok(out)
}

/// How a file in one folder names another folder: empty if they are the same, else with a slash at its end.
fn link(from: &Path, to: &Path) -> String {
    let (from, to) = (absolute(from), absolute(to));
    let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let up = from.iter().skip(common).map(|_| "..".to_owned());
    let down = to.iter().skip(common).cloned();
    up.chain(down).map(|part| part + "/").collect()
}

/// How a file in a folder names another file; both absolute.
pub fn relative(folder: &Path, file: &Path) -> String {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    link(folder, file.parent().unwrap_or(Path::new("/"))) + &name
}

/// Names of the folders from the root on, links followed as far as the folder exists.
fn absolute(path: &Path) -> Vec<String> {
    let path = match path.as_os_str().is_empty() {
        true => Path::new("."),
        false => path,
    };
    let full: PathBuf = path
        .canonicalize()
        .or_else(|_| std::path::absolute(path))
        .unwrap_or(path.into());
    let parts = full.components().filter(|c| *c != Component::CurDir);
    parts
        .map(|c| c.as_os_str().to_string_lossy().into_owned())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_lead_from_the_report_to_the_run() {
        for (from, to, expected) in [
            ("runs/a/1", "runs/a/1", ""),
            ("", "runs/a/1", "runs/a/1/"),
            ("reports", "runs/a/1", "../runs/a/1/"),
            ("runs/a", "runs/a/1/", "1/"),
        ] {
            assert_eq!(
                link(Path::new(from), Path::new(to)),
                expected,
                "{from} {to}"
            );
        }
    }
}
