//! The report of many runs: scenarios over their seeds (`monorig test --json`), or a study with what varied in it.

mod drawn;
mod overview;
mod paired;
mod runs;
mod values;

use super::page::{Page, Section};
use crate::study::RunResult;
use crate::verdict::Judged;
use monorig_sim::error::{Error, InputError};
use monorig_sim::file::read_text;
use serde::Deserialize;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// The results of `monorig test --json`.
#[derive(Deserialize)]
struct Tested {
    version: u32,
    kind: String,
    monorig: String,
    scenarios: Vec<Judged>,
}

/// The first line of a study's results.
#[derive(Deserialize)]
struct Header {
    format: String,
    version: u32,
    study: String,
    runs: u64,
    monorig: String,
}

/// Read results and lay out their report.
pub fn page(path: &Path) -> Result<Page, Error> {
    let failed = |source| Error::Io {
        path: path.into(),
        source,
    };
    if !path.is_file() {
        read_text(path)?; // says what is there instead
    }
    let mut lines = BufReader::new(File::open(path).map_err(failed)?).split(b'\n');
    let first = lines
        .next()
        .transpose()
        .map_err(failed)?
        .unwrap_or_default();
    match serde_json::from_slice::<Header>(&first) {
        Ok(header) => {
            if (header.format.as_str(), header.version) != ("monorig study", 1) {
                let what = format!("version {} of `{}`", header.version, header.format);
                return Err(wrong(path, Some(1), what));
            }
            let mut runs: Vec<RunResult> = Vec::new();
            let mut lines = lines.zip(2..).peekable();
            while let Some((line, number)) = lines.next() {
                let line = line.map_err(failed)?;
                match serde_json::from_slice(&line) {
                    Ok(run) => runs.push(run),
                    // a study that goes on, or was killed, may end in the middle of a line
                    Err(_) if lines.peek().is_none() => {}
                    Err(e) => return Err(wrong(path, Some(number), e.to_string())),
                }
            }
            Ok(of_study(&header, runs))
        }
        Err(_) => {
            let tested: Tested = serde_json::from_str(&read_text(path)?)
                .map_err(|e| wrong(path, Some(e.line()), e.to_string()))?;
            if (tested.version, tested.kind.as_str()) != (1, "test") {
                let what = format!("version {} of kind `{}`", tested.version, tested.kind);
                return Err(wrong(path, None, what));
            }
            Ok(of_test(&tested))
        }
    }
}

fn wrong(path: &Path, line: Option<usize>, what: String) -> Error {
    InputError {
        file: path.into(),
        line,
        column: line.map(|_| 1),
        key: String::new(),
        message: format!("these are not the results of a test or a study: {what}"),
        help: "name the folder of a run, a file that `monorig test --json FILE` has written, or the results of a study"
            .into(),
    }
    .into()
}

fn of_test(tested: &Tested) -> Page {
    let all = &tested.scenarios;
    let runs: usize = all.iter().map(|s| s.runs.len()).sum();
    let failed = all.iter().filter(|s| !s.held).count();
    let mut page = Page::new("Scenarios tested");
    page.subtitle = format!(
        "{} scenarios, {runs} runs, monorig {}",
        all.len(),
        tested.monorig
    );
    page.banner = Some(match failed {
        0 => (format!("All {} scenarios held", all.len()), true),
        n => (format!("{n} of {} scenarios FAILED", all.len()), false),
    });
    page.sections.push(overview::section(all));
    for scenario in all {
        let section = Section::new(&scenario.scenario);
        let section = runs::verdicts(section, &scenario.checks);
        page.sections.push(runs::metrics(section, &scenario.runs));
    }
    page
}

fn of_study(header: &Header, runs: Vec<RunResult>) -> Page {
    let done = runs.len() as u64;
    let finished = runs.iter().filter(|r| r.finished()).count();
    let judged = Judged::new(&header.study, runs);
    let failed = judged.checks.iter().filter(|c| !c.held).count();
    let mut page = Page::new(format!("Study {}", header.study));
    page.subtitle = format!(
        "{done} of {} runs, {finished} of them finished, monorig {}",
        header.runs, header.monorig
    );
    page.banner = Some(match failed {
        0 => (
            format!("Every check held in {done} runs"),
            done == header.runs,
        ),
        n => (
            format!("{n} of {} checks FAILED", judged.checks.len()),
            false,
        ),
    });
    let section = Section::new("Verdicts");
    page.sections.push(runs::verdicts(section, &judged.checks));
    let section = Section::new("Metrics");
    page.sections.push(runs::metrics(section, &judged.runs));
    page.sections.extend(drawn::section(&judged.runs));
    page
}
