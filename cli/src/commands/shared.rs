//! Arguments that several commands take.

use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Threads to work with.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct Jobs {
    /// Runs at a time; without it as many as there are cores. Results do not depend on it
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
}

impl Jobs {
    /// How many.
    pub fn get(self) -> NonZeroUsize {
        self.jobs
            .unwrap_or_else(|| std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN))
    }
}

/// Name of the variable that names the folder for results.
const OUT_VARIABLE: &str = "MONORIG_OUT";

/// Folder for results.
#[derive(Clone, Debug, clap::Args)]
pub struct Out {
    /// Folder the results go to [default: the variable MONORIG_OUT, else runs]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Out {
    /// Which.
    pub fn get(&self) -> PathBuf {
        let variable = || std::env::var_os(OUT_VARIABLE).filter(|dir| !dir.is_empty());
        let given = self.out.clone().or_else(|| variable().map(PathBuf::from));
        given.unwrap_or_else(|| "runs".into())
    }
}

/// Seeds as a scenario would write them.
pub fn seeds(text: &str) -> Result<String, String> {
    let yaml = if text.contains(',') {
        format!("[{text}]")
    } else {
        text.to_owned()
    };
    monorig_sim::config::scenario::Seeds::parse(&yaml)?;
    Ok(yaml)
}

/// A change to a scenario, as `PATH=VALUE`.
pub fn assignment(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((path, value)) if !path.trim().is_empty() => {
            Ok((path.trim().to_owned(), value.to_owned()))
        }
        _ => Err("write PATH=VALUE, such as load.mass_kg=5000".to_owned()),
    }
}
