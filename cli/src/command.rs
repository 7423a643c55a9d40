//! The trait of a command, and the list of the commands of a program.

use crate::ui::errors::CliError;
use clap::{ArgMatches, CommandFactory, FromArgMatches};
use monorig_sim::closed_loop::registry::Registry;

/// A command: arguments, which clap derives from a struct, and the work that it does.
///
/// `#[derive(clap::Parser)]` with `#[command(name = "…")]` makes name, help and arguments of the struct;
/// [`crate::App::command`] adds it.
pub trait Command: CommandFactory + FromArgMatches {
    /// Describes name, help and arguments.
    fn args(_registry: &Registry) -> clap::Command {
        Self::command()
    }

    /// Runs the command.
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError>;
}

/// Outcome of a command that did its work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommandOutcome {
    /// Everything held: exit code 0.
    Held,
    /// An expectation failed: exit code 1.
    Failed,
}

impl CommandOutcome {
    /// Outcome of a command, from the verdict on the expectations.
    pub fn of(held: bool) -> Self {
        if held { Self::Held } else { Self::Failed }
    }
}

/// Program to which a command belongs.
#[derive(Clone, Copy, Debug)]
pub struct Program<'a> {
    /// Estimators and controllers by name.
    pub registry: &'a Registry,
    /// The whole command line, with every command.
    pub command_line: &'a clap::Command,
}

/// A command of a program, whatever its type.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CommandEntry {
    args: fn(&Registry) -> clap::Command,
    pub(crate) run: fn(&ArgMatches, &Program<'_>) -> Result<CommandOutcome, CliError>,
    listed: bool,
}

impl CommandEntry {
    /// Makes the entry of a type of command.
    pub(crate) const fn of<C: Command>() -> Self {
        Self {
            args: C::args,
            run: |matches, program| {
                let task = C::from_arg_matches(matches).map_err(CliError::Usage)?;
                task.run(program)
            },
            listed: true,
        }
    }

    /// The same, left out of the help's list of commands.
    pub(crate) const fn unlisted(self) -> Self {
        Self {
            listed: false,
            ..self
        }
    }

    /// Describes name, help and arguments.
    pub(crate) fn describe(&self, registry: &Registry) -> clap::Command {
        (self.args)(registry).hide(!self.listed)
    }
}
