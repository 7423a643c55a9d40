//! The formats of logs, and which of them a file is of: by its first bytes, else by its name.

use super::{Asked, LogReader, Out};
use crate::{io, wrong};
use monorig_sim::error::Error;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// All formats: a line each, and one more of a format that a program can be built without.
const FORMATS: &[&dyn LogReader] = &[
    &super::csv::CsvReader,
    &super::parquet::ParquetReader,
    &super::mat::MatReader,
    #[cfg(feature = "mcap")]
    &super::mcap::McapReader,
    #[cfg(not(feature = "mcap"))]
    &Absent::new("MCAP", "mcap", b"\x89MCAP0"),
    #[cfg(feature = "mdf")]
    &super::mdf::MdfReader,
    #[cfg(not(feature = "mdf"))]
    &Absent::new("MDF4", "mdf", b"MDF     "),
    #[cfg(feature = "can")]
    &super::can::candump::CandumpReader,
    #[cfg(not(feature = "can"))]
    &Absent::new("candump", "can", b"("),
    #[cfg(feature = "blf")]
    &super::can::vector::AscReader,
    #[cfg(not(feature = "blf"))]
    &Absent::new("ASC", "blf", b""),
    #[cfg(feature = "blf")]
    &super::can::vector::BlfReader,
    #[cfg(not(feature = "blf"))]
    &Absent::new("BLF", "blf", b"LOGG"),
];

/// Longest start of a file that is looked at, bytes.
const HEAD: u64 = 512;

/// The reader of a file.
pub(super) fn reader_of(path: &Path) -> Result<&'static dyn LogReader, Error> {
    let mut head = Vec::new();
    let file = File::open(path).map_err(|e| io(path, e))?;
    file.take(HEAD)
        .read_to_end(&mut head)
        .map_err(|e| io(path, e))?;
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    let ending = ending.to_lowercase();
    let find = |is: &dyn Fn(&dyn LogReader) -> bool| FORMATS.iter().find(|f| is(**f)).copied();
    if let Some(format) = find(&|f| f.magics().iter().any(|magic| head.starts_with(magic))) {
        return Ok(format);
    }
    let promised = find(&|f| !f.magics().is_empty() && f.endings().contains(&ending.as_str()));
    if let Some(format) = promised {
        return Err(not_as_promised(path, format));
    }
    let refused = |message: &str, help: &str| Err(wrong(path, None, message, help));
    if head.is_empty() {
        return refused("this file is empty", "use a log with a header and rows");
    }
    if let Some(format) = find(&|f| f.recognises(&head, &ending)) {
        return Ok(format);
    }
    if head.starts_with(&[0xFF, 0xFE]) || head.starts_with(&[0xFE, 0xFF]) {
        return refused("this is text in UTF-16", "save it as UTF-8");
    }
    if head.contains(&0) {
        return refused("this is not a log of a known format", &all_formats());
    }
    Ok(&super::csv::CsvReader)
}

/// The error of a file that does not begin as its ending demands.
fn not_as_promised(path: &Path, format: &dyn LogReader) -> Error {
    let magic = format.magics().first().copied().unwrap_or_default();
    let magic = magic.escape_ascii().to_string();
    wrong(
        path,
        None,
        format!(
            "this file is not in the format {}: it does not begin with {}",
            format.name(),
            magic.trim_end()
        ),
        "use the file as the logger wrote it; if it has another format, give it the ending of this format",
    )
}

/// The names of all formats: `CSV, Parquet; with the feature `mcap` also MCAP`.
fn all_formats() -> String {
    let named = |feature: Option<&str>| -> String {
        let of = FORMATS.iter().filter(|f| f.missing_feature() == feature);
        of.map(|f| f.name()).collect::<Vec<_>>().join(", ")
    };
    let mut text = named(None);
    let mut features: Vec<&str> = FORMATS.iter().filter_map(|f| f.missing_feature()).collect();
    features.dedup();
    for feature in features {
        let names = named(Some(feature)).replace(", ", " and ");
        text += &format!("; with the feature `{feature}` also {names}");
    }
    text
}

/// A format that this program was built without: its files are recognised, and refused.
#[allow(dead_code)] // with all features there is none
struct Absent {
    name: &'static str,
    feature: &'static str,
    /// First bytes of its files; none of a format that its ending alone shows.
    begins: &'static [u8],
}

#[allow(dead_code)]
impl Absent {
    const fn new(name: &'static str, feature: &'static str, begins: &'static [u8]) -> Self {
        Self {
            name,
            feature,
            begins,
        }
    }
}

impl LogReader for Absent {
    fn name(&self) -> &'static str {
        self.name
    }

    fn recognises(&self, head: &[u8], ending: &str) -> bool {
        let begins = !self.begins.is_empty() && head.starts_with(self.begins);
        begins || self.name.eq_ignore_ascii_case(ending)
    }

    fn missing_feature(&self) -> Option<&'static str> {
        Some(self.feature)
    }

    fn read(&self, asked: Asked<'_>, _: &mut Out<'_>) -> Result<(), Error> {
        Err(wrong(
            asked.path,
            None,
            format!(
                "this is a log of the format {}, which this program was built without",
                self.name
            ),
            format!(
                "use a `monorig` built with the feature `{}`, or the log in another format",
                self.feature
            ),
        ))
    }
}
