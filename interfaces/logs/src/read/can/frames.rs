//! Frames of a file, converted into values by the database of their messages.

use super::dbc::Database;
use crate::read::{LogColumn, Out, ReadOptions, Row};
use crate::wrong;
use monorig_sim::error::Error;
use std::collections::HashMap;
use std::path::Path;

/// A frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Frame {
    /// Time, ns.
    pub(super) ns: i64,
    /// Identifier of 11 or 29 bits.
    pub(super) id: u32,
    /// True for an identifier of 29 bits.
    pub(super) extended: bool,
    /// Payload.
    pub(super) data: Vec<u8>,
    /// Line or frame in the file.
    pub(super) place: u64,
}

/// Frames one after the other.
pub(super) trait Frames {
    /// The next one; false at the end.
    fn next(&mut self, frame: &mut Frame) -> Result<bool, Error>;
}

/// Reads a file.
pub(super) fn read(
    path: &Path,
    options: &ReadOptions,
    mut frames: impl Frames,
    out: &mut Out<'_>,
) -> Result<(), Error> {
    let Some(dbc) = &options.dbc else {
        return Err(wrong(
            path,
            None,
            "a log of CAN frames needs a database of messages",
            "give `dbc: FILE.dbc` in the map file, or --dbc",
        ));
    };
    let database = Database::load(dbc)?;
    let tables = tables(dbc, &database, options, out)?;
    let mut frame = Frame::default();
    let (mut seen, mut known) = (0u64, 0u64);
    let mut senders = HashMap::new();
    while frames.next(&mut frame)? {
        seen += 1;
        let Some(id) = database.known_as((frame.id, frame.extended)) else {
            continue;
        };
        known += 1;
        let (Some((table, wanted)), Some(message)) = (tables.get(&id), database.messages.get(&id))
        else {
            continue;
        };
        let sender = *senders.entry(id).or_insert(frame.id & 0xFF);
        if frame.extended && sender != frame.id & 0xFF {
            if options.wanted.is_none() {
                continue; // what is shown is that of the first sender
            }
            let name = &message.name;
            return Err(wrong(
                path,
                None,
                format!(
                    "frame {} of `{name}` comes from {:02X}, others from {sender:02X}",
                    frame.place,
                    frame.id & 0xFF
                ),
                "the database needs a message for each sender, with its address in the identifier",
            ));
        }
        let value = |i: &usize| message.value(*i, &frame.data).unwrap_or(f64::NAN);
        let values = wanted.iter().map(value);
        if !out.row(Row::at(*table, frame.ns, frame.place), values) {
            return Ok(());
        }
    }
    if seen > 0 && known == 0 {
        return Err(wrong(
            path,
            None,
            format!(
                "none of the {seen} frames has a message in {}",
                dbc.display()
            ),
            "use the database of the recorded bus",
        ));
    }
    Ok(())
}

/// Tables of the messages by identifier, and the places of their wanted signals.
type MessageTables = HashMap<(u32, bool), (u32, Vec<usize>)>;

/// The tables of the messages with a wanted signal.
fn tables(
    dbc: &Path,
    database: &Database,
    options: &ReadOptions,
    out: &mut Out<'_>,
) -> Result<MessageTables, Error> {
    let mut tables = MessageTables::new();
    let mut messages: Vec<_> = database.messages.iter().collect();
    messages.sort_by_key(|(id, _)| **id);
    for (id, message) in messages {
        let signals = message.signals.iter().enumerate();
        let mut wanted: Vec<_> = signals
            .filter(|(_, s)| options.wants(&message.name, &s.name))
            .collect();
        let unreadable = wanted.iter().find_map(|(_, s)| s.unreadable.as_ref());
        if let Some(why) = unreadable.filter(|_| options.wanted.is_some()) {
            let help = "use a DBC file as Vector's tools and cantools write it";
            return Err(wrong(dbc, None, why, help));
        }
        wanted.retain(|(_, s)| s.unreadable.is_none());
        if wanted.is_empty() {
            continue;
        }
        let columns = wanted.iter().map(|(_, s)| LogColumn {
            name: s.name.clone(),
            unit: s.unit.clone(),
        });
        let table = out.table(&message.name, columns.collect());
        let wanted = wanted.into_iter().map(|(i, _)| i).collect();
        tables.insert(*id, (table, wanted));
    }
    Ok(tables)
}
