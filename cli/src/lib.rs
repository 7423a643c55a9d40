//! The command line of monorig: parse, build, run, report.

mod commands;
mod files;
mod simulate;
mod ui;

use clap::Parser;
use commands::Arguments;
use std::process::ExitCode;
use ui::errors::{self, CliError};

/// How a task that could be done has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum CommandOutcome {
    /// Everything held.
    Held,
    /// An expectation failed.
    Failed,
}

/// The program `monorig`.
#[derive(Debug, Default)]
pub struct App {}

impl App {
    /// With everything that monorig has of its own.
    pub fn new() -> Self {
        Self::default()
    }

    /// Read the command line, do what it says, and return the exit code.
    pub fn main(self) -> ExitCode {
        let arguments = match Arguments::try_parse() {
            Ok(arguments) => arguments,
            Err(e) => return errors::usage(&e),
        };
        match arguments.command.run() {
            Ok(CommandOutcome::Held) => ExitCode::SUCCESS,
            Ok(CommandOutcome::Failed) => ExitCode::from(1),
            Err(CliError::ReaderGone) => ExitCode::SUCCESS,
            Err(e) => {
                errors::show(&e);
                ExitCode::from(2)
            }
        }
    }
}
