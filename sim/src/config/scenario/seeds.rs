//! The seeds of a scenario: `7`, `1..10` (both ends included) or `[1, 5, 9]`.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::borrow::Cow;
use std::fmt;

/// Largest number of runs of a scenario; a larger number counts as a typing error.
const MAX_SEEDS: usize = 100_000;

/// Seeds, each once, at least one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Seeds(Vec<u64>);

impl Seeds {
    /// One seed.
    pub fn one(seed: u64) -> Self {
        Self(vec![seed])
    }

    /// The seeds in the order given.
    pub fn as_slice(&self) -> &[u64] {
        &self.0
    }

    /// Reads seeds from YAML: `7`, `1..10` or `[1, 5, 9]`.
    pub fn parse(yaml: &str) -> Result<Self, String> {
        serde_yaml::from_str(yaml).map_err(|e| e.to_string())
    }

    fn new(seeds: Vec<u64>) -> Result<Self, String> {
        if seeds.is_empty() {
            return Err("no seed is given; write a number, a range `1..10` or a list".into());
        }
        let mut sorted = seeds.clone();
        sorted.sort_unstable();
        match sorted.windows(2).find(|w| w[0] == w[1]) {
            Some(w) => Err(format!("seed {} occurs twice; name each seed once", w[0])),
            None => Ok(Self(seeds)),
        }
    }

    fn range(text: &str) -> Result<Self, String> {
        let ends = text.split_once("..").and_then(|(a, b)| {
            let a: u64 = a.trim().parse().ok()?;
            let b: u64 = b.trim().trim_start_matches('=').parse().ok()?;
            Some((a, b))
        });
        let Some((first, last)) = ends else {
            return Err(format!(
                "`{text}` is not a range of seeds; write `1..10` (both ends included), a number, or a list"
            ));
        };
        if last < first {
            return Err(format!("`{text}` has no seed; write the smaller end first"));
        }
        if last - first >= MAX_SEEDS as u64 {
            return Err(format!(
                "`{text}` is more than {MAX_SEEDS} runs; write a shorter range"
            ));
        }
        Self::new((first..=last).collect())
    }
}

impl Default for Seeds {
    fn default() -> Self {
        Self(vec![1])
    }
}

impl<'de> Deserialize<'de> for Seeds {
    fn deserialize<D: Deserializer<'de>>(de: D) -> Result<Self, D::Error> {
        de.deserialize_any(SeedsVisitor)
    }
}

struct SeedsVisitor;

impl<'de> Visitor<'de> for SeedsVisitor {
    type Value = Seeds;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a seed (a whole number, zero or above), a range `1..10` or a list of seeds")
    }
    fn visit_u64<E: Error>(self, seed: u64) -> Result<Seeds, E> {
        Ok(Seeds(vec![seed]))
    }
    fn visit_str<E: Error>(self, text: &str) -> Result<Seeds, E> {
        Seeds::range(text).map_err(E::custom)
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Seeds, A::Error> {
        let mut seeds = Vec::new();
        while let Some(seed) = list.next_element()? {
            if seeds.len() == MAX_SEEDS {
                return Err(A::Error::custom(format!(
                    "the list has more than {MAX_SEEDS} runs; write a shorter list"
                )));
            }
            seeds.push(seed);
        }
        Seeds::new(seeds).map_err(A::Error::custom)
    }
}

impl JsonSchema for Seeds {
    fn schema_name() -> Cow<'static, str> {
        "Seeds".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "A number, a range `1..10` (both ends included), or a list of different numbers.",
            "oneOf": [
                { "type": "integer", "minimum": 0 },
                { "type": "string", "pattern": "^ *[0-9]+ *\\.\\.=? *[0-9]+ *$" },
                { "type": "array", "items": { "type": "integer", "minimum": 0 }, "minItems": 1, "uniqueItems": true }
            ]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(yaml: &str) -> Result<Vec<u64>, String> {
        Seeds::parse(yaml).map(|s| s.0)
    }

    #[test]
    fn the_three_ways_to_write_seeds() {
        assert_eq!(read("7"), Ok(vec![7]));
        assert_eq!(read("1..4"), Ok(vec![1, 2, 3, 4]));
        assert_eq!(read("3..3"), Ok(vec![3]));
        assert_eq!(read("[9, 2]"), Ok(vec![9, 2]));
    }

    #[test]
    fn no_seeds_twice_none_or_endless() {
        for bad in [
            "[]",
            "[1, 1]",
            "4..1",
            "1..x",
            "0..18446744073709551615",
            "-1",
            "1.5",
            "[1, -2]",
            "true",
            "{}",
        ] {
            assert!(read(bad).is_err(), "{bad}");
        }
    }
}
