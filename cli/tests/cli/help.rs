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

/// The words of all commands, from the help of the program and of those commands that have others.
fn commands(help: impl Fn(&[&str]) -> String) -> Vec<Vec<String>> {
    let of = |text: &str| -> Vec<String> {
        let list = text.split("<COMMAND>\n\n").nth(1).unwrap_or_default();
        let list = list.trim_start_matches("Commands:\n").split("\n\n");
        let list = list.into_iter().next().unwrap();
        let named = (list.lines()).filter(|l| l.starts_with("  ") && !l.starts_with("   "));
        let first = |l: &str| l.split_whitespace().next().unwrap().to_owned();
        named.map(first).filter(|c| c != "help").collect()
    };
    let text = help(&["--help"]);
    let more = text.split("More commands: ").nth(1).unwrap();
    let more = more.split('.').next().unwrap().split(", ");
    let mut all = Vec::new();
    for command in of(&text).into_iter().chain(more.map(str::to_owned)) {
        let inner = of(&help(&[&command, "--help"]));
        all.extend(inner.into_iter().map(|i| vec![command.clone(), i]));
        all.push(vec![command]);
    }
    all
}

#[test]
fn help_fits_a_screen_of_80_columns_and_24_lines() {
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
        let lines = help.lines().count();
        assert!(
            arguments[0] == "help" || lines <= 24,
            "{arguments:?}: {lines} lines"
        );
        help
    };
    let all = commands(of);
    assert!(all.len() > 24, "{all:?}");
    for command in all {
        let words: Vec<&str> = command.iter().map(String::as_str).collect();
        let brief = of(&[&words[..], &["-h"]].concat());
        assert_eq!(brief, of(&[&words[..], &["--help"]].concat()));
        // what is left out has a place
        let help = of(&[&["help"], &words[..]].concat());
        for option in help.split_whitespace().filter(|w| w.starts_with("--")) {
            let name = option.trim_end_matches(|c: char| !c.is_ascii_alphanumeric());
            let of_all = ["--quiet", "--verbose", "--color"].contains(&name);
            let whole = of_all || brief.contains(name) || brief.contains("monorig help ");
            assert!(whole, "{command:?}: {name}");
        }
        // an example that the terminal would break cannot be copied
        for line in help
            .lines()
            .filter(|l| l.trim_start().starts_with("monorig "))
        {
            assert!(line.starts_with("  monorig "), "{command:?}: {line}");
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
        let (code, help, err) = dir.monorig(arguments);
        assert_eq!((code, err.as_str()), (Some(0), ""), "{arguments:?}");
        help
    };
    let pages = commands(help).into_iter().map(|command| {
        let words = command.iter().map(String::as_str);
        help(&["help"].into_iter().chain(words).collect::<Vec<_>>())
    });
    let mut seen = 0;
    for example in pages.flat_map(|page| examples(&page)) {
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
    for task in ["run", "tune", "report", "check"] {
        let arguments = ["help", task];
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

/// Each old name of a command is the new one, also behind options of the program.
#[test]
fn old_names_of_commands_still_work() {
    let dir = TestFolder::new();
    for (old, new) in [
        ("calibrate", "log calibrate"),
        ("draw", "new courses"),
        ("export", "log export"),
        ("inspect", "log info"),
        ("judge", "replay"),
        ("map", "log track"),
        ("new-estimator", "new estimator"),
        ("runs", "list runs"),
        ("schema", "check --schema"),
        ("sensors fit", "log imu"),
    ] {
        for before in ["", "-q ", "--color never "] {
            let told = |command: &str| {
                let words = format!("{before}{command} --help");
                dir.monorig(&words.split(' ').collect::<Vec<_>>())
            };
            assert_eq!(told(old), told(new), "{before}{old}");
            assert_eq!(told(old).0, Some(0));
        }
    }
    // a value that is called like an old command is none
    let (code, _, err) = dir.monorig(&["check", "map"]);
    assert!(code == Some(2) && err.contains("map:"), "{err}");
}

#[test]
fn completions_know_names() {
    for shell in ["bash", "zsh", "fish"] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_monorig"));
        let told = command.args(["completions", shell]).output().unwrap();
        assert!(told.status.success(), "{shell}");
        let script = String::from_utf8(told.stdout).unwrap();
        for name in ["calibrate", "rail_fusion", "slope_rmse_deg"] {
            assert!(script.contains(name), "{shell}: {name}");
        }
    }
}
