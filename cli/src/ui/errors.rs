//! Errors for people: the mistake, its place, and its correction.
//!
//! On a terminal with a drawn source snippet (miette); otherwise, and with `NO_COLOR`, plain lines `file:line:column:
//! …`.

use crate::ui::{note, terminal};
use miette::{Diagnostic, GraphicalReportHandler, LabeledSpan, NamedSource, SourceSpan};
use monorig_lab::batch::Interrupted;
use monorig_lab::text::{marked, spelled_out};
use monorig_sim::error::{Error, InputError};
use std::process::ExitCode;

/// Reason why a command could not do its work: exit code 2.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CliError {
    /// A file cannot be used, or the run broke down.
    #[error(transparent)]
    Sim(#[from] Error),
    /// `check` has found mistakes, and has shown them.
    #[error("{bad} of {all} files cannot be used")]
    BadFiles {
        /// Number of files that cannot be used.
        bad: usize,
        /// Number of files that were checked.
        all: usize,
    },
    /// Standard output cannot be written.
    #[error("cannot write to standard output: {0}")]
    Output(std::io::Error),
    /// The reader of standard output has ended, such as `head`: not an error.
    #[error("the reader of standard output has ended")]
    ReaderGone,
    /// A value cannot be written in a format, for a reason.
    #[error("cannot write {0}: {1}")]
    NotWritten(&'static str, String),
    /// The arguments of a command cannot be used.
    #[error(transparent)]
    Usage(clap::Error),
    /// The results cannot go where they should.
    #[error("results cannot go to {}: {}\n  help: name a folder that can be written with --out", .path.display(), why_not(.path, .source))]
    Out {
        /// The folder.
        path: std::path::PathBuf,
        /// The error of the system.
        source: std::io::Error,
    },
    /// The command line has a mistake.
    #[error("{message}\n  help: {help}")]
    Refused {
        /// The mistake.
        message: String,
        /// The right way.
        help: String,
    },
    /// The command was stopped from outside, which counts as not run.
    #[error("interrupted: not everything was run; the files written so far are complete")]
    Interrupted,
    /// An estimator, controller or command of the program cannot be added.
    #[error("this program is put together wrongly: {0}")]
    Program(String),
    /// A study was stopped from outside, after this number of trials.
    #[error("interrupted: {}", match .0 { 0 => "there are no trials yet\n  help: start it again".to_owned(), n => format!("{n} trials are kept\n  help: go on with --resume") })]
    TuningInterrupted(usize),
}

impl From<Interrupted> for CliError {
    fn from(_: Interrupted) -> Self {
        Self::Interrupted
    }
}

impl CliError {
    /// Makes an error from the mistake and its correction.
    pub fn refused(message: impl Into<String>, help: impl Into<String>) -> Self {
        let (message, help) = (message.into(), help.into());
        Self::Refused { message, help }
    }

    /// Makes the error of a value that cannot be written as JSON.
    pub(crate) fn json(e: serde_json::Error) -> Self {
        Self::NotWritten("JSON", e.to_string())
    }
}

/// Reason why a folder cannot be written: a file of the same name, else the error of the system.
fn why_not(folder: &std::path::Path, source: &std::io::Error) -> String {
    match folder.ancestors().find(|part| part.is_file()) {
        Some(file) if file == folder => "this is a file".to_owned(),
        Some(file) => format!("{} is a file", file.display()),
        None => source.to_string(),
    }
}

/// Show an error on standard error.
pub fn show(e: &CliError) {
    let drawn = terminal::drawn();
    match drawn {
        true => note::drawn(&text(e, drawn)),
        false => note::error(&text(e, drawn)),
    }
}

/// Text of an error, drawn for a terminal or plain.
fn text(e: &CliError, drawn: bool) -> String {
    match e {
        CliError::Sim(Error::Input(input)) => {
            // only where there is a line to show: what cannot be read must not be read again
            let source = match input.line {
                Some(_) => monorig_sim::config::file::read_text(&input.file).unwrap_or_default(),
                None => String::new(),
            };
            let source = marked(&source);
            if drawn {
                draw(&shown(input), source)
            } else {
                plain(input, &source)
            }
        }
        CliError::Sim(Error::Io { source, .. }) if full(source) => format!(
            "error: {e}\n  help: make room, or name a folder on another disk with --out; `run.rrd` can be left out with --no-rerun"
        ),
        other => spelled_out(&format!("error: {other}")),
    }
}

/// Error with hidden characters spelled out: the drawing itself uses control characters.
fn shown(e: &InputError) -> InputError {
    InputError {
        file: spelled_out(&e.file.to_string_lossy()).into(),
        key: spelled_out(&e.key),
        message: spelled_out(&e.message),
        help: spelled_out(&e.help),
        ..e.clone()
    }
}

/// Returns true if the disk is full.
fn full(e: &std::io::Error) -> bool {
    use std::io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    matches!(e.kind(), StorageFull | QuotaExceeded | FileTooLarge)
}

/// Largest number of characters of a source line in a message.
const WIDEST: usize = 120;

/// The error, the line with a mark under the place, and the help.
fn plain(e: &InputError, source: &str) -> String {
    let whole = e.to_string();
    let (message, help) = whole.split_once("\n  help: ").unwrap_or((&whole, ""));
    let mut out = format!("error: {message}\n");
    if let (Some(line), Some(column)) = (e.line, e.column)
        && let Some(text) = source.lines().nth(line.saturating_sub(1))
    {
        let margin = line.to_string().len();
        // a very long line is shown from a little before the place
        let skipped = match column {
            c if c > WIDEST => c - WIDEST / 2,
            _ => 0,
        };
        let shown: String = text.chars().skip(skipped).take(WIDEST).collect();
        // tabs stay tabs, so that the mark stands below its letter
        let indent: String = shown
            .chars()
            .take(column.saturating_sub(1 + skipped))
            .map(|c| if c == '\t' { c } else { ' ' })
            .collect();
        out += &format!("  {line} | {shown}\n  {:margin$} | {indent}^\n", "");
    }
    if !help.is_empty() {
        out += &format!("  help: {help}\n");
    }
    out.truncate(out.trim_end().len());
    out
}

#[derive(Debug, thiserror::Error)]
#[error("{title}")]
struct Drawing {
    title: String,
    help: String,
    text: NamedSource<String>,
    label: Option<LabeledSpan>,
}

impl Diagnostic for Drawing {
    fn help<'a>(&'a self) -> Option<Box<dyn std::fmt::Display + 'a>> {
        (!self.help.is_empty()).then(|| Box::new(&self.help) as Box<dyn std::fmt::Display>)
    }
    fn source_code(&self) -> Option<&dyn miette::SourceCode> {
        self.label.as_ref().map(|_| &self.text as _)
    }
    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.label
            .clone()
            .map(|label| Box::new(std::iter::once(label)) as _)
    }
}

fn draw(e: &InputError, source: String) -> String {
    let span = e
        .line
        .zip(e.column)
        .and_then(|(line, column)| span(&source, line, column));
    let key = match e.key.as_str() {
        "" => String::new(),
        key => format!("{key}: "),
    };
    let drawing = Drawing {
        title: match span {
            Some(_) => format!("{key}{}", e.message),
            None => format!("{}: {key}{}", e.file.display(), e.message),
        },
        help: e.help.clone(),
        label: span.map(|s| LabeledSpan::new_with_span(Some("here".into()), s)),
        text: NamedSource::new(e.file.display().to_string(), source),
    };
    let mut out = String::new();
    let handler = GraphicalReportHandler::new()
        .with_width(usize::from(terminal::width()))
        .with_break_words(false);
    match handler.render_report(&mut out, &drawing) {
        Ok(()) => out,
        Err(_) => format!("error: {e}"),
    }
}

/// The word at a line and column (from 1), in bytes.
fn span(source: &str, line: usize, column: usize) -> Option<SourceSpan> {
    let start: usize = source
        .split_inclusive('\n')
        .take(line.checked_sub(1)?)
        .map(str::len)
        .sum();
    let text = source.get(start..)?.lines().next()?;
    let skipped: usize = text
        .chars()
        .take(column.checked_sub(1)?)
        .map(char::len_utf8)
        .sum();
    let word = text.get(skipped..)?;
    let length = word.find([' ', ',', ':', '}', ']']).unwrap_or(word.len());
    Some((start + skipped, length.max(1).min(word.len())).into())
}

/// Help and version go to standard output with code 0; a wrong command line has code 2.
pub fn usage(e: &clap::Error) -> ExitCode {
    let _ = e.print();
    ExitCode::from(if e.use_stderr() { 2 } else { 0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> InputError {
        InputError {
            file: "ä.yaml".into(),
            line: Some(2),
            column: Some(8),
            key: "load.mass_kg".into(),
            message: "-5 is not a number, zero or above".into(),
            help: "write a number, zero or above".into(),
        }
    }

    #[test]
    fn the_mark_stands_below_its_letter() {
        let lines: Vec<String> = plain(&sample(), "é: 1\n\tmäss: -5\n")
            .lines()
            .map(str::to_owned)
            .collect();
        let at = lines[1].chars().position(|c| c == '-').unwrap();
        assert_eq!(lines[2].chars().position(|c| c == '^'), Some(at));
        assert!(lines[3].contains("help"));
    }

    #[test]
    fn a_drawn_error_says_all_that_a_plain_one_does() {
        let e = sample();
        let drawn = draw(&e, "é: 1\n\tmäss: -5\n".into());
        for part in [&e.key, &e.message, &e.help, "ä.yaml"] {
            assert!(drawn.contains(part), "{drawn}");
        }
    }

    #[test]
    fn a_place_outside_the_file_is_no_panic() {
        for (line, column) in [(0, 0), (1, 99), (99, 1), (2, 1), (1, 2), (3, 1)] {
            let e = InputError {
                line: Some(line),
                column: Some(column),
                ..sample()
            };
            assert!(plain(&e, "ü\nb").contains("help"));
            assert!(!draw(&e, "ü\nb".into()).is_empty());
            assert!(!draw(&e, String::new()).is_empty());
        }
    }
}
