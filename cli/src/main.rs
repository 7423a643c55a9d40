//! `monorig`: parse, build, run, report.

mod arguments;
mod check;
mod compare;
mod errors;
mod interrupt;
mod kinds;
mod note;
mod output;
mod prepare;
mod progress;
mod report;
mod results;
mod run;
mod schema;
mod simulate;
mod study;
mod test;
mod tune;
mod write_report;

use arguments::{Arguments, Task};
use clap::Parser;
use errors::CliError;
use std::process::ExitCode;

/// How a task that could be done has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    /// Everything held.
    Held,
    /// An expectation failed.
    Failed,
}

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(e) => return errors::usage(&e),
    };
    let outcome = match arguments.task {
        Task::Run(task) => run::run(&task),
        Task::Test(task) => test::test(&task),
        Task::Compare(task) => compare::compare(&task),
        Task::Study(task) => study::study(&task),
        Task::Merge(task) => study::merge(&task),
        Task::Tune(task) => tune::tune(&task),
        Task::Report(task) => write_report::report(&task),
        Task::Check(task) => check::check(&task),
        Task::Schema(task) => schema::schema(&task),
    };
    match outcome {
        Ok(Outcome::Held) => ExitCode::SUCCESS,
        Ok(Outcome::Failed) => ExitCode::from(1),
        Err(CliError::ReaderGone) => ExitCode::SUCCESS,
        Err(e) => {
            errors::show(&e);
            ExitCode::from(2)
        }
    }
}
