//! Variants of a scenario: the changes on the command line, and the name that separates such a run from others.
//!
//! A run of the scenario as it stands is called by its name, and one with `--set` or `--plant` `NAME@VARIANT`: a name
//! that was given, or a short hash of the changes. Folder and recording have it, so that two variants are never taken
//! for one run.

use sha2::{Digest, Sha256};
use std::collections::BTreeMap;

/// Number of hexadecimal digits of a variant without a name.
const DIGITS: usize = 6;
/// Key that is not part of a variant: the seed has its own folder.
const SEEDS: &str = "seeds";

/// Changes to a scenario file, and the name of the variant.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Variant {
    /// Changes `path=value`, sorted by path; of several for one path the last.
    pub changes: Vec<String>,
    name: Option<String>,
}

impl Variant {
    /// Makes the variant of these changes; `name` is the user's name for it.
    pub fn new(overrides: &[(String, String)], name: Option<&str>) -> Self {
        let list = overrides.iter().filter(|(path, _)| path != SEEDS);
        let by_path: BTreeMap<&str, &str> = list.map(|(p, v)| (p.as_str(), v.trim())).collect();
        let changes: Vec<String> = by_path.iter().map(|(p, v)| format!("{p}={v}")).collect();
        let name = match name {
            Some(name) => Some(name.to_owned()),
            None if changes.is_empty() => None,
            None => {
                let hash = Sha256::digest(changes.join("\n"));
                let hex: String = hash.iter().map(|byte| format!("{byte:02x}")).collect();
                Some(hex.chars().take(DIGITS).collect())
            }
        };
        Self { changes, name }
    }

    /// Name of a run of the scenario, with the variant.
    pub fn run_name(&self, scenario: &str) -> String {
        match &self.name {
            Some(name) => format!("{scenario}@{name}"),
            None => scenario.to_owned(),
        }
    }
}

/// A name for a variant: letters, digits, `.`, `_` and `-`, so that it can be part of a folder's name everywhere.
pub fn parse(text: &str) -> Result<String, String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    match text.chars().all(plain) && (1..=60).contains(&text.len()) && !text.starts_with('.') {
        true => Ok(text.to_owned()),
        false => Err("write letters, digits, `.`, `_` and `-`, at most 60 of them".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(list: &[(&str, &str)]) -> String {
        let list: Vec<_> = list
            .iter()
            .map(|(p, v)| ((*p).into(), (*v).into()))
            .collect();
        Variant::new(&list, None).run_name("hill")
    }

    #[test]
    fn changes_tell_runs_apart_whatever_their_order() {
        assert_eq!(of(&[]), "hill");
        assert_eq!(of(&[("seeds", "7")]), "hill");
        let (ten, five) = (
            of(&[("load.mass_kg", "10000")]),
            of(&[("load.mass_kg", "5000")]),
        );
        assert!(ten.starts_with("hill@") && five.starts_with("hill@") && ten != five);
        assert_eq!(of(&[("a", "1"), ("b", "2")]), of(&[("b", "2"), ("a", "1")]));
        assert_eq!(of(&[("a", "1"), ("a", "2")]), of(&[("a", "2")]));
        // no two lists run together: `a=1\nb` and `a`, `1\nb`
        assert_ne!(
            of(&[("a", "1b"), ("c", "2")]),
            of(&[("a", "1"), ("bc", "2")])
        );
    }

    #[test]
    fn a_name_is_part_of_a_path_and_nothing_else() {
        assert!(parse("5t_no-lag.v2").is_ok());
        for bad in ["", "a/b", "..", "a b", "ä"] {
            assert!(parse(bad).is_err(), "{bad}");
        }
        let named = Variant::new(&[], Some("base"));
        assert_eq!(named.run_name("hill"), "hill@base");
    }
}
