//! The format of a file: by its first bytes, else by its name.

use crate::{io, wrong};
use monorig_sim::error::Error;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// A format of logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Text, a row a line.
    Csv,
    /// Apache Parquet.
    Parquet,
    /// MCAP.
    Mcap,
    /// ASAM MDF 4.
    Mdf,
    /// Text of `candump -L`.
    Candump,
    /// Vector ASC.
    Asc,
    /// Vector BLF.
    Blf,
}

impl Format {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Csv => "CSV",
            Self::Parquet => "Parquet",
            Self::Mcap => "MCAP",
            Self::Mdf => "MDF4",
            Self::Candump => "candump",
            Self::Asc => "ASC",
            Self::Blf => "BLF",
        }
    }

    /// Whether it holds CAN frames, which a database of messages makes values of.
    pub fn is_can(self) -> bool {
        matches!(self, Self::Candump | Self::Asc | Self::Blf)
    }

    /// The format of a file.
    pub fn of(path: &Path) -> Result<Self, Error> {
        let mut head = [0u8; 512];
        let mut file = File::open(path).map_err(|e| io(path, e))?;
        let mut length = 0;
        while let Some(room) = head.get_mut(length..).filter(|r| !r.is_empty()) {
            match file.read(room).map_err(|e| io(path, e))? {
                0 => break,
                n => length += n,
            }
        }
        let head = head.get(..length).unwrap_or_default();
        let magics: [(&[u8], Self); 5] = [
            (b"PAR1", Self::Parquet),
            (b"\x89MCAP0", Self::Mcap),
            (b"MDF     ", Self::Mdf),
            (b"UnFinMF ", Self::Mdf),
            (b"LOGG", Self::Blf),
        ];
        if let Some((_, format)) = magics.iter().find(|(magic, _)| head.starts_with(magic)) {
            return Ok(*format);
        }
        let ending = path
            .extension()
            .unwrap_or_default()
            .to_string_lossy()
            .to_lowercase();
        let named = match ending.as_str() {
            "parquet" => Some((Self::Parquet, "PAR1")),
            "mcap" => Some((Self::Mcap, "\\x89MCAP0")),
            "mf4" | "mdf" => Some((Self::Mdf, "MDF")),
            "blf" => Some((Self::Blf, "LOGG")),
            _ => None,
        };
        if let Some((format, magic)) = named {
            return Err(wrong(
                path,
                None,
                format!(
                    "this is no {} file: it does not begin with {magic}",
                    format.name()
                ),
                "the file as the logger wrote it; if it is another format, give it that ending",
            ));
        }
        if ending == "asc" {
            return Ok(Self::Asc);
        }
        if head.is_empty() {
            return Err(wrong(
                path,
                None,
                "this file is empty",
                "a log with a header and rows",
            ));
        }
        if head.starts_with(b"(") {
            return Ok(Self::Candump);
        }
        if head.starts_with(&[0xFF, 0xFE]) || head.starts_with(&[0xFE, 0xFF]) {
            return Err(wrong(
                path,
                None,
                "this is text in UTF-16",
                "save it as UTF-8",
            ));
        }
        if head.contains(&0) {
            return Err(wrong(
                path,
                None,
                "this is no log of a format that is known here",
                "CSV, Parquet, MCAP, MDF4, candump; with the feature `blf` also ASC and BLF",
            ));
        }
        Ok(Self::Csv)
    }
}
