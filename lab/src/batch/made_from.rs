//! What results were made from and by: results are only added to others if nothing of it differs.

use monorig_sim::record::identity::Identity;
use monorig_sim::record::manifest;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

/// What results were made from and by: part of the header of every file that results are added to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MadeFrom {
    /// The program.
    pub(crate) monorig: Identity,
    /// SHA-256 of every file that was read, by name relative to the folder of the study.
    pub(crate) inputs: BTreeMap<String, String>,
    /// What the files come to with all defaults filled in, those of parameters too.
    pub(crate) resolved: Value,
    /// SHA-256 over all of these.
    pub(crate) hash: String,
}

impl MadeFrom {
    /// The same program, files and resolved values have the same hash.
    pub fn new(monorig: &Identity, inputs: BTreeMap<String, String>, resolved: Value) -> Self {
        Self {
            monorig: monorig.clone(),
            hash: manifest::hash(monorig, &inputs, &resolved),
            inputs,
            resolved,
        }
    }

    /// What differs between what is in a file (`self`) and what would be added to it; none if nothing does.
    pub(crate) fn differs(&self, here: &Self) -> Option<String> {
        if self == here {
            return None;
        }
        let mut told: Vec<String> = self.monorig.differs(&here.monorig).into_iter().collect();
        for (name, digest) in &here.inputs {
            match self.inputs.get(name) {
                Some(same) if same == digest => {}
                Some(_) => told.push(format!("{name} has changed")),
                None => told.push(format!("{name} is new")),
            }
        }
        let gone = self.inputs.keys().filter(|n| !here.inputs.contains_key(*n));
        told.extend(gone.map(|name| format!("{name} is no longer read")));
        told.extend(differing(&self.resolved, &here.resolved, ""));
        if told.is_empty() {
            told.push("its header was edited".into()); // the hash fits nothing else in it
        }
        let more = told.len().saturating_sub(MAX_TOLD);
        told.truncate(MAX_TOLD);
        if more > 0 {
            told.push(format!("{more} more"));
        }
        Some(told.join("; "))
    }
}

/// Of so many differences is told.
const MAX_TOLD: usize = 6;

/// The first value that differs, as its path and both values.
fn differing(there: &Value, here: &Value, path: &str) -> Option<String> {
    let below = |key: &str| match path {
        "" => key.to_owned(),
        _ => format!("{path}.{key}"),
    };
    match (there, here) {
        (a, b) if a == b => None,
        (Value::Object(a), Value::Object(b)) => a
            .keys()
            .chain(b.keys().filter(|key| !a.contains_key(*key)))
            .find_map(|key| {
                let (a, b) = (a.get(key), b.get(key));
                let null = Value::Null;
                differing(a.unwrap_or(&null), b.unwrap_or(&null), &below(key))
            }),
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            let both = a.iter().zip(b).enumerate();
            both.into_iter()
                .find_map(|(i, (a, b))| differing(a, b, &format!("{path}[{i}]")))
        }
        (a, b) => Some(format!("{path} {} there, {} here", brief(a), brief(b))),
    }
}

fn brief(value: &Value) -> String {
    const LONGEST: usize = 60;
    let text = value.to_string();
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_differs_is_told_by_name() {
        let identity = Identity::of_program(Some("abc"));
        let inputs = |digests: &[(&str, &str)]| -> BTreeMap<String, String> {
            let all = digests.iter();
            all.map(|(n, d)| ((*n).to_owned(), (*d).to_owned()))
                .collect()
        };
        let resolved = json!({"a": {"b": [1, 2]}});
        let there = MadeFrom::new(
            &identity,
            inputs(&[("x", "1"), ("y", "2")]),
            resolved.clone(),
        );
        assert_eq!(there.differs(&there.clone()), None);
        let other = Identity::of_program(Some("abd"));
        for (here, told) in [
            (
                MadeFrom::new(&other, there.inputs.clone(), resolved.clone()),
                "git revision abc there, abd here",
            ),
            (
                MadeFrom::new(&identity, inputs(&[("x", "3"), ("z", "2")]), resolved),
                "x has changed; z is new; y is no longer read",
            ),
            (
                MadeFrom::new(&identity, there.inputs.clone(), json!({"a": {"b": [1, 3]}})),
                "a.b[1] 2 there, 3 here",
            ),
            (
                MadeFrom {
                    hash: String::new(),
                    ..there.clone()
                },
                "its header was edited",
            ),
        ] {
            assert_eq!(there.differs(&here).unwrap(), told);
        }
    }
}
