//! CAN: frames as candump writes them, and the DBC that makes values of them. A message a channel: 40 bits of stamp in
//! microseconds and 24 bits for each value, so that a scalar fits a classic frame and a vector a CAN FD frame of 16
//! bytes.

use super::{Instants, LogWriter, RowWriter, Table};
use crate::io;
use monorig_sim::error::Error;
use serde_json::Value;
use std::fmt::Write as _;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

/// Identifier of the first message.
const FIRST_ID: u32 = 0x100;
/// Bits of a stamp and of a value.
const STAMP_BITS: u32 = 40;
const VALUE_BITS: u32 = 24;
/// Largest magnitude of a raw value.
const MAX_RAW: f64 = ((1 << (VALUE_BITS - 1)) - 1) as f64;

/// The writer of CAN frames.
pub(super) struct CanWriter;

impl LogWriter for CanWriter {
    fn name(&self) -> &'static str {
        "can"
    }

    fn files(&self) -> &'static str {
        "Frames as candump writes them, and their DBC"
    }

    fn is_lossy(&self) -> bool {
        true
    }

    fn create(
        &self,
        folder: &Path,
        name: &str,
        tables: &[Table],
    ) -> Result<Box<dyn RowWriter>, Error> {
        let mut ids = FIRST_ID..;
        let mut messages = Vec::new();
        for table in tables {
            messages.push(CanMessage::of_table(table, &mut ids));
        }
        let dbc = folder.join(format!("{name}.dbc"));
        let text = database(tables, &messages);
        std::fs::write(&dbc, text).map_err(|e| io(&dbc, e))?;
        let path = folder.join(format!("{name}.log"));
        let file = std::fs::File::create(&path).map_err(|e| io(&path, e))?;
        Ok(Box::new(CanFile {
            path,
            file: BufWriter::new(file),
            messages,
            line: String::new(),
            clipped: 0,
        }))
    }

    fn only_file(&self, name: &str) -> Option<String> {
        Some(format!("{name}.log"))
    }

    fn column(&self, table: &Table, column: usize) -> String {
        let name = table.columns.get(column).map_or("", String::as_str);
        format!("{}.{name}", message_name(table, column))
    }

    fn adapt(&self, map: &mut Value, name: &str) {
        map["time"]["unit"] = "us".into();
        map["time"]["stamp"] = "stamp_us".into();
        map["dbc"] = format!("{name}.dbc").into();
    }
}

/// A message: its identifier, and the columns of its table with their steps.
struct CanMessage {
    id: u32,
    columns: Vec<(usize, f64)>,
}

impl CanMessage {
    /// The messages of a table: one of a vector, else one for each column.
    fn of_table(table: &Table, ids: &mut impl Iterator<Item = u32>) -> Vec<Self> {
        let step = |column: usize| (column, table.steps.get(column).copied().unwrap_or(1.0));
        let columns: Vec<_> = (0..table.columns.len()).map(step).collect();
        let length = if table.is_vector { columns.len() } else { 1 };
        let groups = columns.chunks(length.max(1)).zip(ids);
        let message = |(columns, id): (&[(usize, f64)], u32)| Self {
            id,
            columns: columns.to_vec(),
        };
        groups.map(message).collect()
    }

    /// Bytes of a frame: a CAN FD frame where a classic one has no room.
    fn bytes(&self) -> usize {
        match STAMP_BITS + VALUE_BITS * self.columns.len() as u32 {
            ..=64 => 8,
            _ => 16,
        }
    }
}

/// The name of the message of a column; of a vector that of the table.
fn message_name(table: &Table, column: usize) -> String {
    match (table.is_vector, table.columns.get(column)) {
        (false, Some(column)) => format!("{}_{column}", table.name),
        _ => table.name.to_owned(),
    }
}

/// Values of the attribute `VFrameFormat`; the last one marks a CAN FD frame.
const FRAME_FORMATS: [&str; 15] = [
    "StandardCAN",
    "ExtendedCAN",
    "reserved",
    "J1939PG",
    "reserved",
    "reserved",
    "reserved",
    "reserved",
    "reserved",
    "reserved",
    "reserved",
    "reserved",
    "reserved",
    "reserved",
    "StandardCAN_FD",
];

/// The text of the DBC.
fn database(tables: &[Table], messages: &[Vec<CanMessage>]) -> String {
    let mut text = String::from("VERSION \"monorig\"\n\nNS_ :\n\nBS_:\n\nBU_: monorig\n\n");
    for (table, messages) in tables.iter().zip(messages) {
        for m in messages {
            let name = message_name(table, m.columns.first().map_or(0, |c| c.0));
            text += &format!("BO_ {} {name}: {} monorig\n", m.id, m.bytes());
            text += &format!(" SG_ stamp_us : 0|{STAMP_BITS}@1- (1,0) [0|0] \"us\" Vector__XXX\n");
            for (k, (column, step)) in m.columns.iter().enumerate() {
                text += &format!(
                    " SG_ {} : {}|{VALUE_BITS}@1- ({step},0) [0|0] \"{}\" Vector__XXX\n",
                    table.columns.get(*column).map_or("value", String::as_str),
                    STAMP_BITS + VALUE_BITS * k as u32,
                    table.units.get(*column).copied().unwrap_or_default()
                );
            }
            text.push('\n');
        }
    }
    let formats = FRAME_FORMATS.map(|f| format!("\"{f}\"")).join(",");
    text += &format!("BA_DEF_ BO_ \"VFrameFormat\" ENUM {formats};\n");
    text += "BA_DEF_DEF_ \"VFrameFormat\" \"StandardCAN\";\n";
    for m in messages.iter().flatten().filter(|m| m.bytes() > 8) {
        let fd = FRAME_FORMATS.len() - 1;
        text += &format!("BA_ \"VFrameFormat\" BO_ {} {fd};\n", m.id);
    }
    text
}

/// The candump file.
struct CanFile {
    path: PathBuf,
    file: BufWriter<std::fs::File>,
    /// Messages by the index of their table.
    messages: Vec<Vec<CanMessage>>,
    line: String,
    clipped: u64,
}

impl RowWriter for CanFile {
    fn row(&mut self, table: usize, at: Instants, values: &[f64]) -> Result<(), Error> {
        for message in self.messages.get(table).into_iter().flatten() {
            let value = |column: usize| values.get(column).copied().unwrap_or(f64::NAN);
            if message.columns.iter().any(|(c, _)| value(*c).is_nan()) {
                continue;
            }
            let stamp_us = (at.stamp_ns as f64 / 1e3).round() as i64;
            let mut bytes = stamp_us.to_le_bytes()[..STAMP_BITS as usize / 8].to_vec();
            for (column, step) in &message.columns {
                let raw = (value(*column) / step).round();
                self.clipped += u64::from(raw.abs() > MAX_RAW);
                let raw = raw.clamp(-MAX_RAW, MAX_RAW) as i32;
                bytes.extend_from_slice(&raw.to_le_bytes()[..VALUE_BITS as usize / 8]);
            }
            bytes.resize(message.bytes(), 0);
            self.line.clear();
            let (s, ns) = (at.arrival_ns / 1_000_000_000, at.arrival_ns % 1_000_000_000);
            let mark = if bytes.len() > 8 { "##0" } else { "#" };
            let _ = write!(self.line, "({s}.{ns:09}) can0 {:03X}{mark}", message.id);
            for byte in bytes {
                let _ = write!(self.line, "{byte:02X}");
            }
            self.line.push('\n');
            let written = self.file.write_all(self.line.as_bytes());
            written.map_err(|e| io(&self.path, e))?;
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<u64, Error> {
        self.file.flush().map_err(|e| io(&self.path, e))?;
        Ok(self.clipped)
    }
}
