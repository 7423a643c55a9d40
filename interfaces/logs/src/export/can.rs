//! CAN: frames as candump writes them, and the DBC that makes values of them. The messages are those of
//! [`monorig_wire`], by which an estimator on a controller is reached, too: a message a channel, its stamp in
//! microseconds and its values in 24 bits each.

use super::tables::{Instants, Table};
use super::writer::{LogWriter, NewLog, RowWriter};
use crate::io;
use monorig_estimators::api::signals::{Measurand, Shape};
use monorig_sim::error::Error;
use monorig_wire::message::{Commanded, Message, Value as Signal};
use monorig_wire::signal::Numbers;
use monorig_wire::{candump, dbc};
use serde_json::Value;
use std::io::{BufWriter, Write as _};
use std::path::PathBuf;

/// Numbers of the signals.
const NUMBERS: Numbers = Numbers::Fixed;

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

    fn create(&self, log: NewLog<'_>) -> Result<Box<dyn RowWriter>, Error> {
        let NewLog { name, folder, .. } = log;
        let messages: Vec<Vec<Message>> = log.tables.iter().map(messages).collect();
        let path = folder.join(format!("{name}.dbc"));
        let mut text = String::new();
        // a text takes everything
        let _ = dbc::write(&mut text, NUMBERS, messages.iter().flatten().copied());
        std::fs::write(&path, text).map_err(|e| io(&path, e))?;
        let path = folder.join(format!("{name}.log"));
        let file = std::fs::File::create(&path).map_err(|e| io(&path, e))?;
        Ok(Box::new(CanFile {
            path,
            file: BufWriter::new(file),
            messages,
            line: Vec::new(),
            clipped: 0,
        }))
    }

    fn only_file(&self, name: &str) -> Option<String> {
        Some(format!("{name}.log"))
    }

    fn column(&self, table: &Table, column: usize) -> String {
        let name = table.columns.get(column).map_or("", String::as_str);
        let all = messages(table);
        let message = all.get(column).or(all.first());
        message.map_or_else(String::new, |m| format!("{}.{name}", m.name()))
    }

    fn adapt(&self, map: &mut Value, name: &str) {
        map["time"]["unit"] = "us".into();
        map["time"]["stamp"] = "stamp_us".into();
        map["dbc"] = format!("{name}.dbc").into();
    }
}

/// The messages of a table: one of a vector, else one for each column.
fn messages(table: &Table) -> Vec<Message> {
    let columns = 0..table.columns.len();
    let drives = columns.len().saturating_sub(2);
    let commanded = |column: usize| match column.checked_sub(drives) {
        None => Commanded::Torque(column),
        Some(0) => Commanded::Clamp,
        Some(_) => Commanded::Brake,
    };
    match Measurand::named(table.name) {
        Some(of) if of.shape() == Shape::Vector => {
            let any = columns.take(1);
            any.map(|_| Message::Sample(of.slot(0))).collect()
        }
        Some(of) => columns.map(|c| Message::Sample(of.slot(c))).collect(),
        None if table.name == super::tables::COMMANDS => {
            columns.map(|c| Message::Command(commanded(c))).collect()
        }
        None => columns.map(Message::Truth).collect(),
    }
}

/// The candump file.
struct CanFile {
    path: PathBuf,
    file: BufWriter<std::fs::File>,
    /// Messages by the index of their table.
    messages: Vec<Vec<Message>>,
    line: Vec<u8>,
    clipped: u64,
}

impl RowWriter for CanFile {
    fn row(&mut self, table: usize, at: Instants, values: &[f64]) -> Result<(), Error> {
        let messages = self.messages.get(table).map_or(&[][..], Vec::as_slice);
        let each = values.len() / messages.len().max(1);
        for (message, values) in messages.iter().zip(values.chunks(each.max(1))) {
            if values.iter().any(|x| x.is_nan()) {
                continue;
            }
            let mut signals = vec![Signal::Instant(at.stamp_ns)];
            signals.extend(values.iter().copied().map(Signal::Number));
            let (frame, clipped) = message.encode(NUMBERS, &signals);
            self.clipped += u64::from(clipped);
            self.line.clear();
            candump::write(&frame, at.arrival_ns, &mut self.line);
            let written = self.file.write_all(&self.line);
            written.map_err(|e| io(&self.path, e))?;
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<u64, Error> {
        self.file.flush().map_err(|e| io(&self.path, e))?;
        Ok(self.clipped)
    }
}
