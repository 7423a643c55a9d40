//! Reads columns of a CSV file in pieces without gap, in SI units.

use monorig_sim::config::file::read_result;
use monorig_sim::error::{Error, InputError};
use std::path::Path;

/// Names a column of time may have when none is given.
const TIME_NAMES: [&str; 4] = ["t", "time", "t_s", "time_s"];
/// A step of time this many times the median begins a new piece.
const GAP: f64 = 5.0;
/// Fewest samples of a piece.
const MIN_PIECE: usize = 16;

/// Units that are understood, the SI unit each is turned into, and the factor.
pub(crate) const UNITS: [(&str, &str, f64); 14] = [
    ("m/s²", "m/s²", 1.0),
    ("m/s2", "m/s²", 1.0),
    ("g", "m/s²", 9.80665),
    ("mg", "m/s²", 9.80665e-3),
    ("rad/s", "rad/s", 1.0),
    ("°/s", "rad/s", std::f64::consts::PI / 180.0),
    ("deg/s", "rad/s", std::f64::consts::PI / 180.0),
    ("m/s", "m/s", 1.0),
    ("km/h", "m/s", 1.0 / 3.6),
    ("rad", "rad", 1.0),
    ("°", "rad", std::f64::consts::PI / 180.0),
    ("deg", "rad", std::f64::consts::PI / 180.0),
    ("Nm", "N·m", 1.0),
    ("MPa", "MPa", 1.0),
];

/// A column that is wanted.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// Name in the file.
    pub(crate) name: String,
    /// SI unit of the result; empty if none was given.
    pub(crate) unit: String,
    pub(crate) factor: f64,
}

impl Wanted {
    /// Reads `NAME` or `NAME=UNIT`; an unknown unit is an error that lists the known ones.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (name, unit) = text.split_once('=').unwrap_or((text, ""));
        let known = UNITS.iter().find(|(given, ..)| *given == unit);
        let (si, factor) = match (known, unit) {
            (Some((_, si, factor)), _) => (*si, *factor),
            (None, "") => ("", 1.0),
            (None, other) => {
                let units: Vec<&str> = UNITS.iter().map(|u| u.0).collect();
                return Err(format!(
                    "`{other}` is no known unit; known: {}",
                    units.join(", ")
                ));
            }
        };
        Ok(Self {
            name: name.into(),
            unit: si.into(),
            factor,
        })
    }
}

/// The part of a file to read.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// Column of the time, s; without one `t`, `time`, `t_s` or `time_s`.
    pub time: Option<String>,
    /// Columns; without any all that hold numbers.
    pub columns: Vec<Wanted>,
    /// Column whose change begins a new piece, such as the number of a run.
    pub pieces: Option<String>,
    /// Time from which on samples count, s.
    pub from_s: Option<f64>,
    /// Time until which they count, s.
    pub to_s: Option<f64>,
}

/// Columns of a file.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Names of the columns.
    pub(crate) names: Vec<String>,
    /// SI unit of each; empty if unknown.
    pub(crate) units: Vec<String>,
    /// Pieces without gap.
    pub(crate) pieces: Vec<Piece>,
}

/// Samples without gap.
#[derive(Clone, Debug, Default)]
pub(crate) struct Piece {
    /// Name of the run, empty if the file has no such column.
    pub(crate) name: String,
    /// Times, s.
    pub(crate) t_s: Vec<f64>,
    /// Samples, column by column.
    pub(crate) columns: Vec<Vec<f64>>,
}

impl Recording {
    /// Mean time between two samples of a piece, s.
    pub(crate) fn period_s(&self) -> f64 {
        let (mut seconds, mut steps) = (0.0, 0);
        for piece in &self.pieces {
            if let (Some(first), Some(last)) = (piece.t_s.first(), piece.t_s.last()) {
                seconds += last - first;
                steps += piece.t_s.len() - 1;
            }
        }
        seconds / steps as f64
    }
}

/// Reads a file.
pub fn read(file: &Path, selection: &Selection) -> Result<Recording, Error> {
    let text = read_result(file)?;
    parse(file, &text, selection)
}

/// Reads a file that has been read; `file` is named in errors.
pub(crate) fn parse(file: &Path, text: &str, selection: &Selection) -> Result<Recording, Error> {
    let wrong = |line: Option<u64>, column: Option<usize>, message: String, help: String| {
        Error::from(Box::new(InputError {
            file: file.into(),
            line: line.map(|l| l as usize),
            column: column.or(line.map(|_| 1)),
            key: String::new(),
            message,
            help,
        }))
    };
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let header: Vec<String> = match reader.headers() {
        Ok(names) => names.iter().map(str::to_owned).collect(),
        Err(e) => return Err(wrong(Some(1), None, e.to_string(), names_help())),
    };
    let find = |name: &str| -> Result<usize, Error> {
        header.iter().position(|h| h == name).ok_or_else(|| {
            let message = format!("there is no column `{name}`");
            wrong(
                Some(1),
                None,
                message,
                format!("columns here: {}", header.join(", ")),
            )
        })
    };
    let time = match &selection.time {
        Some(name) => find(name)?,
        None => {
            let found = header.iter().position(|h| TIME_NAMES.contains(&h.as_str()));
            found.ok_or_else(|| {
                let message = format!("none of the columns {} is a time", header.join(", "));
                wrong(Some(1), None, message, names_help())
            })?
        }
    };
    let pieces = selection.pieces.as_deref().map(find).transpose()?;
    let wanted: Vec<(usize, Wanted)> = if selection.columns.is_empty() {
        let others = (0..header.len()).filter(|i| *i != time && Some(*i) != pieces);
        others
            .map(|i| {
                let wanted = Wanted {
                    name: header[i].clone(),
                    unit: String::new(),
                    factor: 1.0,
                };
                (i, wanted)
            })
            .collect()
    } else {
        let all = selection.columns.iter();
        all.map(|w| find(&w.name).map(|i| (i, w.clone())))
            .collect::<Result<_, _>>()?
    };
    let mut rows: Vec<(String, f64, Vec<f64>)> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| {
            let line = e.position().map(csv::Position::line);
            wrong(
                line,
                None,
                e.to_string(),
                "as many values as there are columns".into(),
            )
        })?;
        let line = record.position().map(csv::Position::line);
        let number = |i: usize| -> Result<f64, Error> {
            let word = record.get(i).unwrap_or("");
            word.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| {
                let column = text
                    .lines()
                    .nth(line.unwrap_or(1) as usize - 1)
                    .map_or(1, |l| l.split(',').take(i).map(|w| w.chars().count() + 1).sum::<usize>() + 1);
                wrong(
                    line,
                    Some(column),
                    format!("`{word}` in the column `{}` is no number", header[i]),
                    "a number with a decimal point; name the columns that hold numbers with --columns".into(),
                )
            })
        };
        let t_s = number(time)?;
        if selection.from_s.is_some_and(|from| t_s < from)
            || selection.to_s.is_some_and(|to| t_s > to)
        {
            continue;
        }
        let values = wanted.iter().map(|(i, w)| number(*i).map(|x| x * w.factor));
        let name = pieces.and_then(|i| record.get(i)).unwrap_or("").to_owned();
        rows.push((name, t_s, values.collect::<Result<_, _>>()?));
    }
    let found = cut(rows, wanted.len());
    if found.is_empty() {
        return Err(wrong(
            None,
            None,
            format!("there is no stretch of {MIN_PIECE} samples without gap"),
            "times that grow, in seconds; --pieces NAME where the time begins anew with each run"
                .into(),
        ));
    }
    Ok(Recording {
        names: wanted.iter().map(|(_, w)| w.name.clone()).collect(),
        units: wanted.into_iter().map(|(_, w)| w.unit).collect(),
        pieces: found,
    })
}

/// Cuts rows into pieces: where the name changes, where the time falls, where there is a gap.
fn cut(rows: Vec<(String, f64, Vec<f64>)>, columns: usize) -> Vec<Piece> {
    let mut steps: Vec<f64> = rows
        .windows(2)
        .map(|w| w[1].1 - w[0].1)
        .filter(|dt| *dt > 0.0)
        .collect();
    steps.sort_by(f64::total_cmp);
    let median = steps.get(steps.len() / 2).copied().unwrap_or(f64::INFINITY);
    let mut pieces: Vec<Piece> = Vec::new();
    for (name, t_s, values) in rows {
        let goes_on = pieces.last().is_some_and(|p| {
            let last = p.t_s.last().copied().unwrap_or(t_s);
            p.name == name && t_s > last && t_s - last < GAP * median
        });
        if !goes_on {
            pieces.push(Piece {
                name,
                t_s: Vec::new(),
                columns: vec![Vec::new(); columns],
            });
        }
        if let Some(piece) = pieces.last_mut() {
            piece.t_s.push(t_s);
            for (column, value) in piece.columns.iter_mut().zip(values) {
                column.push(value);
            }
        }
    }
    pieces.retain(|p| p.t_s.len() >= MIN_PIECE);
    pieces
}

fn names_help() -> String {
    format!(
        "names of the columns in the first line; the time, in seconds, is called {} or named with --time",
        TIME_NAMES.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(rows: impl Iterator<Item = (f64, f64)>) -> String {
        let rows: Vec<String> = rows.map(|(t, x)| format!("a,{t},{x}")).collect();
        format!("run,t,wy\n{}\n", rows.join("\n"))
    }

    fn selection(column: &str) -> Selection {
        Selection {
            columns: vec![Wanted::parse(column).unwrap()],
            ..Selection::default()
        }
    }

    #[test]
    fn values_come_in_si_units_and_in_pieces() {
        let long = (0..40).map(|k| (f64::from(k) * 0.01 + if k < 20 { 0.0 } else { 7.0 }, 180.0));
        let r = parse(Path::new("x.csv"), &text(long), &selection("wy=deg/s")).unwrap();
        assert_eq!(r.pieces.len(), 2, "a gap of 7 s");
        assert_eq!(r.units, ["rad/s"]);
        assert!((r.period_s() - 0.01).abs() < 1e-12);
        assert!((r.pieces[0].columns[0][3] - std::f64::consts::PI).abs() < 1e-12);
    }

    #[test]
    fn a_stretch_of_time_can_be_chosen() {
        let all = (0..100).map(|k| (f64::from(k) * 0.5, f64::from(k)));
        let chosen = Selection {
            from_s: Some(10.0),
            to_s: Some(20.0),
            ..selection("wy")
        };
        let r = parse(Path::new("x.csv"), &text(all), &chosen).unwrap();
        assert_eq!(
            r.pieces[0].columns[0],
            (20..=40).map(f64::from).collect::<Vec<_>>()
        );
    }

    #[test]
    fn mistakes_are_reported_with_line_and_column() {
        let of = |text: &str, column: &str| {
            let Err(Error::Input(e)) = parse(Path::new("x.csv"), text, &selection(column)) else {
                panic!("{text} was read");
            };
            (e.line, e.column, e.message + &e.help)
        };
        let (line, column, message) = of("run,t,wy\na,0,1\na,0.1,x\n", "wy");
        assert_eq!((line, column), (Some(3), Some(7)));
        assert!(message.contains("`x` in the column `wy`"), "{message}");
        let (line, _, message) = of("run,t,wy\na,0,1\n", "wx");
        assert_eq!(line, Some(1));
        assert!(
            message.contains("`wx`") && message.contains("run, t, wy"),
            "{message}"
        );
        assert!(of("run,s,wy\n", "wy").2.contains("is a time"));
        assert!(of("run,t,wy\na,0,1\n", "wy").2.contains("16 samples"));
        assert!(Wanted::parse("wy=furlong").unwrap_err().contains("deg/s"));
    }
}
