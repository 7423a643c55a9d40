//! The schemas under docs/schema are those of the code, and every file names its own in its first line. Both are
//! written anew with `MONORIG_UPDATE=1 cargo test --release --test cli schema::`.

use crate::common::{TestFolder, project};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

#[test]
fn the_committed_schemas_are_fresh() {
    let dir = TestFolder::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/schema");
    let (code, kinds, _) = dir.monorig(&["schema"]);
    assert_eq!(code, Some(0));
    let mut known = BTreeSet::new();
    for kind in kinds
        .lines()
        .filter_map(|line| line.split_whitespace().next())
    {
        let (code, schema, err) = dir.monorig(&["schema", kind]);
        assert_eq!(code, Some(0), "{err}");
        let file = folder.join(format!("{kind}.json"));
        if std::env::var_os("MONORIG_UPDATE").is_some() {
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(&file, &schema).unwrap();
        }
        let committed = std::fs::read_to_string(&file).unwrap_or_default();
        assert!(
            committed == schema,
            "{} is stale; write all anew with\n  MONORIG_UPDATE=1 cargo test --release --test cli schema::",
            file.display()
        );
        known.insert(format!("{kind}.json"));
    }
    assert!(!known.is_empty());
    let there: BTreeSet<String> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    assert_eq!(there, known, "a schema of no kind");
}

/// Files with an ending below a folder, without what is built.
fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("target") && !path.ends_with("runs") {
            all.extend(files(&path, ending));
        } else if path.extension().is_some_and(|e| e == ending) {
            all.push(path);
        }
    }
    all.sort();
    all
}

fn schemas() -> BTreeMap<String, Value> {
    let all = files(&project().join("docs/schema"), "json").into_iter();
    let read = |path: PathBuf| {
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let text = std::fs::read_to_string(&path).unwrap();
        (name, serde_json::from_str(&text).unwrap())
    };
    all.map(read).collect()
}

/// Our files, each with its keys.
fn ours() -> Vec<(PathBuf, Value)> {
    let folders = ["scenarios", "assets", "examples", "tests/data"];
    let all = folders.map(|f| files(&project().join(f), "yaml")).concat();
    assert!(all.len() > 200, "{}", all.len());
    let read = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).unwrap();
        let value = serde_yaml::from_str(&text).unwrap();
        (path, value)
    };
    all.into_iter().map(read).collect()
}

/// An editor finds the schema of each file, which is the one that knows all of its keys. A YAML 1.1 reader takes `off`
/// for a truth value, so it is quoted.
#[test]
fn every_file_names_its_schema_in_its_first_line() {
    let schemas = schemas();
    let mut wrong = Vec::new();
    for (path, value) in ours() {
        let keys: BTreeSet<&String> = value.as_object().unwrap().keys().collect();
        let mut fitting = schemas.iter().filter(|(_, schema)| {
            let properties = schema["properties"].as_object().unwrap();
            let required = schema["required"].as_array();
            let mut required = required.into_iter().flatten().filter_map(Value::as_str);
            keys.iter().all(|k| properties.contains_key(*k))
                && required.all(|r| value.get(r).is_some())
        });
        let (Some((kind, _)), None) = (fitting.next(), fitting.next()) else {
            wrong.push(format!("{}: no schema fits alone", path.display()));
            continue;
        };
        let inside = path.strip_prefix(project()).unwrap();
        let up = "../".repeat(inside.components().count() - 1);
        let line = format!("# yaml-language-server: $schema={up}docs/schema/{kind}.json\n");
        let text = std::fs::read_to_string(&path).unwrap();
        if !text.starts_with(&line) {
            if std::env::var_os("MONORIG_UPDATE").is_some() {
                std::fs::write(&path, line + &text).unwrap();
            } else {
                wrong.push(format!("{}: first line is not {line}", path.display()));
            }
        }
        let quoted = !["off", "on", "yes", "no"].iter().any(|word| {
            [",", "}", "\n"]
                .iter()
                .any(|end| text.contains(&format!(": {word}{end}")))
        });
        if !quoted {
            wrong.push(format!("{}: off, on, yes, no want quotes", path.display()));
        }
    }
    assert_eq!(wrong, [""; 0]);
}

/// The words that the schema of scenarios has are those that scenarios use.
#[test]
fn the_schema_of_scenarios_knows_their_words() {
    let schema = &schemas()["scenario"];
    let words = |place: &str| -> BTreeSet<&str> {
        let list = schema.pointer(place).and_then(Value::as_array).unwrap();
        list.iter().map(|w| w.as_str().unwrap()).collect()
    };
    let metrics = words("/$defs/Expectation/properties/metric/enum");
    let instruments = words("/$defs/Event/anyOf/2/properties/sensor/anyOf/0/enum");
    let types = schema["properties"]["estimators"]["properties"]
        .as_object()
        .unwrap();
    let strings = |value: &Value| -> Vec<String> {
        let one = value.as_str().into_iter();
        let list = value.as_array().into_iter().flatten();
        let all = one.chain(list.filter_map(Value::as_str));
        all.map(str::to_owned).collect()
    };
    let own = ["mine", "c_filter", "ecu"];
    let mut seen = [0; 3];
    for (path, file) in ours() {
        if file.get("drive").is_none() || own.iter().any(|o| !file["estimators"][o].is_null()) {
            continue;
        }
        let told = path.display();
        for key in ["expect", "known_failures"] {
            for bound in file[key].as_array().into_iter().flatten() {
                for metric in strings(&bound["metric"]) {
                    assert!(metrics.contains(metric.as_str()), "{told}: {metric}");
                    seen[0] += 1;
                }
            }
        }
        for event in file["events"].as_array().into_iter().flatten() {
            for sensor in strings(&event["sensor"]) {
                let name = sensor.split('[').next().unwrap();
                assert!(instruments.contains(name), "{told}: {sensor}");
                seen[1] += 1;
            }
        }
        for (name, settings) in file["estimators"].as_object().into_iter().flatten() {
            let of = settings["is"].as_str().unwrap_or(name);
            let Some(of) = types.get(of) else {
                panic!("{told}: {of}");
            };
            for key in settings.as_object().into_iter().flatten().map(|(k, _)| k) {
                assert!(of["properties"].get(key).is_some(), "{told}: {name}.{key}");
            }
            seen[2] += 1;
        }
    }
    assert!(seen.iter().all(|n| *n > 20), "{seen:?}");
}
