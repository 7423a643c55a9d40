//! Shards of a test: each makes a part of the runs, `monorig merge` judges all of them.

use crate::batch::Shard;
use crate::verdicts::judgement::Totals;
use crate::verdicts::run_result::RunResult;
use crate::verdicts::verdict::ScenarioVerdict;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::resolved;
use monorig_sim::config::file::{input_error, read_result};
use monorig_sim::config::scenario::Scenario;
use monorig_sim::error::Error;
use monorig_sim::record::identity::Identity;
use monorig_sim::record::manifest;
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Description of the whole test: the same in all shards of one test, except for `shard`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShardHeader {
    /// The part.
    #[serde(flatten)]
    pub(crate) shard: Shard,
    /// The program, and the arithmetic of the machine.
    monorig: Identity,
    /// Every scenario of the test.
    scenarios: Vec<ShardScenario>,
}

/// A scenario of a sharded test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShardScenario {
    name: String,
    /// Seeds of the runs of all shards together, in the order of their indices.
    seeds: Vec<u64>,
    /// SHA-256 over the program, the files it was made from and what they come to.
    hash: String,
}

/// The file of a test, as far as it is read back.
#[derive(Deserialize)]
struct TestFile {
    kind: String,
    #[serde(default)]
    shard: Option<ShardHeader>,
    scenarios: Vec<ScenarioVerdict>,
}

impl ShardScenario {
    /// Describes a scenario as this program runs it over these seeds.
    pub fn new(
        scenario: &Scenario,
        seeds: &[u64],
        registry: &Registry,
        monorig: &Identity,
    ) -> Self {
        let inputs = scenario.input_digests();
        Self {
            name: scenario.name.clone(),
            seeds: seeds.to_vec(),
            hash: manifest::hash(monorig, &inputs, &resolved(scenario, registry)),
        }
    }
}

impl ShardScenario {
    /// Checks that a run is one of this scenario's, and that its verdicts follow from its numbers.
    fn check(&self, run: &RunResult) -> Result<(), String> {
        let seed = usize::try_from(run.index)
            .ok()
            .and_then(|i| self.seeds.get(i));
        if run.scenario != self.name || seed != Some(&run.seed) {
            return Err(format!(
                "run {} here is of {} seed {}, and not of {} with the seed of that run",
                run.index, run.scenario, run.seed, self.name
            ));
        }
        run.check()
    }
}

impl ShardHeader {
    /// Describes a part of a test of these scenarios.
    pub fn new(shard: Shard, monorig: Identity, scenarios: Vec<ShardScenario>) -> Self {
        Self {
            shard,
            monorig,
            scenarios,
        }
    }

    /// Difference from the test of another shard. `None`: it is the same test.
    fn differs(&self, first: &Self) -> Option<String> {
        if let Some(told) = self.monorig.differs(&first.monorig) {
            return Some(told);
        }
        if self.shard.of != first.shard.of {
            return Some(format!(
                "{} shards there, {} here",
                self.shard.of, first.shard.of
            ));
        }
        let names = |h: &Self| {
            h.scenarios
                .iter()
                .map(|s| s.name.clone())
                .collect::<Vec<_>>()
        };
        if names(self) != names(first) {
            return Some("other scenarios".into());
        }
        let both = self.scenarios.iter().zip(&first.scenarios);
        let other = both.filter(|(a, b)| a != b).map(|(a, _)| a.name.as_str());
        let other: Vec<&str> = other.collect();
        (!other.is_empty()).then(|| {
            format!(
                "files, values or seeds of {} have changed",
                other.join(", ")
            )
        })
    }
}

/// Verdicts and metrics as JSON; of a shard with what it is a part of.
pub fn json(
    verdicts: &[&ScenarioVerdict],
    monorig: &Identity,
    shard: Option<&ShardHeader>,
) -> serde_json::Value {
    let verdict = Totals::of(verdicts.iter().copied()).words();
    let mut all = json!({
        "version": 1,
        "kind": "test",
        "monorig": monorig.to_string(),
        "verdict": verdict,
        "scenarios": verdicts,
    });
    if let Some(shard) = shard {
        all["shard"] = json!(shard);
    }
    all
}

/// Puts the shards of a test together and judges every scenario of it. `to` names the file of the whole in error
/// messages.
pub fn merge_tests(parts: &[PathBuf], to: &Path) -> Result<Vec<ScenarioVerdict>, Error> {
    let mut first: Option<ShardHeader> = None;
    let mut seen: Vec<u64> = Vec::new();
    let mut runs: Vec<Vec<RunResult>> = Vec::new();
    for path in parts {
        let (header, verdicts) = read(path)?;
        let first = first.get_or_insert_with(|| header.clone());
        if let Some(what) = header.differs(first) {
            let message = format!("this is a shard of another test than the first file: {what}");
            let help =
                "name the shards of one test, made by one program on machines that compute alike";
            return Err(wrong(path, message, help));
        }
        if seen.contains(&header.shard.part) {
            let message = format!(
                "shard {}/{} is there twice",
                header.shard.part, first.shard.of
            );
            return Err(wrong(path, message, "name each shard once"));
        }
        seen.push(header.shard.part);
        runs.resize_with(first.scenarios.len(), Vec::new);
        for ((all, verdict), of) in runs.iter_mut().zip(verdicts).zip(&first.scenarios) {
            for run in &verdict.runs {
                of.check(run).map_err(|message| {
                    wrong(
                        path,
                        message,
                        "make this shard again with `monorig test --shard`",
                    )
                })?;
            }
            all.extend(verdict.runs);
        }
    }
    let Some(first) = first else {
        return Err(wrong(
            to,
            "there is nothing to merge".into(),
            "name the shards",
        ));
    };
    let mut verdicts = Vec::new();
    for (of, mut runs) in first.scenarios.iter().zip(runs) {
        runs.sort_by_key(|r| r.index);
        if !runs.iter().map(|r| r.index).eq(0..of.seeds.len() as u64) {
            let message = format!(
                "{}: {} of {} runs are here; shards {seen:?} of {}",
                of.name,
                runs.len(),
                of.seeds.len(),
                first.shard.of
            );
            return Err(wrong(
                parts.first().map_or(to, PathBuf::as_path),
                message,
                "name every shard once, 1/n to n/n",
            ));
        }
        verdicts.push(ScenarioVerdict::new(&of.name, runs));
    }
    Ok(verdicts)
}

fn read(path: &Path) -> Result<(ShardHeader, Vec<ScenarioVerdict>), Error> {
    let help = "a file that `monorig study`, or `monorig test --shard K/N --json FILE`, wrote";
    let text = read_result(path)?;
    let file: TestFile = serde_json::from_str(&text)
        .map_err(|e| wrong(path, format!("this is no shard of a test: {e}"), help))?;
    match file.shard {
        Some(shard) if file.kind == "test" && shard.scenarios.len() == file.scenarios.len() => {
            Ok((shard, file.scenarios))
        }
        _ => Err(wrong(path, "this is no shard of a test".into(), help)),
    }
}

fn wrong(path: &Path, message: String, help: &str) -> Error {
    input_error(path, "", message, help)
}
