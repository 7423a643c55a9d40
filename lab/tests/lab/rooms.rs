//! The rooms of the crate: a room uses only those that stand before it in the tables of `lib.rs`.

use std::collections::BTreeSet;
use std::fs::{read_dir, read_to_string};
use std::path::{Path, PathBuf};

/// Every source file below a folder.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for entry in read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => all.extend(sources(&path)),
            false => all.extend((path.extension() == Some("rs".as_ref())).then_some(path)),
        }
    }
    all
}

/// The room that a file stands in.
fn room(file: &Path, src: &Path) -> String {
    let below = file.strip_prefix(src).unwrap();
    let first = below.components().next().unwrap();
    Path::new(first.as_os_str())
        .file_stem()
        .unwrap()
        .to_string_lossy()
        .into_owned()
}

/// Names of the rooms that a text uses, as `crate::name`.
fn used(text: &str) -> BTreeSet<String> {
    let of = |rest: &str| {
        rest.chars()
            .take_while(|c| c.is_alphanumeric() || *c == '_')
            .collect()
    };
    text.split("crate::").skip(1).map(of).collect()
}

#[test]
fn arrows_lead_from_later_rooms_to_earlier_ones() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let lib = read_to_string(src.join("lib.rs")).unwrap();
    let rows = lib.lines().filter_map(|l| l.strip_prefix("//! | [`"));
    let order: Vec<&str> = rows.filter_map(|l| l.split('`').next()).collect();
    let place = |name: &str| order.iter().position(|room| *room == name);
    let mut rooms = BTreeSet::new();
    for file in sources(&src) {
        let from = room(&file, &src);
        if from == "lib" {
            continue;
        }
        let here = place(&from).unwrap_or_else(|| panic!("{from} is not in a table of lib.rs"));
        rooms.insert(from);
        for to in used(&read_to_string(&file).unwrap()) {
            if let Some(there) = place(&to) {
                assert!(there <= here, "{} uses {to}", file.display());
            }
        }
    }
    assert_eq!(rooms.len(), order.len(), "{rooms:?} against {order:?}");
}

/// Name of the type that a line of code defines.
fn defined(line: &str) -> Option<&str> {
    let line = line
        .trim_start_matches("pub ")
        .trim_start_matches("pub(crate) ");
    let line = line.trim_start_matches("pub(super) ");
    let kinds = ["struct ", "enum ", "trait ", "type "];
    let rest = kinds.iter().find_map(|kind| line.strip_prefix(kind))?;
    rest.split(|c: char| !c.is_alphanumeric()).next()
}

#[test]
fn a_type_name_has_one_meaning() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut seen = BTreeSet::new();
    for file in sources(&src) {
        let text = read_to_string(&file).unwrap();
        for name in text.lines().filter_map(defined) {
            assert!(seen.insert(name.to_owned()), "{name} in {}", file.display());
        }
    }
    assert!(seen.len() > 100, "{} types", seen.len());
}
