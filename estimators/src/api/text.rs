//! Text of bounded length without a heap: names that are not known, reasons of a refusal.

use core::fmt;

/// The first `N` bytes of a text, in place.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Text<const N: usize> {
    bytes: [u8; N],
    length: u8,
}

/// An unknown name.
pub type Name = Text<40>;
/// Reason of a refusal, in words.
pub type Reason = Text<96>;

impl<const N: usize> Text<N> {
    /// Copies the text, or the part that fits.
    pub fn new(text: &str) -> Self {
        let mut copy = Self::empty();
        copy.append(text);
        copy
    }

    /// Copies the displayed text, or the part that fits.
    pub fn of(shown: impl fmt::Display) -> Self {
        let mut copy = Self::empty();
        // fails when the text is longer: what fits is there then
        let _ = fmt::write(&mut copy, format_args!("{shown}"));
        copy
    }

    /// The text, or the part that fitted.
    pub fn as_str(&self) -> &str {
        let bytes = self
            .bytes
            .get(..usize::from(self.length))
            .unwrap_or_default();
        core::str::from_utf8(bytes).unwrap_or_default()
    }

    fn empty() -> Self {
        const { assert!(N <= u8::MAX as usize) };
        Self {
            bytes: [0; N],
            length: 0,
        }
    }

    /// Appends whole characters while they fit; returns false if one did not fit.
    fn append(&mut self, text: &str) -> bool {
        for character in text.chars() {
            let from = usize::from(self.length);
            let end = from + character.len_utf8();
            let Some(place) = self.bytes.get_mut(from..end) else {
                return false;
            };
            character.encode_utf8(place);
            self.length = end as u8;
        }
        true
    }
}

impl<const N: usize> fmt::Write for Text<N> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        match self.append(text) {
            true => Ok(()),
            false => Err(fmt::Error),
        }
    }
}

impl<const N: usize> fmt::Debug for Text<N> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.as_str(), out)
    }
}

impl<const N: usize> fmt::Display for Text<N> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fits_is_kept_in_whole_characters() {
        assert_eq!(Text::<8>::new("12345678").as_str(), "12345678");
        assert_eq!(Text::<8>::new("1234567é").as_str(), "1234567");
        assert_eq!(Text::<8>::new("123456é").as_str(), "123456é");
        assert_eq!(
            Text::<8>::of(format_args!("{}-{}", 12.5, "abcdef")).as_str(),
            "12.5-abc"
        );
        assert_eq!(Text::<8>::of("é".repeat(9).as_str()).as_str(), "éééé");
        assert_eq!(Text::<8>::new("").as_str(), "");
    }
}
