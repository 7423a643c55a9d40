//! Selection of the scenarios of a test: by name, or because they failed the last time.

use crate::arguments::Out;
use crate::ui::note::note;
use monorig_sim::record::whole;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Texts in the name of a scenario, with `not`, `and` and `or`: all terms of one alternative must fit.
#[derive(Clone, Debug)]
pub struct NameFilter {
    /// The expression as it was written.
    text: String,
    /// Terms of each alternative: true if the name must have the text.
    alternatives: Vec<Vec<(bool, String)>>,
}

impl FromStr for NameFilter {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let term = |term: &str| {
            let term = term.trim();
            let (wanted, name) = match term.strip_prefix("not ") {
                Some(name) => (false, name.trim()),
                None => (true, term),
            };
            let is_word = !["", "and", "or", "not"].contains(&name);
            (is_word && !name.contains([' ', '(', ')'])).then(|| (wanted, name.to_lowercase()))
        };
        let alternatives = text
            .split(" or ")
            .map(|all| all.split(" and ").map(term).collect());
        let alternatives: Option<Vec<Vec<(bool, String)>>> = alternatives.collect();
        let wrong =
            || "write texts with `and`, `or`, `not`: \"liu2023 and not vehicle\"".to_owned();
        let text = text.to_owned();
        alternatives
            .map(|alternatives| Self { text, alternatives })
            .ok_or_else(wrong)
    }
}

impl NameFilter {
    /// The expression as it was written.
    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// True if the name of a scenario's file fits, in upper or lower case.
    pub(super) fn fits(&self, file: &Path) -> bool {
        let stem = file.file_stem().unwrap_or_default();
        let name = stem.to_string_lossy().to_lowercase();
        let fits = |(wanted, text): &(bool, String)| name.contains(text) == *wanted;
        let mut alternatives = self.alternatives.iter();
        alternatives.any(|all| all.iter().all(fits))
    }
}

/// Scenarios that failed in their last test: a file in the folder for results with a path in each line.
pub(super) struct LastFailed {
    file: PathBuf,
    paths: BTreeSet<PathBuf>,
}

impl LastFailed {
    /// Reads the list; without a file nothing failed.
    pub(super) fn read() -> Self {
        let file = Out::usual().join(".last_failed");
        let text = std::fs::read_to_string(&file).unwrap_or_default();
        let paths = text.lines().map(PathBuf::from).collect();
        Self { file, paths }
    }

    /// True for a scenario in the list.
    pub(super) fn has(&self, scenario: &Path) -> bool {
        self.paths.contains(&place(scenario))
    }

    /// Adds failed scenarios to the list, removes scenarios that held, and writes the list. Scenarios that were not
    /// tested stay.
    pub(super) fn update<'a>(mut self, tested: impl Iterator<Item = (&'a Path, bool)>) {
        let before = self.paths.clone();
        for (path, held) in tested {
            match held {
                true => self.paths.remove(&place(path)),
                false => self.paths.insert(place(path)),
            };
        }
        if self.paths == before {
            return;
        }
        let paths = self.paths.iter();
        let text: String = paths.map(|p| format!("{}\n", p.display())).collect();
        let folder = self.file.parent().unwrap_or(Path::new(""));
        let made = std::fs::create_dir_all(folder).map_err(|e| e.to_string());
        let write = || whole::write(&self.file, text.as_bytes()).map_err(|e| e.to_string());
        if let Err(why) = made.and_then(|()| write()) {
            note(&format!(
                "the next --lf cannot know the failed scenarios: {why}"
            ));
        }
    }
}

/// Path of the scenario, valid in every current folder.
fn place(scenario: &Path) -> PathBuf {
    scenario.canonicalize().unwrap_or_else(|_| scenario.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_chosen_by_their_texts() {
        let fits = |expression: &str, name: &str| {
            NameFilter::from_str(expression)
                .unwrap()
                .fits(Path::new(name))
        };
        for (expression, name, expected) in [
            ("liu", "a/liu2023_vehicle.yaml", true),
            ("LIU", "liu2023.yaml", true),
            ("liu", "liu/other.yaml", false),
            ("liu and not vehicle", "liu2023_vehicle.yaml", false),
            ("liu and not vehicle", "liu2023_section1.yaml", true),
            ("hill or liu and section", "hill.yaml", true),
            ("hill or liu and section", "liu2023_vehicle.yaml", false),
            ("not hill", "dale.yaml", true),
        ] {
            assert_eq!(fits(expression, name), expected, "{expression} {name}");
        }
        for wrong in ["", "a and", "not", "(a or b)", "a b", "or a", "a or not "] {
            assert!(NameFilter::from_str(wrong).is_err(), "{wrong}");
        }
    }
}
