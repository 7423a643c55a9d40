//! Rows of a log, as a reader passes them on.

use std::collections::BTreeMap;
use std::sync::Arc;

/// A column of a table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LogColumn {
    /// Name in the file.
    pub name: String,
    /// Unit in the file; empty if there is none.
    pub unit: String,
}

/// Rows with the same columns: a CSV file, a channel group, a topic, a CAN message.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LogTable {
    /// Its name; empty in a file of one table.
    pub name: String,
    /// Its columns that are wanted.
    pub columns: Vec<LogColumn>,
}

/// A row: where its values are in the chunk, and when it was taken and recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Row {
    /// Index of its table.
    pub table: u32,
    /// Piece of the log, from 0; time begins again with each piece.
    pub piece: u32,
    /// The time at which the values were measured, ns.
    pub stamp_ns: i64,
    /// The time at which they were recorded, ns; the stamp where the format has no such time.
    pub arrival_ns: i64,
    /// Line, row or message in the file, from 1.
    pub place: u64,
    /// Index of its first value in the chunk.
    pub first: u32,
}

impl Row {
    /// A row of a format that has one time, and no pieces; its values are put behind those of the rows before it.
    pub(super) fn at(table: u32, stamp_ns: i64, place: u64) -> Self {
        Self {
            table,
            stamp_ns,
            arrival_ns: stamp_ns,
            place,
            ..Self::default()
        }
    }
}

/// Some of the rows, in the order of the file.
#[derive(Clone, Debug, Default)]
pub struct Chunk {
    /// All tables so far.
    pub tables: Arc<Vec<LogTable>>,
    /// Parts of the file that are not read, and how often they came so far.
    pub unread: Arc<BTreeMap<String, u64>>,
    /// The rows.
    pub rows: Vec<Row>,
    /// Their values, one row after the other; NaN where there is none.
    pub values: Vec<f64>,
}

impl Chunk {
    /// The values of a row.
    pub fn values_of(&self, row: &Row) -> &[f64] {
        let columns = self
            .tables
            .get(row.table as usize)
            .map_or(0, |t| t.columns.len());
        let first = row.first as usize;
        self.values.get(first..first + columns).unwrap_or(&[])
    }
}

/// Rows of a chunk.
const ROWS: usize = 1024;
/// Values of a chunk, at most about so many.
const VALUES: usize = 1 << 16;

/// Takes the rows of a reader.
pub(crate) struct Out<'a> {
    sink: &'a mut dyn FnMut(Chunk) -> bool,
    chunk: Chunk,
    go_on: bool,
}

impl<'a> Out<'a> {
    /// Passes chunks to this sink, which returns false to stop.
    pub fn new(sink: &'a mut dyn FnMut(Chunk) -> bool) -> Self {
        Self {
            sink,
            chunk: Chunk::default(),
            go_on: true,
        }
    }

    /// A further table; its index.
    pub fn table(&mut self, name: &str, columns: Vec<LogColumn>) -> u32 {
        let tables = Arc::make_mut(&mut self.chunk.tables);
        tables.push(LogTable {
            name: name.to_owned(),
            columns,
        });
        tables.len() as u32 - 1
    }

    /// A part of the file that is not read.
    pub fn unread(&mut self, what: String) {
        *Arc::make_mut(&mut self.chunk.unread)
            .entry(what)
            .or_default() += 1;
    }

    /// The columns of a table.
    pub fn columns(&self, table: u32) -> usize {
        self.chunk
            .tables
            .get(table as usize)
            .map_or(0, |t| t.columns.len())
    }

    /// Adds a row; returns true if more rows are wanted. Its values are as many as the table has columns.
    pub fn row(&mut self, row: Row, values: impl IntoIterator<Item = f64>) -> bool {
        let first = self.chunk.values.len();
        self.chunk.rows.push(Row {
            first: first as u32,
            ..row
        });
        self.chunk.values.extend(values);
        self.chunk
            .values
            .resize(first + self.columns(row.table), f64::NAN);
        if self.chunk.rows.len() >= ROWS || self.chunk.values.len() >= VALUES {
            self.flush();
        }
        self.go_on
    }

    /// Passes on the collected rows.
    pub fn flush(&mut self) {
        if self.chunk.rows.is_empty() && self.chunk.unread.is_empty() || !self.go_on {
            return;
        }
        let next = Chunk {
            tables: self.chunk.tables.clone(),
            unread: self.chunk.unread.clone(),
            ..Chunk::default()
        };
        self.go_on = (self.sink)(std::mem::replace(&mut self.chunk, next));
    }
}
