//! Runs out as logs: every sample with stamp and arrival and every command, in the formats that [`read`](crate::read)
//! reads, with a map file beside them.
//!
//! | file | what it holds |
//! |---|---|
//! | `samples` | `samples.parquet` of a run: the samples of each step, and the truth beside them |
//! | `tables` | a step as rows of tables |
//! | `csv` `parquet` `mat` `mcap` `can` `mf4` | writers, one file a format |
//! | `columns` | tables kept whole, for `mat` and `mf4` |
//! | `map` | the map file that makes the run's estimates of the tables again |

#[cfg(feature = "can")]
mod can;
mod columns;
mod csv;
mod failed;
mod map;
mod mat;
#[cfg(feature = "mcap")]
mod mcap;
#[cfg(feature = "mdf")]
mod mf4;
mod parquet;
mod samples;
mod tables;
mod writer;

pub use samples::{KeptStep, NAME as SAMPLES, SampleColumns, SampleRecorder, Samples};

use crate::io;
use monorig_sim::error::Error;
use monorig_sim::record::manifest::Manifest;
use monorig_sim::record::whole;
use std::path::{Path, PathBuf};
use tables::Tables;
use writer::{LogWriter, NewLog};

/// All formats for the samples of a run, a line each.
const FORMATS: &[&dyn LogWriter] = &[
    &csv::CsvWriter,
    &parquet::ParquetWriter,
    &mat::MatWriter,
    #[cfg(feature = "mcap")]
    &mcap::McapWriter,
    #[cfg(feature = "mdf")]
    &mf4::MdfWriter,
    #[cfg(feature = "can")]
    &can::CanWriter,
];

/// A format for the samples of a run.
#[derive(Clone, Copy)]
pub struct ExportFormat(&'static dyn LogWriter);

impl ExportFormat {
    /// A Parquet file a table.
    pub const PARQUET: Self = Self(&parquet::ParquetWriter);

    /// All formats.
    pub fn all() -> impl Iterator<Item = Self> {
        FORMATS.iter().map(|f| Self(*f))
    }

    /// The format of this name, such as `csv`.
    pub fn find(name: &str) -> Option<Self> {
        Self::all().find(|f| f.name() == name)
    }

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        self.0.name()
    }

    /// The files of a log, for the help of a command.
    pub fn files(self) -> &'static str {
        self.0.files()
    }

    /// True if values are rounded.
    pub fn is_lossy(self) -> bool {
        self.0.is_lossy()
    }
}

impl std::fmt::Debug for ExportFormat {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// A log that was written.
#[derive(Clone, Debug)]
pub struct Exported {
    /// The folder.
    pub folder: PathBuf,
    /// The map file in it.
    pub map: PathBuf,
    /// Rows of all tables.
    pub rows: u64,
    /// Number of values beyond the range of their signal, which were limited (CAN only).
    pub clipped: u64,
}

/// Writes the samples of a run as logs into a new folder, with a map file and the nominal vehicle. What the run had of
/// the folder of its `scenario`, if that is known, is named by its whole path.
pub fn export(
    run: &Path,
    format: ExportFormat,
    out: &Path,
    scenario: Option<&Path>,
) -> Result<Exported, Error> {
    let mut manifest = Manifest::of_run(run)?;
    if let Some(folder) = scenario.and_then(Path::parent) {
        map::name_whole_paths(&mut manifest, folder);
    }
    let path = run.join(SAMPLES);
    if !path.is_file() {
        return Err(crate::wrong(
            &path,
            None,
            "this run was made without --keep-samples",
            "`monorig run --keep-samples` keeps every sample at its full rate, with stamps",
        ));
    }
    manifest.verify(run, SAMPLES)?;
    if std::fs::read_dir(out).is_ok_and(|mut all| all.next().is_some()) {
        return Err(crate::wrong(
            out,
            None,
            "this folder is not empty",
            "use --out with another folder, or remove this folder",
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
    let mut writer = format.0.create(NewLog {
        run,
        folder: &partial.0,
        name: &name,
        tables: &used,
    })?;
    let mut rows = 0;
    samples.each(&mut |step| {
        tables.rows(step, &mut |table, at, values| {
            rows += 1;
            writer.row(table, at, values)
        })
    })?;
    let clipped = writer.finish()?;
    let map = map::write(
        &partial.0, &name, format.0, &samples, &used, &masses, &manifest,
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

/// A folder that is removed unless it was moved to its place.
struct Partial(PathBuf);

impl Drop for Partial {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
