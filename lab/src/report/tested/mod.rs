//! The report of a test: scenarios over their seeds, from the results of `monorig test --json`.

mod overview;
mod scenario;
mod values;

use super::page::Page;
use crate::verdict::Judged;
use monorig_sim::error::Error;
use monorig_sim::file::{input_error, read_text};
use serde::Deserialize;
use std::path::Path;

/// The results of `monorig test --json`.
#[derive(Deserialize)]
struct Tested {
    version: u32,
    kind: String,
    monorig: String,
    scenarios: Vec<Judged>,
}

/// Read results and lay out their report.
pub fn page(path: &Path) -> Result<Page, Error> {
    let wrong = |what: String| {
        input_error(
            path,
            "",
            format!("these are not the results of a test: {what}"),
            "name the folder of a run, or a file that `monorig test --json FILE` has written",
        )
    };
    let tested: Tested =
        serde_json::from_str(&read_text(path)?).map_err(|e| wrong(e.to_string()))?;
    if (tested.version, tested.kind.as_str()) != (1, "test") {
        return Err(wrong(format!(
            "version {} of kind `{}`",
            tested.version, tested.kind
        )));
    }
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
    page.sections.extend(all.iter().map(scenario::section));
    Ok(page)
}
