//! What is packed in a message of an `.rrd` file: an Arrow IPC stream, as a rule compressed by LZ4. Its lengths are checked before
//! Arrow's reader sees them: that makes room for whatever a message says of its body, and where there is no such room the program is
//! aborted (arrow-ipc 58, `MessageReader::maybe_next`).

/// `Compression::LZ4` of Rerun's Protobuf messages.
const LZ4: u64 = 2;
/// Where a length follows that is not of the oldest kind.
const CONTINUATION: [u8; 4] = [0xff; 4];

/// Bytes as they stand in a message, with what the message says of them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Packed<'a> {
    /// The bytes.
    pub bytes: &'a [u8],
    /// How they are compressed.
    pub compression: u64,
    /// Their length when unpacked; to be bounded before.
    pub unpacked_bytes: u64,
}

impl Packed<'_> {
    /// Whether they can be unpacked, and hold as much as they say.
    pub fn is_plausible(&self) -> bool {
        if self.compression != LZ4 {
            return lengths_fit(self.bytes);
        }
        let unpacked = usize::try_from(self.unpacked_bytes).ok();
        let unpacked = unpacked.and_then(|n| lz4_flex::block::decompress(self.bytes, n).ok());
        unpacked.is_some_and(|stream| lengths_fit(&stream))
    }
}

/// Whether no message of an IPC stream says that it is longer than what is left: messages of a length, metadata of this length and a body
/// of the length that is in the metadata; a length of 0 ends them.
fn lengths_fit(stream: &[u8]) -> bool {
    let mut rest = stream;
    while !rest.is_empty() {
        rest = rest.strip_prefix(&CONTINUATION).unwrap_or(rest);
        let Some((length, behind)) = rest.split_first_chunk() else {
            return false;
        };
        let length = i32::from_le_bytes(*length);
        if length == 0 {
            return true;
        }
        let metadata = usize::try_from(length).ok();
        let metadata = metadata.and_then(|n| behind.split_at_checked(n));
        let after = metadata.and_then(|(metadata, body)| {
            let message = arrow_ipc::root_as_message(metadata).ok()?;
            body.get(usize::try_from(message.bodyLength()).ok()?..)
        });
        match after {
            Some(after) => rest = after,
            None => return false,
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use arrow::array::{Float64Array, RecordBatch};
    use arrow_ipc::writer::StreamWriter;
    use std::sync::Arc;

    fn stream() -> Vec<u8> {
        let column: arrow::array::ArrayRef = Arc::new(Float64Array::from_iter_values([1.5; 100]));
        let batch = RecordBatch::try_from_iter([("x", column)]).unwrap();
        let mut out = Vec::new();
        let mut writer = StreamWriter::try_new(&mut out, &batch.schema()).unwrap();
        writer.write(&batch).unwrap();
        writer.finish().unwrap();
        drop(writer);
        out
    }

    fn packed<'a>(bytes: &'a [u8], compression: u64, unpacked: usize) -> Packed<'a> {
        Packed {
            bytes,
            compression,
            unpacked_bytes: unpacked as u64,
        }
    }

    #[test]
    fn what_arrow_writes_is_plausible_packed_or_not() {
        let stream = stream();
        assert!(packed(&stream, 1, 0).is_plausible());
        let small = lz4_flex::block::compress(&stream);
        assert!(packed(&small, LZ4, stream.len()).is_plausible());
        assert!(!packed(&small, LZ4, stream.len() / 2).is_plausible());
        assert!(!packed(&small, 1, stream.len()).is_plausible());
    }

    /// The body of the batch is 800 bytes: said so once, little-endian. A single bit there made Arrow ask for 2^57 bytes.
    #[test]
    fn a_body_longer_than_what_is_left_is_not() {
        let good = stream();
        let said: Vec<usize> = (0..good.len() - 8)
            .filter(|i| {
                good[*i..i + 8] == 832i64.to_le_bytes() || good[*i..i + 8] == 800i64.to_le_bytes()
            })
            .collect();
        assert!(!said.is_empty());
        let mut refused = 0;
        for at in said {
            let mut bad = good.clone();
            bad[at + 7] = 2;
            refused += u32::from(!packed(&bad, 1, 0).is_plausible());
        }
        assert!(refused >= 1);
        for keep in [1, 5, good.len() / 2, good.len() - 9] {
            assert!(!packed(&good[..keep], 1, 0).is_plausible(), "{keep} bytes");
        }
    }
}
