//! A signal of a message: a number, an instant, a flag or the number of a step in some bits of a frame.

use core::fmt;

/// Numbers of a bus: as fixed-point signals of 24 bits, or as they are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Numbers {
    /// Fixed-point signals, as usual on a bus.
    #[default]
    Fixed,
    /// Floating-point signals of 64 bits, without rounding.
    Float,
}

/// Bits of a fixed-point number, and of an instant in microseconds.
const FIXED_BITS: u32 = 24;
const STAMP_BITS: u32 = 40;
/// Largest magnitude of a signed raw number; the number below its negative means "no number".
const MAX_SIGNED: i64 = (1 << (FIXED_BITS - 1)) - 1;
/// Largest unsigned raw number; the number above it means "no number".
const MAX_UNSIGNED: i64 = (1 << FIXED_BITS) - 2;

/// The name of a signal or a message: a word, or words with a number behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Name {
    /// The words before.
    pub words: [&'static str; 2],
    /// The number, counted from 1.
    pub number: Option<usize>,
}

impl Name {
    /// A word.
    pub(crate) const fn of(word: &'static str) -> Self {
        Self::joined("", word)
    }

    /// Two words with a line between them.
    pub(crate) const fn joined(first: &'static str, second: &'static str) -> Self {
        Self {
            words: [first, second],
            number: None,
        }
    }

    /// Adds the number of an index to the name.
    pub(crate) const fn at(mut self, index: usize) -> Self {
        self.number = Some(index + 1);
        self
    }
}

impl fmt::Display for Name {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [first, second] = self.words;
        let line = if first.is_empty() { "" } else { "_" };
        write!(out, "{first}{line}{second}")?;
        match self.number {
            Some(number) => write!(out, "_{number}"),
            None => Ok(()),
        }
    }
}

/// Content of a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Content {
    /// An instant, ns since the start.
    Instant,
    /// A length of time, s.
    Duration,
    /// A number of either sign, with the step of a fixed-point signal.
    Signed(f64),
    /// A number that is not negative, with the step of a fixed-point signal.
    Unsigned(f64),
    /// A flag.
    Flag,
    /// The number of a step.
    Sequence,
}

/// A signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signal {
    /// Name of the signal; for an instant and a length of time without the unit.
    name: Name,
    unit: &'static str,
    pub(crate) content: Content,
}

impl Signal {
    pub(crate) const fn new(name: Name, unit: &'static str, content: Content) -> Self {
        Self {
            name,
            unit,
            content,
        }
    }

    /// Returns the number of bits of the signal.
    pub(crate) fn bits(&self, numbers: Numbers) -> u32 {
        match (self.content, numbers) {
            (Content::Flag, _) => 1,
            (Content::Sequence, _) => crate::SEQUENCES.trailing_zeros(),
            (_, Numbers::Float) => 64,
            (Content::Instant, Numbers::Fixed) => STAMP_BITS,
            (_, Numbers::Fixed) => FIXED_BITS,
        }
    }

    /// The name in a DBC.
    pub fn name(&self, numbers: Numbers) -> Name {
        match (self.content, numbers) {
            (Content::Instant, Numbers::Fixed) => Name::of("stamp_us"),
            (Content::Instant, Numbers::Float) => Name::of("stamp_ns"),
            _ => self.name,
        }
    }

    /// The unit in a DBC.
    pub(crate) fn unit(&self, numbers: Numbers) -> &'static str {
        match (self.content, numbers) {
            (Content::Instant, Numbers::Fixed) => "us",
            (Content::Instant, Numbers::Float) => "ns",
            _ => self.unit,
        }
    }

    /// Step of a raw number.
    pub(crate) fn factor(&self, numbers: Numbers) -> f64 {
        match (self.content, numbers) {
            (Content::Duration, Numbers::Fixed) => 1e-6,
            (Content::Signed(step) | Content::Unsigned(step), Numbers::Fixed) => step,
            _ => 1.0,
        }
    }

    /// True for a raw number with a sign.
    pub(crate) fn is_signed(&self, numbers: Numbers) -> bool {
        self.is_float(numbers) || matches!(self.content, Content::Instant | Content::Signed(_))
    }

    /// True for a floating-point signal.
    pub(crate) fn is_float(&self, numbers: Numbers) -> bool {
        let is_number = matches!(
            self.content,
            Content::Duration | Content::Signed(_) | Content::Unsigned(_)
        );
        is_number && numbers == Numbers::Float
    }

    /// The raw number of an instant, ns.
    pub(crate) fn raw_instant(ns: i64, numbers: Numbers) -> u64 {
        let raw = match numbers {
            Numbers::Fixed => (ns + 500).div_euclid(1000),
            Numbers::Float => ns,
        };
        raw as u64
    }

    /// Raw number of a number, and true if the number is out of range and was limited.
    pub(crate) fn raw_number(&self, number: f64, numbers: Numbers) -> (u64, bool) {
        if numbers == Numbers::Float {
            return (number.to_bits(), false);
        }
        let (least, most) = match self.is_signed(numbers) {
            true => (-MAX_SIGNED, MAX_SIGNED),
            false => (0, MAX_UNSIGNED),
        };
        if number.is_nan() {
            let none = if least < 0 { least - 1 } else { most + 1 };
            return (none as u64, false);
        }
        // saturates
        let raw = libm::round(number / self.factor(numbers)) as i64;
        (raw.clamp(least, most) as u64, raw < least || raw > most)
    }

    /// The instant of a raw number, ns.
    pub(crate) fn instant(raw: u64, numbers: Numbers) -> i64 {
        match numbers {
            Numbers::Fixed => signed(raw, STAMP_BITS) * 1000,
            Numbers::Float => raw as i64,
        }
    }

    /// Converts a raw number into a number; NaN for the raw number that means "no number".
    pub(crate) fn number(&self, raw: u64, numbers: Numbers) -> f64 {
        if numbers == Numbers::Float {
            return f64::from_bits(raw);
        }
        let (raw, none) = match self.is_signed(numbers) {
            true => (signed(raw, FIXED_BITS), -MAX_SIGNED - 1),
            false => (raw as i64, MAX_UNSIGNED + 1),
        };
        match raw == none {
            true => f64::NAN,
            false => raw as f64 * self.factor(numbers),
        }
    }
}

/// A signed number with this number of bits.
fn signed(raw: u64, bits: u32) -> i64 {
    (raw << (64 - bits)) as i64 >> (64 - bits)
}
