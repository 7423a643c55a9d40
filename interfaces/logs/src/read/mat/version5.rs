//! MAT files of version 5: elements of type, length and data, one within the other. A variable is an element, or one
//! that zlib has compressed. No length is trusted beyond the bytes that are there.

use super::workspace::Workspace;
use crate::read::full_name;
use crate::read::text::of_bytes;
use arrow_array::{
    ArrayRef, Float32Array, Float64Array, Int8Array, Int16Array, Int32Array, Int64Array,
    UInt8Array, UInt16Array, UInt32Array, UInt64Array,
};
use flate2::read::ZlibDecoder;
use std::io::Read;
use std::sync::Arc;

/// Bytes of the header.
const HEADER: usize = 128;
/// Type of an element with a variable, and of a compressed one.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Flag of complex numbers.
const COMPLEX: u32 = 0x0800;
/// Deepest struct within structs.
const MAX_DEPTH: usize = 32;

/// Reads all variables. The error says what is wrong.
pub(super) fn read(bytes: &[u8], found: &mut Workspace<'_>) -> Result<(), String> {
    let order = bytes.get(126..HEADER).unwrap_or_default();
    if order != b"IM" {
        let big = "its numbers have the highest byte first";
        return Err(if order == b"MI" {
            big
        } else {
            "its header is damaged"
        }
        .to_owned());
    }
    let mut rest = Elements(bytes.get(HEADER..).unwrap_or_default());
    for place in 1.. {
        if rest.0.is_empty() {
            break;
        }
        let broken = |e: &dyn std::fmt::Display| format!("variable {place} is damaged: {e}");
        let breaks_off = || broken(&"it breaks off");
        let (kind, data) = rest.next().ok_or_else(breaks_off)?;
        let mut plain = Vec::new();
        let (kind, data) = match kind {
            COMPRESSED => {
                let mut decoder = ZlibDecoder::new(data).take(u32::MAX.into());
                let mut piece = [0; 1 << 16];
                loop {
                    let n = decoder.read(&mut piece).map_err(|e| broken(&e))?;
                    if n == 0 {
                        break;
                    }
                    found.take(n)?;
                    plain.extend_from_slice(piece.get(..n).unwrap_or_default());
                }
                Elements(&plain).next().ok_or_else(breaks_off)?
            }
            _ => (kind, data),
        };
        if kind == MATRIX {
            matrix(data, ("", None), 0, found).ok_or_else(breaks_off)??;
        }
    }
    Ok(())
}

/// Elements one after the other.
struct Elements<'a>(&'a [u8]);

impl<'a> Elements<'a> {
    /// Type and data of the next element; none if it is not whole.
    fn next(&mut self) -> Option<(u32, &'a [u8])> {
        let first = word(self.0, 0)?;
        let (kind, begin, length) = match first >> 16 {
            0 => (first, 8usize, word(self.0, 4)? as usize),
            length => (first & 0xFFFF, 4, length as usize),
        };
        let data = self.0.get(begin..begin.checked_add(length)?)?;
        let whole = match kind {
            COMPRESSED => begin + length,
            _ => (begin + length).next_multiple_of(8),
        };
        self.0 = self.0.get(whole..).unwrap_or_default();
        Some((kind, data))
    }
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..)?.first_chunk()?;
    Some(u32::from_le_bytes(*word))
}

/// A variable, or the field of a struct, which has its name from there; none if its elements are not whole.
fn matrix(
    data: &[u8],
    (group, field): (&str, Option<&str>),
    depth: usize,
    found: &mut Workspace<'_>,
) -> Option<Result<(), String>> {
    let mut parts = Elements(data);
    if data.is_empty() {
        return Some(Ok(())); // an empty field
    }
    let flags = word(parts.next()?.1, 0)?;
    let class = flags & 0xFF;
    let dims: Vec<usize> = match class {
        17 => Vec::new(), // an object has none
        _ => parts
            .next()?
            .1
            .as_chunks()
            .0
            .iter()
            .map(|n| u32::from_le_bytes(*n) as usize)
            .collect(),
    };
    let own = of_bytes(parts.next()?.1);
    let name = field.unwrap_or(&own);
    let count = dims.iter().try_fold(1usize, |all, n| all.checked_mul(*n))?;
    match class {
        _ if name.is_empty() => {} // what MATLAB keeps of objects
        2 if depth < MAX_DEPTH => {
            let width = word(parts.next()?.1, 0)? as usize;
            let names = parts.next()?.1.chunks(width.max(1));
            let names: Vec<_> = names
                .map(|n| of_bytes(n.split(|b| *b == 0).next().unwrap_or(n)))
                .collect();
            let structs = if names.is_empty() { 0 } else { count };
            for k in 1..=structs {
                let mut inner = full_name(group, name);
                if count > 1 {
                    inner += &format!("({k})");
                }
                for field in &names {
                    let (MATRIX, data) = parts.next()? else {
                        return None;
                    };
                    if let Err(e) = matrix(data, (&inner, Some(field)), depth + 1, found)? {
                        return Some(Err(e));
                    }
                }
            }
        }
        6..=15 if flags & COMPLEX == 0 => {
            let (kind, data) = parts.next()?;
            if found.needs(group, name) {
                if let Err(e) = found.take(8 * data.len()) {
                    return Some(Err(e));
                }
                let values = numbers(kind, data).filter(|v| v.len() == count)?;
                found.put(group, name, dims, values);
            }
        }
        1 => found.leave(group, name, "a cell array"),
        4 => found.leave(group, name, "text"),
        5 => found.leave(group, name, "a sparse matrix"),
        6..=15 => found.leave(group, name, "complex numbers"),
        _ => found.leave(group, name, "an object"),
    }
    Some(Ok(()))
}

/// The numbers of an element.
fn numbers(kind: u32, bytes: &[u8]) -> Option<ArrayRef> {
    macro_rules! of {
        ($array:ident, $number:ty) => {{
            let numbers = bytes
                .as_chunks()
                .0
                .iter()
                .map(|b| <$number>::from_le_bytes(*b));
            Arc::new($array::from_iter_values(numbers))
        }};
    }
    Some(match kind {
        1 => of!(Int8Array, i8),
        2 => of!(UInt8Array, u8),
        3 => of!(Int16Array, i16),
        4 => of!(UInt16Array, u16),
        5 => of!(Int32Array, i32),
        6 => of!(UInt32Array, u32),
        7 => of!(Float32Array, f32),
        9 => of!(Float64Array, f64),
        12 => of!(Int64Array, i64),
        13 => of!(UInt64Array, u64),
        _ => return None,
    })
}
