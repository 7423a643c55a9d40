//! Runs out as logs: every sample with stamp and arrival and every command, in the formats that [`read`](crate::read) reads, with a map file
//! beside them.
//!
//! | file | what it holds |
//! |---|---|
//! | `samples` | `samples.parquet` of a run: what the estimators were given in each step, and the truth beside it |
//! | `tables` | a step as rows of tables |
//! | `csv` `parquet` `mcap` `can` `mf4` | writers, one file a format |
//! | `map` | the map file that makes the run's estimates of the tables again |

mod can;
mod csv;
mod map;
mod mcap;
mod mf4;
mod parquet;
mod samples;
mod tables;

pub use samples::{KeptStep, NAME as SAMPLES, SampleRecorder, Samples};

use crate::io;
use monorig_sim::error::Error;
use monorig_sim::record::manifest::{self, Manifest};
use monorig_sim::record::whole;
use std::path::{Path, PathBuf};
use tables::{Table, Tables};

/// A format that a run can be written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportFormat {
    /// A file of text a table.
    Csv,
    /// A Parquet file a table.
    Parquet,
    /// One file, a topic of JSON messages a table.
    Mcap,
    /// One MDF 4.10 file, a channel group a table.
    Mf4,
    /// CAN frames as candump writes them, with a DBC: values are rounded to the steps of its signals.
    Can,
}

impl ExportFormat {
    /// As it is written on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Parquet => "parquet",
            Self::Mcap => "mcap",
            Self::Mf4 => "mf4",
            Self::Can => "can",
        }
    }

    /// Whether values are rounded.
    pub fn is_lossy(self) -> bool {
        self == Self::Can
    }
}

/// Writes rows of tables.
trait Writer {
    /// A row of the table with this index: when it was taken and recorded (ns of the run), and its values; not a number where there is none.
    fn row(&mut self, table: usize, at: Instants, values: &[f64]) -> Result<(), Error>;
    /// All rows are written; how many values were beyond the range of their signal.
    fn finish(self: Box<Self>) -> Result<u64, Error>;
}

/// When a row was taken and recorded, ns of the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Instants {
    stamp_ns: i64,
    arrival_ns: i64,
}

/// What was written.
#[derive(Clone, Debug)]
pub struct Exported {
    /// The folder.
    pub folder: PathBuf,
    /// The map file in it.
    pub map: PathBuf,
    /// Rows of all tables.
    pub rows: u64,
    /// Values beyond the range of their signal, written as its end (CAN only).
    pub clipped: u64,
}

/// Writes the samples of a run as logs into a new folder, with a map file and the vehicle as the estimators were told it.
pub fn export(run: &Path, format: ExportFormat, out: &Path) -> Result<Exported, Error> {
    let manifest = Manifest::read(&run.join(manifest::NAME))?;
    let path = run.join(SAMPLES);
    if !path.is_file() {
        return Err(crate::wrong(
            &path,
            None,
            "this run has not kept its samples",
            "`monorig run --keep-samples` keeps every sample at its full rate, with stamps",
        ));
    }
    manifest.verify(run, SAMPLES)?;
    if std::fs::read_dir(out).is_ok_and(|mut all| all.next().is_some()) {
        return Err(crate::wrong(
            out,
            None,
            "there is something in this folder already",
            "--out with another folder, or remove it",
        ));
    }
    let samples = Samples::open(&path)?;
    let mut tables = Tables::new(samples.vehicle.drives);
    let mut masses: Vec<(i64, f64)> = Vec::new();
    samples.each(&mut |step| {
        tables.find_used(step);
        let kg = step.total_mass_kg;
        if masses.last().is_none_or(|m| m.1.to_bits() != kg.to_bits()) && kg.is_finite() {
            masses.push((step.arrival_ns, kg));
        }
        Ok(())
    })?;
    let tables = tables;
    let parent = out.parent().filter(|p| !p.as_os_str().is_empty());
    let parent = parent.unwrap_or(Path::new("."));
    std::fs::create_dir_all(parent).map_err(|e| io(parent, e))?;
    let partial = Partial(whole::partial(out));
    let _ = std::fs::remove_dir_all(&partial.0);
    std::fs::create_dir(&partial.0).map_err(|e| io(&partial.0, e))?;

    let name = format!("{}_{}", manifest.scenario, manifest.seed);
    let used = tables.used();
    let mut writer: Box<dyn Writer> = match format {
        ExportFormat::Csv => Box::new(csv::Files::create(&partial.0, &used)?),
        ExportFormat::Parquet => Box::new(parquet::Files::create(&partial.0, &used)?),
        ExportFormat::Mcap => Box::new(mcap::File::create(&partial.0, &name, &used)?),
        ExportFormat::Mf4 => Box::new(mf4::File::create(&partial.0, &name, &used)?),
        ExportFormat::Can => Box::new(can::File::create(&partial.0, &name, &used)?),
    };
    let mut rows = 0;
    samples.each(&mut |step| {
        tables.rows(step, &mut |table, at, values| {
            rows += 1;
            writer.row(table, at, values)
        })
    })?;
    let clipped = writer.finish()?;
    let map = map::write(
        &partial.0, &name, format, &samples, &used, &masses, &manifest,
    )?;
    let _ = std::fs::remove_dir(out); // an empty folder
    std::fs::rename(&partial.0, out).map_err(|e| io(out, e))?;
    Ok(Exported {
        folder: out.into(),
        map: out.join(map),
        rows,
        clipped,
    })
}

/// A folder that goes when it was not moved to its place.
struct Partial(PathBuf);

impl Drop for Partial {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
