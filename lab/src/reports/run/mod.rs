//! The report of one run, from its folder.

mod about;
mod budget;
mod control;
pub(super) mod errors;
mod estimates;
mod integrity;
mod measured;
pub(super) mod recorded;
mod track;
pub(super) mod verdicts;

use crate::reports::page::{Page, Section};
use monorig_sim::error::Error;
use recorded::Recorded;
use std::path::Path;

/// Read the folder of a run and lay out its report. `link` leads from the report's folder to the run's: empty if they
/// are the same, else with a slash at its end.
pub fn page(folder: &Path, link: &str) -> Result<Page, Error> {
    let run = Recorded::read(folder)?;
    let summary = &run.summary;
    let replayed = run.is_replay();
    let mut page = Page::new(match replayed {
        true => format!("{}, replayed", summary.scenario),
        false => format!("{}, seed {}", summary.scenario, summary.seed),
    });
    page.subtitle = run.why().to_owned();
    page.banner = Some(verdicts::banner(summary));
    page.sections.extend(verdicts::failed(summary));
    let names = run.estimators().map(|(name, _)| name);
    let table = verdicts::overview(summary, names, run.in_loop());
    page.sections.extend(table);
    page.sections.extend(verdicts::findings(summary));
    page.sections.push(verdicts::section(summary, replayed));
    page.sections.push(estimates::section(&run)?);
    page.sections.push(errors::section(&run)?);
    page.sections.push(errors::consistency(&run)?);
    page.sections.push(integrity::section(&run)?);
    page.sections.extend(budget::section(&run)?);
    if replayed {
        page.sections.push(measured::section(&run)?);
    } else {
        page.sections.push(track::section(&run)?);
        page.sections.push(control::section(&run)?);
    }
    page.sections.push(about::section(&run, link));
    if replayed {
        // of a log much is not known, and a box without a curve says nothing
        page.sections
            .iter_mut()
            .for_each(Section::drop_empty_figures);
    }
    Ok(page)
}
