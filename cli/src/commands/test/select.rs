//! Selection of the scenarios of a test: by name, or because they failed the last time.

use crate::arguments::Out;
use crate::ui::note::note;
use monorig_sim::record::whole;
use std::collections::BTreeSet;
use std::iter::Peekable;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Texts in the name of a scenario, with `not`, `and`, `or` and parentheses; an expression that can be read.
#[derive(Clone, Debug)]
pub struct NameFilter(String);

/// Words and parentheses of an expression.
type Tokens<'a> = Peekable<std::vec::IntoIter<&'a str>>;

impl FromStr for NameFilter {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let filter = Self(text.to_owned());
        filter.value("").map(|_| filter.clone()).ok_or_else(|| {
            "write texts with `and`, `or`, `not` and parentheses: \"liu2023 and not (vehicle or load)\"".to_owned()
        })
    }
}

impl NameFilter {
    /// The expression as it was written.
    pub(super) fn text(&self) -> &str {
        &self.0
    }

    /// True if the name of a scenario's file fits, in upper or lower case.
    pub(super) fn fits(&self, file: &Path) -> bool {
        let stem = file.file_stem().unwrap_or_default();
        self.value(&stem.to_string_lossy()) == Some(true)
    }

    /// Value of the expression for a name; `None` if it cannot be read.
    fn value(&self, name: &str) -> Option<bool> {
        let spaced = self
            .0
            .to_lowercase()
            .replace('(', " ( ")
            .replace(')', " ) ");
        let words: Vec<&str> = spaced.split_whitespace().collect();
        let mut tokens = words.into_iter().peekable();
        let value = alternatives(&mut tokens, &name.to_lowercase())?;
        tokens.next().is_none().then_some(value)
    }
}

/// Value of terms with `or`, which binds less than `and`.
fn alternatives(tokens: &mut Tokens, name: &str) -> Option<bool> {
    let mut value = all(tokens, name)?;
    while tokens.next_if_eq(&"or").is_some() {
        value |= all(tokens, name)?;
    }
    Some(value)
}

/// Value of terms with `and`.
fn all(tokens: &mut Tokens, name: &str) -> Option<bool> {
    let mut value = term(tokens, name)?;
    while tokens.next_if_eq(&"and").is_some() {
        value &= term(tokens, name)?;
    }
    Some(value)
}

/// Value of a text, of a term behind `not`, or of what parentheses enclose.
fn term(tokens: &mut Tokens, name: &str) -> Option<bool> {
    match tokens.next()? {
        "not" => term(tokens, name).map(|value| !value),
        "(" => alternatives(tokens, name).filter(|_| tokens.next() == Some(")")),
        "and" | "or" | ")" => None,
        text => Some(name.contains(text)),
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
            ("(hill or liu) and section", "hill.yaml", false),
            ("(hill or liu) and section", "liu2023_section1.yaml", true),
            ("not (hill or dale)", "dale.yaml", false),
            ("not not hill and not(dale)", "hill.yaml", true),
        ] {
            assert_eq!(fits(expression, name), expected, "{expression} {name}");
        }
        for wrong in [
            "",
            "a and",
            "not",
            "(a or b",
            "a or b)",
            "()",
            "a b",
            "or a",
            "a or not ",
        ] {
            assert!(NameFilter::from_str(wrong).is_err(), "{wrong}");
        }
    }
}
