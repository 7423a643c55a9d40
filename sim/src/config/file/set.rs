//! `--set path=value`: change one value of a file before it is checked; `--set path[+]=value` adds one to a list.

use super::locate::{Segment, segments};
use serde_yaml::Value;

/// Longest path: the tree becomes no deeper by it than a file may be.
const MAX_PATH: usize = 200;
/// End of a path that adds a value to the list before it.
pub(super) const APPEND: &str = "[+]";

/// Put `value` (YAML) at `path`; missing mappings on the way are made, list items must exist. A path with `[+]` behind
/// it adds the value to the list that it names, and makes the list if there is none. The error is message and help.
pub(super) fn set(tree: &mut Value, path: &str, value: &str) -> Result<(), (String, String)> {
    if path.len() > MAX_PATH {
        let help = "a path such as `load.mass_kg`".to_owned();
        return Err((format!("this path has more than {MAX_PATH} letters"), help));
    }
    let list = path.strip_suffix(APPEND);
    let steps = segments(list.unwrap_or(path)).ok_or_else(|| {
        (
            format!("`{path}` is not a path"),
            "paths look like `load.mass_kg` or `drive.speed[1].mps`".to_owned(),
        )
    })?;
    super::limits::yaml(value).map_err(|over| (over.message, over.help))?;
    let new: Value = serde_yaml::from_str(value).map_err(|e| {
        let said = e.to_string();
        let said = said.split(" at line ").next().unwrap_or_default();
        (
            format!("the value is not YAML: {said}"),
            "give a number, a word, or a list or mapping in [] or {}".to_owned(),
        )
    })?;
    let mut here = tree;
    for step in steps {
        here = match step {
            Segment::Key(key) => {
                if here.is_null() {
                    *here = Value::Mapping(serde_yaml::Mapping::new());
                }
                let map = here.as_mapping_mut().ok_or_else(|| {
                    (
                        format!("the part before `{key}` is not a mapping"),
                        "remove the rest of the path, or set the whole entry".to_owned(),
                    )
                })?;
                map.entry(Value::String(key)).or_insert(Value::Null)
            }
            Segment::Index(index) => {
                let list = here.as_sequence_mut().ok_or_else(|| {
                    (
                        format!("`[{index}]` needs a list, but this is not a list"),
                        "indices in [] are for lists only, and count from 0".to_owned(),
                    )
                })?;
                let length = list.len();
                list.get_mut(index).ok_or_else(|| {
                    (
                        format!("the list has only {length} items, not [{index}]"),
                        "items count from 0; [+] adds one".to_owned(),
                    )
                })?
            }
        };
    }
    if list.is_none() {
        *here = new;
        return Ok(());
    }
    if here.is_null() {
        *here = Value::Sequence(Vec::new());
    }
    let items = here.as_sequence_mut().ok_or_else(|| {
        (
            "[+] needs a list, but this is not a list".to_owned(),
            "write [+] after the path of a list, such as `events[+]`".to_owned(),
        )
    })?;
    items.push(new);
    Ok(())
}
