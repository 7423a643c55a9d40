//! Every file in scenarios/ is named in the page about them, once, and every name there is a file.

use std::collections::BTreeSet;
use std::path::Path;

/// Names without `.yaml`, those of sub-folders as `folder/name`.
fn files() -> BTreeSet<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios");
    let mut names = BTreeSet::new();
    for folder in ["", "harsh", "studies", "tuning"] {
        for entry in std::fs::read_dir(root.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|e| e == "yaml") {
                let name = path.strip_prefix(&root).unwrap().with_extension("");
                names.insert(name.to_str().unwrap().replace('\\', "/"));
            }
        }
    }
    names
}

/// Names on the page: first cells of its tables, and the paths of studies.
fn named() -> Vec<String> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/src/scenarios.md");
    let page = std::fs::read_to_string(page).unwrap();
    let (tables, _) = page.split_once("## What does not hold").unwrap();
    let mut names = Vec::new();
    let mut of_scenarios = false;
    for line in tables.lines() {
        if line.starts_with("| scenario") || !line.starts_with('|') {
            of_scenarios = line.starts_with('|');
        }
        let cell = line
            .strip_prefix("| ")
            .filter(|_| of_scenarios)
            .and_then(|row| row.split(" |").next());
        let cells = cell.into_iter().flat_map(ticked);
        names.extend(cells.filter(|name| !name.contains('/')));
        names.extend(ticked(line).filter(|name| {
            ["harsh/", "studies/", "tuning/"]
                .iter()
                .any(|folder| name.starts_with(folder))
        }));
    }
    names
}

/// The text between back-ticks.
fn ticked(text: &str) -> impl Iterator<Item = String> + '_ {
    text.split('`').skip(1).step_by(2).map(str::to_string)
}

#[test]
fn every_scenario_is_in_the_book_once() {
    let (files, named) = (files(), named());
    assert!(files.len() > 40, "{files:?}");
    for name in &files {
        let count = named.iter().filter(|n| *n == name).count();
        assert_eq!(
            count, 1,
            "scenarios/{name}.yaml is named {count} times in docs/src/scenarios.md"
        );
    }
    for name in &named {
        assert!(
            files.contains(name),
            "docs/src/scenarios.md names `{name}`, scenarios/{name}.yaml is not there"
        );
    }
}
