//! The trait of a command, and the list of those a program has.

use crate::ui::errors::CliError;
use clap::{ArgMatches, CommandFactory, FromArgMatches};
use monorig_sim::closed_loop::registry::Registry;

/// A command: its arguments, which clap derives from a struct, and what is done with them.
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

/// The end of a task that could be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommandOutcome {
    /// Everything held: exit code 0.
    Held,
    /// An expectation failed: exit code 1.
    Failed,
}

impl CommandOutcome {
    /// The end of a task whose expectations held, or did not.
    pub fn of(held: bool) -> Self {
        match held {
            true => Self::Held,
            false => Self::Failed,
        }
    }
}

/// The program that a command belongs to.
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
