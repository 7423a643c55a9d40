//! `monorig new estimator`: a folder with an estimator of one's own, which builds, runs and is tested as it is.

pub(super) mod copy;

use crate::command::CommandOutcome;
use crate::ui::errors::CliError;
use crate::ui::output;
use copy::Example;
use std::path::PathBuf;

const ESTIMATOR_EXAMPLES: &str = "\
Examples:
  monorig new estimator rust my_filter
      a crate that has every command of monorig, and the estimator `mine`
  monorig new estimator c my_filter
      a library in C; python: a class; simulink: a library around a generated
      model
  monorig new estimator rust ~/my_filter --monorig ~/monorig
      away from the sources of monorig";

const RUST: Example = Example {
    folder: "examples/own_estimator",
    files: &[
        ".gitignore",
        "Cargo.toml",
        "Cargo.lock",
        "README.md",
        "climb.yaml",
        "study.yaml",
        "src/main.rs",
        "src/complementary.rs",
        "tests/climb.rs",
    ],
    estimator: "src/complementary.rs",
    next: "CARGO_TARGET_DIR={way}target cargo test --release",
};

const C: Example = Example {
    folder: "examples/own_estimator_c",
    files: &[
        ".gitignore",
        "Makefile",
        "README.md",
        "climb.yaml",
        "study.yaml",
        "two_state.c",
    ],
    estimator: "two_state.c",
    next: "make && monorig test climb.yaml",
};

const PYTHON: Example = Example {
    folder: "interfaces/python/examples",
    files: &["climb.yaml", "test_climb.py", "two_state.py"],
    estimator: "two_state.py",
    next: "pip install {way}interfaces/python && python test_climb.py",
};

const SIMULINK: Example = Example {
    folder: "examples/own_estimator_simulink",
    files: &[
        ".gitignore",
        "Makefile",
        "README.md",
        "climb.yaml",
        "estimator.c",
        "model.c",
        "model.h",
    ],
    estimator: "model.c, behind estimator.c",
    next: "make && monorig test climb.yaml",
};

/// Make a folder with an estimator of your own, a scenario and a test.
#[derive(Debug, clap::Args)]
#[command(after_help = ESTIMATOR_EXAMPLES)]
pub struct NewEstimatorArgs {
    /// Language of the estimator
    pub language: Language,
    /// Folder to make; its name is that of a crate
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Folder of monorig's sources, of which the new one names files; else the nearest one above this folder or DIR
    #[arg(long, value_name = "DIR")]
    pub monorig: Option<PathBuf>,
}

/// A language that estimators are written in.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
pub enum Language {
    /// A crate
    Rust,
    /// A shared library
    C,
    /// A class
    Python,
    /// A shared library around a model that Embedded Coder has generated
    Simulink,
}

/// Copies the example of the language.
pub fn run(task: &NewEstimatorArgs) -> Result<CommandOutcome, CliError> {
    let example = match task.language {
        Language::Rust => &RUST,
        Language::C => &C,
        Language::Python => &PYTHON,
        Language::Simulink => &SIMULINK,
    };
    let told = copy::make(example, &task.folder, task.monorig.as_deref())?;
    output::print(&told)?;
    Ok(CommandOutcome::Held)
}
