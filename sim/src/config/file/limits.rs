//! Limits of input files: a file far beyond the size of our files is refused before it is parsed, with the limit in the
//! message.
//!
//! The YAML reader takes time that grows with the square of the brackets in a file, memory for every mark in it, and
//! writes out an alias wherever it stands; so marks, brackets and what aliases come to are counted first.

use serde::de::{Deserialize, DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use std::cell::Cell;
use std::fmt;

/// Longest input file, bytes.
pub const MAX_FILE_BYTES: u64 = 16 << 20;
/// Largest shared library or FMU, bytes.
pub const MAX_LIBRARY_BYTES: u64 = 256 << 20;
/// Longest file of results that is read at once (results of studies are read line by line), bytes.
pub const MAX_RESULT_BYTES: u64 = 256 << 20;
/// Longest page, viewer or recording that is read at once, bytes.
pub const MAX_LARGE_BYTES: u64 = 768 << 20;
/// Deepest nesting of lists and mappings.
pub const MAX_DEPTH: usize = 64;
/// Largest number of lists and mappings in brackets.
const MAX_BRACKETS: usize = 20_000;
/// Most marks that can begin or end a value: line ends, commas, colons, hyphens, brackets.
const MAX_MARKS: usize = 1_000_000;
/// Largest number of values; an alias counts as its content.
const MAX_VALUES: usize = 200_000;
/// Longest text of all values together, bytes; an alias counts as its content.
const MAX_TEXT_BYTES: usize = 2 * MAX_FILE_BYTES as usize;

/// A limit that a file exceeds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Over {
    /// The mistake.
    pub message: String,
    /// The remedy.
    pub help: String,
    /// Line and column, from 1, if known.
    pub place: Option<(usize, usize)>,
}

impl Over {
    fn new(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            help: help.into(),
            place: None,
        }
    }
}

/// Refuses a YAML text beyond the limits. Any other mistake in it is left to its reader.
pub(crate) fn yaml(text: &str) -> Result<(), Over> {
    let count = |wanted: &[u8]| text.bytes().filter(|b| wanted.contains(b)).count();
    if count(b"[{") > MAX_BRACKETS {
        return Err(Over::new(
            "this file has far too many brackets",
            format!(
                "use at most {MAX_BRACKETS} of `[` and `{{`; write long lists with an item in each line"
            ),
        ));
    }
    if count(b"\n\r,:-?[]{}") > MAX_MARKS {
        return Err(Over::new(
            "this file has far more values than any file of monorig",
            format!("at most {MAX_VALUES} values"),
        ));
    }
    let spent = Spent::default();
    let walk = ValueCounter {
        depth: 0,
        is_key: false,
        spent: &spent,
    };
    let end = walk.deserialize(serde_yaml::Deserializer::from_str(text));
    let place = || {
        let at = end.err()?.location()?;
        Some((at.line(), at.column()))
    };
    match spent.over.take() {
        Some(mut over) => {
            over.place = place();
            Err(over)
        }
        None => Ok(()),
    }
}

/// Refuses a key or a line that looks like YAML but is not YAML: a space of another kind where one belongs, a merge
/// key.
pub(super) fn taken_for_yaml(text: &str) -> Option<Over> {
    let indented = text.chars().next();
    let behind = text
        .split(':')
        .skip(1)
        .filter_map(|rest| rest.chars().next());
    let mut spaces = indented.into_iter().chain(behind);
    if let Some(c) = spaces.find(|c| !c.is_ascii() && c.is_whitespace()) {
        return Some(Over::new(
            format!(
                "the character U+{:04X} looks like a space but is not a space",
                u32::from(c)
            ),
            "write a space; this character often comes with text copied from web pages",
        ));
    }
    (text == "<<").then(|| {
        Over::new(
            "merge keys (`<<`) are not read",
            "write each key at its place",
        )
    })
}

/// Counts so far.
#[derive(Default)]
struct Spent {
    values: Cell<usize>,
    bytes: Cell<usize>,
    over: Cell<Option<Over>>,
}

/// Goes through all values without keeping them.
struct ValueCounter<'a> {
    depth: usize,
    is_key: bool,
    spent: &'a Spent,
}

impl ValueCounter<'_> {
    fn count<E: Error>(&self, bytes: usize) -> Result<(), E> {
        let spent = self.spent;
        spent.values.set(spent.values.get() + 1);
        spent.bytes.set(spent.bytes.get() + bytes);
        let over = if spent.values.get() > MAX_VALUES {
            Over::new(
                "this file has far more values than any file of monorig (an alias counts as its content)",
                format!("at most {MAX_VALUES} values"),
            )
        } else if spent.bytes.get() > MAX_TEXT_BYTES {
            Over::new(
                "the texts in this file are too long (an alias counts as its content)",
                format!("at most {} MB of text", MAX_TEXT_BYTES >> 20),
            )
        } else {
            return Ok(());
        };
        spent.over.set(Some(over));
        Err(E::custom("over a limit"))
    }

    /// A list or a mapping begins.
    fn open<E: Error>(&self) -> Result<(), E> {
        if self.depth >= MAX_DEPTH {
            self.spent.over.set(Some(Over::new(
                "lists and mappings are nested too deeply",
                format!("at most {MAX_DEPTH} levels"),
            )));
            return Err(E::custom("over a limit"));
        }
        self.count(0)
    }

    fn below(&self) -> Self {
        Self {
            depth: self.depth + 1,
            is_key: false,
            spent: self.spent,
        }
    }
}

impl<'de> DeserializeSeed<'de> for ValueCounter<'_> {
    type Value = ();
    fn deserialize<D: Deserializer<'de>>(self, de: D) -> Result<(), D::Error> {
        de.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for ValueCounter<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("anything")
    }

    fn visit_bool<E: Error>(self, _: bool) -> Result<(), E> {
        self.count(0)
    }

    fn visit_i64<E: Error>(self, _: i64) -> Result<(), E> {
        self.count(0)
    }

    fn visit_u64<E: Error>(self, _: u64) -> Result<(), E> {
        self.count(0)
    }

    fn visit_f64<E: Error>(self, _: f64) -> Result<(), E> {
        self.count(0)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<(), E> {
        if let Some(over) = taken_for_yaml(text).filter(|_| self.is_key) {
            self.spent.over.set(Some(over));
            return Err(E::custom("no YAML"));
        }
        self.count(text.len())
    }

    fn visit_unit<E: Error>(self) -> Result<(), E> {
        self.count(0)
    }

    fn visit_none<E: Error>(self) -> Result<(), E> {
        self.count(0)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<(), A::Error> {
        self.open()?;
        while items.next_element_seed(self.below())?.is_some() {}
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<(), A::Error> {
        self.open()?;
        let key = || Self {
            is_key: true,
            ..self.below()
        };
        while entries.next_key_seed(key())?.is_some() {
            entries.next_value_seed(self.below())?;
        }
        Ok(())
    }

    /// A value with a tag: tags are refused later, where their place is known.
    fn visit_enum<A: serde::de::EnumAccess<'de>>(self, data: A) -> Result<(), A::Error> {
        use serde::de::VariantAccess;
        let (_, value) = data.variant::<Tag>()?;
        value.newtype_variant_seed(self.below())
    }
}

/// Name of a tag of any kind.
struct Tag;

impl<'de> Deserialize<'de> for Tag {
    fn deserialize<D: Deserializer<'de>>(de: D) -> Result<Self, D::Error> {
        de.deserialize_identifier(serde::de::IgnoredAny)
            .map(|_| Self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(text: &str) -> String {
        match yaml(text) {
            Ok(()) => String::new(),
            Err(over) => format!("{}; {}", over.message, over.help),
        }
    }

    #[test]
    fn what_is_far_beyond_any_file_is_refused_with_the_limit() {
        let aliases = format!("a: &a {}\nb: [{}]", "x".repeat(1 << 20), "*a, ".repeat(100));
        for (text, word) in [
            ("[".repeat(100_000), "20000"),
            ("- ".repeat(2_000_000), "200000"),
            ("- 1\n".repeat(300_000), "200000"),
            ("[".repeat(65) + &"]".repeat(65), "64 levels"),
            (aliases, "32 MB"),
        ] {
            let start = std::time::Instant::now();
            assert!(
                told(&text).contains(word),
                "{}: {}",
                &text[..20],
                told(&text)
            );
            assert!(start.elapsed().as_secs() < 5);
        }
    }

    #[test]
    fn what_is_within_the_limits_and_what_is_no_yaml_are_left_to_the_reader() {
        let deep = "[".repeat(MAX_DEPTH) + &"]".repeat(MAX_DEPTH);
        for text in [
            "a: 1\nb: [1, 2.5, x, null, true, {c: d}]",
            "a: !tag x\nb: !tag [1]\nc: !tag {d: 1}",
            deep.as_str(),
            "a: [",
            "",
            "a: 1\na: 1",
        ] {
            assert_eq!(told(text), "", "{text}");
        }
    }
}
