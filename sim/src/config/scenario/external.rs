//! An estimator outside of the program, as a scenario names it.

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fmt;
use std::net::SocketAddr;
use std::path::PathBuf;

/// The way to an estimator outside of the program, which is given CAN frames and answers in CAN frames: one of
/// `process` and `udp`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "ExternalFile")]
pub struct External {
    /// The way.
    #[serde(flatten)]
    pub way: Way,
    /// Numbers of the frames.
    #[serde(skip_serializing_if = "SignalNumbers::is_fixed")]
    pub signals: SignalNumbers,
    /// Folder of the scenario, once it is loaded.
    #[serde(skip)]
    pub folder: PathBuf,
}

/// A way to an estimator.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Way {
    /// A program and its arguments: lines of candump on its standard input and output.
    Process(Vec<String>),
    /// An address: datagrams of cannelloni.
    Udp(SocketAddr),
}

/// Numbers of the frames' signals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SignalNumbers {
    /// Fixed-point numbers of 24 bits, as buses have them.
    #[default]
    Fixed,
    /// Floating-point numbers of 64 bits, which round nothing.
    Float,
}

impl SignalNumbers {
    fn is_fixed(&self) -> bool {
        *self == Self::Fixed
    }
}

/// An estimator outside of the program, which is given CAN frames and answers in CAN frames.
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
    /// Numbers of the frames' signals.
    #[serde(default)]
    signals: SignalNumbers,
}

impl TryFrom<ExternalFile> for External {
    type Error = String;
    fn try_from(file: ExternalFile) -> Result<Self, String> {
        let way = match (file.process, file.udp) {
            (Some(words), None) if words.first().is_some_and(|word| !word.is_empty()) => {
                Way::Process(words)
            }
            (Some(_), None) => {
                return Err(
                    "`process` is a list that begins with a program, such as [python3, mine.py]"
                        .into(),
                );
            }
            (None, Some(address)) => Way::Udp(address.parse().map_err(|_| {
                format!("`{address}` is no address with a port, such as 127.0.0.1:47800")
            })?),
            _ => return Err("one of `process` and `udp` says where the estimator is".into()),
        };
        Ok(Self {
            way,
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
        }
    }
}
