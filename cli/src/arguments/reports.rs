//! The task that makes reports.

use std::path::PathBuf;

const REPORT_EXAMPLES: &str = "\
Examples:
  monorig run scenarios/minimal.yaml                     leaves the folder runs/minimal/1
  monorig report runs/minimal/1                          writes runs/minimal/1/report.html
  monorig test scenarios/minimal.yaml --json out/verdicts.json
  monorig report out/verdicts.json                       writes out/verdicts.html
  monorig compare scenarios/minimal.yaml --seeds 1..5 --json out/compared.json
  monorig report out/compared.json                       writes out/compared.html

In the same way the results of a study, such as runs/vehicle_test_spread/results.jsonl; `monorig tune` writes its report by itself.
The report is one file that needs nothing else: open it in any browser, offline, on a phone or on paper.";

/// `monorig report`
#[derive(Debug, clap::Args)]
#[command(after_help = REPORT_EXAMPLES)]
pub struct Report {
    /// Folder of a run, results of `monorig test --json`, of `monorig compare --json`, or of a study
    pub path: PathBuf,
    /// Write the report here instead of into or beside what it is about
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}
