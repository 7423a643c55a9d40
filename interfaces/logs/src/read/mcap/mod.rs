//! MCAP: a table a topic; JSON, and CDR of the messages of ROS 2 that `cdr` decodes. The stamp is that of the message's
//! header, else the time of publication; the arrival is the time of logging.

mod cdr;
mod json;

use crate::read::{Asked, LogColumn, LogReader, Out, ReadOptions, Row};
use crate::{io, wrong};
use ::mcap::records::op;
use ::mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use monorig_sim::error::Error;
use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// Longest record, bytes: without a limit a corrupt length ends the process instead of the reading.
const MAX_RECORD: usize = 256 << 20;
/// Most columns of a topic.
const MAX_COLUMNS: usize = 4096;

#[derive(Default)]
struct Topic {
    name: String,
    encoding: String,
    schema: String,
    /// Its table, and its wanted columns by name. New names of a message make a new table.
    table: Option<(u32, Vec<String>)>,
}

/// The state while a file is read.
struct Reading<'p, 'a, 'o> {
    path: &'p Path,
    options: &'p ReadOptions,
    out: &'a mut Out<'o>,
    schemas: HashMap<u16, String>,
    topics: HashMap<u16, Topic>,
    place: u64,
}

/// The reader of MCAP.
pub(super) struct McapReader;

impl LogReader for McapReader {
    fn name(&self) -> &'static str {
        "MCAP"
    }

    fn magics(&self) -> &[&'static [u8]] {
        &[b"\x89MCAP0"]
    }

    fn endings(&self) -> &[&'static str] {
        &["mcap"]
    }

    fn is_in_order(&self) -> bool {
        false
    }

    fn declares_columns(&self) -> bool {
        false
    }

    fn read(&self, asked: Asked<'_>, out: &mut Out<'_>) -> Result<(), Error> {
        let Asked { path, options, .. } = asked;
        let mut file =
            BufReader::with_capacity(1 << 16, File::open(path).map_err(|e| io(path, e))?);
        let limits = LinearReaderOptions::default()
            .with_record_length_limit(MAX_RECORD)
            .with_emit_chunks(true);
        let mut reader = LinearReader::new_with_options(limits);
        let mut reading = Reading {
            path,
            options,
            out,
            schemas: HashMap::new(),
            topics: HashMap::new(),
            place: 0,
        };
        while let Some(event) = reader.next_event() {
            let record = match event.map_err(|e| reading.broken(&e))? {
                LinearReadEvent::ReadRequest(n) => {
                    // room for a whole record may be asked for at once; it is filled by what is there
                    let room = reader.insert(n.min(1 << 20));
                    let read = file.read(room).map_err(|e| io(path, e))?;
                    reader.notify_read(read);
                    continue;
                }
                LinearReadEvent::Record { data, opcode } => (opcode, data),
            };
            let go_on = match record {
                (op::CHUNK, data) => {
                    let records = unpacked(data).map_err(|e| reading.broken(&e))?;
                    reading.chunk(&records)?
                }
                (code, data) => reading.record(code, data)?,
            };
            if !go_on {
                return Ok(());
            }
        }
        Ok(())
    }
}

/// Fields of a record one after the other. (The library's own parser makes room for strings by the length that they
/// declare.)
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(n)?;
        self.0 = rest;
        Some(taken)
    }

    fn number<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    fn u16(&mut self) -> Option<u16> {
        self.number().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.number().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.number().map(u64::from_le_bytes)
    }

    fn string(&mut self) -> Option<&'a str> {
        let length = self.u32()?;
        std::str::from_utf8(self.take(length as usize)?).ok()
    }
}

/// The records of a chunk, of no more bytes than it declares, which are no more than a limit.
fn unpacked(chunk: &[u8]) -> Result<Vec<u8>, String> {
    let mut fields = Fields(chunk);
    let mut header = || {
        let (_start, _end) = (fields.u64()?, fields.u64()?);
        let (size, sum) = (fields.u64()?, fields.u32()?);
        let compression = fields.string()?;
        let length = fields.u64()?;
        let data = fields.take(usize::try_from(length).ok()?)?;
        Some((size, sum, compression, data))
    };
    let Some((declared, sum, compression, data)) = header() else {
        return Err("a chunk is incomplete".into());
    };
    if declared > MAX_RECORD as u64 {
        return Err(format!("a chunk of {declared} bytes"));
    }
    let mut records = Vec::new();
    let mut fill = |from: &mut dyn Read| {
        let mut limited = from.take(declared);
        limited.read_to_end(&mut records).map_err(|e| e.to_string())
    };
    match compression {
        "" => fill(&mut &*data)?,
        "zstd" => {
            fill(&mut zstd::stream::read::Decoder::with_buffer(data).map_err(|e| e.to_string())?)?
        }
        "lz4" => fill(&mut lz4::Decoder::new(data).map_err(|e| e.to_string())?)?,
        other => return Err(format!("a chunk compressed with `{other}`")),
    };
    if records.len() as u64 != declared {
        return Err(format!(
            "a chunk has {} of the {declared} bytes that it declares",
            records.len()
        ));
    }
    match sum == 0 || sum == crc32fast::hash(&records) {
        true => Ok(records),
        false => Err("the check sum of a chunk is wrong".into()),
    }
}

impl Reading<'_, '_, '_> {
    fn broken(&self, e: &dyn std::fmt::Display) -> Error {
        wrong(
            self.path,
            None,
            format!(
                "this MCAP file cannot be read beyond message {}: {e}",
                self.place
            ),
            "use a complete file; `mcap recover` repairs an incomplete file",
        )
    }

    /// All records of a chunk: code, length and content, one behind the other. False if no more is wanted.
    fn chunk(&mut self, records: &[u8]) -> Result<bool, Error> {
        let mut rest = records;
        while !rest.is_empty() {
            let parts = rest.split_at_checked(9).and_then(|(head, behind)| {
                let (code, length) = head.split_first()?;
                let length = u64::from_le_bytes(length.try_into().ok()?);
                let (content, behind) = behind.split_at_checked(usize::try_from(length).ok()?)?;
                Some((*code, content, behind))
            });
            let Some((code, content, behind)) = parts else {
                return Err(self.broken(&"a record goes beyond its chunk"));
            };
            if !self.record(code, content)? {
                return Ok(false);
            }
            rest = behind;
        }
        Ok(true)
    }

    /// One record; false if no more is wanted.
    fn record(&mut self, code: u8, data: &[u8]) -> Result<bool, Error> {
        let mut f = Fields(data);
        let known = match code {
            op::SCHEMA => self.schema(&mut f),
            op::CHANNEL => self.channel(&mut f),
            op::MESSAGE => {
                self.place += 1;
                let mut header = || Some((f.u16()?, f.u32()?, f.u64()?, f.u64()?));
                match header() {
                    Some((channel, _, logged, published)) => {
                        return self.message(channel, [logged, published], f.0);
                    }
                    None => None,
                }
            }
            _ => Some(()),
        };
        match known {
            Some(()) => Ok(true),
            None => Err(self.broken(&format!("a record of the kind {code} is incomplete"))),
        }
    }

    fn schema(&mut self, f: &mut Fields<'_>) -> Option<()> {
        let (id, name) = (f.u16()?, f.string()?);
        self.schemas.insert(id, name.to_owned());
        Some(())
    }

    fn channel(&mut self, f: &mut Fields<'_>) -> Option<()> {
        let (id, schema) = (f.u16()?, f.u16()?);
        let (name, encoding) = (f.string()?.to_owned(), f.string()?.to_owned());
        let schema = self.schemas.get(&schema).cloned().unwrap_or_default();
        self.topics.entry(id).or_insert(Topic {
            name,
            encoding,
            schema,
            table: None,
        });
        Some(())
    }

    fn message(
        &mut self,
        channel: u16,
        [logged, published]: [u64; 2],
        data: &[u8],
    ) -> Result<bool, Error> {
        let Some(topic) = self.topics.get(&channel) else {
            return Err(self.broken(&"a message of a channel that the file does not describe"));
        };
        let message = match decode(topic, data) {
            Ok(Some(message)) => message,
            Err(e) if self.may_be_wanted(topic) => return Err(self.broken(&e)),
            _ => {
                let (name, kind) = (&topic.name, [&topic.encoding, &topic.schema]);
                let what = format!("topic {name}: {}", kind.map(String::as_str).join(" "));
                self.out.unread(what);
                return Ok(true);
            }
        };
        let logged = i64::try_from(logged).map_err(|e| self.broken(&e))?;
        let published = i64::try_from(published).ok().filter(|t| *t != 0);
        // a driver that has no time yet writes a stamp of zero
        let own = message.stamp_ns.filter(|t| *t != 0);
        let stamp_ns = own.or(published).unwrap_or(logged);
        let Some(topic) = self.topics.get_mut(&channel) else {
            return Ok(true);
        };
        let (table, names) = table_of(topic, &message.values, self.options, self.out);
        if names.is_empty() {
            return Ok(true);
        }
        let value = |name: &String| {
            let found = message.values.iter().find(|(n, _)| n == name);
            found.map_or(f64::NAN, |(_, x)| *x)
        };
        let values: Vec<f64> = names.iter().map(value).collect();
        let row = Row {
            arrival_ns: logged,
            ..Row::at(table, stamp_ns, self.place)
        };
        Ok(self.out.row(row, values))
    }

    /// False if each column that is wanted is of another topic.
    fn may_be_wanted(&self, topic: &Topic) -> bool {
        let of = |name: &str, t: &Topic| {
            name.strip_prefix(&t.name)
                .is_some_and(|c| c.starts_with('.'))
        };
        let elsewhere =
            |name: &String| !of(name, topic) && self.topics.values().any(|t| of(name, t));
        let wanted = self.options.wanted.as_ref();
        !wanted.is_some_and(|all| all.iter().all(elsewhere))
    }
}

/// The values of a message; none of an encoding that is not read.
fn decode(topic: &Topic, data: &[u8]) -> Result<Option<cdr::Decoded>, String> {
    match topic.encoding.as_str() {
        "json" => {
            let value = json::parse(data)
                .map_err(|e| format!("a message of {} is not JSON: {e}", topic.name))?;
            let mut values = Vec::new();
            json::flatten(&value, "", &mut values);
            Ok(Some(cdr::Decoded {
                stamp_ns: None,
                values,
            }))
        }
        "cdr" if cdr::is_known(&topic.schema) => match cdr::decode(&topic.schema, data) {
            Some(message) => Ok(Some(message)),
            None => Err(format!(
                "a message of {} is not {}",
                topic.name, topic.schema
            )),
        },
        _ => Ok(None),
    }
}

/// The table of a topic with room for all wanted names of the message, and its names.
fn table_of<'a>(
    topic: &'a mut Topic,
    values: &[(String, f64)],
    options: &ReadOptions,
    out: &mut Out<'_>,
) -> (u32, &'a [String]) {
    let wanted = |name: &str| options.wants(&topic.name, name);
    let known = topic.table.as_ref().map_or(&[][..], |t| t.1.as_slice());
    let new: Vec<&String> = values
        .iter()
        .map(|(n, _)| n)
        .filter(|n| !known.contains(n) && wanted(n))
        .collect();
    if topic.table.is_none() || !new.is_empty() {
        let mut names = known.to_vec();
        names.extend(
            new.into_iter()
                .take(MAX_COLUMNS.saturating_sub(known.len()))
                .cloned(),
        );
        let columns = names
            .iter()
            .map(|n| LogColumn {
                name: n.clone(),
                unit: String::new(),
            })
            .collect();
        topic.table = Some((out.table(&topic.name, columns), names));
    }
    topic
        .table
        .as_ref()
        .map_or((0, &[]), |t| (t.0, t.1.as_slice()))
}
