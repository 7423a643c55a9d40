//! `monorig completions` and `monorig man`: what shells and `man` want to know of the commands.

use crate::CommandOutcome;
use crate::commands::{Arguments, with_names};
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::output;
use clap::CommandFactory;
use clap_complete::Shell;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::error::Error;
use std::path::{Path, PathBuf};

const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  monorig completions bash > ~/.local/share/bash-completion/completions/monorig
  monorig completions zsh > ~/.zfunc/_monorig
  monorig completions fish > ~/.config/fish/completions/monorig.fish";

/// `monorig completions`
#[derive(Debug, clap::Args)]
#[command(after_help = COMPLETIONS_EXAMPLES)]
pub struct CompletionsArgs {
    /// For which shell
    pub shell: Shell,
}

/// `monorig man`
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  monorig man ~/.local/share/man/man1      then `man monorig-run`"
)]
pub struct ManArgs {
    /// Folder the pages go to
    pub folder: PathBuf,
}

/// Name of the program, as it is called.
const PROGRAM: &str = "monorig";

fn command(registry: &Registry) -> clap::Command {
    with_names(Arguments::command(), registry)
}

/// Print the script that completes our commands in a shell.
pub fn completions(
    task: &CompletionsArgs,
    registry: &Registry,
) -> Result<CommandOutcome, CliError> {
    let mut script = Vec::new();
    clap_complete::generate(task.shell, &mut command(registry), PROGRAM, &mut script);
    output::print(&String::from_utf8_lossy(&script))?;
    Ok(CommandOutcome::Held)
}

/// Write a page for the program and one for each command.
pub fn man(task: &ManArgs, registry: &Registry) -> Result<CommandOutcome, CliError> {
    let command = command(registry);
    write(&task.folder, PROGRAM, command.clone())?;
    let mut pages = 1;
    for sub in command.get_subcommands() {
        let name = format!("{PROGRAM}-{}", sub.get_name());
        // clap keeps names for ever: a few dozen bytes of a program that ends soon
        let static_name: &'static str = Box::leak(name.clone().into_boxed_str());
        write(&task.folder, &name, sub.clone().name(static_name))?;
        pages += 1;
    }
    note(&format!("{pages} pages in {}", task.folder.display()));
    Ok(CommandOutcome::Held)
}

fn write(folder: &Path, name: &str, command: clap::Command) -> Result<(), CliError> {
    let path = folder.join(format!("{name}.1"));
    let mut page = Vec::new();
    let rendered = clap_mangen::Man::new(command).render(&mut page);
    rendered.map_err(|source| Error::Io {
        path: path.clone(),
        source,
    })?;
    output::write(&path, &String::from_utf8_lossy(&page))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shell_completes_every_command() {
        let registry = Registry::default();
        let command = command(&registry);
        let names: Vec<&str> = command.get_subcommands().map(|c| c.get_name()).collect();
        for shell in [Shell::Bash, Shell::Zsh, Shell::Fish, Shell::PowerShell] {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut command.clone(), PROGRAM, &mut script);
            let script = String::from_utf8(script).unwrap();
            for name in &names {
                assert!(script.contains(name), "{shell}: {name}");
            }
        }
    }

    #[test]
    fn every_command_has_a_page_with_its_options() {
        let folder = tempfile::tempdir().unwrap();
        let task = ManArgs {
            folder: folder.path().into(),
        };
        man(&task, &Registry::default()).unwrap();
        let page = std::fs::read_to_string(folder.path().join("monorig-run.1")).unwrap();
        assert!(
            page.contains("no\\-rerun") && page.contains(".TH"),
            "{page}"
        );
        let command = command(&Registry::default());
        let pages = std::fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(pages, 1 + command.get_subcommands().count());
    }
}
