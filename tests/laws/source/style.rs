//! Comments fit into 120 columns, and the first line of a doc comment is a sentence.

use std::path::{Path, PathBuf};

/// Widest line of a comment, characters.
const MAX_COLUMNS: usize = 120;

/// Members in which so many comments are wider, and so many doc comments open with a noun clause. Both may only fall;
/// every other member and the examples have none.
const AT_MOST: [(&str, usize, usize); 4] = [
    ("estimators", 13, 0),
    ("sim", 2, 0),
    ("interfaces/logs", 1, 0),
    ("lab", 1, 0),
];

/// Every source file below a folder; links and what is built are left out.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        let (path, kind) = (entry.path(), entry.file_type().unwrap());
        if kind.is_dir() && !path.ends_with("target") {
            found.extend(sources(&path));
        } else if kind.is_file() && path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The text of a doc comment's line.
fn doc(line: &str) -> Option<&str> {
    let line = line.trim_start();
    line.strip_prefix("///").or(line.strip_prefix("//!"))
}

/// The first line of a doc comment is no sentence but a clause: "What is wrong.", "Whether it is valid."
fn opens_with_a_clause(line: &str) -> bool {
    let mut words = doc(line).unwrap_or_default().split_whitespace();
    let of_a_module = line.starts_with("//!");
    match words.next() {
        Some("What" | "Whether" | "That") => true,
        Some("How") => !of_a_module,
        _ => false,
    }
}

/// Lines of a file that are too wide, and those that open a doc comment with a clause.
fn counts(text: &str) -> (Vec<&str>, Vec<&str>) {
    let wide =
        |line: &&str| line.trim_start().starts_with("//") && line.chars().count() > MAX_COLUMNS;
    let wide = text.lines().filter(wide).collect();
    let before = std::iter::once("").chain(text.lines());
    let first = before.zip(text.lines());
    let first = first.filter(|(before, line)| doc(before).is_none() && opens_with_a_clause(line));
    (wide, first.map(|(_, line)| line).collect())
}

#[test]
fn comments_fit_and_open_with_a_sentence() {
    let mut wrong = String::new();
    let examples = "examples".to_owned();
    for folder in super::members().into_iter().chain([examples]) {
        let known = AT_MOST.iter().find(|(name, ..)| *name == folder);
        let &(_, most_wide, most_clauses) = known.unwrap_or(&("", 0, 0));
        let (mut wide, mut clauses) = (Vec::new(), Vec::new());
        for file in sources(&super::project().join(&folder)) {
            let text = std::fs::read_to_string(&file).unwrap();
            let found = counts(&text);
            let name = |line: &str| format!("  {}: {}\n", file.display(), line.trim());
            wide.extend(found.0.into_iter().map(name));
            clauses.extend(found.1.into_iter().map(name));
        }
        for (what, found, most) in [
            (
                "lines of comments are wider than 120 columns",
                wide,
                most_wide,
            ),
            (
                "doc comments open with What, Whether, How or That",
                clauses,
                most_clauses,
            ),
        ] {
            if found.len() > most {
                wrong += &format!(
                    "{folder}: {} {what}, not {most}:\n{}",
                    found.len(),
                    found.concat()
                );
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn wide_lines_and_clauses_are_found() {
    let wide = format!("    // {}", "é".repeat(120));
    let text = format!(
        "//! How to use it.\n\n/// Whether it is.\n/// That too.\nfn a() {{}}\n{wide}\n/// Is it.\n"
    );
    assert_eq!(
        counts(&text),
        (vec![wide.as_str()], vec!["/// Whether it is."])
    );
}
