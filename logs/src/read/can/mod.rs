//! CAN: frames of any file made values by a database of messages; a table a message, a column a signal.

pub(super) mod candump;
pub mod dbc;
#[cfg(feature = "blf")]
pub(super) mod vector;

use crate::read::{Column, Out, ReadOptions, Row};
use crate::wrong;
use dbc::Database;
use monorig_sim::error::Error;
use std::collections::HashMap;
use std::path::Path;

/// A frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Frame {
    /// When, ns.
    pub ns: i64,
    /// Identifier of 11 or 29 bits.
    pub id: u32,
    /// Whether it has 29 bits.
    pub extended: bool,
    /// Payload.
    pub data: Vec<u8>,
    /// Line or frame in the file.
    pub place: u64,
}

/// Frames one after the other.
pub(super) trait Source {
    /// The next one; false at the end.
    fn next(&mut self, frame: &mut Frame) -> Result<bool, Error>;
}

/// Reads a file.
pub(super) fn read(
    path: &Path,
    options: &ReadOptions,
    mut frames: impl Source,
    out: &mut Out<'_>,
) -> Result<(), Error> {
    let Some(dbc) = &options.dbc else {
        return Err(wrong(
            path,
            None,
            "a log of CAN frames needs a database of messages",
            "`dbc: FILE.dbc` in the map file, or --dbc",
        ));
    };
    let database = Database::load(dbc)?;
    let mut tables: HashMap<(u32, bool), (u32, Vec<usize>)> = HashMap::new();
    let mut ids: Vec<_> = database.messages.iter().collect();
    ids.sort_by_key(|(id, _)| **id);
    for (id, message) in ids {
        let wanted = (0..message.signals.len()).filter(|i| {
            message
                .signals
                .get(*i)
                .is_some_and(|s| options.wants(&message.name, &s.name))
        });
        let wanted: Vec<usize> = wanted.collect();
        if wanted.is_empty() {
            continue;
        }
        let columns = wanted
            .iter()
            .filter_map(|i| message.signals.get(*i))
            .map(|s| Column {
                name: s.name.clone(),
                unit: s.unit.clone(),
            });
        let columns = columns.collect();
        tables.insert(*id, (out.table(&message.name, columns), wanted));
    }
    let mut frame = Frame::default();
    let (mut seen, mut known) = (0u64, 0u64);
    while frames.next(&mut frame)? {
        seen += 1;
        let id = (frame.id, frame.extended);
        if database.messages.contains_key(&id) {
            known += 1;
        }
        let (Some((table, wanted)), Some(message)) = (tables.get(&id), database.messages.get(&id))
        else {
            continue;
        };
        let switch = message.switch(&frame.data);
        let values = wanted.iter().map(|i| match message.signals.get(*i) {
            Some(s) if s.is_present(switch) => s.value(&frame.data).unwrap_or(f64::NAN),
            _ => f64::NAN,
        });
        let row = Row {
            table: *table,
            piece: 0,
            stamp_ns: frame.ns,
            arrival_ns: frame.ns,
            place: frame.place,
            first: 0,
        };
        if !out.row(row, values) {
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
            "the database of the bus that was recorded",
        ));
    }
    Ok(())
}
