//! A CAN or CAN FD frame, filled and read bit by bit in Intel order.

/// Largest number of bytes of a frame.
pub const MAX_BYTES: usize = 64;
/// Bytes that a CAN FD frame can have.
const LENGTHS: [usize; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];

/// A frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Identifier of 11 or 29 bits.
    pub id: u32,
    /// True for an identifier of 29 bits.
    pub extended: bool,
    length: u8,
    data: [u8; MAX_BYTES],
}

impl Frame {
    /// A frame with an identifier of 11 bits and no data.
    pub fn new(id: u32) -> Self {
        Self {
            id,
            extended: false,
            length: 0,
            data: [0; MAX_BYTES],
        }
    }

    /// A frame with these data; `None` if the data are too long.
    pub fn with(id: u32, extended: bool, data: &[u8]) -> Option<Self> {
        let mut frame = Self::new(id);
        frame.extended = extended;
        frame.length = u8::try_from(data.len()).ok()?;
        frame.data.get_mut(..data.len())?.copy_from_slice(data);
        Some(frame)
    }

    /// The data.
    pub fn data(&self) -> &[u8] {
        self.data.get(..self.length.into()).unwrap_or_default()
    }

    /// True if a classic frame has no room for the data.
    pub fn is_fd(&self) -> bool {
        self.length > 8
    }

    /// Sets the length of a frame with this number of bits.
    pub(crate) fn set_bits(&mut self, bits: u32) {
        self.length = bytes_of(bits) as u8;
    }

    /// Writes `bits` bits of `raw` from bit `start` on.
    pub(crate) fn put(&mut self, start: u32, bits: u32, raw: u64) {
        if start.is_multiple_of(8) && bits.is_multiple_of(8) {
            let from = start as usize / 8;
            let bytes = self.data.iter_mut().skip(from).take(bits as usize / 8);
            bytes
                .zip(raw.to_le_bytes())
                .for_each(|(to, byte)| *to = byte);
            return;
        }
        for k in 0..bits {
            let at = start + k;
            if let Some(byte) = self.data.get_mut(at as usize / 8) {
                let mask = 1 << (at % 8);
                *byte = *byte & !mask | (((raw >> k & 1) as u8) << (at % 8));
            }
        }
    }

    /// Reads `bits` bits from bit `start` on; `None` if the frame is too short.
    pub(crate) fn get(&self, start: u32, bits: u32) -> Option<u64> {
        let data = self.data();
        if (start + bits).div_ceil(8) as usize > data.len() {
            return None;
        }
        if start.is_multiple_of(8) && bits.is_multiple_of(8) {
            let from = start as usize / 8;
            let bytes = data.get(from..from + bits as usize / 8)?;
            return Some(
                bytes
                    .iter()
                    .rev()
                    .fold(0, |raw, byte| raw << 8 | u64::from(*byte)),
            );
        }
        let bit = |k: u32| {
            let at = start + k;
            let byte = data.get(at as usize / 8).copied().unwrap_or_default();
            u64::from(byte >> (at % 8) & 1) << k
        };
        Some((0..bits).map(bit).fold(0, |raw, bit| raw | bit))
    }
}

/// Bytes of a frame for this number of bits: 8 of a classic frame, else those that CAN FD has.
pub(crate) fn bytes_of(bits: u32) -> usize {
    let least = (bits.div_ceil(8) as usize).max(8);
    let fit = LENGTHS.iter().find(|l| **l >= least);
    fit.copied().unwrap_or(MAX_BYTES)
}
