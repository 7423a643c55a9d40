//! The page of parameters in the book is made from the registry.
#![allow(clippy::unwrap_used)]

use monorig_estimators::api::params::{Key, KeyKind};
use monorig_estimators::registry::{NAMES, PRINTED_NAMES, key_groups};
use std::path::Path;

/// Names in backquotes.
fn quoted<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
    names.join(", ")
}

/// A row of a table: name, unit, default, range, meaning.
fn parameter_row(key: &Key) -> String {
    let (unit, default, range) = match key.kind {
        KeyKind::Number {
            unit,
            default,
            range: [low, high],
        } => {
            let default = default.map_or("–".to_owned(), |value| value.to_string());
            let unit = if unit == "-" { "1" } else { unit };
            (unit, default, format!("{low} … {high}"))
        }
        KeyKind::Flag { default } => ("", default.to_string(), "true, false".to_owned()),
        KeyKind::Choice { default, choices } => ("", default.to_owned(), choices.join(", ")),
    };
    let meaning = key.doc.replace('|', "\\|");
    format!(
        "| `{}` | {unit} | {default} | {range} | {meaning} |\n",
        key.name
    )
}

/// The page of the parameters: a table for each group, with the estimators that have it.
fn parameters_page() -> String {
    let mut groups: Vec<(&[Key], Vec<&str>)> = Vec::new();
    for name in NAMES.iter().chain(PRINTED_NAMES) {
        for &group in key_groups(name).unwrap() {
            match groups.iter_mut().find(|(keys, _)| *keys == group) {
                Some((_, names)) => names.push(name),
                None => groups.push((group, vec![name])),
            }
        }
    }
    let mut page = "# Parameters of the estimators\n\n\
        Here you find every parameter of every estimator with its unit, default and range. `monorig list parameters NAME` prints those of one\n\
        estimator. A scenario sets a parameter by its name: `estimators: {dffrls_aekf_robust: {mass_sd: 0.2, square_root: false}}`. A value outside\n\
        its range, of another kind, or a name that is not there, is an error. A dash for a default: not set; the meaning has what the estimator then\n\
        takes.\n\n\
        Written by `MONORIG_UPDATE=1 cargo test --release -p monorig-estimators --features printed --test parameters`.\n"
        .to_owned();
    for (keys, names) in groups.iter().filter(|(keys, _)| !keys.is_empty()) {
        let some = quoted(keys.iter().take(3).map(|key| key.name));
        let more = if keys.len() > 3 { " …" } else { "" };
        let of = quoted(names.iter().copied());
        page += &format!("\n## {some}{more}\n\nOf {of}.\n\n");
        page += "| parameter | unit | default | range | meaning |\n|---|---|---|---|---|\n";
        page.extend(keys.iter().map(parameter_row));
    }
    page
}

/// The tables of parameters are those of the program.
#[test]
fn the_tables_of_parameters_are_those_of_the_program() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/src/methods/parameters.md");
    let page = parameters_page();
    assert!(page.lines().count() > 200);
    if std::env::var_os("MONORIG_UPDATE").is_some() {
        std::fs::write(&file, &page).unwrap();
    }
    let there = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(there == page, "{} is stale", file.display());
}
