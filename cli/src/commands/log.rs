//! `monorig log`: read and write recorded logs.

mod calibrate;
pub(super) mod check;
mod export;
mod imu;
mod info;
mod track;

use crate::command::{Command, CommandOutcome, Program};
use crate::ui::errors::CliError;

/// Show, check and calibrate with a recorded log; write runs as logs.
#[derive(Debug, clap::Parser)]
#[command(name = "log")]
pub struct LogArgs {
    #[command(subcommand)]
    task: LogTask,
}

/// Tasks for recorded logs.
#[derive(Debug, clap::Subcommand)]
enum LogTask {
    Info(info::InfoArgs),
    Check(check::CheckLogArgs),
    Calibrate(calibrate::CalibrateArgs),
    Imu(imu::ImuArgs),
    Track(track::TrackArgs),
    Export(export::ExportArgs),
}

impl Command for LogArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        match &self.task {
            LogTask::Info(task) => info::run(task),
            LogTask::Check(task) => check::run(task),
            LogTask::Calibrate(task) => calibrate::run(task, program.registry),
            LogTask::Imu(task) => imu::run(task),
            LogTask::Track(task) => track::run(task),
            LogTask::Export(task) => export::run(task),
        }
    }
}
