//! The report of one run, from its folder.

mod about;
mod budget;
mod control;
pub(super) mod errors;
mod estimates;
mod ghost;
mod integrity;
pub(super) mod recorded;
mod track;
pub(super) mod verdicts;

use crate::reports::page::Page;
use monorig_sim::error::Error;
use recorded::Recorded;
use std::path::Path;

/// Read the folder of a run and lay out its report. `link` leads from the report's folder to the run's: empty if they
/// are the same, else with a slash at its end.
pub fn page(folder: &Path, link: &str) -> Result<Page, Error> {
    let run = Recorded::read(folder)?;
    let summary = &run.summary;
    let mut page = Page::new(format!("{}, seed {}", summary.scenario, summary.seed));
    page.subtitle = run.why().to_owned();
    page.banner = Some(verdicts::banner(summary));
    page.sections.extend(verdicts::findings(summary));
    page.sections.push(verdicts::section(summary));
    page.sections.push(estimates::section(&run)?);
    page.sections.push(errors::section(&run)?);
    page.sections.push(errors::consistency(&run)?);
    page.sections.push(integrity::section(&run)?);
    page.sections.extend(budget::section(&run)?);
    page.sections.push(track::section(&run)?);
    page.sections.push(control::section(&run)?);
    page.sections.extend(ghost::section(&run)?);
    page.sections.push(about::section(&run, link));
    Ok(page)
}
