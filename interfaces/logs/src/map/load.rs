//! From a map file to a checked map with its files found.

use super::check;
use super::file::{MapFile, NoiseSource, Order};
use crate::notation::NS;
use crate::read::ReadOptions;
use crate::read::merge::{By, Source};
use crate::wrong;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::checked::{Finite, Positive};
use monorig_sim::config::file::{Document, Sets, exists, name_of};
use monorig_sim::config::input_files::InputFiles;
use monorig_sim::error::Error;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A map file, read and checked, and the files of its log.
#[derive(Clone, Debug)]
pub struct Map {
    /// File name without its endings: `drive` of `drive.map.yaml`.
    pub name: String,
    /// The keys of the file.
    pub(crate) file: MapFile,
    /// The files of the log by name.
    pub(crate) files: BTreeMap<String, PathBuf>,
    /// The database of CAN messages.
    pub(crate) dbc: Option<PathBuf>,
    /// The file with its read content: errors are reported in it.
    pub(crate) document: Document,
    /// The files that were read so far.
    pub(crate) inputs: InputFiles,
}

/// Name of the only file of a map that names none.
const ONLY: &str = "log";
/// A gap longer than this begins a new segment unless the map file has another length, s.
const SEGMENT_GAP_S: f64 = 60.0;

/// Ends of the path of a change, behind the name of an estimator, that say what is run.
const NAMING: [&str; 7] = [
    "",
    ".library",
    ".fmu",
    ".external",
    ".external.process",
    ".external.udp",
    ".external.can",
];

impl Map {
    /// Reads and checks a map file; its log must be there.
    pub fn load(path: &Path) -> Result<Self, Error> {
        Self::load_with(path, None, &[])
    }

    /// The same with a log given: a folder in which the files of the map are found, or the one file of the map; and
    /// with changes such as `("step.rate_hz", "200")`.
    pub fn load_with(
        path: &Path,
        log: Option<&Path>,
        changes: &[(String, String)],
    ) -> Result<Self, Error> {
        let inputs = InputFiles::default();
        let document = inputs.during(|| Document::read(path))?;
        Self::of(document, inputs, log, changes)
    }

    /// Reads and checks a map file from this text, without a file.
    pub(crate) fn of_text(text: String, log: &Path) -> Result<Self, Error> {
        let document = Document::of(Path::new("proposed.map.yaml"), text)?;
        Self::of(document, InputFiles::default(), Some(log), &[])
    }

    fn of(
        mut document: Document,
        inputs: InputFiles,
        log: Option<&Path>,
        changes: &[(String, String)],
    ) -> Result<Self, Error> {
        let path = document.path().to_owned();
        let path = path.as_path();
        let file = inputs.during(|| {
            document.apply(&Sets::new(changes))?;
            document.parse::<MapFile>()
        })?;
        check::check(&file).map_err(|w| document.error(w.0, w.1, w.2))?;
        let stem = name_of(path)?;
        let name = stem.strip_suffix(".map").unwrap_or(&stem).to_owned();
        let folder = path.parent().unwrap_or(Path::new(""));
        let files = match log {
            Some(log) if !log.is_dir() => match file.files.len() {
                0 | 1 => {
                    let only = file.files.keys().next().map_or(ONLY, String::as_str);
                    BTreeMap::from([(only.to_owned(), log.to_owned())])
                }
                n => {
                    let help = "give the folder with these files, or no LOG to use the paths in the map file";
                    return Err(wrong(
                        log,
                        None,
                        format!("the map file {} names {n} files", path.display()),
                        help,
                    ));
                }
            },
            _ => {
                let within = log.unwrap_or(folder);
                file.files
                    .iter()
                    .map(|(name, file)| (name.clone(), within.join(file)))
                    .collect()
            }
        };
        if files.is_empty() {
            return Err(document.error(
                "files",
                "this map has no file",
                "add `files: {log: FILE}`, or give the log on the command line",
            ));
        }
        for (name, path) in &files {
            exists(path).map_err(|(message, help)| {
                document.error(format!("files.{name}"), message, help)
            })?;
        }
        let dbc = file.dbc.as_ref().map(|dbc| folder.join(dbc));
        if let Some(dbc) = &dbc {
            exists(dbc).map_err(|(message, help)| document.error("dbc", message, help))?;
        }
        Ok(Self {
            name,
            file,
            files,
            dbc,
            document,
            inputs,
        })
    }

    /// Foreign estimators that these changes name; estimators of the file do not count, as somebody may have sent it.
    pub fn foreign_named_by<'a>(
        &'a self,
        changes: &'a [(String, String)],
    ) -> impl Iterator<Item = String> + 'a {
        let names = self.file.estimators.keys().cloned();
        names.filter(|name| {
            let of = |path: &str| match path.strip_prefix("estimators") {
                Some("") => true,
                Some(rest) => rest
                    .strip_prefix('.')
                    .and_then(|r| r.strip_prefix(name.as_str()))
                    .is_some_and(|key| NAMING.contains(&key)),
                None => false,
            };
            changes.iter().any(|(path, _)| of(path))
        })
    }

    /// Removes the foreign estimators that the registry does not run; returns their descriptions.
    pub fn leave_out_foreign(&mut self, registry: &Registry) -> Vec<String> {
        registry.leave_out_foreign(&mut self.file.estimators)
    }

    /// The source of the noise that estimators are given.
    pub fn noise(&self) -> Option<NoiseSource> {
        self.file.noise
    }

    /// The names of the log's files, for messages.
    pub fn log_names(&self) -> String {
        let name = |path: &PathBuf| {
            path.file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned()
        };
        self.files.values().map(name).collect::<Vec<_>>().join(", ")
    }

    /// True if the map has a reference of the mass.
    pub fn has_mass(&self) -> bool {
        self.file.reference.mass.is_some()
    }

    /// True if the map has a reference of the slope.
    pub fn has_slope(&self) -> bool {
        self.file.reference.slope.is_some()
    }

    /// An error at a key of the map file.
    pub fn error(
        &self,
        key: impl Into<String>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Error {
        self.document.error(key, message, help)
    }

    /// The name of the file that a channel means: the one it names, else the only one.
    pub(crate) fn file_of(&self, key: &str, named: Option<&str>) -> Result<usize, Error> {
        let all = || self.files.keys().cloned().collect::<Vec<_>>().join(", ");
        match named {
            Some(name) => self.files.keys().position(|n| n == name).ok_or_else(|| {
                self.error(
                    format!("{key}.file"),
                    format!("`files` has no file `{name}`"),
                    format!("one of: {}", all()),
                )
            }),
            None if self.files.len() == 1 => Ok(0),
            None => Err(self.error(
                key,
                "this log has several files, but the channel names none",
                format!("`file:` with one of: {}", all()),
            )),
        }
    }

    /// The file and the column that `FILE:COLUMN` means, by the names under `files`; none of a name without such a file
    /// before it.
    pub(crate) fn elsewhere<'a>(&self, name: &'a str) -> Option<(usize, &'a str)> {
        let (file, column) = name.split_once(':')?;
        let source = self.files.keys().position(|n| n == file)?;
        Some((source, column))
    }

    /// The files to be merged, with the columns that are wanted of each, in the order of their names.
    pub(crate) fn sources(&self, wanted: &[BTreeSet<String>]) -> Vec<Source> {
        let time = &self.file.time;
        let each = self.files.iter().zip(wanted);
        let source = |((name, path), wanted): ((&String, &PathBuf), &BTreeSet<String>)| {
            let clock = self.file.clocks.get(name);
            let own =
                |f: fn(&super::Clock) -> Option<Finite>| clock.and_then(f).map_or(0.0, Finite::get);
            Source {
                path: path.clone(),
                options: ReadOptions {
                    time: clock
                        .and_then(|c| c.column.clone())
                        .or_else(|| time.column.clone()),
                    unit: clock.and_then(|c| c.unit).or(time.unit),
                    wraps: clock.and_then(|c| c.wraps).or(time.wraps),
                    pieces: time.pieces.clone(),
                    wanted: Some(wanted.iter().chain(&time.stamp).cloned().collect()),
                    dbc: self.dbc.clone(),
                },
                stamp: time
                    .stamp
                    .clone()
                    .map(|column| (column, time.unit.unwrap_or_default())),
                offset_ns: (own(|c| c.offset_s) * NS as f64).round() as i64,
                drift_ppm: own(|c| c.drift_ppm),
                leads: false,
            }
        };
        // a file of which nothing is wanted is not read
        each.map(source).collect()
    }

    /// Time by which rows are merged.
    pub(crate) fn by(&self) -> By {
        match self.file.time.order {
            Order::Stamp => By::Stamp,
            Order::Arrival => By::Arrival,
        }
    }

    /// True if only a part of the log is played and checked.
    pub fn is_trimmed(&self) -> bool {
        self.file.trim.from_s.is_some() || self.file.trim.until_s.is_some()
    }

    /// The part of the log that is played, ns of the replay.
    pub(crate) fn trim_ns(&self) -> std::ops::RangeInclusive<i64> {
        let ns = |s: f64| (s * NS as f64).round() as i64;
        let trim = &self.file.trim;
        let from = trim.from_s.map_or(i64::MIN, |s| ns(s.get()));
        from..=trim.until_s.map_or(i64::MAX, |s| ns(s.get()))
    }

    /// A gap longer than this begins a new segment, ns.
    pub(crate) fn segment_gap_ns(&self) -> i64 {
        let s = self
            .file
            .time
            .segment_gap_s
            .map_or(SEGMENT_GAP_S, Positive::get);
        (s * NS as f64).round() as i64
    }

    /// Length of a step, ns.
    pub(crate) fn step_ns(&self) -> i64 {
        (NS as f64 / self.file.step.rate_hz.get()).round() as i64
    }
}
