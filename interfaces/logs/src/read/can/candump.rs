//! candump: a frame a line, `(1700000000.000125) can0 100#B2FF`, `##` for CAN FD, with or without a direction at the
//! end.

use super::frames::{Frame, Frames, read};
use crate::notation::TimeUnit;
use crate::read::{Asked, LogReader, Out};
use crate::{io, wrong};
use monorig_sim::error::Error;
use monorig_sim::lines::read_line;
use monorig_wire::candump;
use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;

/// Longest line.
const MAX_LINE: u64 = 4096;

/// The reader of candump.
pub(in crate::read) struct CandumpReader;

impl LogReader for CandumpReader {
    fn name(&self) -> &'static str {
        "candump"
    }

    fn recognises(&self, head: &[u8], _: &str) -> bool {
        // with a stamp, or as it stands on the screen without one: `can0  100   [8]  08 07`
        let line = head.split(|c| *c == b'\n').next().unwrap_or_default();
        let mut words = line
            .split(u8::is_ascii_whitespace)
            .filter(|w| !w.is_empty());
        let (first, third) = (words.next().unwrap_or_default(), words.nth(1));
        let length = third.and_then(|w| w.strip_prefix(b"[")?.strip_suffix(b"]"));
        first.starts_with(b"(") || length.is_some_and(|n| n.iter().all(u8::is_ascii_digit))
    }

    fn is_can(&self) -> bool {
        true
    }

    fn read(&self, asked: Asked<'_>, out: &mut Out<'_>) -> Result<(), Error> {
        let Asked { path, options, .. } = asked;
        let file = File::open(path).map_err(|e| io(path, e))?;
        let lines = Lines {
            path: path.into(),
            lines: BufReader::new(file),
            line: 0,
            text: Vec::new(),
        };
        read(path, options, lines, out)
    }
}

/// The lines of a file.
struct Lines {
    path: PathBuf,
    lines: BufReader<File>,
    line: u64,
    text: Vec<u8>,
}

impl Frames for Lines {
    fn next(&mut self, frame: &mut Frame) -> Result<bool, Error> {
        loop {
            self.text.clear();
            let read = read_line(&mut self.lines, MAX_LINE, &mut self.text);
            if !read.map_err(|e| io(&self.path, e))? {
                return Ok(false);
            }
            self.line += 1;
            let text = String::from_utf8_lossy(&self.text);
            let text = text.trim();
            if text.is_empty() {
                continue;
            }
            match line(text, frame) {
                Some(true) => {
                    frame.place = self.line;
                    return Ok(true);
                }
                Some(false) => continue,
                None => {
                    let shown: String = text.chars().take(60).collect();
                    return Err(wrong(
                        &self.path,
                        Some(self.line as usize),
                        format!("`{shown}` is not a frame of candump"),
                        "use lines with a time, as `candump -L` writes them: (1700000000.000125) can0 100#B2FF",
                    ));
                }
            }
        }
    }
}

/// Parses a line; false for frames without data: errors and remote requests.
fn line(text: &str, frame: &mut Frame) -> Option<bool> {
    let read = candump::read(text.as_bytes())?;
    frame.ns = TimeUnit::Seconds.parse(std::str::from_utf8(read.stamp).ok()?)?;
    let Some(came) = &read.frame else {
        return Some(false);
    };
    (frame.id, frame.extended) = (came.id, came.extended);
    frame.data.clear();
    frame.data.extend_from_slice(came.data());
    Some(true)
}
