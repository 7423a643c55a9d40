//! The documentation leads nowhere that is not there: links, headings, files named in examples, the table of contents. Its tables are
//! whole.

#![allow(clippy::unwrap_used)] // helpers of tests

use monorig_sim::config::scenario::Scenario;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Every page: those of the book, README and the changelog.
fn pages() -> Vec<PathBuf> {
    let mut pages = vec![project().join("README.md"), project().join("CHANGELOG.md")];
    let mut folders = vec![project().join("docs/src")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                pages.push(path);
            }
        }
    }
    assert!(pages.len() > 20, "{pages:?}");
    pages
}

/// Lines of a page that are not in a block of code.
fn prose(text: &str) -> impl Iterator<Item = &str> {
    let mut code = false;
    text.lines().filter(move |line| {
        let fence = line.trim_start().starts_with("```");
        code ^= fence;
        !code && !fence
    })
}

/// Targets of the links and pictures in a page.
fn links(text: &str) -> Vec<&str> {
    prose(text)
        .flat_map(|line| line.split("](").skip(1))
        .filter_map(|rest| Some(rest.split_once(')')?.0))
        .collect()
}

/// Names by which the headings of a page are linked to, as mdBook and GitHub make them.
fn anchors(text: &str) -> Vec<String> {
    let headings = prose(text).filter(|line| line.starts_with('#'));
    let name = |line: &str| {
        let title = line.trim_start_matches('#').trim().to_lowercase();
        let keep = |c: &char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
        let kept: String = title.chars().filter(keep).collect();
        kept.replace(' ', "-")
    };
    headings.map(name).collect()
}

/// What is wrong with the links of a page.
fn dead(page: &Path, text: &str) -> Vec<String> {
    let mut dead = Vec::new();
    for link in links(text) {
        if link.starts_with("https://") || link.starts_with("http://") {
            continue;
        }
        let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
        let target = page.parent().unwrap().join(file);
        let has = |text: &str| anchors(text).iter().any(|a| a == anchor);
        let there = match (file, anchor) {
            ("", _) => has(text),
            (_, "") => target.is_file(),
            _ => std::fs::read_to_string(&target).is_ok_and(|text| has(&text)),
        };
        if !there {
            dead.push(link.to_owned());
        }
    }
    dead
}

/// Files of the project that a page names, as in `monorig run scenarios/minimal.yaml`.
fn named(text: &str) -> Vec<&str> {
    let part_of_path = |c: char| c.is_ascii_alphanumeric() || "/._-*{}<>".contains(c);
    text.split(|c| !part_of_path(c))
        .map(|word| word.trim_end_matches('.'))
        .filter(|word| {
            ["scenarios/", "assets/", "docs/"]
                .iter()
                .any(|folder| word.starts_with(folder))
        })
        .filter(|word| !word.contains(['*', '{', '}', '<', '>']))
        .collect()
}

#[test]
fn no_link_is_dead() {
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        assert_eq!(dead(&page, &text), [""; 0], "{}", page.display());
    }
}

#[test]
fn files_named_in_examples_are_there() {
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        let mut gone = named(&text);
        gone.retain(|path| !project().join(path).exists());
        assert_eq!(gone, [""; 0], "{}", page.display());
    }
}

#[test]
fn every_page_of_the_book_is_in_its_table_of_contents() {
    let source = project().join("docs/src");
    let contents = source.join("SUMMARY.md");
    let text = std::fs::read_to_string(&contents).unwrap();
    let listed: BTreeSet<PathBuf> = links(&text).iter().map(|l| source.join(l)).collect();
    let pages = pages().into_iter();
    let there = pages.filter(|p| p.starts_with(&source) && *p != contents);
    assert_eq!(there.collect::<BTreeSet<_>>(), listed);
}

/// Rows that have another number of cells than the title of their table. A bar within a cell is written `\|`.
fn torn(text: &str) -> Vec<&str> {
    let bars = |line: &str| line.replace("\\|", "").matches('|').count();
    let mut width = None;
    prose(text)
        .filter(|line| {
            if !line.starts_with('|') {
                width = None;
                return false;
            }
            bars(line) != *width.get_or_insert(bars(line)) || !line.ends_with('|')
        })
        .collect()
}

#[test]
fn rows_of_tables_have_as_many_cells_as_their_titles() {
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        assert_eq!(torn(&text), [""; 0], "{}", page.display());
    }
}

/// Scenario files in the folder and in those below it.
fn scenario_files(folder: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_owned();
        if path.is_dir() && name != "studies" && name != "tuning" {
            all.extend(scenario_files(&path));
        } else if path.extension().is_some_and(|e| e == "yaml") {
            all.push(path);
        }
    }
    all
}

/// Names in backquotes, each once, in their order.
fn quoted(names: impl Iterator<Item = String>) -> String {
    let mut once: Vec<String> = Vec::new();
    for name in names {
        let name = format!("`{name}`");
        if !once.contains(&name) {
            once.push(name);
        }
    }
    once.join(", ")
}

/// Known failures of every scenario, an entry a row: scenario, estimators, metrics, why. They are rows of the page, and the page has no others.
#[test]
fn the_page_of_known_failures_is_what_the_scenarios_say() {
    let mut known = BTreeSet::new();
    let folder = project().join("scenarios");
    for path in scenario_files(&folder) {
        let scenario = Scenario::load(&path, &[]).unwrap();
        let name = path.strip_prefix(&folder).unwrap().with_extension("");
        let name = name.display().to_string().replace('\\', "/");
        let failures = &scenario.file.known_failures;
        for entry in failures.iter().map(|k| k.entry).collect::<BTreeSet<_>>() {
            let of = || failures.iter().filter(|k| k.entry == entry);
            let estimators = quoted(of().map(|k| k.estimator.clone().unwrap_or_default()));
            let metrics = quoted(of().map(|k| k.metric.clone()));
            let why = of().map(|k| k.why.as_str()).next().unwrap_or_default();
            let why = why.split_whitespace().collect::<Vec<_>>().join(" ");
            known.insert(format!("| `{name}` | {estimators} | {metrics} | {why} |"));
        }
    }
    let file = project().join("docs/src/known_failures.md");
    if std::env::var_os("MONORIG_UPDATE").is_some() {
        let page = std::fs::read_to_string(&file).unwrap();
        let (head, _) = page.split_once("|---|---|---|---|\n").unwrap();
        let rows: String = known.iter().map(|row| format!("{row}\n")).collect();
        std::fs::write(&file, format!("{head}|---|---|---|---|\n{rows}")).unwrap();
    }
    let page = std::fs::read_to_string(&file).unwrap();
    let rows = page.lines().filter(|l| l.starts_with("| `"));
    let rows: BTreeSet<String> = rows.map(str::to_owned).collect();
    assert_eq!(rows, known);
}

/// The checks above see what is wrong.
#[test]
fn what_is_wrong_is_found() {
    let page = project().join("docs/src/made_up.md");
    let text = "# Two words, `code`\n[a](nowhere.md) [b](design.md) [c](design.md#nothing) ![d](images/none.png)\n\
                [e](#two-words-code) [f](#three) [g](https://example.org/x)\n```\n[h](in_code.md)\n```\n";
    let found = dead(&page, text);
    let expected = [
        "nowhere.md",
        "design.md#nothing",
        "images/none.png",
        "#three",
    ];
    assert_eq!(found, expected);
    let text = "monorig run scenarios/minimal.yaml, `scenarios/*.yaml`, assets/none.yaml.";
    assert_eq!(named(text), ["scenarios/minimal.yaml", "assets/none.yaml"]);
    let text =
        "| a | b |\n|---|---|\n| 1 | 2 |\n| \\|v\\| | 2 |\n| |v| | 2 |\n| 1 |\n\n| c |\n|---|\n";
    assert_eq!(torn(text), ["| |v| | 2 |", "| 1 |"]);
}
