//! BLF and ASC of Vector, by `blf_asc`.

use super::Format;
use super::can::{Frame, Source};
use crate::wrong;
use blf_asc::{AscReader, BlfReader, Message};
use monorig_sim::error::Error;
use std::path::{Path, PathBuf};

/// The frames of a file.
pub(super) struct Frames {
    path: PathBuf,
    reader: Reader,
    frame: u64,
}

enum Reader {
    Asc(Box<AscReader>),
    Blf(Box<BlfReader>),
}

impl Frames {
    /// Open it.
    pub fn open(path: &Path, format: Format) -> Result<Self, Error> {
        let refused = |e: blf_asc::BlfError| broken(path, 0, &e);
        let reader = match format {
            Format::Asc => Reader::Asc(Box::new(AscReader::open(path).map_err(refused)?)),
            _ => Reader::Blf(Box::new(BlfReader::open(path).map_err(refused)?)),
        };
        Ok(Self {
            path: path.into(),
            reader,
            frame: 0,
        })
    }
}

fn broken(path: &Path, frame: u64, e: &dyn std::fmt::Display) -> Error {
    wrong(
        path,
        None,
        format!("this CAN log cannot be read beyond frame {frame}: {e}"),
        "a whole file",
    )
}

impl Source for Frames {
    fn next(&mut self, frame: &mut Frame) -> Result<bool, Error> {
        loop {
            let next = match &mut self.reader {
                Reader::Asc(r) => r.next_message(),
                Reader::Blf(r) => r.next_message(),
            };
            let Some(m): Option<Message> = next.map_err(|e| broken(&self.path, self.frame, &e))?
            else {
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
