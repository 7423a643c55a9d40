//! Frames in a datagram as cannelloni has them (version 2): version, 0 for data, number of the datagram, number of the
//! frames in two bytes; then of each frame the identifier in four bytes, the length with the top bit set for CAN FD,
//! the flags of CAN FD, the data. Big-endian.

use crate::frame::Frame;

const VERSION: u8 = 2;
const DATA: u8 = 0;
const HEADER: usize = 5;
const FD: u8 = 0x80;
const EXTENDED: u32 = 0x8000_0000;
const NO_DATA: u32 = 0x6000_0000;

/// Begins a datagram.
pub fn begin(sequence: u8) -> [u8; HEADER] {
    [VERSION, DATA, sequence, 0, 0]
}

/// Appends a frame to a datagram. The datagram is then counted with [`count`].
pub fn write(frame: &Frame, out: &mut impl Extend<u8>) {
    let id = frame.id | if frame.extended { EXTENDED } else { 0 };
    out.extend(id.to_be_bytes());
    let length = frame.data().len() as u8;
    match frame.is_fd() {
        true => out.extend([length | FD, 0]),
        false => out.extend([length]),
    }
    out.extend(frame.data().iter().copied());
}

/// Writes the number of frames into a datagram.
pub fn count(datagram: &mut [u8], frames: u16) {
    if let Some(place) = datagram.get_mut(3..HEADER) {
        place.copy_from_slice(&frames.to_be_bytes());
    }
}

/// Passes on the frames of a datagram. False if it is none of cannelloni, or cut off.
pub fn read(datagram: &[u8], each: &mut impl FnMut(&Frame)) -> bool {
    let Some(([VERSION, DATA, _, high, low], mut rest)) = datagram.split_first_chunk() else {
        return false;
    };
    for _ in 0..u16::from_be_bytes([*high, *low]) {
        let Some((frame, behind)) = one(rest) else {
            return false;
        };
        rest = behind;
        if let Some(frame) = frame {
            each(&frame);
        }
    }
    true
}

/// The first frame (`None` without data), and the data after it.
fn one(bytes: &[u8]) -> Option<(Option<Frame>, &[u8])> {
    let (id, rest) = bytes.split_first_chunk()?;
    let id = u32::from_be_bytes(*id);
    let (length, mut rest) = rest.split_first()?;
    if length & FD != 0 {
        rest = rest.get(1..)?;
    }
    if id & NO_DATA != 0 {
        return Some((None, rest));
    }
    let (data, rest) = rest.split_at_checked(usize::from(length & !FD))?;
    let frame = Frame::with(id & 0x1FFF_FFFF, id & EXTENDED != 0, data)?;
    Some((Some(frame), rest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// The bytes are those of cannelloni's description of its format.
    #[test]
    fn a_datagram_holds_frames() {
        let frames = [
            Frame::with(0x123, false, &[1, 2, 3]).unwrap(),
            Frame::with(0x18FF_0001, true, &[7; 12]).unwrap(),
        ];
        let mut datagram = begin(9).to_vec();
        frames.iter().for_each(|f| write(f, &mut datagram));
        count(&mut datagram, 2);
        let head = [
            2, 0, 9, 0, 2, 0, 0, 1, 0x23, 3, 1, 2, 3, 0x98, 0xFF, 0, 1, 0x8C, 0, 7,
        ];
        assert_eq!(datagram[..20], head);
        let mut back = Vec::new();
        assert!(read(&datagram, &mut |f| back.push(*f)));
        assert_eq!(back, frames);
        for cut in 0..datagram.len() {
            assert!(!read(&datagram[..cut], &mut |_| {}), "{cut}");
        }
        datagram[0] = 1;
        assert!(!read(&datagram, &mut |_| {}));
    }
}
