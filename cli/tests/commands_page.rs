//! The page of commands in the book is what `monorig COMMAND -h` prints.
//!
//! `MONORIG_UPDATE=1 cargo test --release --test commands_page` writes `docs/src/commands.md` anew.

#![allow(clippy::unwrap_used)] // a test that cannot go on fails

use std::path::Path;
use std::process::Command;

/// Returns the help of the program, or of one of its commands, for a terminal of 100 columns.
fn help(arguments: &[&str]) -> String {
    let shown = Command::new(env!("CARGO_BIN_EXE_monorig"))
        .args(arguments)
        .arg("-h")
        .env("COLUMNS", "100")
        .env("NO_COLOR", "1")
        .output()
        .unwrap();
    assert!(shown.status.success(), "{arguments:?}");
    let text = String::from_utf8(shown.stdout).unwrap();
    let lines: Vec<&str> = text.trim_end().lines().map(str::trim_end).collect();
    lines.join("\n").replace("monorig.exe", "monorig")
}

/// Returns the names of all commands in the order of the help, without `help` itself.
fn commands(help: &str) -> Vec<String> {
    let list = help.split("Commands:\n").nth(1).unwrap();
    let list = list.split("\n\n").next().unwrap();
    let names = list.lines().filter_map(|line| {
        let named = line.strip_prefix("  ")?;
        let first = named.split(' ').next()?;
        (!first.is_empty() && first != "help").then(|| first.to_owned())
    });
    names.collect()
}

/// The whole page: the program, then each of its commands.
fn page() -> String {
    let program = help(&[]);
    let names = commands(&program);
    assert!(names.len() > 20, "{names:?}");
    let mut page = format!(
        "# Commands\n\n\
         Every command with its options, as `monorig COMMAND -h` prints it. `monorig help COMMAND` says more, and `monorig man DIR` writes man\n\
         pages. Completions of commands, options and names for a shell: `monorig completions bash > ~/.local/share/bash-completion/completions/monorig`\n\
         (or `zsh`, `fish`, `powershell`).\n\n\
         This page is written by `MONORIG_UPDATE=1 cargo test --release --test commands_page`.\n\n\
         ```text\n{program}\n```\n"
    );
    for name in names {
        let text = help(&[&name]);
        page += &format!("\n## `{name}`\n\n```text\n{text}\n```\n");
    }
    page
}

#[test]
fn the_page_of_commands_is_what_the_help_prints() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/src/commands.md");
    let page = page();
    if std::env::var_os("MONORIG_UPDATE").is_some() {
        std::fs::write(&file, &page).unwrap();
    }
    let there = std::fs::read_to_string(&file).unwrap_or_default();
    let there = there.replace("\r\n", "\n");
    assert!(
        there == page,
        "{} is stale: write it anew with MONORIG_UPDATE=1",
        file.display()
    );
}
