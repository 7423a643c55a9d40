//! The frames of an `.rrd` file, read before Rerun's decoder sees them and put in order after its encoder has written them.
//!
//! A file is a header of 12 bytes; messages, each with a header of 16 bytes (kind and length, little-endian) and a Protobuf payload; the
//! last of them, of kind 0, is the index: one manifest a store; behind it 32 bytes that say where the index is, with its check sum.
//! (`re_log_encoding` 0.36, `src/rrd/frames.rs`.)

use crate::packed::Packed;
use re_log_encoding::{Decodable, Encodable, MessageHeader, MessageKind, StreamFooter};
use re_protos::log_msg::v1alpha1::{RrdFooter, RrdManifest};
use rerun::external::arrow::datatypes::Schema as ArrowSchema;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;

const FILE_HEADER_BYTES: u64 = 12;
const HEADER_BYTES: usize = MessageHeader::ENCODED_SIZE_BYTES;
/// Longest payload of a message: those of ours are some megabytes.
const MAX_PAYLOAD_BYTES: u64 = 256 << 20;
/// LZ4 does not compress better than this.
const MAX_RATIO: u64 = 255;
/// Protobuf fields: the manifests of an index, the table of a manifest.
const MANIFESTS: u64 = 1;
const TABLE: u64 = 4;

/// Protobuf fields of what is packed: how it is compressed, its length when unpacked, its bytes.
struct PackedFields(u64, u64, u64);
const MESSAGE_FIELDS: PackedFields = PackedFields(2, 3, 5);
const TABLE_FIELDS: PackedFields = PackedFields(3, 4, 2);

/// Whether lengths in a file are such as can be: the decoder makes room for whatever they say. What is wrong, if not.
pub fn check(path: &Path) -> io::Result<Result<(), String>> {
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut file = BufReader::new(file);
    file.seek(SeekFrom::Start(FILE_HEADER_BYTES))?;
    let mut at = FILE_HEADER_BYTES;
    while at + HEADER_BYTES as u64 <= length {
        let (kind, payload) = header(&mut file)?;
        at += HEADER_BYTES as u64;
        if payload > MAX_PAYLOAD_BYTES {
            return Ok(Err(format!("a message of {payload} bytes at byte {at}")));
        }
        if payload > length - at {
            return Ok(Ok(())); // it breaks off: the decoder says where
        }
        let mut bytes = vec![0; payload as usize];
        file.read_exact(&mut bytes)?;
        if !plausible(kind, &bytes) {
            return Ok(Err(format!("a message that cannot be, at byte {at}")));
        }
        at += payload;
        if kind == MessageKind::End as u64 {
            let behind = length - at;
            return Ok(match behind == StreamFooter::ENCODED_SIZE_BYTES as u64 {
                true => Ok(()),
                false => Err(format!(
                    "{behind} bytes behind its index, where there are 32"
                )),
            });
        }
    }
    Ok(Ok(()))
}

/// Put the index in order: Rerun's encoder keeps the manifests, and the fields of each one's schema, in hash maps, whose order is another
/// in every process. What the index says stays the same; its SHA-256 of the schema does not depend on the order.
pub fn sort_index(path: &Path) -> io::Result<()> {
    let mut file = File::options().read(true).write(true).open(path)?;
    let tail = StreamFooter::ENCODED_SIZE_BYTES as u64;
    let length = file.metadata()?.len();
    if length < FILE_HEADER_BYTES + HEADER_BYTES as u64 + tail {
        return Ok(());
    }
    file.seek(SeekFrom::Start(length - tail))?;
    let start = u64::from_le_bytes(array(&mut file)?);
    let size = u64::from_le_bytes(array(&mut file)?);
    let header = start.checked_sub(HEADER_BYTES as u64);
    let (Some(header), true) = (header, start.checked_add(size) == Some(length - tail)) else {
        return Err(damaged("there is no index at the end"));
    };
    if size > MAX_PAYLOAD_BYTES {
        return Err(damaged("its index is too long"));
    }
    let mut index = vec![0; size as usize];
    file.seek(SeekFrom::Start(start))?;
    file.read_exact(&mut index)?;
    let index = sorted(&index)?;
    let mut out = Vec::new();
    MessageHeader {
        kind: MessageKind::End,
        len: index.len() as u64,
    }
    .to_rrd_bytes(&mut out)
    .map_err(io::Error::other)?;
    out.extend_from_slice(&index);
    StreamFooter::from_rrd_footer_bytes(start, &index)
        .to_rrd_bytes(&mut out)
        .map_err(io::Error::other)?;
    file.seek(SeekFrom::Start(header))?;
    file.write_all(&out)?;
    file.set_len(header + out.len() as u64)
}

/// The same index with its manifests, and the fields of their schemas, in an order of their own.
fn sorted(index: &[u8]) -> io::Result<Vec<u8>> {
    let mut footer = RrdFooter::from_rrd_bytes(index).map_err(io::Error::other)?;
    for schema in footer
        .manifests
        .iter_mut()
        .filter_map(|m| m.sorbet_schema.as_mut())
    {
        let ArrowSchema { fields, metadata } = (&*schema).try_into().map_err(io::Error::other)?;
        let mut fields = fields.to_vec();
        fields.sort_by(|a, b| a.name().cmp(b.name()));
        let ordered = ArrowSchema::new_with_metadata(fields, metadata);
        *schema = (&ordered).try_into().map_err(io::Error::other)?;
    }
    footer
        .manifests
        .sort_by(|a, b| Ord::cmp(&name(a), &name(b)));
    let mut out = Vec::new();
    footer.to_rrd_bytes(&mut out).map_err(io::Error::other)?;
    Ok(out)
}

/// What tells the store of a manifest from another's.
fn name(manifest: &RrdManifest) -> Option<(i32, &str)> {
    let id = manifest.store_id.as_ref()?;
    Some((id.kind, id.recording_id.as_str()))
}

/// Kind and payload length of the message that comes next.
fn header(file: &mut impl Read) -> io::Result<(u64, u64)> {
    let kind = u64::from_le_bytes(array(file)?);
    Ok((kind, u64::from_le_bytes(array(file)?)))
}

fn array(file: &mut impl Read) -> io::Result<[u8; 8]> {
    let mut bytes = [0; 8];
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn damaged(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
}

/// Whether what is packed in a payload can become as long as it says.
fn plausible(kind: u64, payload: &[u8]) -> bool {
    match kind {
        2 => packed_is_plausible(payload, &MESSAGE_FIELDS),
        0 => index_is_plausible(payload),
        _ => are_fields(payload),
    }
}

fn are_fields(mut rest: &[u8]) -> bool {
    while !rest.is_empty() {
        if field(&mut rest).is_none() {
            return false;
        }
    }
    true
}

/// The table of every manifest.
fn index_is_plausible(mut rest: &[u8]) -> bool {
    while !rest.is_empty() {
        let mut manifest = match field(&mut rest) {
            Some((MANIFESTS, Value::Bytes(manifest))) => manifest,
            Some(_) => continue,
            None => return false,
        };
        while !manifest.is_empty() {
            match field(&mut manifest) {
                Some((TABLE, Value::Bytes(table))) => {
                    if !packed_is_plausible(table, &TABLE_FIELDS) {
                        return false;
                    }
                }
                Some(_) => {}
                None => return false,
            }
        }
    }
    true
}

fn packed_is_plausible(message: &[u8], fields: &PackedFields) -> bool {
    let PackedFields(compression, unpacked_bytes, bytes) = *fields;
    let mut packed = Packed::default();
    let mut rest = message;
    while !rest.is_empty() {
        match field(&mut rest) {
            None => return false,
            Some((n, Value::Number(x))) if n == compression => packed.compression = x,
            Some((n, Value::Number(x))) if n == unpacked_bytes => packed.unpacked_bytes = x,
            Some((n, Value::Bytes(x))) if n == bytes => packed.bytes = x,
            Some(_) => {}
        }
    }
    let most = (packed.bytes.len() as u64 + 1).saturating_mul(MAX_RATIO);
    packed.unpacked_bytes <= most.min(MAX_PAYLOAD_BYTES) && packed.is_plausible()
}

/// A value of a Protobuf field.
enum Value<'a> {
    Number(u64),
    Bytes(&'a [u8]),
    /// Of fixed length.
    Fixed,
}

/// The next field of a Protobuf message: its number and its value. None if it is not one.
fn field<'a>(rest: &mut &'a [u8]) -> Option<(u64, Value<'a>)> {
    let tag = varint(rest)?;
    let value = match tag & 7 {
        0 => Value::Number(varint(rest)?),
        1 => take(rest, 8).map(|_| Value::Fixed)?,
        2 => {
            let length = varint(rest)?;
            Value::Bytes(take(rest, length)?)
        }
        5 => take(rest, 4).map(|_| Value::Fixed)?,
        _ => return None,
    };
    Some((tag >> 3, value))
}

fn take<'a>(rest: &mut &'a [u8], length: u64) -> Option<&'a [u8]> {
    let (taken, after) = rest.split_at_checked(usize::try_from(length).ok()?)?;
    *rest = after;
    Some(taken)
}

fn varint(rest: &mut &[u8]) -> Option<u64> {
    let mut value = 0u64;
    for shift in (0..64).step_by(7) {
        let byte = take(rest, 1)?[0];
        value |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Some(value);
        }
    }
    None
}
