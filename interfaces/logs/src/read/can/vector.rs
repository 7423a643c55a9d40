//! BLF and ASC of Vector, by `blf_asc`.

use super::frames::{Frame, Frames, read};
use crate::read::{Asked, LogReader, Out};
use crate::wrong;
use blf_asc::{BlfError, Message};
use monorig_sim::error::Error;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// The reader of ASC.
pub(in crate::read) struct AscReader;

impl LogReader for AscReader {
    fn name(&self) -> &'static str {
        "ASC"
    }

    fn recognises(&self, _: &[u8], ending: &str) -> bool {
        ending == "asc"
    }

    fn is_can(&self) -> bool {
        true
    }

    fn read(&self, asked: Asked<'_>, out: &mut Out<'_>) -> Result<(), Error> {
        let Asked { path, options, .. } = asked;
        let mut reader = blf_asc::AscReader::open(path).map_err(|e| broken(path, 0, &e))?;
        let messages = Messages::of(path, Box::new(move || reader.next_message()));
        read(path, options, messages, out)
    }
}

/// The reader of BLF.
pub(in crate::read) struct BlfReader;

impl LogReader for BlfReader {
    fn name(&self) -> &'static str {
        "BLF"
    }

    fn magics(&self) -> &[&'static [u8]] {
        &[b"LOGG"]
    }

    fn endings(&self) -> &[&'static str] {
        &["blf"]
    }

    fn is_can(&self) -> bool {
        true
    }

    fn read(&self, asked: Asked<'_>, out: &mut Out<'_>) -> Result<(), Error> {
        let Asked { path, options, .. } = asked;
        lengths_fit(path)?;
        let mut reader = blf_asc::BlfReader::open(path).map_err(|e| broken(path, 0, &e))?;
        let messages = Messages::of(path, Box::new(move || reader.next_message()));
        read(path, options, messages, out)
    }
}

/// The next message of a file.
type NextMessage = Box<dyn FnMut() -> Result<Option<Message>, BlfError>>;

/// The messages of a file.
struct Messages {
    path: PathBuf,
    next: NextMessage,
    frame: u64,
}

impl Messages {
    fn of(path: &Path, next: NextMessage) -> Self {
        Self {
            path: path.into(),
            next,
            frame: 0,
        }
    }
}

/// Longest header of a BLF file and longest object in it, bytes: Vector's containers are of 128 kB.
const MAX_HEADER: u64 = 1 << 20;
const MAX_OBJECT: u64 = 8 << 20;
/// Magic, size, version and type in front of each object.
const OBJECT_HEADER: u64 = 16;

/// Refuses a BLF file with an object that is longer than the rest of the file. The library asks for as much memory as a
/// file declares, and a damaged length would end the process. Only the headers of the objects are read.
fn lengths_fit(path: &Path) -> Result<(), Error> {
    let failed = |e| crate::io(path, e);
    let mut file = BufReader::new(File::open(path).map_err(failed)?);
    let length = file.get_ref().metadata().map_err(failed)?.len();
    let beyond = |at: u64, declared: u64| {
        wrong(
            path,
            None,
            format!("at byte {at} this BLF file declares {declared} bytes, of {length}"),
            "a whole file",
        )
    };
    let mut head = [0u8; OBJECT_HEADER as usize];
    file.read_exact(&mut head)
        .map_err(|_| beyond(0, OBJECT_HEADER))?;
    let word = |head: &[u8], at: usize| {
        let bytes = head.get(at..at + 4).and_then(|b| b.try_into().ok());
        u64::from(bytes.map_or(0, u32::from_le_bytes))
    };
    let mut at = word(&head, 4);
    if at > length.min(MAX_HEADER) {
        return Err(beyond(4, at));
    }
    while at + OBJECT_HEADER <= length {
        file.seek(SeekFrom::Start(at)).map_err(failed)?;
        file.read_exact(&mut head).map_err(failed)?;
        let size = word(&head, 8);
        if !head.starts_with(b"LOBJ") || size < OBJECT_HEADER {
            return Ok(()); // refused by the library, with its reason
        }
        if size > (length - at).min(MAX_OBJECT) {
            return Err(beyond(at, size));
        }
        at += size + size % 4;
    }
    Ok(())
}

fn broken(path: &Path, frame: u64, e: &dyn std::fmt::Display) -> Error {
    wrong(
        path,
        None,
        format!("this CAN log cannot be read beyond frame {frame}: {e}"),
        "a whole file",
    )
}

impl Frames for Messages {
    fn next(&mut self, frame: &mut Frame) -> Result<bool, Error> {
        loop {
            let next = (self.next)().map_err(|e| broken(&self.path, self.frame, &e))?;
            let Some(m) = next else {
                return Ok(false);
            };
            self.frame += 1;
            if m.is_error_frame || m.is_remote_frame {
                continue;
            }
            let ns = (m.timestamp * 1e9).round();
            if ns.is_nan() || ns.abs() > 9.2e18 {
                return Err(broken(&self.path, self.frame, &"a frame without a time"));
            }
            frame.ns = ns as i64;
            frame.id = m.arbitration_id.0 & 0x1FFF_FFFF;
            frame.extended = m.is_extended_id;
            frame.data.clone_from(&m.data.0);
            frame.place = self.frame;
            return Ok(true);
        }
    }
}
