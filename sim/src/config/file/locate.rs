//! Finds line and column of a key path: the text is read again, and an error is raised on purpose at the target,
//! because the YAML reader gives the place of errors only.

use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// Message of the errors that the search raises on purpose.
const HERE: &str = "this is the place searched for";

/// Part of an entry to locate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// Place of the value.
    Value,
    /// Place of the key.
    Key,
    /// Place of the key where it occurs for the second time.
    SecondKey,
}

/// One step down the tree.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Segment {
    /// Into a mapping.
    Key(String),
    /// Into a list, from 0.
    Index(usize),
}

/// `vertical[2].radius_m` in steps; `None` if it is not such a path.
pub(super) fn segments(path: &str) -> Option<Vec<Segment>> {
    let mut out = Vec::new();
    for part in path.split('.') {
        let (key, indices) = match part.find('[') {
            Some(i) => part.split_at(i),
            None => (part, ""),
        };
        if key.is_empty() {
            return None;
        }
        out.push(Segment::Key(key.to_owned()));
        let mut rest = indices;
        while !rest.is_empty() {
            let (index, after) = rest.strip_prefix('[')?.split_once(']')?;
            out.push(Segment::Index(index.parse().ok()?));
            rest = after;
        }
    }
    Some(out)
}

/// Line and column, from 1, of the target of a key path, or of the nearest existing entry above it.
pub(super) fn locate(text: &str, path: &str, target: Target) -> Option<(usize, usize)> {
    let all = segments(path)?;
    for length in (1..=all.len()).rev() {
        let target = if length == all.len() {
            target
        } else {
            Target::Key
        };
        let mut seen = 0;
        let walk = PathWalk {
            path: &all[..length],
            target,
            seen: &mut seen,
        };
        if let Err(e) = walk.deserialize(serde_yaml::Deserializer::from_str(text)) {
            // any other error: the text is not YAML, and the path is of something else
            return (e.to_string().contains(HERE))
                .then(|| e.location().map(|l| (l.line(), l.column())))?;
        }
    }
    None
}

/// Scalars other than text lead nowhere.
macro_rules! ignore_scalars {
    ($value:expr) => {
        fn visit_bool<E>(self, _: bool) -> Result<Self::Value, E> {
            Ok($value)
        }
        fn visit_i64<E>(self, _: i64) -> Result<Self::Value, E> {
            Ok($value)
        }
        fn visit_u64<E>(self, _: u64) -> Result<Self::Value, E> {
            Ok($value)
        }
        fn visit_f64<E>(self, _: f64) -> Result<Self::Value, E> {
            Ok($value)
        }
        fn visit_unit<E>(self) -> Result<Self::Value, E> {
            Ok($value)
        }
        fn visit_none<E>(self) -> Result<Self::Value, E> {
            Ok($value)
        }
    };
}

struct PathWalk<'a> {
    path: &'a [Segment],
    target: Target,
    seen: &'a mut usize,
}

impl<'de> DeserializeSeed<'de> for PathWalk<'_> {
    type Value = ();
    fn deserialize<D: Deserializer<'de>>(self, de: D) -> Result<(), D::Error> {
        match self.path {
            [] => de.deserialize_any(Raise),
            _ => de.deserialize_any(self),
        }
    }
}

impl<'de> Visitor<'de> for PathWalk<'_> {
    type Value = ();
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a mapping or a list")
    }
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let (wanted, rest) = match self.path {
            [Segment::Key(key), rest @ ..] => (Some(key.as_str()), rest),
            _ => (None, self.path),
        };
        let raise = rest.is_empty() && self.target != Target::Value;
        while let Some(here) = map.next_key_seed(Key {
            wanted,
            raise_at: match (raise, self.target) {
                (false, _) => None,
                (true, Target::SecondKey) => Some(2),
                (true, _) => Some(1),
            },
            seen: &mut *self.seen,
        })? {
            if here && !raise {
                map.next_value_seed(PathWalk {
                    path: rest,
                    target: self.target,
                    seen: &mut *self.seen,
                })?;
            } else {
                map.next_value::<IgnoredAny>()?;
            }
        }
        Ok(())
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<(), A::Error> {
        if let [Segment::Index(index), rest @ ..] = self.path {
            for _ in 0..*index {
                if seq.next_element::<IgnoredAny>()?.is_none() {
                    return Ok(());
                }
            }
            seq.next_element_seed(PathWalk {
                path: rest,
                target: if rest.is_empty() {
                    Target::Value
                } else {
                    self.target
                },
                seen: &mut *self.seen,
            })?;
        }
        while seq.next_element::<IgnoredAny>()?.is_some() {}
        Ok(())
    }
    // A scalar where the path goes on: the path is not there.
    ignore_scalars!(());
    fn visit_str<E>(self, _: &str) -> Result<(), E> {
        Ok(())
    }
}

/// Compares each key with the wanted key, and raises an error at its given occurrence.
struct Key<'a> {
    wanted: Option<&'a str>,
    raise_at: Option<usize>,
    seen: &'a mut usize,
}

impl<'de> DeserializeSeed<'de> for Key<'_> {
    type Value = bool;
    fn deserialize<D: Deserializer<'de>>(self, de: D) -> Result<bool, D::Error> {
        de.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Key<'_> {
    type Value = bool;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a key")
    }
    // `1:` or `yes:` as a key is none of ours.
    ignore_scalars!(false);
    fn visit_str<E: serde::de::Error>(self, key: &str) -> Result<bool, E> {
        if self.wanted != Some(key) {
            return Ok(false);
        }
        let Some(raise_at) = self.raise_at else {
            return Ok(true);
        };
        *self.seen += 1;
        if *self.seen == raise_at {
            Err(E::custom(HERE))
        } else {
            Ok(true)
        }
    }
}

/// Accepts nothing: whatever it visits becomes an error, which has a place.
struct Raise;

impl<'de> Visitor<'de> for Raise {
    type Value = ();
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(HERE)
    }
    fn visit_none<E: serde::de::Error>(self) -> Result<(), E> {
        Err(E::custom(HERE))
    }
}
