//! The page of commands in the book is what `monorig COMMAND -h` prints; what several commands have stands there once.
//!
//! `MONORIG_UPDATE=1 cargo test --release --test cli commands_page::` writes `docs/src/commands.md` anew.

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

/// An option that so many commands have in the same words is said once.
const SHARED: usize = 5;
/// So many examples of each command are on the page.
const EXAMPLES: usize = 2;

/// Splits a block of the help (`Options:`, `Examples:`) into its title and its entries, of one or more lines.
fn entries(block: &str, begins: impl Fn(&str) -> bool) -> (&str, Vec<String>) {
    let (title, lines) = block.split_once('\n').unwrap();
    let mut entries: Vec<String> = Vec::new();
    for line in lines.lines() {
        match entries.last_mut() {
            Some(entry) if !begins(line) => *entry += &format!("\n{line}"),
            _ => entries.push(line.to_owned()),
        }
    }
    (title, entries)
}

/// Returns the options in a block of the help, each with its text.
fn options(block: &str) -> Vec<String> {
    let begins = |line: &str| line.trim_start().starts_with('-') && !line.starts_with("       ");
    entries(block, begins).1
}

/// An option by what it says, however its lines are broken.
fn words(option: &str) -> String {
    option.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The head of an option in the help, in front of its text: `--jobs <N>`.
fn flag(option: &str) -> String {
    let parts = option.trim_start().split("  ");
    parts.take(1).collect::<String>().trim().to_owned()
}

/// The options that several commands have in the same words, in the order in which they come first.
fn shared(helps: &[String]) -> Vec<String> {
    let blocks = helps.iter().flat_map(|help| help.split("\n\n"));
    let all: Vec<String> = blocks
        .filter(|block| block.starts_with("Options:"))
        .flat_map(options)
        .collect();
    let mut shared: Vec<String> = Vec::new();
    for option in &all {
        let same = |other: &&String| words(other) == words(option);
        if all.iter().filter(same).count() >= SHARED && !shared.iter().any(|s| same(&s)) {
            shared.push(option.clone());
        }
    }
    shared
}

/// The help of a command with its own options and its first examples. Options that every command has are left out, of
/// those of several commands the name is left.
fn shortened(help: &str, shared: &[String], of_all: &[String]) -> String {
    let mut kept = Vec::new();
    for block in help.split("\n\n") {
        if block.starts_with("Options:") {
            let is_in =
                |list: &[String], option: &String| list.iter().any(|s| words(s) == words(option));
            let (common, own): (Vec<String>, Vec<String>) = options(block)
                .into_iter()
                .filter(|option| !is_in(of_all, option))
                .partition(|option| is_in(shared, option));
            let common: Vec<String> = common.iter().map(|option| flag(option)).collect();
            let common = (!common.is_empty()).then(|| format!("  as above: {}", common.join(", ")));
            let lines: Vec<String> = own.into_iter().chain(common).collect();
            if !lines.is_empty() {
                kept.push(format!("Options:\n{}", lines.join("\n")));
            }
        } else if block.starts_with("Examples:") {
            let (title, mut examples) = entries(block, |line| line.starts_with("  monorig "));
            examples.truncate(EXAMPLES);
            kept.push(format!("{title}\n{}", examples.join("\n")));
        } else {
            kept.push(block.to_owned());
        }
    }
    kept.join("\n\n")
}

/// The whole page: what the program and several commands have, then each command.
fn page() -> String {
    let program = help(&[]);
    let names = commands(&program);
    assert!(names.len() > 20, "{names:?}");
    let helps: Vec<String> = names.iter().map(|name| help(&[name])).collect();
    let shared = shared(&helps);
    let in_all = |option: &&String| helps.iter().all(|h| words(h).contains(&words(option)));
    let of_all: Vec<String> = shared.iter().filter(in_all).cloned().collect();
    assert!(
        of_all.len() >= 4 && shared.len() > of_all.len(),
        "{shared:?}"
    );
    let codes = program
        .split("\n\n")
        .find(|b| b.starts_with("Exit codes"))
        .unwrap();
    let some: Vec<String> = shared
        .iter()
        .filter(|s| !of_all.contains(s))
        .cloned()
        .collect();
    let mut page = format!(
        "# Commands\n\n\
         Here you find every command with its options, as `monorig COMMAND -h` prints it, which has more examples. `monorig -h` lists the\n\
         commands, `monorig help COMMAND` says more of an option, and `monorig man DIR` writes man pages. Completions for a shell:\n\
         `monorig completions bash > ~/.local/share/bash-completion/completions/monorig` (or `zsh`, `fish`, `powershell`).\n\n\
         Written by `MONORIG_UPDATE=1 cargo test --release --test cli commands_page::`.\n\n\
         ## Of all commands\n\n\
         ```text\n{}\n\n{codes}\n```\n\n\
         ## Of several commands\n\n```text\n{}\n```\n",
        of_all.join("\n"),
        some.join("\n")
    );
    for (name, help) in names.iter().zip(&helps) {
        let text = shortened(help, &shared, &of_all);
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
