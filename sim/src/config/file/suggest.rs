//! "Did you mean …": the nearest of the words that would have been right.

use std::path::Path;

/// A longer word is no name: comparing it would take long.
const MAX_WORD_BYTES: usize = 256;

/// Candidate most similar to `word`, if at most a third of its letters differ.
///
/// ```
/// assert_eq!(monorig_sim::config::file::nearest("mas_kg", ["speed_mps", "mass_kg"]), Some("mass_kg"));
/// assert_eq!(monorig_sim::config::file::nearest("colour", ["speed_mps", "mass_kg"]), None);
/// ```
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if word.len() > MAX_WORD_BYTES {
        return None;
    }
    candidates
        .into_iter()
        .filter(|c| c.len() <= MAX_WORD_BYTES)
        .map(|c| {
            let differs = strsim::osa_distance(&word.to_lowercase(), &c.to_lowercase());
            (differs, c)
        })
        .filter(|(differs, c)| differs * 3 <= c.chars().count().max(3))
        .min_by_key(|(differs, _)| *differs)
        .map(|(_, c)| c)
}

/// Help for an unknown word: the nearest of them, or, where none is near, all of them.
pub fn suggestion<'a>(word: &str, known: impl IntoIterator<Item = &'a str>, title: &str) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    match nearest(word, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("{title}: {}", known.join(", ")),
    }
}

/// Help for a missing file: a near name in its folder, or the folder that is missing.
pub(super) fn beside(path: &Path) -> String {
    let folder = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    let Ok(entries) = std::fs::read_dir(folder) else {
        return format!("the folder {} does not exist either", folder.display());
    };
    let mut names: Vec<String> = entries
        .flatten()
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    let wanted = path.file_name().unwrap_or_default().to_string_lossy();
    match nearest(&wanted, names.iter().map(String::as_str)) {
        Some(name) => format!("did you mean {}?", path.with_file_name(name).display()),
        None => "check the name; a relative name starts at the current folder".to_owned(),
    }
}
