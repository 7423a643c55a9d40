//! Verdicts as JUnit XML: a suite for each scenario, a case for each of its checks.

use super::TestedScenario;
use crate::ui::errors::CliError;
use monorig_lab::verdicts::verdict::{Check, ScenarioVerdict};
use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};

/// Writes the whole report.
pub(crate) fn xml(tested: &[TestedScenario]) -> Result<String, CliError> {
    let mut report = Report::new("monorig");
    for one in tested {
        let mut suite = TestSuite::new(one.judged.scenario.clone());
        suite.set_time(one.took);
        if let Some(why) = &one.unusable {
            suite.add_test_case(unusable(&one.judged.scenario, why));
            report.add_test_suite(suite);
            continue;
        }
        for check in &one.judged.checks {
            suite.add_test_case(case(&one.judged.scenario, check));
        }
        suite.add_test_cases(weakened(&one.judged));
        report.add_test_suite(suite);
    }
    report
        .to_string()
        .map_err(|e| CliError::NotWritten("JUnit XML", e.to_string()))
}

/// Case of a file that cannot be used: an error, not a failure, as nothing was run.
fn unusable(scenario: &str, why: &str) -> TestCase {
    let mut status = TestCaseStatus::non_success(NonSuccessKind::Error);
    status.set_message(why);
    let mut case = TestCase::new("can be used", status);
    case.set_classname(scenario.to_owned());
    case
}

/// Case of limits that are weaker than usual: neither passed nor failed.
fn weakened(verdict: &ScenarioVerdict) -> Option<TestCase> {
    if verdict.weakened.is_empty() {
        return None;
    }
    let mut status = TestCaseStatus::skipped();
    status.set_message(format!("weakened limits: {}", verdict.weakened.join("; ")));
    let mut case = TestCase::new("limits are the usual ones", status);
    case.set_classname(verdict.scenario.clone());
    Some(case)
}

fn case(scenario: &str, check: &Check) -> TestCase {
    let mut status = TestCaseStatus::success();
    if !check.held {
        status = TestCaseStatus::non_success(NonSuccessKind::Failure);
        status.set_message(check.reason());
        let seeds: Vec<String> = check.failing.iter().map(u64::to_string).collect();
        status.set_description(format!("seeds that fail: {}", seeds.join(", ")));
    }
    if check.fails_as_known() {
        status = TestCaseStatus::skipped();
        let why = check.known_failure.as_deref().unwrap_or_default();
        status.set_message(format!("known failure: {} ({why})", check.reason()));
    }
    if check.not_judged {
        status = TestCaseStatus::skipped();
        status.set_message(format!("not judged: {}", check.reason()));
    }
    let mut case = TestCase::new(format!("{} {}", check.what, check.bound), status);
    case.set_classname(scenario.to_owned());
    case
}
