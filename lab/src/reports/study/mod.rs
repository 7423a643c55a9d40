//! The report of many runs: scenarios over their seeds (`monorig test --json`), estimators side by side (`monorig
//! compare --json`), or a study with what varied in it.

mod comparison;
mod drawn;
mod expected;
mod overview;
mod ranks;
mod read;
mod runs;
mod values;
mod worst;

use crate::campaign::Campaign;
use crate::reports::findings;
use crate::reports::page::{Page, Section};
use crate::verdicts::findings::Finding;
use crate::verdicts::judgement::{Grade, Totals};
use crate::verdicts::run_result::RunResult;
use crate::verdicts::verdict::ScenarioVerdict;
use monorig_sim::error::Error;
use read::{Results, TestResults};
use std::path::Path;

/// Read results and lay out their report.
pub fn page(path: &Path) -> Result<Page, Error> {
    Ok(pages(path, "")?.0)
}

/// A page of a scenario, and the name of its file.
pub type NamedPage = (String, Page);

/// Read results and lay out their report: one page, or, for several scenarios, an index with a page for each, in the
/// folder `folder` beside it.
pub fn pages(path: &Path, folder: &str) -> Result<(Page, Vec<NamedPage>), Error> {
    Ok(match read::read(path)? {
        Results::Test(tested) => of_test(&tested, folder),
        Results::Compare(comparison) => (comparison::page(&comparison), Vec::new()),
        Results::Study(campaign, runs) => (of_study(&campaign, runs), Vec::new()),
    })
}

fn of_test(tested: &TestResults, folder: &str) -> (Page, Vec<NamedPage>) {
    let all = &tested.scenarios;
    let totals = Totals::of(all);
    let mut page = Page::new("Scenarios tested");
    page.subtitle = format!(
        "{} scenarios, {} runs, monorig {}",
        all.len(),
        totals.runs,
        tested.monorig
    );
    let findings: Vec<(String, Finding)> = all
        .iter()
        .flat_map(|s| s.findings().into_iter().map(|f| (s.scenario.clone(), f)))
        .collect();
    let only: Vec<Finding> = findings.iter().map(|(_, f)| f.clone()).collect();
    let mut banner = totals.words();
    banner.extend(findings::told(&only).map(|told| format!("; {told}")));
    page.banner = Some((banner, totals.grade()));
    if let [one] = all.as_slice() {
        page.sections.push(overview::section(all, &[]));
        page.sections.extend(worst_first(findings));
        page.sections.push(of_scenario(one));
        return (page, Vec::new());
    }
    let names = file_names(all);
    let links: Vec<String> = names
        .iter()
        .map(|name| format!("{folder}/{name}"))
        .collect();
    page.sections.push(overview::section(all, &links));
    page.sections.extend(worst_first(findings));
    let own = all.iter().zip(names).map(|(scenario, name)| {
        let mut page = Page::new(&scenario.scenario);
        let judged = scenario.judgement();
        page.banner = Some((judged.words(), judged.grade()));
        page.sections.push(of_scenario(scenario));
        page.sections.extend(findings::of_one(scenario.findings()));
        (name, page)
    });
    let own = own.collect();
    (page, own)
}

/// Names for the pages of scenarios. A name in results may come from elsewhere: only letters, digits, `_`, `-` and `@`
/// are kept of it, and it is made different from the others by its place.
fn file_names(all: &[ScenarioVerdict]) -> Vec<String> {
    let plain = |c: char| match c {
        c if c.is_ascii_alphanumeric() || "_-@".contains(c) => c,
        _ => '_',
    };
    let mut names: Vec<String> = Vec::new();
    for (i, scenario) in all.iter().enumerate() {
        let mut name: String = scenario.scenario.chars().take(80).map(plain).collect();
        let taken = |name: &str| names.iter().any(|n| n.eq_ignore_ascii_case(name));
        if name.is_empty() || taken(&format!("{name}.html")) {
            name = format!("{name}-{i}");
        }
        names.push(format!("{name}.html"));
    }
    names
}

fn of_scenario(scenario: &ScenarioVerdict) -> Section {
    let section = Section::new(&scenario.scenario);
    let section = runs::verdicts(section, &scenario.checks, &scenario.runs);
    let section = runs::integrity(section, &scenario.runs);
    runs::metrics(section, &scenario.runs)
}

fn of_study(campaign: &Campaign, runs: Vec<RunResult>) -> Page {
    let done = runs.len() as u64;
    let finished = runs.iter().filter(|r| r.finished()).count();
    let judged = ScenarioVerdict::new(&campaign.name, runs);
    let judgement = judged.judgement();
    let mut page = Page::new(format!("Study {}", campaign.name));
    page.subtitle = format!(
        "{done} of {} runs, {finished} of them finished, monorig {}",
        campaign.runs(),
        campaign.monorig
    );
    let words = judgement.words();
    page.banner = Some(match (judgement.grade(), done == campaign.runs()) {
        (grade, true) | (grade @ Grade::Failed, _) => (words, grade),
        (_, false) => (
            format!("{words}; {done} of {} runs are done", campaign.runs()),
            Grade::HeldBut,
        ),
    });
    let varied = drawn::section(&judged.runs, &campaign.swept());
    let (first, last) = match campaign.swept().is_empty() {
        true => (None, varied),
        false => (varied, None),
    };
    page.sections.extend(first);
    let section = Section::new("Verdicts");
    let section = runs::verdicts(section, &judged.checks, &judged.runs);
    page.sections.push(runs::integrity(section, &judged.runs));
    page.sections.extend(findings::of_one(judged.findings()));
    let section = Section::new("Metrics");
    page.sections.push(runs::metrics(section, &judged.runs));
    page.sections.extend(worst::section(campaign, &judged.runs));
    page.sections.extend(last);
    page
}

/// Findings of several scenarios in one list; `None` without findings.
fn worst_first(mut all: Vec<(String, Finding)>) -> Option<Section> {
    all.sort_by(|(_, a), (_, b)| {
        let order = b.fails.cmp(&a.fails);
        order.then(b.severity.total_cmp(&a.severity))
    });
    findings::section(&all)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No name leads out of the folder, and none is there twice.
    #[test]
    fn names_of_pages_are_names() {
        let named = |name: &str| ScenarioVerdict::new(name, Vec::new());
        let all = ["a", "../a", "A", "", "x/y", "x.y"].map(named);
        let names = file_names(&all);
        assert_eq!(names[0], "a.html");
        for (i, name) in names.iter().enumerate() {
            assert!(!name.contains('/') && !name.starts_with('.'), "{name}");
            assert!(
                names[..i].iter().all(|n| !n.eq_ignore_ascii_case(name)),
                "{name}"
            );
        }
    }
}
