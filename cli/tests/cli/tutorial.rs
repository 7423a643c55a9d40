//! The commands of README, tutorial and two more pages are run, and what these pages show is what they print.
//!
//! `MONORIG_UPDATE=1 cargo test --release --test cli tutorial::` writes the outputs of these pages anew. A block that
//! begins with `text` belongs to the commands or to the Python snippet before it. A line of `…` in it stands for any
//! lines; such a block is written by hand. Python snippets are run where there is a Python with pyarrow and pandas.

use monorig_testing::tools;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The mark for any lines.
const ANY: &str = "…";
/// The wall time differs from machine to machine: lines with this are compared up to here.
const WALL_TIME: &str = " s simulated in ";

/// The program as README runs it.
const CARGO: &str = "cargo run --release -- ";

/// A part of the page, in its order.
#[derive(Debug, PartialEq)]
enum Part {
    /// Lines indented by four that begin with `monorig`, `cargo run` or `echo`; a line that ends with `\` goes on.
    Commands(Vec<String>),
    /// A Python snippet.
    Python(String),
    /// A `text` block: its first line and the one behind its last, counted from 0.
    Shown(usize, usize),
}

fn parts(page: &[&str]) -> Vec<Part> {
    let mut parts = Vec::new();
    let mut i = 0;
    while i < page.len() {
        let block_end = |from: usize| (from..page.len()).find(|&k| page[k] == "```").unwrap();
        if let Some(command) = page[i].strip_prefix("    ")
            && ["monorig ", CARGO, "echo $?"]
                .iter()
                .any(|w| command.starts_with(w))
        {
            let begun = i;
            let mut command = command.replacen(CARGO, "monorig ", 1);
            while let Some(before) = command.strip_suffix('\\') {
                i += 1;
                command = format!("{before}{}", page[i].trim_start());
            }
            match parts.last_mut() {
                Some(Part::Commands(list)) if page[begun - 1].starts_with("    ") => {
                    list.push(command);
                }
                _ => parts.push(Part::Commands(vec![command])),
            }
        } else if page[i] == "```python" {
            let end = block_end(i + 1);
            parts.push(Part::Python(page[i + 1..end].join("\n")));
            i = end;
        } else if page[i] == "```text" {
            let end = block_end(i + 1);
            parts.push(Part::Shown(i + 1, end));
            i = end;
        } else if page[i].starts_with("```") {
            i = block_end(i + 1);
        }
        i += 1;
    }
    parts
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap()
        .into()
}

/// A folder of the repository with what it needs, and a folder for results.
struct Tutorial {
    out: tempfile::TempDir,
    python: bool,
}

impl Tutorial {
    fn new() -> Self {
        let probe = tools(&["python3"]).then(|| {
            let mut probe = Command::new("python3");
            probe.args(["-c", "import pyarrow, pandas"]).output()
        });
        let python = probe.is_some_and(|o| o.is_ok_and(|o| o.status.success()));
        if !python {
            eprintln!("skipped: the snippets in Python; no python3 with pyarrow and pandas here");
        }
        Self {
            out: tempfile::tempdir().unwrap(),
            python,
        }
    }

    /// Runs commands; returns the lines they print, notes and errors first.
    fn commands(&self, list: &[String]) -> Vec<String> {
        let (mut lines, mut code) = (Vec::new(), None);
        for command in list {
            if command == "echo $?" {
                lines.push(format!("{}", code.unwrap()));
                continue;
            }
            let program = env!("CARGO_BIN_EXE_monorig");
            let full = command.replacen("monorig", &format!("'{program}'"), 1);
            let shell = Command::new("sh")
                .args(["-c", &full])
                .current_dir(root())
                .env("MONORIG_OUT", self.out.path())
                .env("NO_COLOR", "1")
                .output()
                .unwrap();
            code = shell.status.code();
            lines.extend(self.lines(&shell));
        }
        lines
    }

    /// Returns the output of the last of these snippets; imports of the earlier ones hold for it.
    fn python(&self, snippets: &[&str]) -> Option<Vec<String>> {
        let (last, earlier) = snippets.split_last().filter(|_| self.python)?;
        let imports = earlier
            .iter()
            .flat_map(|s| s.lines())
            .filter(|l| l.starts_with("import "));
        let imports: Vec<&str> = imports.collect();
        let code = format!("{}\n{last}", imports.join("\n"));
        let code = code.replace("\"runs/", &format!("\"{}/", self.out.path().display()));
        let run = Command::new("python3")
            .args(["-c", &code])
            .current_dir(root())
            .output()
            .unwrap();
        assert!(
            run.status.success(),
            "{last}\n{}",
            String::from_utf8_lossy(&run.stderr)
        );
        Some(self.lines(&run))
    }

    fn lines(&self, of: &Output) -> Vec<String> {
        let both = [&of.stderr[..], &of.stdout[..]].concat();
        let text = String::from_utf8(both).unwrap();
        let text = text.replace(&self.out.path().display().to_string(), "runs");
        // on a slow machine a run says how far it has come
        let is_progress = |line: &&str| line.ends_with(" s left");
        text.trim_end()
            .lines()
            .filter(|line| !is_progress(line))
            .map(|l| l.trim_end().to_owned())
            .collect()
    }
}

/// A line without what differs from machine to machine.
fn stable(line: &str) -> &str {
    line.find(WALL_TIME).map_or(line, |end| &line[..end])
}

/// Returns whether a block shows these lines; a line of `…` stands for any.
fn shows(block: &[&str], printed: &[String]) -> bool {
    let Some((first, rest)) = block.split_first() else {
        return printed.is_empty();
    };
    if first.trim() == ANY {
        return (0..=printed.len()).any(|skipped| shows(rest, &printed[skipped..]));
    }
    let Some((line, behind)) = printed.split_first() else {
        return false;
    };
    stable(first) == stable(line) && shows(rest, behind)
}

/// Runs the commands of a page and compares what they print with its blocks, of which there are at least so many.
fn check(page: &str, at_least: usize) {
    if !tools(&["sh"]) {
        return;
    }
    let place = root().join(page);
    let text = std::fs::read_to_string(&place).unwrap();
    let page: Vec<&str> = text.lines().collect();
    let tutorial = Tutorial::new();
    let update = std::env::var_os("MONORIG_UPDATE").is_some();
    let mut new: Vec<String> = page.iter().map(|l| (*l).to_owned()).collect();
    let (mut printed, mut snippets) = (None, Vec::new());
    let (mut stale, mut compared) = (Vec::new(), 0);
    let mut moved: isize = 0;
    let parts = parts(&page);
    for part in &parts {
        match part {
            Part::Commands(list) => printed = Some(tutorial.commands(list)),
            Part::Python(code) => {
                snippets.push(code.as_str());
                printed = tutorial.python(&snippets);
            }
            Part::Shown(from, to) => {
                let block = &page[*from..*to];
                let Some(lines) = printed.take() else {
                    continue;
                };
                compared += 1;
                if shows(block, &lines) {
                    continue;
                }
                if update && !block.iter().any(|line| line.trim() == ANY) {
                    let at = |line: usize| line.checked_add_signed(moved).unwrap();
                    new.splice(at(*from)..at(*to), lines.iter().cloned());
                    moved += lines.len() as isize - block.len() as isize;
                    continue;
                }
                stale.push(format!(
                    "line {from}: the page shows\n{}\nprinted is\n{}\n",
                    block.join("\n"),
                    lines.join("\n")
                ));
            }
        }
    }
    assert!(compared >= at_least, "{parts:?}");
    if update {
        std::fs::write(&place, new.join("\n") + "\n").unwrap();
    }
    assert!(
        stale.is_empty(),
        "{}\nwrite them anew with MONORIG_UPDATE=1, and those that leave lines out by hand",
        stale.join("\n")
    );
}

#[test]
fn outputs_in_the_tutorial_are_what_the_commands_print() {
    check("docs/src/tutorial.md", 6);
}

#[test]
fn outputs_in_the_readme_are_what_the_command_prints() {
    check("README.md", 1);
}

#[test]
fn outputs_of_the_replay_in_ten_minutes_are_what_the_commands_print() {
    check("docs/src/ten_minutes.md", 3);
}

#[test]
fn outputs_of_the_good_and_the_bad_result_are_what_the_command_prints() {
    check("docs/src/choose.md", 1);
}

#[test]
fn outputs_of_the_snippet_that_reads_channels_are_what_it_prints() {
    // nothing else is shown there: without pyarrow and pandas nothing is compared
    check("docs/src/outputs.md", 0);
}

#[test]
fn a_stale_figure_is_seen() {
    let printed: Vec<String> = [
        "results in runs/a/1",
        " mass 51.7",
        "60.0 s simulated in 0.4 s, 143 times real time",
    ]
    .map(String::from)
    .into();
    let same = [
        "results in runs/a/1",
        " mass 51.7",
        "60.0 s simulated in 9.9 s, 6 times real time",
    ];
    assert!(shows(&same, &printed));
    assert!(shows(&[ANY, " mass 51.7", ANY], &printed));
    assert!(!shows(
        &["results in runs/a/1", " mass 51.8", ANY],
        &printed
    ));
    assert!(!shows(&same[..2], &printed));
    let page = "    cargo run --release -- run \\\n      a\n    echo $?\n\n```text\n0\n```\n\n```yaml\na: 1\n```\n```python\nprint(1)\n```";
    let page: Vec<&str> = page.lines().collect();
    let found = parts(&page);
    let commands = Part::Commands(vec!["monorig run a".into(), "echo $?".into()]);
    assert_eq!(
        found,
        [commands, Part::Shown(5, 6), Part::Python("print(1)".into())]
    );
}
