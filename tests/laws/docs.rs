//! The documentation leads nowhere that is not there: links, headings, files, commands, the table of contents. Its
//! tables are whole.

use monorig_sim::config::scenario::Scenario;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

pub fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Files of the project below a folder, without what is built and what is hidden.
pub fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        // a link leads to what is listed already
        let kind = entry.file_type().unwrap();
        if kind.is_dir() && !name.starts_with('.') && name != "target" {
            files.extend(files_below(&entry.path()));
        } else if kind.is_file() {
            files.push(entry.path());
        }
    }
    files
}

/// Every page of the project.
fn pages() -> Vec<PathBuf> {
    let mut pages = files_below(&project());
    pages.retain(|path| path.extension().is_some_and(|e| e == "md"));
    assert!(pages.len() > 40, "{pages:?}");
    pages
}

/// Checks every page, and shows everything that is wrong at once.
fn check_pages(wrong: impl Fn(&Path, &str) -> Vec<String>) {
    let mut all = Vec::new();
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        let of_page = wrong(&page, &text).into_iter();
        all.extend(of_page.map(|w| format!("{}: {w}", page.display())));
    }
    assert_eq!(all, [""; 0]);
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

/// Links of a page that lead nowhere.
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
            (_, "") => target.exists(),
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
    check_pages(dead);
}

#[test]
fn files_named_in_examples_are_there() {
    check_pages(|_, text| {
        let gone = named(text)
            .into_iter()
            .filter(|path| !project().join(path).exists());
        gone.map(str::to_owned).collect()
    });
}

/// Names of source files in backquotes, such as `sim/src/lib.rs` or `lib.rs`.
fn sources(text: &str) -> Vec<&str> {
    let is_source = |word: &&str| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
        let known = [".rs", ".py", ".sh", ".toml"]
            .iter()
            .any(|end| word.ends_with(end));
        known && word.chars().all(plain) && !word.starts_with(['.', '/'])
    };
    let in_quotes = prose(text).flat_map(|line| line.split('`').skip(1).step_by(2));
    in_quotes.filter(is_source).collect()
}

/// The changelog is history: its files may be gone.
#[test]
fn source_files_in_backquotes_are_there() {
    let files: Vec<String> = files_below(&project())
        .iter()
        .map(|path| path.display().to_string().replace('\\', "/"))
        .collect();
    let is_there = |name: &str| files.iter().any(|file| file.ends_with(&format!("/{name}")));
    check_pages(|page, text| match page.ends_with("CHANGELOG.md") {
        true => Vec::new(),
        false => {
            let gone = sources(text).into_iter().filter(|name| !is_there(name));
            gone.map(str::to_owned).collect()
        }
    });
}

/// ARCHITECTURE names the files of a newcomer's path with their lines, to a tenth.
#[test]
fn the_newcomers_path_has_the_lines_it_says() {
    let text = std::fs::read_to_string(project().join("ARCHITECTURE.md")).unwrap();
    let (_, path) = text.split_once("## A newcomer's path").unwrap();
    let (path, _) = path.split_once("\n## ").unwrap();
    let mut files = 0;
    for row in path.lines().filter(|row| row.contains(".rs`")) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let told: f64 = cells[3].parse().unwrap();
        let file = project().join(cells[2].trim_matches('`'));
        let lines = std::fs::read_to_string(&file).unwrap().lines().count() as f64;
        assert!((lines / told - 1.0).abs() <= 0.1, "{row}: {lines} lines");
        files += 1;
    }
    assert!(files >= 5, "{files}");
}

/// Names of the commands, from the files that have them.
fn commands() -> Vec<String> {
    let files = files_below(&project().join("cli/src/commands"));
    let texts = files
        .iter()
        .map(|path| std::fs::read_to_string(path).unwrap());
    let names = texts.flat_map(|text| {
        let parts = text.split("name = \"").skip(1);
        let of_file: Vec<String> = parts
            .filter_map(|p| Some(p.split_once('"')?.0.to_owned()))
            .collect();
        of_file
    });
    let is_name = |name: &String| name.chars().all(|c| c.is_ascii_lowercase());
    let names: Vec<String> = names.filter(is_name).collect();
    assert!(names.len() >= 18, "{names:?}");
    names
}

/// Commands of monorig that a page names: the word behind `monorig` in backquotes, and at the start of a line of code.
fn commands_named(text: &str) -> Vec<&str> {
    let begins = |part: &'_ str| part.starts_with("monorig ");
    let in_quotes = prose(text).flat_map(|line| line.split('`').skip(1).step_by(2));
    let in_code = text
        .lines()
        .filter(|line| line.starts_with("    "))
        .map(str::trim);
    let all = in_quotes.chain(in_code).filter(|part| begins(part));
    let words = all.filter_map(|part| part.split_whitespace().nth(1));
    let is_name = |word: &&str| word.chars().all(|c| c.is_ascii_lowercase());
    words.filter(is_name).collect()
}

#[test]
fn commands_named_in_pages_are_there_and_the_introduction_has_all() {
    let commands = commands();
    let known = |name: &str| name == "help" || commands.iter().any(|c| c == name);
    check_pages(|_, text| {
        let gone = commands_named(text).into_iter().filter(|name| !known(name));
        gone.map(|name| format!("monorig {name}")).collect()
    });
    for page in ["docs/src/introduction.md", "README.md"] {
        let text = std::fs::read_to_string(project().join(page)).unwrap();
        let missing = |name: &&String| {
            !text.contains(&format!("`{name}`")) && !text.contains(&format!("monorig {name}"))
        };
        let missing: Vec<&String> = commands.iter().filter(missing).collect();
        assert_eq!(missing, [""; 0], "{page}");
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

/// Every page of the book with a block of Rust is compiled by the tests of the documentation of `cli`.
#[test]
fn every_block_of_rust_in_the_book_is_compiled() {
    let compiled = std::fs::read_to_string(project().join("cli/src/book.rs")).unwrap();
    let mut pages = files_below(&project().join("docs/src"));
    pages.retain(|page| page.extension().is_some_and(|e| e == "md"));
    pages.retain(|page| std::fs::read_to_string(page).unwrap().contains("```rust"));
    assert!(!pages.is_empty());
    for page in pages {
        let page = page.strip_prefix(project()).unwrap();
        let included = format!("include_str!(\"../../{}\")", page.display());
        assert!(compiled.contains(&included), "{included}");
    }
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

/// Cargo features of a crate, without `default`.
fn features(manifest: &str) -> Vec<String> {
    let list = manifest.split("[features]\n").nth(1).unwrap_or_default();
    let list = list.split("\n[").next().unwrap_or_default();
    let names = list
        .lines()
        .filter_map(|line| Some(line.split_once(" = ")?.0));
    names
        .filter(|name| !name.starts_with('#') && *name != "default")
        .map(str::to_owned)
        .collect()
}

#[test]
fn the_features_of_the_estimators_are_in_their_readme() {
    let read =
        |name: &str| std::fs::read_to_string(project().join("estimators").join(name)).unwrap();
    let (features, readme) = (features(&read("Cargo.toml")), read("README.md"));
    assert!(features.len() > 5, "{features:?}");
    let missing = features
        .iter()
        .filter(|name| !readme.contains(&format!("`{name}`")));
    assert_eq!(missing.collect::<Vec<_>>(), [""; 0]);
}

/// First rows of tables without a title: their second line is no rule, as where a blank line tears a table.
fn headless(text: &str) -> Vec<&str> {
    let lines: Vec<&str> = prose(text).collect();
    let is_row = |line: Option<&&str>| line.is_some_and(|l| l.starts_with('|'));
    let is_rule =
        |line: Option<&&str>| line.is_some_and(|l| l.starts_with("|-") || l.starts_with("|:-"));
    let first = |i: &usize| is_row(lines.get(*i)) && !(*i > 0 && is_row(lines.get(i - 1)));
    let headless = (0..lines.len()).filter(|i| first(i) && !is_rule(lines.get(i + 1)));
    headless.map(|i| lines[i]).collect()
}

#[test]
fn tables_have_titles_and_rows_as_many_cells() {
    check_pages(|_, text| {
        let wrong = torn(text).into_iter().chain(headless(text));
        wrong.map(str::to_owned).collect()
    });
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

/// Bounds that fail for one reason: their number, estimators, metrics and scenarios.
#[derive(Default)]
struct Reason {
    bounds: usize,
    estimators: BTreeSet<String>,
    metrics: BTreeSet<String>,
    scenarios: BTreeSet<String>,
}

impl Reason {
    /// The item of the page: the reason, then where it acts.
    fn item(&self, why: &str) -> String {
        let quoted = |names: &BTreeSet<String>| {
            let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
            names.join(", ")
        };
        let of = match self.estimators.is_empty() {
            true => "The run".to_owned(),
            false => quoted(&self.estimators),
        };
        format!(
            "**{why}**\n{of}: {}; in {}.\n\n",
            quoted(&self.metrics),
            quoted(&self.scenarios)
        )
    }
}

/// The second half of the page of known failures: every reason once, those with most bounds first.
fn reasons() -> String {
    let mut reasons: BTreeMap<String, Reason> = BTreeMap::new();
    let folder = project().join("scenarios");
    for path in scenario_files(&folder) {
        let scenario = Scenario::load(&path, &[]).unwrap();
        let name = path.strip_prefix(&folder).unwrap().with_extension("");
        let name = name.display().to_string().replace('\\', "/");
        for known in &scenario.file.known_failures {
            let why = known.why.split_whitespace().collect::<Vec<_>>().join(" ");
            let reason = reasons.entry(why).or_default();
            reason.bounds += 1;
            reason.estimators.extend(known.estimator.clone());
            reason.metrics.insert(known.metric.clone());
            reason.scenarios.insert(name.clone());
        }
    }
    let bounds: usize = reasons.values().map(|reason| reason.bounds).sum();
    let mut sorted: Vec<(String, Reason)> = reasons.into_iter().collect();
    sorted.sort_by_key(|(_, reason)| std::cmp::Reverse(reason.bounds));
    let mut text = format!("{bounds} bounds, {} reasons.\n\n", sorted.len());
    text.extend(sorted.iter().map(|(why, reason)| reason.item(why)));
    text.trim_end().to_owned() + "\n"
}

/// Known failures of every scenario by their reason. The page has all of them behind its last heading, and no others.
#[test]
fn the_page_of_known_failures_is_what_the_scenarios_say() {
    let file = project().join("docs/known_failures.md");
    let page = std::fs::read_to_string(&file).unwrap();
    let heading = "## The reasons\n\n";
    let (head, there) = page.split_once(heading).unwrap();
    let made = reasons();
    if std::env::var_os("MONORIG_UPDATE").is_some() {
        std::fs::write(&file, format!("{head}{heading}{made}")).unwrap();
        return;
    }
    assert!(
        there == made,
        "known_failures.md is stale: write it anew with MONORIG_UPDATE=1"
    );
}

/// The checks above see what is wrong.
#[test]
fn what_is_wrong_is_found() {
    let page = project().join("docs/src/made_up.md");
    let text = "# Two words, `code`\n[a](nowhere.md) [b](physics.md) [c](physics.md#nothing) ![d](images/none.png)\n\
                [e](#two-words-code) [f](#three) [g](https://example.org/x)\n```\n[h](in_code.md)\n```\n";
    let found = dead(&page, text);
    let expected = [
        "nowhere.md",
        "physics.md#nothing",
        "images/none.png",
        "#three",
    ];
    assert_eq!(found, expected);
    let text = "monorig run scenarios/minimal.yaml, `scenarios/*.yaml`, assets/none.yaml.";
    assert_eq!(named(text), ["scenarios/minimal.yaml", "assets/none.yaml"]);
    let text =
        "| a | b |\n|---|---|\n| 1 | 2 |\n| \\|v\\| | 2 |\n| |v| | 2 |\n| 1 |\n\n| c |\n|---|\n";
    assert_eq!(torn(text), ["| |v| | 2 |", "| 1 |"]);
    assert_eq!(headless("| a |\n|---|\n| 1 |\n\n| 2 |\n| 3 |\n"), ["| 2 |"]);
    let text = "`lib.rs`, `a/b.py` and `runs/a.yaml`; `monorig run x` and `monorig rum`\n\n    monorig chek a\n";
    assert_eq!(sources(text), ["lib.rs", "a/b.py"]);
    assert_eq!(commands_named(text), ["run", "rum", "chek"]);
}
