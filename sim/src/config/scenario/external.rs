//! An estimator outside the program, as a scenario names it.

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fmt;
use std::net::SocketAddr;
use std::num::NonZeroU16;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Connection to an estimator outside the program, which reads CAN frames and answers with CAN frames: one of
/// `process`, `udp` and `can`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "ExternalFile")]
pub struct External {
    /// Connection.
    #[serde(flatten)]
    pub way: Way,
    /// Numbers of the frames.
    #[serde(skip_serializing_if = "SignalNumbers::is_fixed")]
    pub signals: SignalNumbers,
    /// Time for an answer in real time, ms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deadline_ms: Option<f64>,
    /// Time for the first answer, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start_s: Option<f64>,
    /// Answers that are lost or delayed on purpose.
    #[serde(skip_serializing_if = "AnswerFaults::are_none")]
    pub faults: AnswerFaults,
    /// Folder of the scenario, after loading.
    #[serde(skip)]
    pub folder: PathBuf,
}

/// Kind of connection to an estimator.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Way {
    /// A program and its arguments: lines of candump on its standard input and output.
    Process(Vec<String>),
    /// An address: datagrams of cannelloni.
    Udp(SocketAddr),
    /// An interface of SocketCAN: the frames themselves.
    Can(String),
}

/// Numbers of the frames' signals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SignalNumbers {
    /// Fixed-point numbers of 24 bits, as usual on a bus.
    #[default]
    Fixed,
    /// Floating-point numbers of 64 bits, without rounding.
    Float,
}

impl SignalNumbers {
    fn is_fixed(&self) -> bool {
        *self == Self::Fixed
    }
}

/// Answers that are lost or delayed on purpose, in real time: to see that it is found.
#[serde_with::skip_serializing_none]
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AnswerFaults {
    /// The answer to each step whose number this divides is lost.
    pub lose_every: Option<NonZeroU16>,
    /// The answer to each step whose number this divides is delayed.
    pub delay_every: Option<NonZeroU16>,
    /// Delay, ms.
    pub delay_ms: Option<f64>,
}

impl AnswerFaults {
    fn are_none(&self) -> bool {
        *self == Self::default()
    }
}

/// Default time for an answer in real time, ms.
const DEADLINE_MS: f64 = 2.0;
/// Longest time that can be set, ms.
const MAX_MS: f64 = 1000.0;
/// Default time for the first answer of a process, which must start, and of a running program, s; longest time that can
/// be set.
const START_S: [f64; 2] = [10.0, 2.0];
const MAX_START_S: f64 = 600.0;

impl External {
    /// Files that a process runs, as far as its words show: programs of the search path, and files from the folder of
    /// the scenario, scripts and modules of Python among them, with those of the same ending beside them, which a
    /// script may load.
    pub(super) fn files(&self) -> BTreeSet<PathBuf> {
        let mut found = BTreeSet::new();
        let Way::Process(words) = &self.way else {
            return found;
        };
        let path = std::env::var_os("PATH").unwrap_or_default();
        // `sh -c \"python3 'mine.py'\"`, `--model=mine.bin`
        let parts = words
            .iter()
            .flat_map(|word| word.split([' ', '=', ';', '"', '\'']));
        for part in parts.filter(|part| !part.is_empty()) {
            let programs = std::env::split_paths(&path).map(|folder| folder.join(part));
            let mut programs = programs.filter(|file| !part.contains('/') && file.is_file());
            found.extend(programs.next());
            let [here, module] = [part, &part.replace('.', "/")].map(|p| self.folder.join(p));
            let package = here.join("__main__.py");
            for script in [
                here,
                package,
                module.with_extension("py"),
                module.join("__main__.py"),
            ] {
                if script.is_file() {
                    found.extend(beside(&script));
                    found.insert(script);
                }
            }
        }
        found
    }

    /// Time for an answer in real time.
    pub fn deadline(&self) -> Duration {
        Duration::from_secs_f64(self.deadline_ms.unwrap_or(DEADLINE_MS) * 1e-3)
    }

    /// Time for the first answer.
    pub fn start(&self) -> Duration {
        let [process, other] = START_S;
        let usual = match self.way {
            Way::Process(_) => process,
            _ => other,
        };
        Duration::from_secs_f64(self.start_s.unwrap_or(usual))
    }
}

/// Files beside a file with the same ending; none for a file without an ending.
fn beside(file: &Path) -> impl Iterator<Item = PathBuf> + '_ {
    let folder = Path::new(".").join(file.parent().unwrap_or(Path::new("")));
    let ending = file.extension().unwrap_or(OsStr::new("/"));
    let files = folder.read_dir().into_iter().flatten().flatten();
    let files = files.map(|entry| file.with_file_name(entry.file_name()));
    files.filter(move |other| other.extension() == Some(ending) && other.is_file())
}

/// An estimator outside the program, which reads CAN frames and answers with CAN frames.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "External")]
struct ExternalFile {
    /// A program and its arguments, started in the folder of the scenario: lines of candump on its standard input and
    /// output.
    #[serde(default)]
    process: Option<Vec<String>>,
    /// Address and port where it listens: datagrams of cannelloni.
    #[serde(default)]
    udp: Option<String>,
    /// Interface of a CAN bus on Linux, such as can0: the frames themselves. For programs with the feature `socketcan`.
    #[serde(default)]
    can: Option<String>,
    /// Numbers of the frames' signals.
    #[serde(default)]
    signals: SignalNumbers,
    /// Time for an answer in real time (`monorig run --pace 1`), ms, 2 by default: what comes later counts as not
    /// delivered.
    #[serde(default)]
    deadline_ms: Option<f64>,
    /// Time for the first answer, s: 10 by default for a process, which starts, and 2 for the others.
    #[serde(default)]
    start_s: Option<f64>,
    /// Answers that are lost or delayed on purpose, in real time.
    #[serde(default)]
    faults: AnswerFaults,
}

impl TryFrom<ExternalFile> for External {
    type Error = String;
    fn try_from(file: ExternalFile) -> Result<Self, String> {
        let way = match (file.process, file.udp, file.can) {
            (Some(words), None, None) if words.first().is_some_and(|word| !word.is_empty()) => {
                Way::Process(words)
            }
            (Some(_), None, None) => {
                return Err(
                    "`process` is a list that begins with a program, such as [python3, mine.py]"
                        .into(),
                );
            }
            (None, Some(address), None) => Way::Udp(address.parse().map_err(|_| {
                format!("`{address}` is no address with a port, such as 127.0.0.1:47800")
            })?),
            (None, None, Some(interface)) => match interface.is_empty() {
                false => Way::Can(interface),
                true => return Err("`can` is an interface, such as can0".into()),
            },
            _ => {
                return Err("one of `process`, `udp` and `can` says where the estimator is".into());
            }
        };
        for (key, time, most) in [
            ("deadline_ms", file.deadline_ms, MAX_MS),
            ("faults.delay_ms", file.faults.delay_ms, MAX_MS),
            ("start_s", file.start_s, MAX_START_S),
        ] {
            if time.is_some_and(|time| !(time > 0.0 && time <= most)) {
                return Err(format!("`{key}` is above 0 and at most {most}"));
            }
        }
        if file.faults.delay_every.is_some() != file.faults.delay_ms.is_some() {
            return Err("`delay_every` and `delay_ms` belong together".into());
        }
        Ok(Self {
            way,
            deadline_ms: file.deadline_ms,
            start_s: file.start_s,
            faults: file.faults,
            signals: file.signals,
            folder: PathBuf::new(),
        })
    }
}

impl JsonSchema for External {
    fn schema_name() -> Cow<'static, str> {
        ExternalFile::schema_name()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        ExternalFile::json_schema(generator)
    }
}

impl fmt::Display for External {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.way {
            Way::Process(words) => write!(out, "process {}", words.join(" ")),
            Way::Udp(address) => write!(out, "UDP {address}"),
            Way::Can(interface) => write!(out, "CAN {interface}"),
        }
    }
}
