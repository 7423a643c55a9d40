//! `monorig new courses`: scenarios drawn at random.

use crate::arguments::RANGES;
use crate::command::CommandOutcome;
use crate::files::{out, prepare, share};
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::output;
use monorig_lab::draw::{self, RangesFile};
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::file::{input_error, read_bytes};
use std::path::{Path, PathBuf};

const COURSES_EXAMPLES: &str = "\
Examples:
  monorig new courses --seed 1 --count 5
      five scenarios, drawn/drawn_1.yaml to drawn/drawn_5.yaml
  monorig test drawn   no estimator was tuned on them: does any mislead?
  monorig compare drawn/drawn_3.yaml --seeds 1..5        errors side by side
  monorig new courses assets/ranges/roadway.yaml --seed 7 --out other
      with a file of ranges of your own

The same ranges and seed give the same files. Track and sensor sheet of each
scenario are in OUT/parts.";

/// Draw scenarios at random: courses on which no estimator was tuned.
#[derive(Debug, clap::Args)]
#[command(after_help = COURSES_EXAMPLES)]
pub struct CoursesArgs {
    /// File of ranges
    #[arg(default_value = RANGES, value_parser = share::named())]
    pub file: PathBuf,
    /// Seed of the first course; each further course has the next seed
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Number of courses
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub count: u64,
    /// Folder for the scenarios
    #[arg(long, value_name = "DIR", default_value = "drawn")]
    pub out: PathBuf,
}

/// Draw the scenarios, write the files, and check these files.
pub fn run(task: &CoursesArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let ranges = RangesFile::load(&task.file)?;
    ranges.check(&task.file, registry)?;
    out::make(&task.out)?;
    for seed in (task.seed..=u64::MAX).take(task.count as usize) {
        let course = draw::course(&ranges, &task.file, &task.out, seed)?;
        let mut places = course.files.iter().map(|f| task.out.join(&f.path));
        let pairs = places.clone().zip(&course.files);
        let there = pairs.map(|(place, drawn)| is_there(&place, &drawn.text));
        let there = there.collect::<Result<Vec<bool>, CliError>>()?;
        for (drawn, _) in course.files.iter().zip(there).filter(|(_, there)| !there) {
            output::write_in(&task.out, &drawn.path, &drawn.text)?;
        }
        if let Some(scenario) = places.next_back() {
            prepare::simulation(&scenario, &[], registry)?;
        }
    }
    note(&format!(
        "{} scenarios in {}",
        task.count,
        task.out.display()
    ));
    Ok(CommandOutcome::Held)
}

/// True if this file is there already; refuses to replace one with another content.
fn is_there(place: &Path, text: &str) -> Result<bool, CliError> {
    match read_bytes(place) {
        Ok(there) if *there != *text.as_bytes() => Err(input_error(
            place,
            "",
            "a file of this name exists already, with another content",
            "name another folder with --out, or remove the file",
        )
        .into()),
        there => Ok(there.is_ok()),
    }
}
