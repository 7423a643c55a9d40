//! A published method depends on filters, models, the public types and one interface, and on nothing else of the crate;
//! as printed it stands on the samples of a pipeline besides, and on nothing of ours. Every number of our own estimator
//! that a user does not set stands in `tuning.rs`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Most files that a published method stands on, itself included.
const MOST: usize = 28;

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// The file of a module path such as `filters::rls::Rls`, whose end may be an item of the file.
fn file_of(path: &str) -> Option<PathBuf> {
    let parts: Vec<&str> = path.split("::").collect();
    (1..=parts.len()).rev().find_map(|count| {
        let module = source().join(parts[..count].join("/"));
        [module.with_extension("rs"), module.join("mod.rs")]
            .into_iter()
            .find(|file| file.is_file())
    })
}

/// Paths after `use crate::`, with lists in braces taken apart.
fn spread(prefix: &str, tree: &str, found: &mut Vec<String>) {
    let Some((head, list)) = tree.split_once('{') else {
        found.push(format!("{prefix}{tree}"));
        return;
    };
    let list = list.strip_suffix('}').unwrap();
    let (mut depth, mut start) = (0, 0);
    for (k, c) in list.char_indices().chain([(list.len(), ',')]) {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                spread(&format!("{prefix}{head}"), &list[start..k], found);
                start = k + 1;
            }
            _ => {}
        }
    }
}

/// Files of this crate that a file imports, tests left out.
fn imports(file: &Path) -> BTreeSet<PathBuf> {
    let text = fs::read_to_string(file).unwrap();
    let (text, _) = text.split_once("#[cfg(test)]").unwrap_or((&text, ""));
    let mut paths = Vec::new();
    for import in text.split("use crate::").skip(1) {
        let (tree, _) = import.split_once(';').unwrap();
        let tree: String = tree.chars().filter(|c| !c.is_whitespace()).collect();
        spread("", &tree, &mut paths);
    }
    paths.iter().filter_map(|path| file_of(path)).collect()
}

fn closure(file: &Path) -> BTreeSet<PathBuf> {
    let (mut seen, mut next) = (BTreeSet::new(), vec![file.to_owned()]);
    while let Some(file) = next.pop() {
        if seen.insert(file.clone()) {
            next.extend(imports(&file));
        }
    }
    seen
}

/// The files of `methods/` that implement the trait `Method`.
fn methods() -> Vec<PathBuf> {
    let files = fs::read_dir(source().join("methods")).unwrap();
    let files = files.map(|entry| entry.unwrap().path());
    let implements = |file: &PathBuf| {
        let text = fs::read_to_string(file).unwrap();
        let words: Vec<&str> = text.split_whitespace().collect();
        words.windows(2).any(|pair| pair == ["Method", "for"])
    };
    files.filter(implements).collect()
}

#[test]
fn a_published_method_stands_on_filters_and_models_and_nothing_else() {
    let methods = methods();
    assert!(methods.len() >= 6, "{methods:?}");
    for method in methods {
        let files = closure(&method);
        let places: Vec<String> = files
            .iter()
            .map(|file| file.strip_prefix(source()).unwrap().display().to_string())
            .collect();
        println!("{}: {} files", method.display(), files.len());
        assert!((8..=MOST).contains(&files.len()), "{method:?}: {places:#?}");
        for room in places
            .iter()
            .filter_map(|place| place.split(['/', '\\']).next())
        {
            let allowed = ["api", "filters", "models", "methods"].contains(&room);
            assert!(allowed, "{method:?} stands on {room}: {places:#?}");
        }
    }
}

/// A method as printed is a pipeline of its own: it takes its samples from `preprocess` and is run by `runner`. What
/// these two stand on is theirs; what the printed file itself imports is none of our supervision.
#[test]
fn a_method_as_printed_imports_neither_supervision_nor_fusion() {
    let files = fs::read_dir(source().join("printed")).unwrap();
    let files: Vec<PathBuf> = files.map(|entry| entry.unwrap().path()).collect();
    assert!(files.len() >= 7, "{files:?}");
    let allowed = [
        "api",
        "filters",
        "models",
        "preprocess",
        "printed",
        "lib.rs",
        "runner.rs",
    ];
    for file in files {
        for import in imports(&file) {
            let place = import.strip_prefix(source()).unwrap().to_owned();
            let room = place.iter().next().unwrap().to_str().unwrap();
            assert!(allowed.contains(&room), "{file:?} imports {place:?}");
        }
    }
}

/// Rooms of our own estimator.
const ROOMS: [&str; 6] = ["aiding", "bank", "detect", "fusion", "instruments", "rail"];

/// Most numbers of our own estimator that a user does not set.
const MOST_NUMBERS: usize = 123;

/// Numeric types, by the words of a type.
const NUMERIC: [&str; 14] = [
    "Real", "f64", "f32", "usize", "u8", "u16", "u32", "u64", "u128", "i8", "i16", "i32", "i64",
    "isize",
];

/// Source files below a folder; none if it is not there.
fn files_below(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten();
    let paths = entries.map(|entry| entry.unwrap().path());
    let below = |path: PathBuf| match path.is_dir() {
        true => files_below(&path),
        false => vec![path],
    };
    paths.flat_map(below).collect()
}

/// Names of the numeric constants and statics that a source text declares, its tests left out.
fn numeric_constants(text: &str) -> Vec<&str> {
    let (text, _) = text.split_once("#[cfg(test)]").unwrap_or((text, ""));
    let declared = text.lines().filter_map(|line| {
        let line = line.trim_start();
        let (_, rest) = line
            .split_once("const ")
            .or_else(|| line.split_once("static "))
            .filter(|(head, _)| head.is_empty() || head.starts_with("pub"))?;
        let (name, rest) = rest.split_once(": ")?;
        let (kind, _) = rest.split_once('=')?;
        let mut words = kind.split(|c: char| !c.is_alphanumeric());
        let plain = name
            .chars()
            .all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_');
        (plain && words.any(|word| NUMERIC.contains(&word))).then_some(name)
    });
    declared.collect()
}

/// A number stands in `tuning.rs`, whatever its visibility and its place, and nowhere else in the rooms.
#[test]
fn the_numbers_of_our_own_estimator_stand_in_one_file() {
    let text = "const A: Real = 1.0;\n    pub(crate) const B_2: [[u8; 2]; 3] = x;\nstatic C: [crate::Real; 1] = [0.0];\n\
        const NAMES: &[&str] = &[];\nconst fn of(x: usize) -> Real {\n#[cfg(test)]\nconst D: f64 = 1.0;";
    assert_eq!(numeric_constants(text), ["A", "B_2", "C"]);
    let files = ROOMS.map(|room| files_below(&source().join(room)));
    let mut seen = 0;
    for file in files.iter().flatten() {
        let name = file.file_name().unwrap();
        if name != "tuning.rs" && name != "tests.rs" {
            seen += 1;
            let text = fs::read_to_string(file).unwrap();
            let found = numeric_constants(&text);
            assert!(
                found.is_empty(),
                "{}: {found:?} belong into tuning.rs",
                file.display()
            );
        }
    }
    assert!(seen > 40);
}

/// Each number says in its comment where it comes from, and there are no more of them than there were.
#[test]
fn a_number_of_our_own_estimator_says_where_it_comes_from() {
    let text = fs::read_to_string(source().join("tuning.rs")).unwrap();
    let (_, groups) = text.split_once("\ngroups! {").unwrap();
    let (mut comment, mut count) = (String::new(), 0);
    for line in groups.lines().map(str::trim_start) {
        if let Some(words) = line.strip_prefix("///") {
            comment += words;
            continue;
        }
        let field = line
            .split_once(": ")
            .filter(|(_, rest)| rest.contains(" = "));
        if let Some((name, _)) = field {
            count += 1;
            let told = ["Chosen", "Derived", "Measured", "Data sheet"];
            assert!(
                told.iter().any(|told| comment.contains(told)),
                "{name}: {comment}"
            );
        }
        comment.clear();
    }
    assert!(count > 100 && count <= MOST_NUMBERS, "{count} numbers");
}
