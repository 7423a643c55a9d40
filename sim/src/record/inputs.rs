//! Which files a run was made from: the scenario, every file it names, every file those name, and so on.

use crate::config::file::read_text;
use crate::error::Error;
use std::collections::BTreeMap;
use std::path::Path;

/// Contents of a YAML file and of all files named in it, directly or not, by path relative to the folder of the first.
/// A string that is the path of a file counts as naming it; meshes named inside URDF files only change looks and are left out.
pub fn inputs(file: &Path) -> Result<BTreeMap<String, Vec<u8>>, Error> {
    let root = file.parent().unwrap_or(Path::new(""));
    let name = file
        .file_name()
        .map(|n| n.to_string_lossy().into_owned())
        .unwrap_or_default();
    let mut found = BTreeMap::new();
    gather(root, Path::new(&name), &mut found)?;
    Ok(found)
}

fn gather(root: &Path, name: &Path, found: &mut BTreeMap<String, Vec<u8>>) -> Result<(), Error> {
    let key = tidy(name);
    if found.contains_key(&key) {
        return Ok(());
    }
    let text = read_text(&root.join(name))?;
    let yaml = name.extension().is_some_and(|e| e == "yaml" || e == "yml");
    let value = if yaml {
        serde_yaml::from_str(&text).unwrap_or_default()
    } else {
        serde_yaml::Value::Null
    };
    found.insert(key, text.into_bytes());
    let mut names = Vec::new();
    strings(&value, &mut names);
    let folder = name.parent().unwrap_or(Path::new(""));
    for s in names {
        let next = folder.join(&s);
        if next.extension().is_some() && root.join(&next).is_file() {
            gather(root, &next, found)?;
        }
    }
    Ok(())
}

/// All strings in a value.
fn strings(value: &serde_yaml::Value, out: &mut Vec<String>) {
    match value {
        serde_yaml::Value::String(s) => out.push(s.clone()),
        serde_yaml::Value::Sequence(list) => list.iter().for_each(|v| strings(v, out)),
        serde_yaml::Value::Mapping(map) => map.iter().for_each(|(_, v)| strings(v, out)),
        _ => {}
    }
}

/// `a/../b` is `b`, with forward slashes.
fn tidy(path: &Path) -> String {
    let mut parts: Vec<String> = Vec::new();
    for part in path.components() {
        let part = part.as_os_str().to_string_lossy().into_owned();
        if part == ".." && parts.last().is_some_and(|p| p != "..") {
            parts.pop();
        } else if part != "." {
            parts.push(part);
        }
    }
    parts.join("/")
}
