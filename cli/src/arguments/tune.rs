//! The command line of `monorig tune`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  monorig tune scenarios/tuning/quick.yaml                  search; results go to runs/tune/quick/
  monorig tune scenarios/tuning/quick.yaml --resume         go on after an interruption, with the same future
  monorig check scenarios/tuning/*.yaml                     find mistakes in studies without running them

Results: OUT/tune/<study>/ with report.html (read this), trials.jsonl (every trial), winner.yaml (for `estimators: {x: {from: winner.yaml}}`), validation.json and sensitivity.json,
and before_after.rrd to open in the Rerun viewer: a validation run with defaults, published constants and winner side by side.";

/// `monorig tune`
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Tune {
    /// Study file
    pub file: PathBuf,
    /// Go on with the trials that are there, instead of starting anew
    #[arg(long)]
    pub resume: bool,
    /// Threads; the result is the same for any number [default: one per core]
    #[arg(long, value_name = "N")]
    pub jobs: Option<NonZeroUsize>,
    /// Folder the results go to
    #[arg(long, value_name = "DIR", default_value = "runs")]
    pub out: PathBuf,
    /// Do not write before_after.rrd
    #[arg(long)]
    pub no_rerun: bool,
    /// Folder of the recorded runs [default: OUT/tune/.cache]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
}
