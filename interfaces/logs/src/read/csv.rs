//! CSV: names in the first line; comma, semicolon, tab or bar between values; decimal point, or comma where values are
//! not separated by one; UTF-8 with or without byte order mark, or Latin-1. Empty and the words of [`NO_VALUE`] stand
//! for no value.
//! Lines that begin with `#` are comments. Lines before the names in which nothing is separated are skipped, and so is
//! a line of units behind them.

use super::time_column::{self, Wraps};
use super::{Asked, LogColumn, LogReader, Out, ReadOptions, Row, text};
use crate::notation::{TimeUnit, Title};
use crate::{io, wrong};
use ::csv::{ByteRecord, ErrorKind, Position, ReaderBuilder, Trim};
use monorig_sim::error::Error;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Longest first line.
const MAX_HEADER: u64 = 1 << 20;
/// Words that loggers, spreadsheets and languages write where there is no value, beside an empty field.
const NO_VALUE: &str = "nan -nan nan(ind) -nan(ind) null none na n/a #n/a -";
/// Characters that may stand between values; of two that are as often there the later one counts.
const DELIMITERS: [u8; 4] = [b'|', b',', b'\t', b';'];
/// Characters around a name that are not part of it.
const NAME_ENDS: [char; 4] = [' ', '"', '\r', '\n'];
/// Most lines before the line of names.
const MAX_PREAMBLE: u64 = 100;

/// The reader of CSV; also of every text that no other reader recognises.
pub(super) struct CsvReader;

impl LogReader for CsvReader {
    fn name(&self) -> &'static str {
        "CSV"
    }

    fn read(&self, asked: Asked<'_>, out: &mut Out<'_>) -> Result<(), Error> {
        let Asked { path, options, .. } = asked;
        let mut file = File::open(path).map_err(|e| io(path, e))?;
        let (delimiter, skipped) = prepare(path, options, &mut file)?;
        let mut reader = ReaderBuilder::new()
            .delimiter(delimiter)
            .comment(Some(b'#'))
            .trim(Trim::All)
            .from_reader(BufReader::with_capacity(1 << 16, file));
        let header = reader
            .byte_headers()
            .map_err(|e| broken(path, skipped, &e))?;
        let names = header.iter().map(|n| text::of_bytes(n).into_owned());
        let mut titles = Titles::new(path, names.collect(), options, delimiter != b',')?;
        titles.skipped = skipped;
        let mut record = ByteRecord::new();
        let mut more = reader
            .read_byte_record(&mut record)
            .map_err(|e| broken(path, skipped, &e))?;
        if more && titles.take_units(&record) {
            more = reader
                .read_byte_record(&mut record)
                .map_err(|e| broken(path, skipped, &e))?;
        }
        titles.settle_time(&record);
        let table = out.table("", titles.columns());
        let (mut pieces, mut points, mut days) =
            (Pieces::default(), Points::default(), Wraps::of(DAY_NS));
        let mut values = Vec::with_capacity(titles.wanted.len());
        while more {
            let line = Line {
                path,
                titles: &titles,
                record: &record,
            };
            points.see(&line)?;
            let mut row = Row::at(table, line.stamp_ns(&mut days)?, line.number());
            if let Some(column) = titles.pieces {
                row.piece = pieces.of(line.word(column));
            }
            values.clear();
            for &column in &titles.wanted {
                values.push(line.value(column)?);
            }
            if !out.row(row, values.iter().copied()) {
                return Ok(());
            }
            more = reader
                .read_byte_record(&mut record)
                .map_err(|e| broken(path, skipped, &e))?;
        }
        Ok(())
    }
}

fn broken(path: &Path, skipped: u64, e: &::csv::Error) -> Error {
    let line = e.position().map(|p| (skipped + p.line()) as usize);
    let (message, help) = match e.kind() {
        ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => (
            format!("this line has {len} values, the first line {expected_len} names"),
            "as many values as names; a line that breaks off is removed",
        ),
        _ => (
            format!("this line cannot be read: {e}"),
            "a table of text, a row a line",
        ),
    };
    wrong(path, line, message, help)
}

/// The first line: names, and the use of each column.
struct Titles {
    names: Vec<String>,
    /// Units of a line behind the names; empty where there is none.
    units: Vec<String>,
    time: usize,
    /// Unit of the time; none until the first row tells it.
    unit: Option<TimeUnit>,
    /// Column of the date of a time of day.
    date: Option<usize>,
    /// Lines before the names.
    skipped: u64,
    pieces: Option<usize>,
    wanted: Vec<usize>,
    /// Numbers may have a decimal comma.
    comma: bool,
    /// A wanted value that is no number is an error, and not one that is missing.
    strict: bool,
}

impl Titles {
    fn new(
        path: &Path,
        names: Vec<String>,
        options: &ReadOptions,
        comma: bool,
    ) -> Result<Self, Error> {
        let refused = |message, help: String| wrong(path, Some(1), message, help);
        let (mut each, mut seen) = (names.iter().enumerate(), BTreeSet::new());
        if let Some((i, name)) = each.find(|(_, n)| !n.is_empty() && !seen.insert(*n)) {
            let message = format!("the column `{name}` is there twice (column {})", i + 1);
            return Err(refused(message, "a name for each column".into()));
        }
        if let [line] = names.as_slice() {
            return Err(refused(
                format!("nothing separates the names of the columns in `{line}`"),
                "a comma, semicolon, tab or `|` between names, and between values".into(),
            ));
        }
        let is_name = |n: &String| number(n.as_bytes(), comma).is_none_or(f64::is_nan);
        if !names.iter().any(is_name) {
            return Err(refused(
                "the first line holds numbers where the names of the columns are looked for".into(),
                "a line with a name for each column before the first row".into(),
            ));
        }
        let (time, unit) = time_column::find(path, &names, options)?;
        let place = |name: &String| {
            names.iter().position(|n| n == name).ok_or_else(|| {
                refused(
                    format!("there is no column `{name}` for the pieces"),
                    format!("columns here: {}", names.join(", ")),
                )
            })
        };
        let pieces = options.pieces.as_ref().map(place).transpose()?;
        let is_wanted = |(i, name): &(usize, &String)| {
            *i != time && Some(*i) != pieces && !name.is_empty() && options.wants("", name)
        };
        let wanted = names.iter().enumerate().filter(is_wanted);
        let wanted = wanted.map(|(i, _)| i).collect();
        Ok(Self {
            units: Vec::new(),
            time,
            unit,
            date: names
                .iter()
                .position(|n| ["date", "datum"].contains(&n.to_lowercase().as_str())),
            skipped: 0,
            pieces,
            wanted,
            names,
            comma,
            strict: options.wanted.is_some(),
        })
    }

    fn columns(&self) -> Vec<LogColumn> {
        let of = |i: &usize| {
            let name = self.names.get(*i)?;
            let below = self.units.get(*i).filter(|u| !u.is_empty()).cloned();
            Some(LogColumn {
                name: name.clone(),
                unit: below.unwrap_or_else(|| Title::of(name).unit),
            })
        };
        self.wanted.iter().filter_map(of).collect()
    }

    /// Takes a line of units: one whose time is a unit of time, and that has no number.
    fn take_units(&mut self, record: &ByteRecord) -> bool {
        let words: Vec<String> = record
            .iter()
            .map(|w| text::of_bytes(w).into_owned())
            .collect();
        let of_time = words.get(self.time).and_then(|w| time_column::unit(w));
        let is_number = |w: &String| number(w.as_bytes(), self.comma).is_some_and(f64::is_finite);
        if of_time.is_none() || words.iter().any(is_number) {
            return false;
        }
        self.unit = self.unit.or(of_time);
        let bare = |w: &String| w.trim_matches(['[', ']', '(', ')']).to_owned();
        self.units = words.iter().map(bare).collect();
        true
    }

    /// Settles the unit of the time by the first row, where nothing else tells it.
    fn settle_time(&mut self, first: &ByteRecord) {
        let word = text::of_bytes(first.get(self.time).unwrap_or_default());
        let word = match self.comma {
            true => word.replace(',', "."),
            false => word.into_owned(),
        };
        self.unit = self.unit.or_else(|| Some(time_column::guessed(&word)));
    }
}

/// Pieces of a log, counted by the changes of a word.
#[derive(Default)]
struct Pieces {
    word: Option<Vec<u8>>,
    count: u32,
}

impl Pieces {
    fn of(&mut self, word: &[u8]) -> u32 {
        if self.word.as_deref() != Some(word) {
            self.count += u32::from(self.word.is_some());
            self.word = Some(word.to_vec());
        }
        self.count
    }
}

/// A time of day begins anew after this, ns.
const DAY_NS: i64 = 86_400_000_000_000;

/// Points before three digits, `1.220`, which stand between thousands where other values have a decimal comma.
#[derive(Default)]
struct Points {
    has_comma: bool,
    /// The first such value: its error, if a comma follows.
    first: Option<Error>,
}

impl Points {
    fn see(&mut self, line: &Line<'_>) -> Result<(), Error> {
        let comma = line.titles.comma;
        let has_comma =
            |w: &[u8]| w.contains(&b',') && number(w, comma).is_some_and(f64::is_finite);
        self.has_comma = comma && (self.has_comma || line.record.iter().any(has_comma));
        if comma && self.first.is_none() {
            let of_thousands = |word: &[u8]| {
                let digits = word.strip_prefix(b"-").unwrap_or(word);
                let is_point = |(i, c): (usize, &u8)| match i {
                    _ if i + 4 == digits.len() => *c == b'.',
                    _ => c.is_ascii_digit(),
                };
                (5..8).contains(&digits.len())
                    && !digits.starts_with(b"0")
                    && digits.iter().enumerate().all(is_point)
            };
            let mut wanted = line.titles.wanted.iter();
            if let Some(&column) = wanted.find(|c| of_thousands(line.word(**c))) {
                let what = format!("`{}` in the column", text::of_bytes(line.word(column)));
                let why = "may be thousands: other values of this table have a decimal comma";
                self.first = Some(line.wrong(
                    column,
                    &what,
                    why,
                    "nothing between thousands, and a comma before decimals",
                ));
            }
        }
        match self.first.take_if(|_| self.has_comma) {
            Some(e) => Err(e),
            None => Ok(()),
        }
    }
}

/// A line behind the first one.
struct Line<'a> {
    path: &'a Path,
    titles: &'a Titles,
    record: &'a ByteRecord,
}

impl Line<'_> {
    fn number(&self) -> u64 {
        self.titles.skipped + self.record.position().map_or(0, Position::line)
    }

    fn word(&self, column: usize) -> &[u8] {
        self.record.get(column).unwrap_or_default()
    }

    fn stamp_ns(&self, days: &mut Wraps) -> Result<i64, Error> {
        let column = self.titles.time;
        let mut stamp = text::of_bytes(self.word(column));
        let of_day = stamp.as_bytes().get(2) == Some(&b':');
        if let Some(date) = self.titles.date.filter(|_| of_day) {
            stamp = format!("{} {stamp}", text::of_bytes(self.word(date))).into();
        }
        if self.titles.comma {
            stamp = stamp.replace(',', ".").into();
        }
        let unit = self.titles.unit.unwrap_or_default();
        let goes_on = |ns| match of_day && self.titles.date.is_none() {
            true => days.unwrapped(ns),
            false => ns,
        };
        unit.parse(&stamp).map(goes_on).ok_or_else(|| {
            let what = format!("`{stamp}` in the column");
            let help = match !self.titles.comma && stamp.contains(',') {
                true => "a decimal point where values are separated by commas",
                false => "a number in the unit of the column, or `unit: iso8601` for dates",
            };
            self.wrong(column, &what, "is no time", help)
        })
    }

    fn value(&self, column: usize) -> Result<f64, Error> {
        let word = self.word(column);
        match number(word, self.titles.comma) {
            Some(x) => Ok(x),
            None if self.titles.strict => {
                let what = format!("`{}` in the column", text::of_bytes(word));
                let help = match word.contains(&b',') {
                    true => {
                        "a decimal point where values are separated by commas, and nothing between thousands"
                    }
                    false => "a number; empty where there is none",
                };
                Err(self.wrong(column, &what, "is no number", help))
            }
            None => Ok(f64::NAN),
        }
    }

    /// An error at a value: "`1x` in the column `v` is no number".
    fn wrong(&self, column: usize, what: &str, why: &str, help: &str) -> Error {
        let name = self.titles.names.get(column).map_or("", String::as_str);
        let before = self.record.iter().take(column);
        let characters: usize = before.map(|f| text::of_bytes(f).chars().count() + 1).sum();
        let place = Some((self.number() as usize, 1 + characters));
        Error::input(self.path, place, "", format!("{what} `{name}` {why}"), help)
    }
}

/// A number; not a number where the field stands for none.
fn number(word: &[u8], comma: bool) -> Option<f64> {
    let word = std::str::from_utf8(word).ok()?;
    let x: Result<f64, _> = match comma && word.contains(',') {
        true => word.replace(',', ".").parse(),
        false => word.parse(),
    };
    match x {
        Ok(x) if x.is_finite() => Some(x),
        _ => {
            let stands = |none| word.eq_ignore_ascii_case(none);
            (word.is_empty() || NO_VALUE.split(' ').any(stands)).then_some(f64::NAN)
        }
    }
}

/// Skips a byte order mark and the lines before the line of names, and finds what separates the values: of
/// [`DELIMITERS`] the one that is most often in the line of names, which is the first with a name of a time, else the
/// first in which something is separated. Returns also how many lines were skipped; comments and empty lines are
/// counted by the reader itself.
fn prepare(path: &Path, options: &ReadOptions, file: &mut File) -> Result<(u8, u64), Error> {
    let mut mark = [0u8; 3];
    let bom = file.read_exact(&mut mark).is_ok() && mark == [0xEF, 0xBB, 0xBF];
    let start = if bom { 3 } else { 0 };
    file.seek(SeekFrom::Start(start)).map_err(|e| io(path, e))?;
    let mut reader = BufReader::new(file.take(MAX_HEADER));
    let count = |line: &[u8], mark: u8| line.iter().filter(|b| **b == mark).count();
    let (mut at, mut lines, mut line) = (start, 0, Vec::new());
    let (begin, mut first) = (start, None);
    let has_time = |line: &[u8], mark: u8| {
        let words = line.split(|b| *b == mark).map(|w| text::of_bytes(w));
        let names: Vec<String> = words
            .map(|w| w.trim_matches(NAME_ENDS).to_owned())
            .collect();
        match &options.time {
            Some(time) => names.contains(time),
            None => time_column::called(&names).is_some(),
        }
    };
    loop {
        line.clear();
        let read = reader
            .read_until(b'\n', &mut line)
            .map_err(|e| io(path, e))?;
        if read == 0 || lines == MAX_PREAMBLE {
            break;
        }
        if at - begin + read as u64 >= MAX_HEADER {
            if first.is_some() {
                break;
            }
            return Err(wrong(
                path,
                Some(1),
                "the first line is longer than 1 MB",
                "names of columns in the first line",
            ));
        }
        let best = DELIMITERS.into_iter().max_by_key(|m| count(&line, *m));
        // spreadsheets write `sep=,` before the names
        let is_skipped = [&b"#"[..], b"sep=", b"SEP="]
            .iter()
            .any(|s| line.starts_with(s));
        if let Some(best) = best.filter(|m| count(&line, *m) > 0 && !is_skipped) {
            first = first.or(Some((at, lines, best)));
            if has_time(&line, best) {
                first = Some((at, lines, best));
                break;
            }
        }
        at += read as u64;
        lines += 1;
    }
    drop(reader);
    let (start, skipped, delimiter) = first.unwrap_or((start, 0, b','));
    file.seek(SeekFrom::Start(start)).map_err(|e| io(path, e))?;
    Ok((delimiter, skipped))
}
