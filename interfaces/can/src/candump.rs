//! A frame as a line of candump: `(1700000000.000125) can0 100#B2FF`, `##` and a digit of flags for CAN FD.

use crate::frame::{Frame, MAX_BYTES};

/// Largest number of bytes of a line.
pub const MAX_LINE: usize = 192;
const DIGITS: &[u8; 16] = b"0123456789ABCDEF";

/// A line as it is written.
struct Line {
    text: [u8; MAX_LINE],
    length: usize,
}

impl Line {
    fn put(&mut self, byte: u8) {
        if let Some(place) = self.text.get_mut(self.length) {
            *place = byte;
            self.length += 1;
        }
    }

    fn word(&mut self, word: &[u8]) {
        word.iter().for_each(|byte| self.put(*byte));
    }

    fn digit(&mut self, digit: u64) {
        self.put(DIGITS.get(digit as usize & 15).copied().unwrap_or(b'0'));
    }

    fn hex(&mut self, number: u32, digits: u32) {
        (0..digits)
            .rev()
            .for_each(|k| self.digit(u64::from(number >> (4 * k) & 15)));
    }

    fn decimal(&mut self, number: u64, least: u32) {
        let mut scale = 10_u64.pow(least.saturating_sub(1));
        while number / scale >= 10 {
            scale *= 10;
        }
        while scale > 0 {
            self.digit(number / scale % 10);
            scale /= 10;
        }
    }
}

/// Appends the line of a frame that was sent at this time, ns, with its end.
pub fn write(frame: &Frame, ns: i64, out: &mut impl Extend<u8>) {
    let mut line = Line {
        text: [0; MAX_LINE],
        length: 0,
    };
    let ns = ns.max(0) as u64;
    line.put(b'(');
    line.decimal(ns / 1_000_000_000, 1);
    line.put(b'.');
    line.decimal(ns % 1_000_000_000, 9);
    line.word(b") can0 ");
    line.hex(frame.id, if frame.extended { 8 } else { 3 });
    line.word(if frame.is_fd() { b"##0" } else { b"#" });
    for byte in frame.data() {
        line.hex((*byte).into(), 2);
    }
    line.put(b'\n');
    out.extend(line.text.into_iter().take(line.length));
}

/// A line that was read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Read<'a> {
    /// The time, s, as in the line.
    pub stamp: &'a [u8],
    /// The frame; none for errors and remote requests, which have no data.
    pub frame: Option<Frame>,
}

/// Reads a line, with or without its end; `None` if it is not a frame of candump.
pub fn read(line: &[u8]) -> Option<Read<'_>> {
    let mut words = line
        .split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty());
    let stamp = words.next()?.strip_prefix(b"(")?.strip_suffix(b")")?;
    let _bus = words.next()?;
    let word = words.next()?;
    let Some(hash) = word.iter().position(|c| *c == b'#') else {
        let frame = of_screen(word, words)?;
        return Some(Read { stamp, frame });
    };
    let (id, rest) = word.split_at_checked(hash)?;
    let rest = rest.strip_prefix(b"#")?;
    let number = id.iter().try_fold(0_u32, |number, c| {
        Some(number.checked_mul(16)? | u32::from(digit(*c)?))
    })?;
    let hex = match rest.strip_prefix(b"#") {
        Some(fd) => fd.get(1..)?,
        None => rest,
    };
    if id.is_empty() {
        return None;
    }
    if number & 0x2000_0000 != 0 || matches!(hex.first(), Some(b'R' | b'r')) {
        return Some(Read { stamp, frame: None });
    }
    let (mut data, mut length, mut high) = ([0; MAX_BYTES], 0, None);
    for c in hex.iter().filter(|c| **c != b'.') {
        let digit = digit(*c)?;
        match high.take() {
            None => high = Some(digit),
            Some(high) => {
                *data.get_mut(length)? = high << 4 | digit;
                length += 1;
            }
        }
    }
    let frame = Frame::with(number & 0x1FFF_FFFF, id.len() > 3, data.get(..length)?)?;
    high.is_none().then_some(Read {
        stamp,
        frame: Some(frame),
    })
}

/// The frame of a line as candump shows it on the screen: identifier, `[8]`, a word a byte; none of a remote request or
/// an error.
fn of_screen<'a>(id: &[u8], mut words: impl Iterator<Item = &'a [u8]>) -> Option<Option<Frame>> {
    let hex = |word: &[u8]| {
        let next = |n: u32, c: &u8| Some(n.checked_mul(16)? | u32::from(digit(*c)?));
        word.iter().try_fold(0, next)
    };
    let number = hex(id)?;
    let length = words.next()?.strip_prefix(b"[")?.strip_suffix(b"]")?;
    let length: usize = core::str::from_utf8(length).ok()?.parse().ok()?;
    let (mut data, mut count) = ([0; MAX_BYTES], 0);
    for word in words.take(length) {
        if word == b"remote" || number & 0x2000_0000 != 0 {
            return Some(None);
        }
        *data.get_mut(count)? = u8::try_from(hex(word)?).ok()?;
        count += 1;
    }
    (count == length).then_some(())?;
    Frame::with(number & 0x1FFF_FFFF, id.len() > 3, data.get(..count)?).map(Some)
}

fn digit(c: u8) -> Option<u8> {
    char::from(c).to_digit(16).map(|d| d as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn a_line_is_that_of_candump() {
        let mut text = Vec::new();
        let frame = Frame::with(0x100, false, &[0xB2, 0xFF]).unwrap();
        write(&frame, 1_700_000_000_000_125_000, &mut text);
        assert_eq!(text, b"(1700000000.000125000) can0 100#B2FF\n");
        let read = read(&text).unwrap();
        assert_eq!(read.stamp, b"1700000000.000125000");
        assert_eq!(read.frame, Some(frame));
        text.clear();
        write(&Frame::with(0x7, true, &[1; 12]).unwrap(), 5, &mut text);
        assert_eq!(
            text,
            b"(0.000000005) can0 00000007##0010101010101010101010101\n"
        );
    }

    #[test]
    fn what_is_none_is_refused() {
        for line in [
            "",
            "hello",
            "(1.0) can0 100",
            "(1.0) can0 #00",
            "(1.0) can0 1G0#00",
            "(1.0) can0 100#0",
            "(1.0) can0 100#0H",
            "1.0 can0 100#00",
            "(1.0) can0 100##",
        ] {
            assert_eq!(read(line.as_bytes()), None, "{line}");
        }
        let long = [b"(1.0) can0 100##0".to_vec(), std::vec![b'0'; 130]].concat();
        assert_eq!(read(&long), None);
        for line in ["(1.0) can0 20000000#00", "(1.0) can0 100#R"] {
            assert_eq!(read(line.as_bytes()).unwrap().frame, None, "{line}");
        }
    }
}
