//! Results of many runs, read back.

use crate::batch::lines::Lines;
use crate::batch::{FORMAT, StudyHeader, StudyOfHeader, VERSION};
use crate::verdicts::compare::Comparison;
use crate::verdicts::run_result::RunResult;
use crate::verdicts::verdict::ScenarioVerdict;
use monorig_sim::config::file::read_result;
use monorig_sim::error::{Error, InputError};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::error::Category;
use std::path::Path;

/// Results, by who has written them.
pub(crate) enum Results {
    /// `monorig test --json`.
    Test(TestResults),
    /// `monorig compare --json`.
    Compare(Comparison),
    /// `monorig study`.
    Study(StudyHeader, Vec<RunResult>),
}

/// The results of `monorig test --json`.
#[derive(Deserialize)]
pub(crate) struct TestResults {
    /// Version of monorig.
    pub(crate) monorig: String,
    /// Every scenario and its runs.
    pub(crate) scenarios: Vec<ScenarioVerdict>,
}

/// The keys by which results that are one piece of JSON are distinguished.
#[derive(Deserialize)]
struct JsonHeader {
    version: u32,
    kind: String,
}

/// Read results of any kind.
pub(crate) fn read(path: &Path) -> Result<Results, Error> {
    // studies may be long: line by line
    let mut lines = Lines::open(path)?;
    let first = lines.next().and_then(Result::ok).unwrap_or_default();
    let Ok(header) = serde_json::from_str::<StudyHeader>(&first) else {
        return one_piece(path);
    };
    if (header.format.as_str(), header.version) != (FORMAT, VERSION) {
        let what = format!("version {} of `{}`", header.version, header.format);
        return Err(wrong(path, Some(1), what));
    }
    let study = StudyOfHeader::new(&header).map_err(|what| wrong(path, Some(1), what))?;
    let mut runs: Vec<RunResult> = Vec::new();
    let mut lines = lines.zip(2..).peekable();
    while let Some((line, number)) = lines.next() {
        let line = line?;
        match serde_json::from_str(&line) {
            Ok(run) => {
                let n = runs.len() as u64;
                let fits = study.check(n, &run);
                fits.map_err(|what| wrong(path, Some(number), what))?;
                runs.push(run);
            }
            // a study that goes on, or was killed, may end in the middle of a line
            Err(_) if lines.peek().is_none() => {}
            Err(e) => return Err(wrong(path, Some(number), e.to_string())),
        }
    }
    Ok(Results::Study(header, runs))
}

fn one_piece(path: &Path) -> Result<Results, Error> {
    let text = read_result(path)?;
    let kind: JsonHeader = parse(path, &text)?;
    match (kind.kind.as_str(), kind.version) {
        ("test", 1) => {
            let tested: TestResults = parse(path, &text)?;
            for verdict in &tested.scenarios {
                verdict.check().map_err(|what| wrong(path, None, what))?;
            }
            Ok(Results::Test(tested))
        }
        ("compare", 1) => Ok(Results::Compare(parse(path, &text)?)),
        (kind, version) => {
            let what = format!("version {version} of kind `{kind}`");
            Err(wrong(path, None, what))
        }
    }
}

fn parse<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, Error> {
    serde_json::from_str(text).map_err(|e| {
        // the place stands before the message already
        let message = e.to_string();
        let message = message.split(" at line ").next().unwrap_or(&message);
        let what = match e.classify() {
            Category::Data => message.to_owned(),
            _ => format!("it is no JSON ({message})"),
        };
        wrong(path, Some(e.line()), what)
    })
}

fn wrong(path: &Path, line: Option<usize>, what: String) -> Error {
    InputError {
        file: path.into(),
        line,
        column: line.map(|_| 1),
        key: String::new(),
        message: format!("a report cannot be made of this: {what}"),
        help: crate::reports::TAKES.into(),
    }
    .into()
}
