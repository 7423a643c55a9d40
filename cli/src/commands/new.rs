//! `monorig new`: files from a template.

mod courses;
mod estimator;
mod scenario;

use crate::command::{Command, CommandOutcome, Program};
use crate::ui::errors::CliError;

/// Make an estimator or a scenario from a template, or draw courses
#[derive(Debug, clap::Parser)]
#[command(name = "new")]
pub struct NewArgs {
    #[command(subcommand)]
    task: NewTask,
}

/// Things that the command makes.
#[derive(Debug, clap::Subcommand)]
enum NewTask {
    Estimator(estimator::NewEstimatorArgs),
    Scenario(scenario::NewScenarioArgs),
    Courses(courses::CoursesArgs),
}

impl Command for NewArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        match &self.task {
            NewTask::Estimator(task) => estimator::run(task),
            NewTask::Scenario(task) => scenario::run(task, program.registry),
            NewTask::Courses(task) => courses::run(task, program.registry),
        }
    }
}
