//! The report of many runs: scenarios over their seeds (`monorig test --json`), estimators side by side (`monorig
//! compare --json`), or a study with what varied in it.

mod comparison;
mod drawn;
mod expected;
mod overview;
mod paired;
mod ranks;
mod read;
mod runs;
mod values;
mod worst;

use crate::batch::StudyHeader;
use crate::reports::findings;
use crate::reports::page::{Page, Section};
use crate::verdicts::findings::Finding;
use crate::verdicts::run_result::RunResult;
use crate::verdicts::verdict::ScenarioVerdict;
use monorig_sim::error::Error;
use read::{Results, TestResults};
use std::path::Path;

/// Read results and lay out their report.
pub fn page(path: &Path) -> Result<Page, Error> {
    Ok(match read::read(path)? {
        Results::Test(tested) => of_test(&tested),
        Results::Compare(comparison) => comparison::page(&comparison),
        Results::Study(header, runs) => of_study(&header, runs),
    })
}

fn of_test(tested: &TestResults) -> Page {
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
    let findings = all.iter().flat_map(|s| {
        let of = s.findings().into_iter();
        of.map(|f| (s.scenario.clone(), f))
    });
    page.sections.extend(worst_first(findings.collect()));
    page.sections.push(overview::section(all));
    for scenario in all {
        let section = Section::new(&scenario.scenario);
        let section = runs::verdicts(section, &scenario.checks, &scenario.runs);
        let section = runs::integrity(section, &scenario.runs);
        page.sections.push(runs::metrics(section, &scenario.runs));
    }
    page
}

fn of_study(header: &StudyHeader, runs: Vec<RunResult>) -> Page {
    let done = runs.len() as u64;
    let finished = runs.iter().filter(|r| r.finished()).count();
    let judged = ScenarioVerdict::new(&header.study, runs);
    let failed = judged.checks.iter().filter(|c| !c.held).count();
    let mut page = Page::new(format!("Study {}", header.study));
    page.subtitle = format!(
        "{done} of {} runs, {finished} of them finished, monorig {}",
        header.runs, header.made_from.monorig
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
    let findings = judged.findings().into_iter();
    page.sections
        .extend(worst_first(findings.map(|f| (String::new(), f)).collect()));
    let section = Section::new("Verdicts");
    let section = runs::verdicts(section, &judged.checks, &judged.runs);
    page.sections.push(runs::integrity(section, &judged.runs));
    let section = Section::new("Metrics");
    page.sections.push(runs::metrics(section, &judged.runs));
    page.sections.extend(worst::section(header, &judged.runs));
    page.sections.extend(drawn::section(&judged.runs));
    page
}

/// Findings of several scenarios in one list; none if there is none.
fn worst_first(mut all: Vec<(String, Finding)>) -> Option<Section> {
    all.sort_by(|(_, a), (_, b)| {
        let order = b.fails.cmp(&a.fails);
        order.then(b.severity.total_cmp(&a.severity))
    });
    findings::section(&all)
}
