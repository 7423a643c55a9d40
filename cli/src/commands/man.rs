//! Pages for `man`, which `monorig completions --man` writes.

use crate::ui::errors::CliError;
use crate::ui::output;
use monorig_sim::error::Error;
use std::path::Path;

/// Writes a page for the program and a page for each command; returns the number of pages.
pub(super) fn write_all(folder: &Path, command_line: &clap::Command) -> Result<usize, CliError> {
    let program = command_line.get_name().to_owned();
    write(folder, &program, command_line.clone())?;
    let mut pages = 1;
    for sub in command_line.get_subcommands() {
        let name = format!("{program}-{}", sub.get_name());
        // clap keeps names for ever: a few dozen bytes of a program that ends soon
        let static_name: &'static str = Box::leak(name.clone().into_boxed_str());
        write(folder, &name, sub.clone().name(static_name))?;
        pages += 1;
    }
    Ok(pages)
}

fn write(folder: &Path, name: &str, command: clap::Command) -> Result<(), CliError> {
    let path = folder.join(format!("{name}.1"));
    let mut page = Vec::new();
    let rendered = clap_mangen::Man::new(command).render(&mut page);
    rendered.map_err(Error::at(&path))?;
    output::write_in(
        folder,
        path.file_name().unwrap_or_default(),
        &String::from_utf8_lossy(&page),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Arg, ArgAction};

    #[test]
    fn every_command_has_a_page_with_its_options() {
        let flag = Arg::new("x").long("no-rerun").action(ArgAction::SetTrue);
        let run = clap::Command::new("run").arg(flag);
        let command_line =
            clap::Command::new("monorig").subcommands([run, clap::Command::new("list")]);
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(write_all(folder.path(), &command_line).unwrap(), 3);
        let page = std::fs::read_to_string(folder.path().join("monorig-run.1")).unwrap();
        assert!(
            page.contains("no\\-rerun") && page.contains(".TH"),
            "{page}"
        );
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3);
    }
}
