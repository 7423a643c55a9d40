//! Description of a parameter of an estimator, and a parameter that is set.

use crate::text::Text;
use monorig_estimators::api::params::{Key, KeyKind, Setting};

/// Kinds of a parameter.
const NUMBER: u64 = 0;
const FLAG: u64 = 1;
const WORD: u64 = 2;

/// A parameter there is: `monorig_parameter`.
#[repr(C)]
#[derive(Clone, Copy, Default)]
#[allow(missing_docs)] // the header has them
pub struct Parameter {
    pub name: Text<64>,
    pub unit: Text<32>,
    pub doc: Text<512>,
    pub kind: u64,
    pub otherwise: f64,
    pub least: f64,
    pub most: f64,
    pub words: Text<256>,
}

/// A parameter that is set: `monorig_setting`.
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(missing_docs)] // the header has them
pub struct SetParameter {
    pub name: Text<64>,
    pub kind: u64,
    pub number: f64,
    pub word: Text<64>,
}

/// Words with blanks between them, the default first.
struct Words(&'static str, &'static [&'static str]);

impl core::fmt::Display for Words {
    fn fmt(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        out.write_str(self.0)?;
        let others = self.1.iter().filter(|word| **word != self.0);
        others
            .into_iter()
            .try_for_each(|word| write!(out, " {word}"))
    }
}

impl From<&Key> for Parameter {
    fn from(key: &Key) -> Self {
        let named = Self {
            name: Text::of(key.name),
            doc: Text::of(key.doc),
            unit: Text::of("-"),
            ..Self::default()
        };
        match key.kind {
            KeyKind::Number {
                unit,
                default,
                range: [least, most],
            } => Self {
                unit: Text::of(unit),
                kind: NUMBER,
                otherwise: default.unwrap_or(f64::NAN),
                least,
                most,
                ..named
            },
            KeyKind::Flag { default } => Self {
                kind: FLAG,
                otherwise: f64::from(u8::from(default)),
                most: 1.0,
                ..named
            },
            KeyKind::Choice { default, choices } => Self {
                kind: WORD,
                words: Text::of(Words(default, choices)),
                ..named
            },
        }
    }
}

impl Parameter {
    /// Converts the description into our key, with its texts kept by `keep` and its words by `keep_all`; `None` for an
    /// unknown kind, an empty range, or a choice without words.
    pub fn key(
        &self,
        keep: impl Fn(&str) -> &'static str,
        keep_all: impl FnOnce(&mut dyn Iterator<Item = &'static str>) -> &'static [&'static str],
    ) -> Option<Key> {
        let kind = match self.kind {
            NUMBER if self.least <= self.most => KeyKind::Number {
                unit: keep(self.unit.as_str()),
                default: (!self.otherwise.is_nan()).then_some(self.otherwise),
                range: [self.least, self.most],
            },
            FLAG => KeyKind::Flag {
                default: self.otherwise != 0.0,
            },
            WORD => {
                let mut words = self.words.as_str().split_ascii_whitespace().map(&keep);
                let choices = keep_all(&mut words);
                KeyKind::Choice {
                    default: choices.first()?,
                    choices,
                }
            }
            _ => return None,
        };
        Some(Key {
            name: keep(self.name.as_str()),
            doc: keep(self.doc.as_str()),
            kind,
        })
    }
}

impl SetParameter {
    /// A parameter that is set to this value.
    pub fn new(name: &str, value: Setting<'_>) -> Self {
        let (kind, number, word) = match value {
            Setting::Number(number) => (NUMBER, number, ""),
            Setting::Flag(flag) => (FLAG, f64::from(u8::from(flag)), ""),
            Setting::Choice(word) => (WORD, 0.0, word),
        };
        Self {
            name: Text::of(name),
            kind,
            number,
            word: Text::of(word),
        }
    }

    /// Name and value.
    pub fn setting(&self) -> (&str, Setting<'_>) {
        let value = match self.kind {
            NUMBER => Setting::Number(self.number),
            FLAG => Setting::Flag(self.number != 0.0),
            _ => Setting::Choice(self.word.as_str()),
        };
        (self.name.as_str(), value)
    }
}
