//! From a study file to its runs.

use crate::batch::{RunSpec, Shard, StudyFile};
use crate::verdicts::expected;
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::file::{Document, named};
use monorig_sim::config::scenario::Scenario;
use monorig_sim::error::Error;
use monorig_sim::record::inputs::inputs;
use monorig_sim::record::manifest::Manifest;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// More runs than this are taken for a typing error.
const MAX_RUNS: u64 = 10_000_000;

/// A checked study.
#[derive(Clone, Debug)]
pub struct Plan {
    /// File name without its ending.
    pub name: String,
    /// What the file says.
    pub file: StudyFile,
    scenario: PathBuf,
    hash: String,
}

/// The first line of a study's results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyHeader {
    /// What this file is: `monorig study`.
    pub format: String,
    /// Format version, 1.
    pub version: u32,
    /// Name of the study.
    pub study: String,
    /// How many runs the whole study has.
    pub runs: u64,
    /// Which of them are here; all if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shard: Option<Shard>,
    /// Version of monorig.
    pub monorig: String,
    /// SHA-256 over monorig's version, the study and every file it names, directly or not: the same hash is the same study.
    pub hash: String,
}

impl StudyHeader {
    /// As the first line of a file, without its end.
    pub fn to_line(&self) -> String {
        // Strings and whole numbers: nothing in here can fail to serialise.
        serde_json::to_string(self).unwrap_or_default()
    }
}

impl Plan {
    /// Read a study, and check it by building the simulation of its first run.
    pub fn load(path: &Path, registry: &Registry) -> Result<Self, Error> {
        let document = Document::read(path)?;
        let file: StudyFile = document.parse()?;
        if file.why.trim().is_empty() {
            return Err(document.error(
                "why",
                "a study says why it exists",
                "write a sentence: what it is to show",
            ));
        }
        if !(1..=MAX_RUNS).contains(&file.runs) || file.first_seed.checked_add(file.runs).is_none()
        {
            return Err(document.error(
                "runs",
                format!(
                    "{} runs from seed {} on cannot be made",
                    file.runs, file.first_seed
                ),
                format!("from 1 to {MAX_RUNS} runs"),
            ));
        }
        for (i, vary) in file.vary.iter().enumerate() {
            let key = format!("vary[{i}]");
            vary.check()
                .map_err(|(message, help)| document.error(&key, message, help))?;
            let earlier = file.vary.iter().take(i).flat_map(|v| v.paths());
            let mut taken = earlier.chain(file.set.keys());
            if let Some(twice) = vary.paths().find(|p| taken.any(|t| t == *p)) {
                return Err(document.error(
                    key,
                    format!("`{twice}` is changed twice"),
                    "once in `set`, or in one variable",
                ));
            }
        }
        let scenario = named(path, "scenario", &file.scenario)?;
        let stem = path.file_stem().unwrap_or_default();
        let mut plan = Self {
            name: stem.to_string_lossy().into_owned(),
            hash: String::new(),
            file,
            scenario,
        };
        let first = plan.spec(0);
        let checked = Scenario::load(&first.scenario, &first.overrides)?;
        expected::check(&checked)?;
        Simulation::build(checked, registry, first.seed)?;
        plan.hash = plan.fingerprint(path)?;
        Ok(plan)
    }

    /// How many runs.
    pub fn runs(&self) -> u64 {
        self.file.runs
    }

    /// The run of this index.
    pub fn spec(&self, index: u64) -> RunSpec {
        let seed = self.file.first_seed + index;
        let fixed = self.file.set.iter();
        let mut overrides: Vec<(String, String)> = fixed
            .map(|(path, v)| (path.clone(), v.to_string()))
            .collect();
        let mut draws = std::collections::BTreeMap::new();
        for vary in &self.file.vary {
            let value = vary.draw(seed);
            overrides.extend(vary.paths().map(|p| (p.clone(), value.to_string())));
            draws.insert(vary.path.clone(), value);
        }
        RunSpec {
            index,
            scenario: self.scenario.clone(),
            overrides,
            seed,
            draws,
            reference: None,
        }
    }

    /// The first line of its results.
    pub fn header(&self, shard: Shard) -> StudyHeader {
        StudyHeader {
            format: "monorig study".into(),
            version: 1,
            study: self.name.clone(),
            runs: self.file.runs,
            shard: (shard != Shard::WHOLE).then_some(shard),
            monorig: env!("CARGO_PKG_VERSION").into(),
            hash: self.hash.clone(),
        }
    }

    /// The files that the study and its scenario name, and those that a choice or a fixed change may name in their place.
    fn fingerprint(&self, path: &Path) -> Result<String, Error> {
        let mut files = inputs(path)?;
        let folder = self.scenario.parent().unwrap_or(Path::new(""));
        let choices = self
            .file
            .vary
            .iter()
            .flat_map(|v| v.choice.iter().flatten());
        for name in choices
            .chain(self.file.set.values())
            .filter_map(|v| v.as_str())
        {
            let chosen = folder.join(name);
            if chosen.extension().is_some() && chosen.is_file() {
                for (below, bytes) in inputs(&chosen)? {
                    files.insert(format!("{name}: {below}"), bytes);
                }
            }
        }
        let resolved = serde_json::to_value(&self.file).unwrap_or_default();
        Ok(Manifest::new(&self.name, self.file.first_seed, &files, resolved).hash)
    }
}
