//! The index of an `.rrd` file, put in order after Rerun's encoder has written it: the same run then gives the same
//! file.
//!
//! A file is a header of 12 bytes; messages, each with a header of 16 bytes (kind and length, little-endian) and a
//! Protobuf payload; the last of them, of kind 0, is the index: one manifest a store; behind it 32 bytes that say where
//! the index is, with its check sum. (`re_log_encoding` 0.36, `src/rrd/frames.rs`.)

use re_log_encoding::{Decodable, Encodable, MessageHeader, MessageKind, StreamFooter};
use re_protos::log_msg::v1alpha1::{ArrowMsg, RrdFooter, RrdManifest};
use rerun::external::arrow::datatypes::Schema as ArrowSchema;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;

const FILE_HEADER_BYTES: u64 = 12;
const HEADER_BYTES: usize = MessageHeader::ENCODED_SIZE_BYTES;
const FOOTER_BYTES: u64 = StreamFooter::ENCODED_SIZE_BYTES as u64;
/// A byte that LZ4 has packed stands for at most so many.
const MOST_PACKED: u64 = 256;
/// Longest index that is read; our recordings have some megabytes.
const MAX_INDEX_BYTES: u64 = 256 << 20;

/// Puts the index in order: Rerun's encoder keeps the manifests, and the fields of each one's schema, in hash maps,
/// whose order is another in every process. The content of the index stays the same; its SHA-256 of the schema does not
/// depend on the order.
pub fn sort_index(path: &Path) -> io::Result<()> {
    let mut file = File::options().read(true).write(true).open(path)?;
    if file.metadata()?.len() < FILE_HEADER_BYTES + HEADER_BYTES as u64 + FOOTER_BYTES {
        return Ok(());
    }
    let place = place_of_index(&mut file)?;
    let (start, size) = place.ok_or_else(|| damaged("it has no index at its end"))?;
    if size > MAX_INDEX_BYTES {
        return Err(damaged("its index is too long"));
    }
    let header = start - HEADER_BYTES as u64;
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

/// Checks the lengths that a file declares against what is there: the decoder asks for memory by them. A file that
/// breaks off is not refused by this.
pub fn check_lengths(path: &Path) -> io::Result<()> {
    let mut file = BufReader::new(File::open(path)?);
    let size = file.get_ref().metadata()?.len();
    file.seek(SeekFrom::Start(FILE_HEADER_BYTES))?;
    loop {
        let (Ok(kind), Ok(length)) = (array(&mut file), array(&mut file)) else {
            return Ok(());
        };
        let (kind, length) = (u64::from_le_bytes(kind), u64::from_le_bytes(length));
        if length > size {
            return Err(damaged("a message in it is longer than the file"));
        }
        if kind == MessageKind::ArrowMsg as u64 {
            let mut payload = vec![0; length as usize];
            if file.read_exact(&mut payload).is_err() {
                return Ok(());
            }
            let message = ArrowMsg::from_rrd_bytes(&payload).map_err(io::Error::other)?;
            if message.uncompressed_size > MOST_PACKED * (1 + length) {
                return Err(damaged("a message in it is longer than it can be"));
            }
            continue;
        }
        file.seek_relative(length as i64)?;
        if kind == MessageKind::End as u64 && file.stream_position()? + FOOTER_BYTES < size {
            return Err(damaged("it has data after its end"));
        }
    }
}

/// Returns whether a file ends with its index, no byte less and no byte more.
pub fn ends_with_index(path: &Path) -> io::Result<bool> {
    Ok(place_of_index(&mut File::open(path)?)?.is_some())
}

/// Place and length of the index, as the last bytes of the file have them; none if they do not fit the file.
fn place_of_index(file: &mut File) -> io::Result<Option<(u64, u64)>> {
    let Some(end) = file.metadata()?.len().checked_sub(FOOTER_BYTES) else {
        return Ok(None);
    };
    file.seek(SeekFrom::Start(end))?;
    let start = u64::from_le_bytes(array(file)?);
    let size = u64::from_le_bytes(array(file)?);
    let fits = start >= HEADER_BYTES as u64 && start.checked_add(size) == Some(end);
    Ok(fits.then_some((start, size)))
}

/// Returns the index with its manifests, and the fields of their schemas, sorted by name.
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

/// Kind and name of the store of a manifest.
fn name(manifest: &RrdManifest) -> Option<(i32, &str)> {
    let id = manifest.store_id.as_ref()?;
    Some((id.kind, id.recording_id.as_str()))
}

fn array(file: &mut impl Read) -> io::Result<[u8; 8]> {
    let mut bytes = [0; 8];
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn damaged(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
}
