//! `monorig completions`: scripts that complete commands and options in a shell.

use crate::command::{Command, CommandOutcome, Program};
use crate::ui::errors::CliError;
use crate::ui::output;
use clap_complete::Shell;

const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  monorig completions bash > ~/.local/share/bash-completion/completions/monorig
  monorig completions zsh > ~/.zfunc/_monorig
  monorig completions fish > ~/.config/fish/completions/monorig.fish";

/// Print a script that completes commands and options in a shell.
#[derive(Debug, clap::Parser)]
#[command(name = "completions", after_help = COMPLETIONS_EXAMPLES)]
pub struct CompletionsArgs {
    /// For which shell
    shell: Shell,
}

impl Command for CompletionsArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        let mut commands = program.command_line.clone();
        let name = commands.get_name().to_owned();
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut commands, name, &mut script);
        output::print(&String::from_utf8_lossy(&script))?;
        Ok(CommandOutcome::Held)
    }
}
