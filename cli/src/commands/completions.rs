//! `monorig completions`: scripts that complete commands, options and names in a shell, and pages for `man`.

use crate::command::{Command, CommandOutcome, Program};
use crate::commands::man;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::output;
use clap::builder::{PossibleValue, PossibleValuesParser};
use clap_complete::Shell;
use monorig_lab::metrics::METRICS;
use monorig_sim::closed_loop::registry::Registry;
use std::path::PathBuf;

const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  monorig completions bash > ~/.local/share/bash-completion/completions/monorig
  monorig completions zsh > ~/.zfunc/_monorig
  monorig completions fish > ~/.config/fish/completions/monorig.fish
  monorig completions --man ~/.local/share/man/man1      then `man monorig-run`";

/// Print a script that completes commands, options and names in a shell, or write man pages.
#[derive(Debug, clap::Parser)]
#[command(name = "completions", after_help = COMPLETIONS_EXAMPLES)]
pub struct CompletionsArgs {
    /// Shell for which the script is printed
    #[arg(required_unless_present = "man")]
    shell: Option<Shell>,

    /// Write man pages to this folder
    #[arg(long, value_name = "FOLDER", conflicts_with = "shell")]
    man: Option<PathBuf>,
}

impl Command for CompletionsArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        if let Some(folder) = &self.man {
            let pages = man::write_all(folder, program.command_line)?;
            note(&format!("{pages} pages in {}", folder.display()));
        }
        let Some(shell) = self.shell else {
            return Ok(CommandOutcome::Held);
        };
        let mut commands = with_names(program.command_line.clone(), program.registry);
        let name = commands.get_name().to_owned();
        let mut script = Vec::new();
        clap_complete::generate(shell, &mut commands, name, &mut script);
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
