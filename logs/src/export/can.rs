//! CAN: frames as candump writes them, and the DBC that makes values of them. A message a channel: 40 bits of stamp in microseconds and 24 bits
//! for each value, so that a scalar fits a classic frame and a vector a CAN FD frame of 16 bytes.

use super::{Instants, Table, Writer};
use crate::io;
use monorig_sim::error::Error;
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

/// A message: its identifier, and the columns of its table with their steps.
struct Message {
    id: u32,
    columns: Vec<(usize, f64)>,
}

/// The candump file.
pub(super) struct File {
    path: PathBuf,
    file: BufWriter<std::fs::File>,
    /// Messages by the index of their table.
    messages: Vec<Vec<Message>>,
    line: String,
    clipped: u64,
}

/// The name of the message of a column; of a vector that of the table.
pub(super) fn message_name(table: &Table, column: usize) -> String {
    match (table.is_vector, table.columns.get(column)) {
        (false, Some(column)) => format!("{}_{column}", table.name),
        _ => table.name.to_owned(),
    }
}

impl File {
    /// The candump file and its DBC.
    pub fn create(folder: &Path, name: &str, tables: &[Table]) -> Result<Self, Error> {
        let mut database = String::from("VERSION \"monorig\"\n\nNS_ :\n\nBS_:\n\nBU_: monorig\n\n");
        let mut id = FIRST_ID;
        let (mut messages, mut flexible) = (Vec::new(), Vec::new());
        for table in tables {
            let mut of_table = Vec::new();
            let columns: Vec<usize> = (0..table.columns.len()).collect();
            let groups: Vec<&[usize]> = match table.is_vector && !columns.is_empty() {
                true => vec![&columns],
                false => columns.chunks(1).collect(),
            };
            for group in groups {
                let first = group.first().copied().unwrap_or(0);
                let bits = STAMP_BITS + VALUE_BITS * group.len() as u32;
                let bytes = if bits <= 64 { 8 } else { 16 };
                if bytes > 8 {
                    flexible.push(id);
                }
                let _ = writeln!(
                    database,
                    "BO_ {id} {}: {bytes} monorig",
                    message_name(table, first)
                );
                let _ = writeln!(
                    database,
                    " SG_ stamp_us : 0|{STAMP_BITS}@1- (1,0) [0|0] \"us\" Vector__XXX"
                );
                let mut columns = Vec::new();
                for (k, column) in group.iter().enumerate() {
                    let step = table.steps.get(*column).copied().unwrap_or(1.0);
                    let _ = writeln!(
                        database,
                        " SG_ {} : {}|{VALUE_BITS}@1- ({step},0) [0|0] \"{}\" Vector__XXX",
                        table.columns.get(*column).map_or("value", String::as_str),
                        STAMP_BITS + VALUE_BITS * k as u32,
                        table.units.get(*column).copied().unwrap_or_default()
                    );
                    columns.push((*column, step));
                }
                database.push('\n');
                of_table.push(Message { id, columns });
                id += 1;
            }
            messages.push(of_table);
        }
        database.push_str("BA_DEF_ BO_ \"VFrameFormat\" ENUM \"StandardCAN\",\"ExtendedCAN\",\"reserved\",\"J1939PG\",\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"StandardCAN_FD\";\nBA_DEF_DEF_ \"VFrameFormat\" \"StandardCAN\";\n");
        for id in flexible {
            let _ = writeln!(database, "BA_ \"VFrameFormat\" BO_ {id} 14;");
        }
        let dbc = folder.join(format!("{name}.dbc"));
        std::fs::write(&dbc, database).map_err(|e| io(&dbc, e))?;
        let path = folder.join(format!("{name}.log"));
        let file = std::fs::File::create(&path).map_err(|e| io(&path, e))?;
        Ok(Self {
            path,
            file: BufWriter::new(file),
            messages,
            line: String::new(),
            clipped: 0,
        })
    }
}

impl Writer for File {
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
            let fd = bytes.len() > 8;
            bytes.resize(if fd { 16 } else { 8 }, 0);
            self.line.clear();
            let (s, ns) = (at.arrival_ns / 1_000_000_000, at.arrival_ns % 1_000_000_000);
            let mark = if fd { "##0" } else { "#" };
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
