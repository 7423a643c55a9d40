//! Texts in structs: bytes up to a zero.

use core::fmt::{self, Display, Write};

/// A text of at most `N` − 1 bytes that ends with a zero byte.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Text<const N: usize>([u8; N]);

/// Reason of a refusal.
pub type Reason = Text<200>;

/// A name and the unit of its values.
#[repr(C)]
#[derive(Clone, Copy, Default)]
pub struct Label {
    /// The name.
    pub name: Text<64>,
    /// The unit, `-` for none.
    pub unit: Text<32>,
}

impl<const N: usize> Text<N> {
    /// Makes a text from the part that fits, cut between characters.
    pub fn of(what: impl Display) -> Self {
        let mut cut = Cut {
            text: Self::default(),
            used: 0,
        };
        // what does not fit is left out
        let _ = write!(cut, "{what}");
        cut.text
    }

    /// The text up to its zero byte, or up to the first byte that is not UTF-8.
    pub fn as_str(&self) -> &str {
        let bytes = self.0.split(|b| *b == 0).next().unwrap_or_default();
        match core::str::from_utf8(bytes) {
            Ok(text) => text,
            Err(e) => bytes
                .get(..e.valid_up_to())
                .and_then(|good| core::str::from_utf8(good).ok())
                .unwrap_or_default(),
        }
    }
}

impl<const N: usize> Default for Text<N> {
    fn default() -> Self {
        Self([0; N])
    }
}

/// A text being written. After the first character that does not fit it is full.
struct Cut<const N: usize> {
    text: Text<N>,
    used: usize,
}

impl<const N: usize> Write for Cut<N> {
    fn write_str(&mut self, more: &str) -> fmt::Result {
        for character in more.chars() {
            let end = self.used + character.len_utf8();
            // the last byte stays zero
            match self.text.0.get_mut(self.used..end) {
                Some(place) if end < N => character.encode_utf8(place),
                _ => return Err(fmt::Error),
            };
            self.used = end;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_cut_between_characters_and_ends_with_a_zero() {
        let text: Text<8> = Text::of("slope °°");
        assert_eq!(text.as_str(), "slope ");
        assert_eq!(Text::<8>::of("1234567").as_str(), "1234567");
        assert_eq!(Text::<8>::of("12345678").as_str(), "1234567");
        assert_eq!(Text::<4>([b'a', 0xff, b'b', b'c']).as_str(), "a");
        assert_eq!(Text::<4>([b'a'; 4]).as_str(), "aaaa");
    }
}
