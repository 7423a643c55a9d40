//! MCAP: a topic of JSON messages a table, logged at their arrival, published at their stamp, which stands in the
//! message too because a stamp before the start of the run cannot be a time of publication.

use super::failed::failed;
use super::tables::{Instants, Table};
use super::writer::{LogWriter, NewLog, RowWriter};
use crate::io;
use ::mcap::records::MessageHeader;
use ::mcap::{WriteOptions, Writer};
use monorig_sim::error::Error;
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::io::BufWriter;
use std::path::PathBuf;

/// The writer of MCAP.
pub(super) struct McapWriter;

impl LogWriter for McapWriter {
    fn name(&self) -> &'static str {
        "mcap"
    }

    fn files(&self) -> &'static str {
        "One MCAP file, JSON"
    }

    fn create(&self, log: NewLog<'_>) -> Result<Box<dyn RowWriter>, Error> {
        let path = log.folder.join(format!("{}.mcap", log.name));
        let failed = |e: &dyn std::fmt::Display| failed(&path)(e);
        let file = std::fs::File::create(&path).map_err(|e| io(&path, e))?;
        let options = WriteOptions::new().compression(None).library("monorig");
        let mut writer = options
            .create(BufWriter::new(file))
            .map_err(|e| failed(&e))?;
        let mut channels = Vec::new();
        for table in log.tables {
            if table.columns.is_empty() {
                channels.push(None);
                continue;
            }
            let schema = schema(table).to_string();
            let title = format!("monorig.{}", table.name);
            let schema = writer.add_schema(&title, "jsonschema", schema.as_bytes());
            let schema = schema.map_err(|e| failed(&e))?;
            let topic = format!("/{}", table.name);
            let channel = writer.add_channel(schema, &topic, "json", &BTreeMap::new());
            let channel = channel.map_err(|e| failed(&e))?;
            channels.push(Some((channel, table.columns.clone())));
        }
        Ok(Box::new(McapFile {
            path,
            writer,
            channels,
            sequence: 0,
        }))
    }

    fn only_file(&self, name: &str) -> Option<String> {
        Some(format!("{name}.mcap"))
    }

    fn column(&self, table: &Table, column: usize) -> String {
        let name = table.columns.get(column).map_or("", String::as_str);
        format!("/{}.{name}", table.name)
    }
}

/// The file, and channel and columns of each table.
struct McapFile {
    path: PathBuf,
    writer: Writer<BufWriter<std::fs::File>>,
    channels: Vec<Option<(u16, Vec<String>)>>,
    sequence: u32,
}

/// The JSON Schema of a table's messages, as viewers of MCAP need it.
fn schema(table: &Table) -> Value {
    let mut properties = Map::new();
    properties.insert("stamp_ns".into(), serde_json::json!({"type": "integer"}));
    for (column, unit) in table.columns.iter().zip(&table.units) {
        let property = serde_json::json!({"type": "number", "description": unit});
        properties.insert(column.clone(), property);
    }
    serde_json::json!({"type": "object", "properties": properties})
}

impl RowWriter for McapFile {
    fn row(&mut self, table: usize, at: Instants, values: &[f64]) -> Result<(), Error> {
        let Some((channel, columns)) = self.channels.get(table).and_then(Option::as_ref) else {
            return Ok(());
        };
        let mut message = Map::new();
        message.insert("stamp_ns".into(), at.stamp_ns.into());
        for (column, x) in columns.iter().zip(values).filter(|(_, x)| !x.is_nan()) {
            message.insert(column.clone(), (*x).into());
        }
        self.sequence = self.sequence.wrapping_add(1);
        let header = MessageHeader {
            channel_id: *channel,
            sequence: self.sequence,
            log_time: at.arrival_ns.max(0) as u64,
            publish_time: at.stamp_ns.max(0) as u64,
        };
        let data = Value::Object(message).to_string();
        let written = self.writer.write_to_known_channel(&header, data.as_bytes());
        written.map_err(|e| failed(&self.path)(&e))
    }

    fn finish(mut self: Box<Self>) -> Result<u64, Error> {
        let finished = self.writer.finish();
        finished.map_err(|e| failed(&self.path)(&e))?;
        Ok(0)
    }
}
