//! Differences between two runs: values of the resolved scenario, input files, the program.

use super::Pair;
use crate::reports::page::Section;
use crate::reports::table::Table;
use serde_json::Value;
use std::collections::BTreeMap;

/// Largest number of characters of a value in a difference.
const LONGEST: usize = 80;
/// Largest number of differences that are shown unfolded.
const SHOWN: usize = 30;
/// Text for a value that one of the runs does not have.
const NONE: &str = "–";

/// A value that differs: where, of A, of B.
pub(crate) struct Change {
    path: String,
    a: String,
    b: String,
}

/// Differences, scenario first.
pub(crate) fn of(pair: &Pair) -> Vec<Change> {
    let (a, b) = (&pair.a.manifest, &pair.b.manifest);
    let mut all = differing(flat(&a.resolved), flat(&b.resolved));
    if a.seed != b.seed {
        all.push(change("seed", &a.seed.to_string(), &b.seed.to_string()));
    }
    let sums = |inputs: &BTreeMap<String, String>| -> BTreeMap<String, String> {
        let short = |sum: &String| sum.get(..12).unwrap_or(sum).to_owned();
        let named = |(file, sum): (&String, &String)| (format!("file {file}"), short(sum));
        inputs.iter().map(named).collect()
    };
    all.extend(differing(sums(&a.inputs), sums(&b.inputs)));
    if a.monorig != b.monorig {
        let (a, b) = (a.monorig.to_string(), b.monorig.to_string());
        all.push(change("program", &a, &b));
    }
    all
}

/// The number of differences in a sentence.
pub(crate) fn sentence(changes: &[Change]) -> String {
    match changes {
        [] => "Both runs have the same inputs".into(),
        [one] => format!(
            "One difference: {} is {} in A and {} in B",
            one.path, one.a, one.b
        ),
        all => format!("{} differences in the inputs of the runs", all.len()),
    }
}

/// Differences as a table; the end of a long table is folded.
pub(crate) fn section(changes: &[Change]) -> Section {
    let section = Section::new("What differs");
    if changes.is_empty() {
        return section.text("Scenario, seed, input files and program are the same in both runs.");
    }
    let (open, folded) = changes.split_at(changes.len().min(SHOWN));
    let section = section.table(table(open));
    match folded.len() {
        0 => section,
        n => section.folded(format!("{n} more differences"), table(folded)),
    }
}

fn table(changes: &[Change]) -> Table {
    let mut table = Table::new(&["", "A", "B"], &[]);
    for c in changes {
        table.row([
            c.path.clone().into(),
            c.a.clone().into(),
            c.b.clone().into(),
        ]);
    }
    table
}

fn change(path: &str, a: &str, b: &str) -> Change {
    let cut = |text: &str| match text.chars().count() > LONGEST {
        true => text.chars().take(LONGEST).collect::<String>() + " …",
        false => text.to_owned(),
    };
    Change {
        path: path.to_owned(),
        a: cut(a),
        b: cut(b),
    }
}

fn differing(a: BTreeMap<String, String>, b: BTreeMap<String, String>) -> Vec<Change> {
    let paths: std::collections::BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    let of = |map: &BTreeMap<String, String>, path: &String| {
        map.get(path).cloned().unwrap_or(NONE.to_owned())
    };
    let both = paths
        .into_iter()
        .map(|path| (path, of(&a, path), of(&b, path)));
    let differing = both.filter(|(_, a, b)| a != b);
    differing.map(|(path, a, b)| change(path, &a, &b)).collect()
}

/// Every value by its path, as `--set` writes it.
fn flat(value: &Value) -> BTreeMap<String, String> {
    let mut all = BTreeMap::new();
    fill(&mut all, String::new(), value);
    // a variant is named after what differs, which is shown itself
    all.remove("name");
    // what `--set` changes in the files of a scenario stands there as pairs of path and value
    let changed = value.get("changed").and_then(Value::as_array);
    all.retain(|path, _| !path.starts_with("changed["));
    for pair in changed.into_iter().flatten() {
        if let [Some(path), Some(value)] = [0, 1].map(|i| pair.get(i).and_then(Value::as_str)) {
            all.insert(path.to_owned(), value.to_owned());
        }
    }
    all
}

fn fill(all: &mut BTreeMap<String, String>, path: String, value: &Value) {
    match value {
        Value::Object(entries) if !entries.is_empty() => {
            for (key, value) in entries {
                let path = match path.as_str() {
                    "" => key.clone(),
                    path => format!("{path}.{key}"),
                };
                fill(all, path, value);
            }
        }
        Value::Array(items) if items.iter().any(|i| i.is_object() || i.is_array()) => {
            for (i, item) in items.iter().enumerate() {
                fill(all, format!("{path}[{i}]"), item);
            }
        }
        // not given is the same as no value
        Value::Null => {}
        Value::String(text) => drop(all.insert(path, text.clone())),
        other => drop(all.insert(path, other.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn values_that_differ_are_found_by_their_path() {
        let a = json!({"name": "x", "load": {"mass_kg": 10}, "drive": {"speed": [{"mps": 1}]}, "same": [1, 2], "gone": 1});
        let b = json!({"name": "y", "load": {"mass_kg": 5}, "drive": {"speed": [{"mps": 2}]}, "same": [1, 2], "none": null});
        let all = differing(flat(&a), flat(&b));
        let told: Vec<[&str; 3]> = all.iter().map(|c| [&*c.path, &*c.a, &*c.b]).collect();
        let expected = [
            ["drive.speed[0].mps", "1", "2"],
            ["gone", "1", NONE],
            ["load.mass_kg", "10", "5"],
        ];
        assert_eq!(told, expected);
        assert_eq!(
            sentence(&all[2..]),
            "One difference: load.mass_kg is 10 in A and 5 in B"
        );
    }
}
