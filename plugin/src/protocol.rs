//! Messages between the program and a process that runs a part for it. One answers the other in turn. A message is two
//! numbers of 64 bits, what it is and the length of the rest, and then structs of the header as they lie in memory:
//! both ends are on one machine.

use monorig_abi::{
    Aid, Estimated, Input, Label, NominalVehicle, Parameter, Reason, SetParameter, Text,
};
use std::io::{Error, ErrorKind, Read, Result, Write};

/// Describe a part: kind, path, name. Answer: [`DONE`] with its name and its parameters.
pub(crate) const LOAD: u64 = 1;
/// Build an instance: the part as before, vehicle, settings. Answer: [`DONE`] with the labels of internals and
/// sources, and the state.
pub(crate) const BUILD: u64 = 2;
/// Make a step: [`Input`]. Answer: the state.
pub(crate) const STEP: u64 = 3;
/// Go back to the state after the building. Answer: the state.
pub(crate) const RESET: u64 = 4;
/// Take a snapshot: the room for it. Answer: a code, the bytes it takes, the bytes.
pub(crate) const SNAPSHOT: u64 = 5;
/// Take the state of a snapshot: its bytes. Answer: the state.
pub(crate) const RESTORE: u64 = 6;
/// Give the instance up. Answer: nothing.
pub(crate) const DROP: u64 = 7;
/// Answer: done, and what was asked for. A state is a code, a [`Reason`], [`Estimated`], internals, aid status.
pub(crate) const DONE: u64 = 100;
/// Answer to [`LOAD`] and [`BUILD`]: refused, with message and help.
pub(crate) const REFUSED: u64 = 101;

/// Beside the codes of the header, of a snapshot: none is kept.
pub(crate) const NOT_KEPT: u64 = 3;

/// A longer message is none.
const MAX_BYTES: u64 = 1 << 30;

/// Data of which any bytes are a value, and whose bytes are all data.
///
/// # Safety
/// The type is `repr(C)`, has no padding, and each of its fields is plain.
pub(crate) unsafe trait Plain: Copy {}

// SAFETY: bytes.
unsafe impl Plain for u8 {}
// SAFETY: numbers.
unsafe impl Plain for u64 {}
// SAFETY: numbers.
unsafe impl Plain for f64 {}
// SAFETY: numbers of eight bytes.
unsafe impl Plain for Input {}
// SAFETY: numbers of eight bytes.
unsafe impl Plain for Estimated {}
// SAFETY: numbers of eight bytes.
unsafe impl Plain for Aid {}
// SAFETY: numbers of eight bytes.
unsafe impl Plain for NominalVehicle {}
// SAFETY: bytes.
unsafe impl<const N: usize> Plain for Text<N> {}
// SAFETY: bytes.
unsafe impl Plain for Label {}
// SAFETY: 608 bytes of texts, four numbers, 256 bytes.
unsafe impl Plain for Parameter {}
// SAFETY: 64 bytes, two numbers, 64 bytes.
unsafe impl Plain for SetParameter {}

const _: () = assert!(size_of::<Parameter>() == 608 + 4 * 8 + 256);
const _: () = assert!(size_of::<SetParameter>() == 64 + 2 * 8 + 64);
const _: () = assert!(size_of::<Reason>() == 200);

/// A message that is put together. Its memory is kept for the next one.
#[derive(Default)]
pub(crate) struct Message(Vec<u8>);

impl Message {
    /// Begins a message.
    pub fn begin(&mut self, what: u64) -> &mut Self {
        self.0.clear();
        self.put(&[what, 0])
    }

    /// Appends values.
    pub fn put<T: Plain>(&mut self, values: &[T]) -> &mut Self {
        // SAFETY: the type is plain: all its bytes are data, for as long as the values live.
        let bytes = unsafe {
            std::slice::from_raw_parts(values.as_ptr().cast::<u8>(), size_of_val(values))
        };
        self.0.extend_from_slice(bytes);
        self
    }

    /// Appends bytes after their number.
    pub fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        self.put(&[bytes.len() as u64]);
        self.0.extend_from_slice(bytes);
        self
    }

    /// Sends it.
    pub fn send(&mut self, to: &mut impl Write) -> Result<()> {
        let rest = (self.0.len() - 16) as u64;
        self.0[8..16].copy_from_slice(&rest.to_ne_bytes());
        to.write_all(&self.0)
    }
}

/// Receives a message: what it is, and its rest into `body`.
pub(crate) fn receive(from: &mut impl Read, body: &mut Vec<u8>) -> Result<u64> {
    let mut header = [0; 16];
    from.read_exact(&mut header)?;
    let mut header = Body(&header);
    let (what, length) = (header.take::<u64>()?, header.take::<u64>()?);
    if length > MAX_BYTES {
        return Err(ErrorKind::InvalidData.into());
    }
    body.clear();
    match from.take(length).read_to_end(body)? as u64 == length {
        true => Ok(what),
        false => Err(ErrorKind::UnexpectedEof.into()),
    }
}

/// What of a message is not yet read.
pub(crate) struct Body<'a>(pub &'a [u8]);

impl<'a> Body<'a> {
    /// The next value.
    pub fn take<T: Plain>(&mut self) -> Result<T> {
        let bytes = self.cut(size_of::<T>())?;
        // SAFETY: so many bytes are there, and the type is plain: any of them are a value.
        Ok(unsafe { bytes.as_ptr().cast::<T>().read_unaligned() })
    }

    /// The values up to the end.
    pub fn all<T: Plain>(&mut self) -> Result<Vec<T>> {
        let mut values = Vec::new();
        while !self.0.is_empty() {
            values.push(self.take()?);
        }
        Ok(values)
    }

    /// The next bytes, after their number.
    pub fn bytes(&mut self) -> Result<&'a [u8]> {
        let length = self.take::<u64>()?;
        self.cut(usize::try_from(length).unwrap_or(usize::MAX))
    }

    /// The next bytes, as a text.
    pub fn text(&mut self) -> Result<String> {
        Ok(String::from_utf8_lossy(self.bytes()?).into_owned())
    }

    fn cut(&mut self, length: usize) -> Result<&'a [u8]> {
        let (bytes, rest) = self
            .0
            .split_at_checked(length)
            .ok_or_else(|| Error::from(ErrorKind::InvalidData))?;
        self.0 = rest;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_sent_is_received() {
        let mut message = Message::default();
        let mut wire = Vec::new();
        for what in [STEP, DONE] {
            let message = message.begin(what).put(&[2.5_f64, f64::NAN]);
            message.bytes("slope °".as_bytes()).put(&[7_u64]);
            message.send(&mut wire).unwrap();
        }
        let (mut from, mut body) = (&wire[..], Vec::new());
        for what in [STEP, DONE] {
            assert_eq!(receive(&mut from, &mut body).unwrap(), what);
            let mut body = Body(&body);
            assert_eq!(body.take::<f64>().unwrap(), 2.5);
            assert!(body.take::<f64>().unwrap().is_nan());
            assert_eq!(body.text().unwrap(), "slope °");
            assert_eq!(body.all::<u64>().unwrap(), [7]);
        }
        assert!(receive(&mut from, &mut body).is_err(), "nothing is left");
        assert!(receive(&mut &wire[..wire.len() - 1], &mut body).is_ok());
    }

    /// Whatever a broken process sends is an error and no panic.
    #[test]
    fn nonsense_is_an_error() {
        let mut body = Vec::new();
        assert!(receive(&mut &[0xff; 64][..], &mut body).is_err());
        let mut short = Body(&[1, 0, 0]);
        assert!(
            short.take::<u64>().is_err() && short.bytes().is_err() && short.all::<f64>().is_err()
        );
        let long = [u64::MAX.to_ne_bytes(), [0; 8]].concat();
        assert!(Body(&long).bytes().is_err());
    }
}
