//! The page of parameters in the book is made from the registry.

use monorig_estimators::Real;
use monorig_estimators::api::params::{Key, KeyKind};
use monorig_estimators::registry::{NAMES, PRINTED_NAMES, key_groups};
use std::path::Path;

/// Names in backquotes.
fn quoted<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
    names.join(", ")
}

/// A number as people read it: powers of ten where it is very small or very large.
fn number(value: Real) -> String {
    match value.abs() {
        size if size != 0.0 && !(1e-3..1e6).contains(&size) => format!("{value:e}"),
        _ => value.to_string(),
    }
}

/// The default and the range with its unit.
fn default_and_range(key: &Key) -> (String, String) {
    match key.kind {
        KeyKind::Number {
            unit,
            default,
            range: [low, high],
        } => {
            let default = default.map_or("–".to_owned(), number);
            let unit = if unit == "-" { "" } else { unit };
            let range = format!("{}…{} {unit}", number(low), number(high));
            (default, range.trim_end().to_owned())
        }
        KeyKind::Flag { default } => (default.to_string(), "flag".to_owned()),
        KeyKind::Choice { default, choices } => (default.to_owned(), choices.join(", ")),
    }
}

/// The part that two keys have in common which are the same parameter, with a default of their own or not.
fn what(key: &Key) -> (&'static str, String, &'static str) {
    (key.name, default_and_range(key).1, key.doc)
}

/// The meaning in a cell of a table.
fn meaning(key: &Key) -> String {
    key.doc.replace('|', "\\|")
}

/// Estimators in the order of the list, and the keys that these and no others have.
type Section = (Vec<&'static str>, Vec<Key>);

/// All keys by the estimators that have them.
fn sections() -> Vec<Section> {
    let mut groups: Vec<(&[Key], Vec<&str>)> = Vec::new();
    for name in NAMES.iter().chain(PRINTED_NAMES) {
        for &group in key_groups(name).unwrap() {
            match groups.iter_mut().find(|(keys, _)| *keys == group) {
                Some((_, names)) => names.push(name),
                None => groups.push((group, vec![name])),
            }
        }
    }
    let mut sections: Vec<Section> = Vec::new();
    for (keys, names) in groups {
        match sections.iter_mut().find(|(of, _)| *of == names) {
            Some((_, all)) => all.extend_from_slice(keys),
            None => sections.push((names, keys.to_vec())),
        }
    }
    sections.retain(|(_, keys)| !keys.is_empty());
    sections
}

/// Of each name that means the same in several sections: the key with its commonest meaning, in order of the names.
fn shared(sections: &[Section]) -> Vec<Key> {
    let all: Vec<&Key> = sections.iter().flat_map(|(_, keys)| keys).collect();
    let times = |key: &Key| all.iter().filter(|other| what(other) == what(key)).count();
    let mut shared: Vec<Key> = Vec::new();
    for key in &all {
        match shared.iter_mut().find(|s| s.name == key.name) {
            Some(there) if times(there) < times(key) => *there = **key,
            None if times(key) > 1 => shared.push(**key),
            _ => {}
        }
    }
    shared.sort_by_key(|key| key.name);
    shared
}

/// The page of the parameters: what several have, then a table for each set of estimators.
fn parameters_page() -> String {
    let sections = sections();
    let shared = shared(&sections);
    let mut page = "# Parameters of the estimators\n\n\
        Here you find every parameter of every estimator with its default, range and unit. `monorig list parameters NAME` prints those of one\n\
        estimator. A scenario sets a parameter by its name: `estimators: {dffrls_aekf_robust: {mass_sd: 0.2, square_root: false}}`. A value outside\n\
        its range, of another kind, or a name that is not there, is an error. A dash for a default: not set; the meaning has what the estimator then\n\
        takes. A flag is `true` or `false`.\n\n\
        Written by `MONORIG_UPDATE=1 cargo test --release -p monorig-estimators --features printed --test estimators parameters::`.\n\n\
        ## Shared parameters\n\n\
        The sections below name those that they share, each with its default there.\n\n\
        | parameter | range | meaning |\n|---|---|---|\n"
        .to_owned();
    for key in &shared {
        let (_, range) = default_and_range(key);
        page += &format!("| `{}` | {range} | {} |\n", key.name, meaning(key));
    }
    for (names, keys) in &sections {
        page += &format!("\n## {}\n", quoted(names.iter().copied()));
        let is_shared = |key: &&Key| shared.iter().any(|s| what(s) == what(key));
        let (common, own): (Vec<&Key>, Vec<&Key>) = keys.iter().partition(is_shared);
        if !common.is_empty() {
            let one = |key: &&Key| format!("`{}` {}", key.name, default_and_range(key).0);
            let common: Vec<String> = common.iter().map(one).collect();
            page += &format!("\nShared: {}.\n", common.join(", "));
        }
        if !own.is_empty() {
            page += "\n| parameter | default | range | meaning |\n|---|---|---|---|\n";
        }
        for key in own {
            let (default, range) = default_and_range(key);
            page += &format!(
                "| `{}` | {default} | {range} | {} |\n",
                key.name,
                meaning(key)
            );
        }
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
