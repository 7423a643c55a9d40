//! The kinds of files there are. A new one is a variant and a row of the table.

use clap::ValueEnum;
use monorig_sim::error::Error;
use monorig_sim::scenario::{Scenario, ScenarioFile};
use schemars::Schema;
use std::path::Path;

/// A kind of file of ours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// What to run
    Scenario,
}

/// What is known of a kind.
pub struct Row {
    /// The kind.
    pub kind: Kind,
    /// Its name on the command line.
    pub name: &'static str,
    /// What it is for.
    pub about: &'static str,
    /// Keys by which a file of the kind is recognised: the kind with most of them in the file.
    pub telling: &'static [&'static str],
    /// Its JSON Schema.
    pub schema: fn() -> Schema,
    /// Reads and checks a file.
    pub check: fn(&Path) -> Result<(), Error>,
}

/// Every kind.
pub const KINDS: &[Row] = &[Row {
    kind: Kind::Scenario,
    name: "scenario",
    about: "what to run: track, train, drive cycle, sensors, estimators, events, expectations",
    telling: &["train", "stop", "drive", "in_loop", "expect", "why"],
    schema: || schemars::schema_for!(ScenarioFile),
    check: |path| Scenario::load(path, &[]).map(drop),
}];

/// What is known of one kind.
pub fn row(kind: Kind) -> Option<&'static Row> {
    KINDS.iter().find(|row| row.kind == kind)
}

/// The kind of a file with these keys at its top, if it can be told.
pub fn recognise(keys: &[String]) -> Option<&'static Row> {
    let hits = |row: &Row| {
        let telling = row.telling.iter();
        telling.filter(|t| keys.iter().any(|k| k == *t)).count()
    };
    KINDS
        .iter()
        .filter(|row| hits(row) > 0)
        .max_by_key(|row| hits(row))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_a_row_and_is_recognised_by_its_own_keys() {
        for kind in Kind::value_variants() {
            let row = row(*kind).unwrap();
            let name = kind.to_possible_value().unwrap();
            assert_eq!(name.get_name(), row.name);
            let keys: Vec<String> = row.telling.iter().map(|t| (*t).to_owned()).collect();
            assert_eq!(recognise(&keys).unwrap().name, row.name);
        }
        assert!(recognise(&["nothing".to_owned()]).is_none());
    }
}
