//! Arguments that several commands take.

use crate::command::CommandOutcome;
use crate::ui::errors::CliError;
use crate::ui::output;
use monorig_lab::campaign::Shard;
use monorig_lab::metrics;
use monorig_sim::closed_loop::registry::Registry;
use monorig_wire::signal::Numbers;
use std::net::{SocketAddr, ToSocketAddrs};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Threads to work with.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct Jobs {
    /// Runs at a time [default: the cores this process may use: affinity, cgroup quota, SLURM_CPUS_PER_TASK]. Results
    /// do not depend on it
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
}

impl Jobs {
    /// Number of threads.
    pub fn get(self) -> NonZeroUsize {
        self.jobs.unwrap_or_else(|| {
            // with affinity and, on Linux, the quota of the cgroup
            let cores = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
            at_most(cores, std::env::var(SLURM_CPUS).ok().as_deref())
        })
    }
}

/// Variable with the cores that Slurm gives a task; Slurm does not bind the task to them everywhere.
const SLURM_CPUS: &str = "SLURM_CPUS_PER_TASK";

/// Number of cores, limited by the number in the variable; a text that is not a number sets no limit.
fn at_most(cores: NonZeroUsize, variable: Option<&str>) -> NonZeroUsize {
    let limit = variable.and_then(|n| n.trim().parse::<NonZeroUsize>().ok());
    limit.map_or(cores, |limit| limit.min(cores))
}

/// Changes to scenarios.
#[derive(Clone, Debug, clap::Args)]
pub struct Changes {
    /// Run these seeds instead of the scenario's seeds: `7`, `1..50` or `1,5,9`
    #[arg(long, value_name = "SEEDS", value_parser = seeds)]
    pub seeds: Option<String>,
    /// Change a value of every scenario; may be given several times
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = assignment)]
    pub sets: Vec<(String, String)>,
}

impl Changes {
    /// All changes as paths and values.
    pub fn all(&self) -> Vec<(String, String)> {
        let seeds = self.seeds.iter();
        let seeds = seeds.map(|seeds| ("seeds".to_owned(), seeds.clone()));
        self.sets.iter().cloned().chain(seeds).collect()
    }
}

/// Which process judges the figures of shards.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Expect {
    /// This process: exit code 1 if an expectation failed
    #[default]
    Here,
    /// `monorig merge`: a shard whose runs were made exits with 0, whatever their results are
    Merge,
}

impl Expect {
    /// Outcome that sets the exit code after the verdicts `judged`.
    pub fn outcome(self, judged: CommandOutcome) -> CommandOutcome {
        match self {
            Self::Here => judged,
            Self::Merge => CommandOutcome::Held,
        }
    }
}

/// File of the ranges from which courses are drawn.
pub const RANGES: &str = "assets/ranges/roadway.yaml";

/// Reads a part of the runs, as `K/N`.
pub fn shard(text: &str) -> Result<Shard, String> {
    let parsed = text.split_once('/').and_then(|(part, of)| {
        let (part, of) = (part.trim().parse().ok()?, of.trim().parse().ok()?);
        (1..=of).contains(&part).then_some(Shard { part, of })
    });
    parsed.ok_or_else(|| "write K/N with K from 1 to N, such as 2/5".to_owned())
}

/// Name of the environment variable with the folder for results.
const OUT_VARIABLE: &str = "MONORIG_OUT";

/// Folder for results.
#[derive(Clone, Debug, clap::Args)]
pub struct Out {
    /// Folder for the results [default: the variable MONORIG_OUT, else runs]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Out {
    /// Path of the folder.
    pub fn get(&self) -> PathBuf {
        self.out.clone().unwrap_or_else(Self::usual)
    }

    /// Path of the folder if the command line names none.
    pub fn usual() -> PathBuf {
        let variable = std::env::var_os(OUT_VARIABLE).filter(|dir| !dir.is_empty());
        variable.map_or_else(|| "runs".into(), PathBuf::from)
    }
}

/// Permission to run the foreign code that a file names.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct Foreign {
    /// Run the libraries, FMUs and programs that the files name, with your rights; without this option only those that
    /// `--set` names
    #[arg(long)]
    allow_foreign: bool,
}

impl Foreign {
    /// Registry for files that others may have sent: foreign code runs only if the user names or allows it.
    pub fn registry(self, all: &Registry, named: impl IntoIterator<Item = String>) -> Registry {
        match self.allow_foreign {
            true => all.clone(),
            false => all.clone().only_foreign(named),
        }
    }
}

/// Results for programs.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct Json {
    /// Write results and verdicts as JSON; `-` is standard output, and the text for people then goes to standard error
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl Json {
    /// Path of the JSON file, if the user asked for a file.
    pub fn path(&self) -> Option<&Path> {
        self.json.as_deref()
    }

    /// Writes the results; `make` is called only if the user asked for a file.
    pub fn write(&self, make: impl FnOnce() -> serde_json::Value) -> Result<(), CliError> {
        let text = || serde_json::to_string_pretty(&make()).map_err(CliError::json);
        self.write_text(|| Ok(text()? + "\n"))
    }

    /// Writes a text; `make` is called only if the user asked for a file.
    pub fn write_text(
        &self,
        make: impl FnOnce() -> Result<String, CliError>,
    ) -> Result<(), CliError> {
        match self.path() {
            Some(path) => output::write(path, &make()?),
            None => Ok(()),
        }
    }
}

/// Reads seeds; returns the text that a scenario would have for these seeds.
pub fn seeds(text: &str) -> Result<String, String> {
    let yaml = if text.contains(',') {
        format!("[{text}]")
    } else {
        text.to_owned()
    };
    monorig_sim::config::scenario::Seeds::parse(&yaml)?;
    Ok(yaml)
}

/// Reads a change to a scenario, as `PATH=VALUE`.
pub fn assignment(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((path, value)) if !path.trim().is_empty() => {
            Ok((path.trim().to_owned(), value.to_owned()))
        }
        _ => Err("write PATH=VALUE, such as load.mass_kg=5000".to_owned()),
    }
}

/// Value of a parameter from its text: a number, a flag or a word.
#[cfg(feature = "plugins")]
pub fn value_of(text: &str) -> monorig_sim::config::scenario::ParameterValue {
    match (text.parse::<f64>(), text.parse::<bool>()) {
        (Ok(number), _) if number.is_finite() => number.into(),
        (_, Ok(flag)) => flag.into(),
        _ => text.into(),
    }
}

/// Numbers of CAN signals.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct Signals {
    /// Numbers of the signals
    #[arg(long, value_enum, default_value = "fixed")]
    signals: SignalNumbers,
}

/// Numbers of CAN signals, as the command line names them.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum SignalNumbers {
    /// Fixed-point numbers of 24 bits, as usual on a bus
    Fixed,
    /// Floating-point numbers of 64 bits, without rounding
    Float,
}

impl Signals {
    /// Format of the numbers in the frames.
    pub fn numbers(self) -> Numbers {
        match self.signals {
            SignalNumbers::Fixed => Numbers::Fixed,
            SignalNumbers::Float => Numbers::Float,
        }
    }
}

/// Default address of a Rerun viewer.
pub const VIEWER: &str = "127.0.0.1:9876";

/// Reads an address, as HOST:PORT.
pub fn address(text: &str) -> Result<SocketAddr, String> {
    let found = text.to_socket_addrs().ok().and_then(|mut all| all.next());
    found.ok_or_else(|| format!("write HOST:PORT, such as {VIEWER}"))
}

/// Reads the name of a metric of estimators.
pub fn metric(name: &str) -> Result<String, String> {
    let known = metrics::estimator_metrics().map(|m| m.name);
    if known.clone().any(|k| k == name) {
        return Ok(name.to_owned());
    }
    Err(metrics::advice(name, &known.collect::<Vec<_>>()))
}

/// An estimator of a comparison: its name in the run and, if it was given, its type.
#[derive(Clone, Debug)]
pub struct NamedEstimator {
    pub(crate) name: String,
    pub(crate) is: Option<String>,
}

/// Reads an estimator, as NAME or NAME=TYPE.
pub fn named(text: &str) -> Result<NamedEstimator, String> {
    let (name, is) = match text.split_once('=') {
        Some((name, is)) => (name, Some(is.trim().to_owned())),
        None => (text, None),
    };
    let name = name.trim().to_owned();
    match name.is_empty() || is.as_ref().is_some_and(String::is_empty) {
        true => Err("write NAME or NAME=TYPE, such as tuned=dffrls_aekf_robust".into()),
        false => Ok(NamedEstimator { name, is }),
    }
}

/// A share as `5%` or `0.05`.
pub fn share(text: &str) -> Result<f64, String> {
    let (number, scale) = match text.trim().strip_suffix('%') {
        Some(number) => (number, 0.01),
        None => (text, 1.0),
    };
    let share = number.trim().parse::<f64>().map(|x| x * scale);
    share
        .ok()
        .filter(|x| (0.0..=10.0).contains(x))
        .ok_or_else(|| "write a share such as 5% or 0.05".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slurm_lessens_the_cores_and_never_adds_any() {
        let n = |n| NonZeroUsize::new(n).unwrap();
        for (told, jobs) in [
            (None, 8),
            (Some("2"), 2),
            (Some(" 3\n"), 3),
            (Some("64"), 8),
            (Some("0"), 8),
            (Some("many"), 8),
        ] {
            assert_eq!(at_most(n(8), told), n(jobs), "{told:?}");
        }
    }

    #[test]
    fn shares_are_read() {
        assert_eq!(share("5%"), Ok(0.05));
        assert_eq!(share(" 0.1 "), Ok(0.1));
        assert!(share("five").is_err() && share("-1%").is_err() && share("nan").is_err());
    }
}
