//! candump: a frame a line, `(1700000000.000125) can0 100#B2FF`, `##` for CAN FD, with or without a direction at the
//! end.

use super::{Frame, Frames};
use crate::notation::TimeUnit;
use crate::read::{LogReader, Out, ReadOptions, Section};
use crate::{io, wrong};
use monorig_sim::error::Error;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// Longest line.
const MAX_LINE: u64 = 4096;

/// The reader of candump.
pub(in crate::read) struct CandumpReader;

impl LogReader for CandumpReader {
    fn name(&self) -> &'static str {
        "candump"
    }

    fn recognises(&self, head: &[u8], _: &str) -> bool {
        head.starts_with(b"(")
    }

    fn is_can(&self) -> bool {
        true
    }

    fn is_in_order(&self) -> bool {
        false
    }

    fn read(
        &self,
        path: &Path,
        options: &ReadOptions,
        _: Section,
        out: &mut Out<'_>,
    ) -> Result<(), Error> {
        let file = File::open(path).map_err(|e| io(path, e))?;
        let lines = Lines {
            path: path.into(),
            lines: BufReader::new(file),
            line: 0,
            text: Vec::new(),
        };
        super::read(path, options, lines, out)
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
            let mut limited = (&mut self.lines).take(MAX_LINE);
            let read = limited
                .read_until(b'\n', &mut self.text)
                .map_err(|e| io(&self.path, e))?;
            if read == 0 {
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
                        format!("`{shown}` is no frame of candump"),
                        "lines as `candump -L` writes them: (1700000000.000125) can0 100#B2FF",
                    ));
                }
            }
        }
    }
}

/// Parses a line; false for frames without data: errors and remote requests.
fn line(text: &str, frame: &mut Frame) -> Option<bool> {
    let mut words = text.split_ascii_whitespace();
    let stamp = words.next()?.strip_prefix('(')?.strip_suffix(')')?;
    frame.ns = TimeUnit::Seconds.parse(stamp)?;
    let _bus = words.next()?;
    let (id, rest) = words.next()?.split_once('#')?;
    let number = u32::from_str_radix(id, 16).ok()?;
    frame.extended = id.len() > 3;
    frame.id = number & 0x1FFF_FFFF;
    let hex = match rest.strip_prefix('#') {
        Some(fd) => fd.get(1..)?,
        None => rest,
    };
    if number & 0x2000_0000 != 0 || hex.starts_with(['R', 'r']) {
        return Some(false);
    }
    frame.data.clear();
    let mut high = None;
    for c in hex.chars().filter(|c| *c != '.') {
        let digit = c.to_digit(16)? as u8;
        match high.take() {
            None => high = Some(digit),
            Some(h) => frame.data.push(h << 4 | digit),
        }
    }
    (high.is_none() && frame.data.len() <= 64).then_some(true)
}
