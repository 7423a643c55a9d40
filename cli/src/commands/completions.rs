//! `monorig completions`: scripts that complete commands, options and names in a shell.

use crate::command::{Command, CommandOutcome, Program};
use crate::ui::errors::CliError;
use crate::ui::output;
use clap::builder::{PossibleValue, PossibleValuesParser};
use clap_complete::Shell;
use monorig_lab::metrics::METRICS;
use monorig_sim::closed_loop::registry::Registry;

const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  monorig completions bash > ~/.local/share/bash-completion/completions/monorig
  monorig completions zsh > ~/.zfunc/_monorig
  monorig completions fish > ~/.config/fish/completions/monorig.fish";

/// Print a script that completes commands, options and names in a shell.
#[derive(Debug, clap::Parser)]
#[command(name = "completions", after_help = COMPLETIONS_EXAMPLES)]
pub struct CompletionsArgs {
    /// Shell for which the script is printed
    shell: Shell,
}

impl Command for CompletionsArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        let mut commands = with_names(program.command_line.clone(), program.registry);
        let name = commands.get_name().to_owned();
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut commands, name, &mut script);
        output::print(&String::from_utf8_lossy(&script))?;
        Ok(CommandOutcome::Held)
    }
}

/// Command line with the names of estimators and metrics as values of their options: for scripts only, as a scenario
/// may give its estimators other names.
fn with_names(commands: clap::Command, registry: &Registry) -> clap::Command {
    let estimators = registry.estimators().iter().map(|t| t.name().to_owned());
    // a name lives as long as the program, which ends with this command
    let estimators: Vec<&'static str> = estimators.map(|n| &*n.leak()).collect();
    let metrics: Vec<&'static str> = METRICS.iter().map(|m| m.name).collect();
    let parser = |names: &[&'static str]| {
        PossibleValuesParser::new(names.iter().map(|name| PossibleValue::new(*name)))
    };
    commands.mut_subcommands(|command| {
        command.mut_args(|arg| match arg.get_id().as_str() {
            "estimators" | "reference" => arg.value_parser(parser(&estimators)),
            "metrics" => arg.value_parser(parser(&metrics)),
            _ => arg,
        })
    })
}
