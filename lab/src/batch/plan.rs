//! The runs of a study file.

use crate::batch::{RunSpec, StudyFile};
use crate::campaign::{Campaign, CampaignKind, RunList};
use crate::verdicts::expected;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::{Simulation, SimulationBuilder, resolved};
use monorig_sim::config::checked::Version1;
use monorig_sim::config::file::{Document, Sets, name_of, named};
use monorig_sim::config::input_files::InputFiles;
use monorig_sim::config::scenario::Scenario;
use monorig_sim::error::Error;
use monorig_sim::record::identity::Identity;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Largest number of runs; a larger number counts as a typing error.
const MAX_RUNS: u64 = 10_000_000;

/// A checked study.
#[derive(Clone, Debug)]
pub struct Plan {
    /// File name without its ending.
    pub name: String,
    /// Contents of the file.
    pub(crate) file: StudyFile,
    path: PathBuf,
    scenario: PathBuf,
    /// Changes of the command line.
    sets: Vec<(String, String)>,
    inputs: InputFiles,
    /// The scenario of the first run with all defaults.
    resolved: Value,
}

impl Plan {
    /// Read a study, and check it by building the simulation of its first run. Every file that one of its runs may
    /// need is read here and never again.
    pub fn load(path: &Path, registry: &Registry) -> Result<Self, Error> {
        let inputs = InputFiles::default();
        inputs.during(|| Self::read(path, registry, inputs.clone()))
    }

    /// Plans the runs of a scenario with its seeds, changed by `sets`, at every point of a grid of values.
    pub fn sweep(
        scenario: &Path,
        sets: &[(String, String)],
        grid: BTreeMap<String, Vec<Value>>,
        registry: &Registry,
    ) -> Result<Self, Error> {
        let inputs = InputFiles::default();
        inputs.during(|| {
            let document = Document::read(scenario)?;
            let checked = Scenario::load_with(scenario, &Sets::new(sets))?;
            let seeds = checked.seeds();
            if seeds.windows(2).any(|two| two[1] != two[0] + 1) {
                let message = "a sweep needs consecutive seeds";
                return Err(document.error(
                    "seeds",
                    message,
                    "use --seeds with a range, such as 1..5",
                ));
            }
            let name = scenario.file_name().unwrap_or_default().to_string_lossy();
            let file = StudyFile {
                version: Version1,
                why: "A sweep.".into(),
                scenario: name.into_owned(),
                runs: seeds.len() as u64,
                first_seed: seeds.first().copied().unwrap_or_default(),
                set: BTreeMap::new(),
                vary: Vec::new(),
                grid,
            };
            Self::checked(scenario, document, file, sets, registry, inputs.clone())
        })
    }

    fn read(path: &Path, registry: &Registry, inputs: InputFiles) -> Result<Self, Error> {
        let document = Document::read(path)?;
        let file: StudyFile = document.parse()?;
        Self::checked(path, document, file, &[], registry, inputs)
    }

    fn checked(
        path: &Path,
        document: Document,
        file: StudyFile,
        sets: &[(String, String)],
        registry: &Registry,
        inputs: InputFiles,
    ) -> Result<Self, Error> {
        if file.why.trim().is_empty() {
            return Err(document.error(
                "why",
                "a study needs a purpose",
                "write a sentence: what the study shows",
            ));
        }
        if !(1..=MAX_RUNS).contains(&file.runs) || file.first_seed.checked_add(file.runs).is_none()
        {
            return Err(document.error(
                "runs",
                format!(
                    "{} runs cannot be made from seed {} on",
                    file.runs, file.first_seed
                ),
                format!("from 1 to {MAX_RUNS} runs"),
            ));
        }
        let runs = file
            .points()
            .and_then(|points| points.checked_mul(file.runs));
        if runs.is_none_or(|n| n > MAX_RUNS) {
            let help = format!("use one value or more for each path, and at most {MAX_RUNS} runs");
            return Err(document.error("grid", "this grid cannot be run", help));
        }
        for (i, vary) in file.vary.iter().enumerate() {
            let key = format!("vary[{i}]");
            vary.check()
                .map_err(|(message, help)| document.error(&key, message, help))?;
            let earlier = file.vary.iter().take(i).flat_map(|v| v.paths());
            let mut taken = earlier.chain(file.set.keys()).chain(file.grid.keys());
            if let Some(twice) = vary.paths().find(|p| taken.any(|t| t == *p)) {
                return Err(document.error(
                    key,
                    format!("`{twice}` is changed twice"),
                    "change each path only once: in `set` or in one variable",
                ));
            }
        }
        let scenario = named(path, "scenario", &file.scenario)?;
        let mut plan = Self {
            name: name_of(path)?,
            sets: sets.to_vec(),
            file,
            path: path.into(),
            scenario,
            inputs,
            resolved: Value::Null,
        };
        let first = plan.spec(0);
        let checked = Scenario::load_with(&first.scenario, &first.changes)?;
        expected::check(&checked)?;
        plan.resolved = resolved(&checked, registry);
        Simulation::build(checked, registry, first.seed)?;
        plan.read_choices();
        plan.inputs.seal();
        Ok(plan)
    }

    /// Reads the files that a choice may name instead of the files of the first run. What is wrong with one is the
    /// result of its runs.
    fn read_choices(&self) {
        let choices = self.file.vary.iter().map(|vary| {
            let values = vary.choice.iter().flatten();
            (vary.paths().collect::<Vec<_>>(), values.collect::<Vec<_>>())
        });
        let grid = self.file.grid.iter();
        let grid = grid.map(|(path, values)| (vec![path], values.iter().collect()));
        for (paths, values) in choices.chain(grid) {
            let names = |v: &&&Value| v.is_string() || v.is_array() || v.is_object();
            for value in values.iter().filter(names) {
                let mut changes = self.fixed();
                changes.extend(paths.iter().map(|p| ((*p).clone(), value.to_string())));
                let changes = Sets::new(&changes);
                let _ = Scenario::load_with(&self.scenario, &changes)
                    .and_then(SimulationBuilder::from_scenario);
            }
        }
    }

    /// Changes that are the same in all runs.
    fn fixed(&self) -> Vec<(String, String)> {
        let fixed = self.file.set.iter();
        let fixed = fixed.map(|(path, v)| (path.clone(), v.to_string()));
        fixed.chain(self.sets.iter().cloned()).collect()
    }

    /// Files of the study with the content that was read.
    pub fn inputs(&self) -> &InputFiles {
        &self.inputs
    }

    /// Number of runs.
    pub fn runs(&self) -> u64 {
        self.file.runs * self.file.points().unwrap_or_default()
    }

    /// The run of this index.
    pub fn spec(&self, index: u64) -> RunSpec {
        let seed = self.file.first_seed + index % self.file.runs;
        let mut changes = self.fixed();
        let draws = self.file.values(index, seed);
        let also = self.file.vary.iter().flat_map(|vary| {
            let value = draws.get(&vary.path);
            vary.also.iter().filter_map(move |p| Some((p, value?)))
        });
        let all = draws.iter().chain(also);
        changes.extend(all.map(|(path, value)| (path.clone(), value.to_string())));
        let file = self.path.file_name().unwrap_or_default().to_string_lossy();
        let changes = Sets::new(&changes).written_in(match self.path == self.scenario {
            true => "--vary",
            false => &file,
        });
        RunSpec {
            draws,
            ..RunSpec::new(index, &self.scenario, seed, changes, &self.inputs)
        }
    }

    /// Campaign of these runs, with this program as its maker.
    pub fn campaign(&self, monorig: &Identity) -> Campaign {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let (inputs, file) = (self.inputs.digests(folder), &self.file);
        let resolved = json!({ "study": file, "first_run": self.resolved });
        let stem = self.scenario.file_stem().unwrap_or_default();
        let points = 0..file.points().unwrap_or_default();
        let seeds = points.flat_map(|_| file.first_seed..file.first_seed + file.runs);
        let list = RunList::new(&stem.to_string_lossy(), seeds);
        Campaign::new(
            CampaignKind::Study,
            &self.name,
            vec![list],
            monorig,
            inputs,
            resolved,
        )
    }
}
