//! Lock files of the packages outside of the workspace: what both use has the same version there, so that it is built
//! from what a machine has already. Compared as texts: Cargo would ask for the packages.

use crate::docs::{files_below, project};
use std::collections::BTreeMap;
use std::path::Path;

/// The versions of every package of a lock file.
fn versions(lock: &Path) -> BTreeMap<String, Vec<String>> {
    let text = std::fs::read_to_string(lock).unwrap();
    let mut all = BTreeMap::<String, Vec<String>>::new();
    for package in text.split("[[package]]").skip(1) {
        let value = |key: &str| {
            let line = package.lines().find_map(|l| l.strip_prefix(key)).unwrap();
            line.trim_matches('"').to_owned()
        };
        let of_name = all.entry(value("name = ")).or_default();
        of_name.push(value("version = "));
    }
    all
}

/// Of the versions that Cargo takes for one another, the first numbers: `1` of 1.2.3, `0.2` of 0.2.3.
fn line_of(version: &str) -> String {
    let numbers: Vec<&str> = version.split(['.', '+', '-']).collect();
    let first = numbers.iter().position(|n| *n != "0").unwrap_or(2);
    numbers[..=first.min(2)].join(".")
}

#[test]
fn packages_outside_of_the_workspace_have_its_versions() {
    let ours = versions(&project().join("Cargo.lock"));
    assert!(ours.len() > 100, "{}", ours.len());
    let mut found = files_below(&project().join("docs"));
    found.extend(files_below(&project().join("examples")));
    found.retain(|file| file.ends_with("Cargo.lock"));
    assert!(found.len() >= 3, "{found:?}");
    let mut other = Vec::new();
    for lock in found {
        for (name, theirs) in versions(&lock) {
            let ours = ours.get(&name).map_or(&[][..], Vec::as_slice);
            for version in theirs {
                let replaced = ours.iter().find(|v| line_of(v) == line_of(&version));
                if let Some(ours) = replaced.filter(|ours| **ours != version) {
                    other.push(format!(
                        "{}: {name} {version}; the workspace has {ours}",
                        lock.display()
                    ));
                }
            }
        }
    }
    assert!(
        other.is_empty(),
        "in the folder of each: cargo update -p NAME --precise VERSION\n{}",
        other.join("\n")
    );
    // what the example has is all in the workspace, whatever the line
    let mut example = versions(&project().join("examples/own_estimator/Cargo.lock"));
    example.remove("own_estimator").unwrap();
    for (name, theirs) in example {
        let ours = &ours[&name];
        assert!(theirs.iter().all(|v| ours.contains(v)), "{name} {theirs:?}");
    }
}

#[test]
fn lines_of_versions() {
    for (version, line) in [("1.2.3", "1"), ("0.2.3", "0.2"), ("0.0.3", "0.0.3")] {
        assert_eq!(line_of(version), line);
    }
}
