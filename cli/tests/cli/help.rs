//! The help teaches by examples: every one of them works.

use crate::common::{TestFolder, project};
use monorig_testing::tools;
use std::process::{Command, Stdio};

/// Examples in a help text: lines that start with `monorig`, with those they go on in, without the remark behind them.
fn examples(help: &str) -> Vec<String> {
    let whole = help.replace("\\\n", "");
    let lines = whole
        .lines()
        .filter(|l| l.trim_start().starts_with("monorig "));
    lines
        .map(|l| {
            l.trim()
                .split("   ")
                .next()
                .unwrap_or_default()
                .trim()
                .to_owned()
        })
        .collect()
}

/// The names of all commands, from the help of the program.
fn commands(help: &str) -> Vec<String> {
    let list = help.split("Commands:\n").nth(1).unwrap();
    let list = list.split("\n\n").next().unwrap();
    let named = list
        .lines()
        .filter(|l| l.starts_with("  ") && !l.starts_with("   "));
    let first = |l: &str| l.split_whitespace().next().unwrap().to_owned();
    named.map(first).filter(|c| c != "help").collect()
}

#[test]
fn help_fits_80_columns() {
    let of = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_monorig"));
        let told = command
            .args(arguments)
            .env("COLUMNS", "80")
            .output()
            .unwrap();
        assert!(told.status.success(), "{arguments:?}");
        let help = String::from_utf8(told.stdout).unwrap();
        for line in help.lines() {
            assert!(line.chars().count() <= 80, "{arguments:?}: {line}");
        }
        help
    };
    let all = commands(&of(&["--help"]));
    assert!(all.len() > 20, "{all:?}");
    for command in all {
        of(&[&command, "-h"]);
        let help = of(&[&command, "--help"]);
        // an example that the terminal would break cannot be copied
        for line in help
            .lines()
            .filter(|l| l.trim_start().starts_with("monorig "))
        {
            assert!(line.starts_with("  monorig "), "{command}: {line}");
        }
    }
}

/// Every example of every command has options that there are, with values that they take: help is asked for behind
/// it, and a mistake before that is an error. What the examples do: `soak_every_example_works`.
#[test]
fn every_example_is_a_command_line() {
    if !tools(&["sh"]) {
        return;
    }
    let dir = TestFolder::new();
    let help = |arguments: &[&str]| {
        let (code, help, err) = dir.monorig(&[arguments, &["--help"]].concat());
        assert_eq!((code, err.as_str()), (Some(0), ""), "{arguments:?}");
        help
    };
    let all = help(&[]);
    let pages = commands(&all).into_iter().map(|command| help(&[&command]));
    let mut seen = 0;
    for example in pages.chain([all.clone()]).flat_map(|page| examples(&page)) {
        for part in example.split("&&").map(str::trim) {
            // what the shell does has no options of ours
            let part = part.split(['<', '>', '|']).next().unwrap_or_default();
            let arguments = part.strip_prefix("monorig ").unwrap();
            let mut shell = Command::new("sh");
            let program = env!("CARGO_BIN_EXE_monorig");
            shell.args(["-c", &format!("'{program}' {arguments} --help")]);
            let (code, out, err) = dir.output(shell.stdout(Stdio::piped()));
            assert_eq!(code, Some(0), "{part}\n{out}{err}");
            assert!(out.contains("Usage:"), "{part}\n{out}");
            seen += 1;
        }
    }
    assert!(seen >= 60, "only {seen} examples");
}

#[test]
#[ignore = "a soak, which .ci/run makes"]
fn soak_every_example_works() {
    if !tools(&["sh", "cp"]) {
        return;
    }
    let dir = TestFolder::new();
    for folder in ["assets", "scenarios"] {
        let copied = Command::new("cp")
            .arg("-r")
            .arg(project().join(folder))
            .arg(dir.path(""))
            .status();
        assert!(copied.unwrap().success());
    }
    let binary = std::path::Path::new(env!("CARGO_BIN_EXE_monorig"));
    let path = format!(
        "{}:{}",
        binary.parent().unwrap().display(),
        std::env::var("PATH").unwrap_or_default()
    );
    let mut seen = 0;
    for task in [
        None,
        Some("run"),
        Some("tune"),
        Some("report"),
        Some("check"),
        Some("schema"),
    ] {
        let mut arguments: Vec<&str> = task.into_iter().collect();
        arguments.push("--help");
        let (code, help, err) = dir.monorig(&arguments);
        assert_eq!((code, err.as_str()), (Some(0), ""), "{arguments:?}");
        let found = examples(&help);
        let _ = std::fs::remove_dir_all(dir.path("runs/tune")); // every page begins with its own search
        assert!(!found.is_empty(), "no example in\n{help}");
        for example in found {
            let mut shell = Command::new("sh");
            shell
                .args(["-c", &example])
                .env("PATH", &path)
                .stdout(Stdio::piped());
            let (code, out, err) = dir.output(&mut shell);
            // 1: it ran, and an expectation of the scenario failed
            assert!(
                matches!(code, Some(0 | 1)),
                "{example}: {code:?}\n{out}{err}"
            );
            seen += 1;
        }
    }
    assert!(seen >= 10, "only {seen} examples");
}

#[test]
fn completions_know_names() {
    for shell in ["bash", "zsh", "fish"] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_monorig"));
        let told = command.args(["completions", shell]).output().unwrap();
        assert!(told.status.success(), "{shell}");
        let script = String::from_utf8(told.stdout).unwrap();
        for name in ["new-estimator", "rail_fusion", "slope_rmse_deg"] {
            assert!(script.contains(name), "{shell}: {name}");
        }
    }
}
