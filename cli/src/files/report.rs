//! Reports of runs, and the links from a page to the files of a run.

use crate::ui::errors::CliError;
use crate::ui::output;
use monorig_lab::reports::pair::Pair;
use monorig_lab::reports::run;
use monorig_lab::verdicts::signals::SignalComparison;
use std::path::{Component, Path, PathBuf};

/// Writes the report of a run into its folder; returns the path of the report.
pub(crate) fn of_run(folder: &Path) -> Result<PathBuf, CliError> {
    let out = folder.join("report.html");
    output::write(&out, &run::page(folder, &link(folder, folder))?.to_html())?;
    Ok(out)
}

/// Report of two runs, with links relative to `out`.
pub(crate) fn of_pair(
    pair: &Pair,
    folders: [&Path; 2],
    out: &Path,
    signals: &SignalComparison,
) -> Result<String, CliError> {
    let from = out.parent().unwrap_or(Path::new(""));
    let [a, b] = folders.map(|run| link(from, run));
    Ok(pair.page([&a, &b], signals)?.to_html())
}

/// Relative path from one folder to another: empty if they are the same, else with a slash at its end.
pub(crate) fn link(from: &Path, to: &Path) -> String {
    let (from, to) = (absolute(from), absolute(to));
    let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let up = from.iter().skip(common).map(|_| "..".to_owned());
    let down = to.iter().skip(common).cloned();
    up.chain(down).map(|part| part + "/").collect()
}

/// Relative path from a folder to a file; both are given as absolute paths.
pub(crate) fn relative(folder: &Path, file: &Path) -> String {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    link(folder, file.parent().unwrap_or(Path::new("/"))) + &name
}

/// Names of the folders from the root on; links are followed as far as the folder exists.
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
