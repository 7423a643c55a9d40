//! The origin of results: program, files and values. Results are only added to others of the same origin.

use monorig_sim::record::identity::Identity;
use monorig_sim::record::manifest;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

/// Origin of results: a part of the header of every file that results are added to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MadeFrom {
    /// The program.
    pub(crate) monorig: Identity,
    /// SHA-256 of every file that was read, by name relative to the folder of the study.
    pub(crate) inputs: BTreeMap<String, String>,
    /// Values of the files with all defaults filled in, those of parameters too.
    pub(crate) resolved: Value,
    /// SHA-256 over all of these.
    pub(crate) hash: String,
}

impl MadeFrom {
    /// Computes the hash: it is equal for the same program, files and resolved values.
    pub fn new(monorig: &Identity, inputs: BTreeMap<String, String>, resolved: Value) -> Self {
        Self {
            monorig: monorig.clone(),
            hash: manifest::hash(monorig, &inputs, &resolved),
            inputs,
            resolved,
        }
    }

    /// Difference between the origin in a file (`self`) and that of new results. `None`: they are equal.
    pub(crate) fn differs(&self, here: &Self) -> Option<String> {
        if self == here {
            return None;
        }
        let mut found: Vec<String> = self.monorig.differs(&here.monorig).into_iter().collect();
        for (name, digest) in &here.inputs {
            match self.inputs.get(name) {
                Some(same) if same == digest => {}
                Some(_) => found.push(format!("{name} has changed")),
                None => found.push(format!("{name} is new")),
            }
        }
        let gone = self.inputs.keys().filter(|n| !here.inputs.contains_key(*n));
        found.extend(gone.map(|name| format!("{name} is no longer read")));
        found.extend(differing(&self.resolved, &here.resolved, ""));
        if found.is_empty() {
            found.push("its header was edited".into()); // the hash fits nothing else in it
        }
        let more = found.len().saturating_sub(MAX_LISTED);
        found.truncate(MAX_LISTED);
        if more > 0 {
            found.push(format!("{more} more"));
        }
        Some(found.join("; "))
    }
}

/// Most differences in a message; the rest is a number.
const MAX_LISTED: usize = 6;

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
