//! Rows of several files in the order of time: a thread reads each file, a heap chooses the earliest row.

use super::plausible::{MAX_GAP_NS, implausible};
use super::{Chunk, LogReader, LogTable, Part, ReadOptions, Row, full_name};
use crate::notation::{NS, TimeUnit};
use crate::wrong;
use monorig_sim::error::Error;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};

/// Chunks that a reader may be ahead.
const AHEAD: usize = 4;
/// Rows of a bus or of several topics come in the order in which they were recorded; those within this time are put in
/// order, ns.
const REORDER_NS: i64 = NS;
/// Most rows that are kept to be put in order.
const MAX_WAITING: usize = 1 << 20;

/// Time, of the two times of a row, by which it reaches the estimators.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum By {
    /// The time at which the values were taken.
    #[default]
    Stamp,
    /// The time at which they were recorded.
    Arrival,
}

/// A file to merge, and its clock.
#[derive(Clone, Debug)]
pub(crate) struct Source {
    /// The file.
    pub path: PathBuf,
    /// Options of reading it.
    pub options: ReadOptions,
    /// Column of when the values were taken, and its unit, where the time of a row is when they were recorded.
    pub stamp: Option<(String, TimeUnit)>,
    /// Added to its stamps, ns.
    pub offset_ns: i64,
    /// Rate by which its clock is too slow, parts per million: stamps grow by it from its first one on.
    pub drift_ppm: f64,
    /// True if of rows with the same time its own come first: others ask what it says.
    pub leads: bool,
}

/// A row of a file, on the common clock.
#[derive(Clone, Debug, Default)]
pub(crate) struct MergedRow {
    /// Index of its source.
    pub source: usize,
    /// Index of the part of the file in which the table is.
    pub part: usize,
    /// The row; stamp and arrival on the common clock.
    pub row: Row,
    /// Its values.
    pub values: Vec<f64>,
    /// The tables of its part so far.
    pub tables: Arc<Vec<LogTable>>,
}

impl MergedRow {
    /// Its table.
    pub fn table(&self) -> Option<&LogTable> {
        self.tables.get(self.row.table as usize)
    }
}

/// A part of a file while it is read.
struct Stream {
    source: usize,
    path: PathBuf,
    format: &'static dyn LogReader,
    rows: Receiver<Result<Chunk, Error>>,
    chunk: Chunk,
    at: usize,
    ended: bool,
    by: By,
    stamp: Option<(String, TimeUnit)>,
    offset_ns: i64,
    drift_ppm: f64,
    /// First stamp of this part, before the correction.
    first_ns: Option<i64>,
    /// Piece that the rows are in, what is added to its stamps, and the last time given out, ns.
    piece: u32,
    piece_ns: i64,
    last_ns: i64,
    sorts: bool,
    waiting: BinaryHeap<Reverse<(i64, u64, WaitingRow)>>,
    newest_ns: i64,
    count: u64,
}

/// A row that waits to be put in order; all compare as equal, so that the heap goes by time and number.
struct WaitingRow(Row, Vec<f64>, Arc<Vec<LogTable>>);

impl PartialEq for WaitingRow {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
impl Eq for WaitingRow {}
impl PartialOrd for WaitingRow {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for WaitingRow {
    fn cmp(&self, _: &Self) -> std::cmp::Ordering {
        std::cmp::Ordering::Equal
    }
}

impl Stream {
    fn open(part: Part, number: usize, source: &Source, by: By) -> Result<Self, Error> {
        let (send, rows) = sync_channel(AHEAD);
        // rows that are recorded in the order of one time are not in the order of another
        let another_time = source.stamp.is_some() && by == By::Stamp;
        let sorts = another_time || !part.format.is_in_order();
        let (path, format) = (part.path.clone(), part.format);
        let thread = std::thread::Builder::new()
            .name("log reader".into())
            .spawn(move || {
                let done = part.scan(&mut |chunk| send.send(Ok(chunk)).is_ok());
                if let Err(e) = done {
                    // a receiver that has gone needs no error
                    let _ = send.send(Err(e));
                }
            });
        thread.map_err(|e| crate::io(&path, e))?;
        Ok(Self {
            source: number,
            path,
            format,
            rows,
            chunk: Chunk::default(),
            at: 0,
            ended: false,
            by,
            stamp: source.stamp.clone(),
            offset_ns: source.offset_ns,
            drift_ppm: source.drift_ppm,
            first_ns: None,
            piece: 0,
            piece_ns: 0,
            last_ns: i64::MIN,
            sorts,
            waiting: BinaryHeap::new(),
            newest_ns: i64::MIN,
            count: 0,
        })
    }

    fn time(&self, row: &Row) -> i64 {
        match self.by {
            By::Stamp => row.stamp_ns,
            By::Arrival => row.arrival_ns,
        }
    }

    /// A time of the file on the common clock, ns.
    fn corrected(&mut self, ns: i64) -> i64 {
        let first = *self.first_ns.get_or_insert(ns);
        let drift = match self.drift_ppm {
            0.0 => 0,
            ppm => ((ns.saturating_sub(first)) as f64 * ppm * 1e-6).round() as i64,
        };
        ns.saturating_add(self.offset_ns)
            .saturating_add(self.piece_ns)
            .saturating_add(drift)
    }

    /// The next row of the file into `into`, on the common clock; false at the end.
    fn next_of_file(&mut self, into: &mut MergedRow) -> Result<bool, Error> {
        while self.at >= self.chunk.rows.len() {
            match self.rows.recv() {
                Ok(chunk) => {
                    self.chunk = chunk?;
                    self.at = 0;
                }
                Err(_) => return Ok(false),
            }
        }
        let Some(mut row) = self.chunk.rows.get(self.at).copied() else {
            return Ok(false);
        };
        into.values.clear();
        into.values.extend_from_slice(self.chunk.values_of(&row));
        if !Arc::ptr_eq(&into.tables, &self.chunk.tables) {
            into.tables = self.chunk.tables.clone();
        }
        self.at += 1;
        if let Some((name, unit)) = &self.stamp {
            let table = into.tables.get(row.table as usize);
            let column = table.and_then(|t| t.columns.iter().position(|c| c.name == *name));
            let taken = column.and_then(|c| into.values.get(c)).copied();
            let Some(ns) = taken.and_then(|x| unit.of_f64(x)) else {
                let message = match column {
                    None => format!("the file has no column `{name}` for when values were taken"),
                    Some(_) => format!("row {} has no time of measurement", row.place),
                };
                let help = "`time: {stamp: COLUMN}` must name a column that every table has";
                return Err(wrong(&self.path, None, message, help));
            };
            if ns.abs_diff(row.arrival_ns) > MAX_GAP_NS.unsigned_abs() {
                let what = "far from the time of its recording";
                return Err(implausible(&self.path, row.place, ns, what));
            }
            row.stamp_ns = ns;
        }
        if row.piece != self.piece {
            // a piece begins a second after the one before it has ended, whatever the time of its own clock
            self.piece = row.piece;
            let raw = self.time(&row).saturating_add(self.offset_ns);
            self.piece_ns = self.last_ns.saturating_add(NS).saturating_sub(raw);
            self.first_ns = None;
        }
        row.stamp_ns = self.corrected(row.stamp_ns);
        row.arrival_ns = self.corrected(row.arrival_ns);
        let t = self.time(&row);
        if !self.sorts && t < self.last_ns {
            return Err(self.backwards(&row, t));
        }
        if !self.sorts {
            self.last_ns = t;
        }
        into.row = row;
        into.source = self.source;
        Ok(true)
    }

    fn backwards(&self, row: &Row, t: i64) -> Error {
        let back_s = self.last_ns.saturating_sub(t) as f64 * 1e-9;
        let text = row.place < u64::from(u32::MAX);
        wrong(
            &self.path,
            Some(row.place as usize).filter(|_| text),
            format!(
                "the time goes back by {back_s:.6} s here (row {})",
                row.place
            ),
            "sort the rows by time; use `time: {pieces: COLUMN}` in the map file if time begins again with each run",
        )
    }

    /// The next row in the order of time; false at the end.
    fn next(&mut self, into: &mut MergedRow) -> Result<bool, Error> {
        if !self.sorts {
            return self.next_of_file(into);
        }
        loop {
            let ripe = self.waiting.peek().is_some_and(|Reverse((t, _, _))| {
                self.ended
                    || self.newest_ns.saturating_sub(*t) > REORDER_NS
                    || self.waiting.len() > MAX_WAITING
            });
            if ripe
                && let Some(Reverse((t, _, WaitingRow(row, values, tables)))) = self.waiting.pop()
            {
                if t < self.last_ns {
                    return Err(self.backwards(&row, t));
                }
                self.last_ns = t;
                *into = MergedRow {
                    source: self.source,
                    part: into.part,
                    row,
                    values,
                    tables,
                };
                return Ok(true);
            }
            if self.ended {
                return Ok(false);
            }
            if self.next_of_file(into)? {
                let t = self.time(&into.row);
                self.newest_ns = self.newest_ns.max(t);
                self.count += 1;
                let waiting = WaitingRow(
                    into.row,
                    std::mem::take(&mut into.values),
                    into.tables.clone(),
                );
                self.waiting.push(Reverse((t, self.count, waiting)));
            } else {
                self.ended = true;
            }
        }
    }
}

/// Files that begin further apart are looked at to their end, ns.
const FAR_NS: i64 = 10 * NS;

/// The last time of a file on the common clock, ns.
fn end_of(source: &Source, number: usize, by: By) -> Result<i64, Error> {
    let (mut row, mut end) = (MergedRow::default(), i64::MIN);
    for part in Part::all(&source.path, &source.options)? {
        let mut stream = Stream::open(part, number, source, by)?;
        while stream.next(&mut row)? {
            end = end.max(stream.time(&row.row));
        }
    }
    Ok(end)
}

/// All files, merged.
pub(crate) struct Merged {
    streams: Vec<(Stream, MergedRow)>,
    order: BinaryHeap<Reverse<(i64, usize)>>,
}

impl Merged {
    /// Opens all files and reads the first row of each.
    pub fn open(sources: &[Source], by: By) -> Result<Self, Error> {
        let mut merged = Self {
            streams: Vec::new(),
            order: BinaryHeap::new(),
        };
        let leading = |leads: bool| {
            let all = sources.iter().enumerate();
            all.filter(move |(_, source)| source.leads == leads)
        };
        for (number, source) in leading(true).chain(leading(false)) {
            for part in Part::all(&source.path, &source.options)? {
                let stream = Stream::open(part, number, source, by)?;
                let part = merged.streams.len();
                merged.streams.push((
                    stream,
                    MergedRow {
                        source: number,
                        part,
                        ..MergedRow::default()
                    },
                ));
                merged.refill(part)?;
            }
        }
        merged.have_common_time(sources, by)?;
        Ok(merged)
    }

    /// Refuses files of which one ends before another begins: clocks that are not the same. Only where they begin far
    /// apart is the end of one looked for.
    fn have_common_time(&self, sources: &[Source], by: By) -> Result<(), Error> {
        let first = |number: usize| {
            let parts = self.order.iter().filter(|Reverse((_, part))| {
                let stream = self.streams.get(*part);
                stream.is_some_and(|(stream, _)| stream.source == number)
            });
            parts.map(|Reverse((t, _))| *t).min()
        };
        let mut firsts: Vec<(i64, usize)> = (0..sources.len())
            .filter_map(|number| Some((first(number)?, number)))
            .collect();
        firsts.sort_unstable();
        let Some(&(last_begin, late)) = firsts.last() else {
            return Ok(());
        };
        for &(begin, early) in &firsts {
            let far = last_begin.saturating_sub(begin) > FAR_NS;
            let (Some(a), Some(b)) = (sources.get(early), sources.get(late)) else {
                continue;
            };
            if !far || a.options.pieces.is_some() {
                continue;
            }
            let end = end_of(a, early, by)?.max(begin);
            if end < last_begin {
                let range = |from: i64, to: i64| {
                    let s = |ns: i64| ns as f64 * 1e-9;
                    format!("{:.3} to {:.3} s", s(from), s(to))
                };
                let end_of_late = end_of(b, late, by)?.max(last_begin);
                return Err(wrong(
                    &a.path,
                    None,
                    format!(
                        "this file has no time in common with {}: it goes from {}, the other from {}",
                        b.path.display(),
                        range(begin, end),
                        range(last_begin, end_of_late)
                    ),
                    "use files of one clock; `clocks: {NAME: {offset_s: …}}` in the map adds an offset to the times of a file, and `column` and `unit` there choose another time",
                ));
            }
        }
        Ok(())
    }

    fn refill(&mut self, part: usize) -> Result<(), Error> {
        if let Some((stream, row)) = self.streams.get_mut(part)
            && stream.next(row)?
        {
            row.part = part;
            self.order.push(Reverse((stream.time(&row.row), part)));
        }
        Ok(())
    }

    /// The time of the next row, ns; none at the end.
    pub fn next_ns(&self) -> Option<i64> {
        self.order.peek().map(|Reverse((t, _))| *t)
    }

    /// The next row, swapped into `into`; false at the end.
    pub fn next(&mut self, into: &mut MergedRow) -> Result<bool, Error> {
        let Some(Reverse((_, part))) = self.order.pop() else {
            return Ok(false);
        };
        if let Some((_, row)) = self.streams.get_mut(part) {
            std::mem::swap(row, into);
        }
        self.refill(part)?;
        Ok(true)
    }

    /// True if no file of a source has a row.
    pub fn is_empty(&self, source: usize) -> bool {
        let mut of_source = self.streams.iter().filter(|s| s.0.source == source);
        of_source.all(|(_, row)| row.tables.is_empty())
    }

    /// True if a source has a column of this name; none if that shows only when it is read to its end.
    pub fn has_column(&self, source: usize, name: &str) -> Option<bool> {
        let mut of_source = self.streams.iter().filter(|s| s.0.source == source);
        let known = |(stream, row): &(Stream, MergedRow)| -> Option<bool> {
            let mut tables = row.tables.iter();
            let here = tables.any(|t| {
                let named = |c: &str| c == name || full_name(&t.name, c) == name;
                t.columns.iter().any(|c| named(&c.name))
            });
            (here || stream.format.declares_columns()).then_some(here)
        };
        of_source.try_fold(false, |found, part| known(part).map(|here| found || here))
    }
}
