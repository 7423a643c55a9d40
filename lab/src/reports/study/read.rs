//! Results of many runs, read back.

use crate::batch::judged;
use crate::campaign::{self, Campaign, CampaignKind, Rows};
use crate::verdicts::compare::Comparison;
use crate::verdicts::run_result::RunResult;
use crate::verdicts::verdict::ScenarioVerdict;
use monorig_sim::config::file::read_result;
use monorig_sim::error::Error;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::error::Category;
use std::path::Path;

/// Results, by the command that wrote them.
pub(crate) enum Results {
    /// `monorig test --json`.
    Test(TestResults),
    /// `monorig compare --json`.
    Compare(Comparison),
    /// `monorig study`.
    Study(Campaign, Vec<RunResult>),
}

/// The results of `monorig test --json`.
#[derive(Deserialize)]
pub(crate) struct TestResults {
    /// Version of monorig.
    pub(crate) monorig: String,
    /// Every scenario and its runs.
    pub(crate) scenarios: Vec<ScenarioVerdict>,
}

/// Keys that distinguish results in one piece of JSON.
#[derive(Deserialize)]
struct JsonHeader {
    version: u32,
    kind: String,
}

/// Read results of any kind.
pub(crate) fn read(path: &Path) -> Result<Results, Error> {
    // studies may be long: line by line
    let Ok(campaign) = Campaign::read(path) else {
        return one_piece(path);
    };
    let rows = Rows::open(path, &[CampaignKind::Study, CampaignKind::Test])?;
    Ok(match campaign.kind {
        CampaignKind::Test => Results::Test(TestResults {
            monorig: campaign.monorig.to_string(),
            scenarios: judged(&campaign, rows)?,
        }),
        _ => {
            let runs: Result<Vec<RunResult>, Error> = rows.map(|row| Ok(row?.1)).collect();
            Results::Study(campaign, runs?)
        }
    })
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
            _ => format!("it is not JSON ({message})"),
        };
        wrong(path, Some(e.line()), what)
    })
}

fn wrong(path: &Path, line: Option<usize>, what: String) -> Error {
    let message = format!("monorig cannot make a report from this file: {what}");
    campaign::wrong(path, line, message, crate::reports::TAKES)
}
