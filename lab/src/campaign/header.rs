//! The header of a campaign: its list of runs, and the program, files and values they are made from. Results are only
//! added to others with an equal header.

use crate::campaign::Shard;
use crate::campaign::lines::Lines;
use crate::campaign::wrong;
use monorig_sim::error::Error;
use monorig_sim::record::identity::Identity;
use monorig_sim::record::manifest;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// Version of the format of these files.
const VERSION: u32 = 3;
/// Largest number of shards; a larger number counts as a mistake.
const MAX_SHARDS: u64 = 1_000_000;

/// Command that makes the runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CampaignKind {
    /// `monorig study`: a scenario with drawn values.
    Study,
    /// `monorig test`: scenarios over their seeds.
    Test,
    /// `monorig stress`: scenarios under conditions.
    Stress,
    /// `monorig tune`: trials of a search.
    Tune,
}

impl CampaignKind {
    /// The command.
    pub fn word(self) -> &'static str {
        match self {
            Self::Study => "study",
            Self::Test => "test",
            Self::Stress => "stress",
            Self::Tune => "tune",
        }
    }

    /// Advice to start again, in error messages.
    pub(crate) fn anew(self) -> &'static str {
        match self {
            Self::Tune => "start again with --restart",
            _ => "remove this file to start again",
        }
    }

    /// Advice for a wrong line, in error messages.
    pub(crate) fn again(self) -> String {
        match self {
            Self::Test => "make this shard again with `monorig test --shard`".to_owned(),
            _ => format!(
                "start the same `monorig {}` again: it continues an incomplete file; for an edited file: {}",
                self.word(),
                self.anew()
            ),
        }
    }
}

/// A scenario and its seeds.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunList {
    /// Name of the scenario.
    pub scenario: String,
    /// Condition of the runs.
    pub condition: Option<String>,
    /// Seeds in the order of the runs, as ranges with both ends included.
    seeds: Vec<[u64; 2]>,
    /// SHA-256 over the scenario's files and resolved values, if the campaign has many scenarios.
    hash: Option<String>,
}

impl RunList {
    /// Lists the runs of a scenario with these seeds.
    pub fn new(scenario: &str, seeds: impl IntoIterator<Item = u64>) -> Self {
        let mut ranges: Vec<[u64; 2]> = Vec::new();
        for seed in seeds {
            match ranges.last_mut() {
                Some([_, last]) if last.checked_add(1) == Some(seed) => *last = seed,
                _ => ranges.push([seed; 2]),
            }
        }
        Self {
            scenario: scenario.to_owned(),
            condition: None,
            seeds: ranges,
            hash: None,
        }
    }

    /// The list of the same runs under a condition.
    pub(crate) fn under(self, condition: &str) -> Self {
        Self {
            condition: Some(condition.to_owned()),
            ..self
        }
    }

    /// The list with the hash of the scenario.
    pub fn hashed(self, hash: String) -> Self {
        Self {
            hash: Some(hash),
            ..self
        }
    }

    /// Number of runs; `None` if a range has no run, or there are more than can be counted.
    fn checked_runs(&self) -> Option<u64> {
        let mut ranges = self.seeds.iter();
        ranges.try_fold(0_u64, |sum, [first, last]| {
            sum.checked_add(last.checked_sub(*first)?.checked_add(1)?)
        })
    }

    /// Number of runs.
    pub fn runs(&self) -> u64 {
        self.checked_runs().unwrap_or(0)
    }

    /// Seeds in the order of the runs.
    pub(crate) fn seeds(&self) -> impl Iterator<Item = u64> {
        self.seeds.iter().flat_map(|[first, last]| *first..=*last)
    }

    /// The seed of run `n`, from 0.
    fn seed(&self, mut n: u64) -> Option<u64> {
        self.seeds.iter().find_map(|[first, last]| {
            let found = (n <= last - first).then(|| first + n);
            n = n.saturating_sub(last - first + 1);
            found
        })
    }
}

/// A run of a list of runs.
#[derive(Clone, Copy, Debug)]
pub struct PlannedRun<'a> {
    /// The runs of the same scenario.
    pub list: &'a RunList,
    /// Place of this list among the lists.
    pub(crate) of: usize,
    /// Place among the runs of the same scenario.
    pub(crate) place: u64,
    /// Seed.
    pub(crate) seed: u64,
}

impl<'a> PlannedRun<'a> {
    /// Finds the run of this index.
    pub(crate) fn find(lists: &'a [RunList], index: u64) -> Option<Self> {
        let mut place = index;
        for (of, list) in lists.iter().enumerate() {
            if let Some(seed) = list.seed(place) {
                return Some(Self {
                    list,
                    of,
                    place,
                    seed,
                });
            }
            place -= list.runs();
        }
        None
    }
}

/// A campaign, or a shard of one: the first line of its file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Campaign {
    /// Kind of the campaign.
    #[serde(rename = "campaign")]
    pub kind: CampaignKind,
    /// Format version, 3.
    version: u32,
    /// Name.
    pub name: String,
    /// Every run of the whole campaign.
    pub list: Vec<RunList>,
    /// Part of the runs in this file; without this key all runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    shard: Option<Shard>,
    /// The program.
    pub monorig: Identity,
    /// SHA-256 of every file that was read, by name relative to the folder of the study.
    inputs: BTreeMap<String, String>,
    /// Values of the files with all defaults filled in, including the defaults of parameters.
    pub(crate) resolved: Value,
    /// SHA-256 over program, files, values and list.
    pub hash: String,
}

impl Campaign {
    /// Makes a whole campaign. The hash is equal for the same program, files, values and list.
    pub fn new(
        kind: CampaignKind,
        name: &str,
        list: Vec<RunList>,
        monorig: &Identity,
        inputs: BTreeMap<String, String>,
        resolved: Value,
    ) -> Self {
        let mut made = Self {
            kind,
            version: VERSION,
            name: name.to_owned(),
            list,
            shard: None,
            monorig: monorig.clone(),
            inputs,
            resolved,
            hash: String::new(),
        };
        made.hash = made.computed_hash();
        made
    }

    /// Makes the shard of a machine.
    pub fn part(self, shard: Option<Shard>) -> Self {
        let shard = shard.filter(|shard| *shard != Shard::WHOLE);
        Self { shard, ..self }
    }

    fn computed_hash(&self) -> String {
        let values = json!([self.list, self.resolved]);
        manifest::hash(&self.monorig, &self.inputs, &values)
    }

    /// Opens a file of results and reads its first line.
    pub(crate) fn open(path: &Path) -> Result<(Self, Lines), Error> {
        let mut lines = Lines::open(path)?;
        let first = lines.read()?.map(|line| line.bytes).unwrap_or_default();
        let found = serde_json::from_slice::<Self>(&first);
        let found = found.ok().filter(|c| c.version == VERSION);
        let refused = || {
            let help = "a file of JSON lines of `monorig study`, or of `monorig test` or `stress` with --shard and --json";
            wrong(
                path,
                Some(1),
                "these are not results of this version of monorig",
                help,
            )
        };
        Ok((found.ok_or_else(refused)?, lines))
    }

    /// Reads the first line of a file of results.
    pub fn read(path: &Path) -> Result<Self, Error> {
        Ok(Self::open(path)?.0)
    }

    /// Part of the runs in this file.
    pub(crate) fn shard(&self) -> Shard {
        self.shard.unwrap_or(Shard::WHOLE)
    }

    /// Paths of the values of a study's grid; empty without a grid.
    pub fn swept(&self) -> Vec<String> {
        let grid = self.resolved.pointer("/study/grid");
        let grid = grid.and_then(Value::as_object).into_iter();
        grid.flat_map(|grid| grid.keys().cloned()).collect()
    }

    /// Number of runs of the whole campaign.
    pub fn runs(&self) -> u64 {
        let runs = self.list.iter().map(RunList::runs);
        runs.fold(0, u64::saturating_add)
    }

    /// Number of runs of this part.
    pub fn rows(&self) -> u64 {
        self.shard().runs(self.runs())
    }

    /// The index of run number `n` of this part, from 0.
    pub fn index(&self, n: u64) -> u64 {
        self.shard().index(n)
    }

    /// Name of the file with its results.
    pub fn file_name(&self) -> String {
        match self.shard {
            None => "results.jsonl".to_owned(),
            Some(Shard { part, of }) => format!("results.{part}-of-{of}.jsonl"),
        }
    }

    /// Checks the header by itself. The error says what does not fit the rest of it.
    pub(crate) fn check(&self) -> Result<(), String> {
        if self.computed_hash() != self.hash {
            return Err(
                "its header was edited: its hash does not fit its program, inputs, values and runs"
                    .into(),
            );
        }
        let mut lists = self.list.iter();
        let runs = lists.try_fold(0_u64, |sum, list| sum.checked_add(list.checked_runs()?));
        let Shard { part, of } = self.shard();
        if runs.is_none() || of > MAX_SHARDS || !(1..=of).contains(&part) {
            return Err("its header was edited: runs and shard do not fit".into());
        }
        Ok(())
    }

    /// Finds the run of this index, which must be of this scenario and seed.
    pub(crate) fn is_run(
        &self,
        index: u64,
        scenario: &str,
        seed: u64,
    ) -> Result<PlannedRun<'_>, String> {
        match PlannedRun::find(&self.list, index) {
            Some(run) if (run.list.scenario.as_str(), run.seed) == (scenario, seed) => Ok(run),
            Some(run) => Err(format!(
                "this is not the result of run {index}: it is of {scenario} seed {seed}, and run {index} is of {} seed {}",
                run.list.scenario, run.seed
            )),
            None => Err(format!("the campaign has no run {index}")),
        }
    }

    /// Difference between the header of a file (`self`) and the header of new results. `None`: they are equal.
    pub(crate) fn differs(&self, here: &Self) -> Option<String> {
        if self == here {
            return None;
        }
        let of = |c: &Self| {
            let (kind, Shard { part, of }) = (c.kind.word(), c.shard());
            format!(
                "{kind} {} with {} runs, shard {part}/{of}",
                c.name,
                c.runs()
            )
        };
        let (there, wanted) = (of(self), of(here));
        let mut found: Vec<String> = self.monorig.differs(&here.monorig).into_iter().collect();
        found.extend((there != wanted).then(|| format!("{there} there, {wanted} here")));
        for (name, digest) in &here.inputs {
            match self.inputs.get(name) {
                Some(same) if same == digest => {}
                Some(_) => found.push(format!("{name} has changed")),
                None => found.push(format!("{name} is new")),
            }
        }
        let gone = self.inputs.keys().filter(|n| !here.inputs.contains_key(*n));
        found.extend(gone.map(|name| format!("{name} is no longer read")));
        found.extend(differing(&self.resolved, &here.resolved, ""));
        let both = self.list.iter().zip(&here.list);
        let other = both
            .filter(|(a, b)| a != b)
            .map(|(a, _)| a.scenario.as_str());
        let other: Vec<&str> = other.collect();
        let names = |c: &Self| {
            c.list
                .iter()
                .map(|l| l.scenario.clone())
                .collect::<Vec<_>>()
        };
        if names(self) != names(here) {
            found.push("other scenarios".into());
        } else if !other.is_empty() {
            found.push(format!(
                "files, values or seeds of {} have changed",
                other.join(", ")
            ));
        }
        if found.is_empty() {
            found.push("its header was edited".into()); // the hash fits nothing else in it
        }
        let more = found.len().saturating_sub(MAX_LISTED);
        found.truncate(MAX_LISTED);
        if more > 0 {
            found.push(format!("{more} more"));
        }
        Some(found.join("; "))
    }
}

/// Largest number of differences in a message; the others are counted.
const MAX_LISTED: usize = 6;

/// The first value that differs, as its path and both values.
fn differing(there: &Value, here: &Value, path: &str) -> Option<String> {
    let below = |key: &str| match path {
        "" => key.to_owned(),
        _ => format!("{path}.{key}"),
    };
    match (there, here) {
        (a, b) if a == b => None,
        (Value::Object(a), Value::Object(b)) => a
            .keys()
            .chain(b.keys().filter(|key| !a.contains_key(*key)))
            .find_map(|key| {
                let (a, b) = (a.get(key), b.get(key));
                let null = Value::Null;
                differing(a.unwrap_or(&null), b.unwrap_or(&null), &below(key))
            }),
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            let both = a.iter().zip(b).enumerate();
            both.into_iter()
                .find_map(|(i, (a, b))| differing(a, b, &format!("{path}[{i}]")))
        }
        (a, b) => Some(format!("{path} {} there, {} here", brief(a), brief(b))),
    }
}

fn brief(value: &Value) -> String {
    const LONGEST: usize = 60;
    let text = value.to_string();
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_is_told_by_name() {
        let identity = Identity::of_program(Some("abc"));
        let inputs = |digests: &[(&str, &str)]| -> BTreeMap<String, String> {
            let all = digests.iter();
            all.map(|(n, d)| ((*n).to_owned(), (*d).to_owned()))
                .collect()
        };
        let make = |monorig: &Identity, digests: &[(&str, &str)], value: u32, seeds: &[u64]| {
            let (list, values) = (
                vec![RunList::new("hill", seeds.iter().copied())],
                json!({"a": {"b": [1, value]}}),
            );
            Campaign::new(
                CampaignKind::Study,
                "s",
                list,
                monorig,
                inputs(digests),
                values,
            )
        };
        let both = [("x", "1"), ("y", "2")];
        let there = make(&identity, &both, 2, &[1, 2]);
        assert_eq!(there.differs(&there.clone()), None);
        assert!(there.check().is_ok());
        let other = Identity::of_program(Some("abd"));
        let edited = Campaign {
            hash: String::new(),
            ..there.clone()
        };
        assert!(edited.check().is_err());
        for (here, told) in [
            (
                make(&other, &both, 2, &[1, 2]),
                "git revision abc there, abd here",
            ),
            (
                make(&identity, &[("x", "3"), ("z", "2")], 2, &[1, 2]),
                "x has changed; z is new; y is no longer read",
            ),
            (make(&identity, &both, 3, &[1, 2]), "a.b[1] 2 there, 3 here"),
            (
                make(&identity, &both, 2, &[1, 4]),
                "files, values or seeds of hill have changed",
            ),
            (
                there.clone().part(Some(Shard { part: 1, of: 3 })),
                "study s with 2 runs, shard 1/1 there, study s with 2 runs, shard 1/3 here",
            ),
            (edited, "its header was edited"),
        ] {
            assert_eq!(there.differs(&here).unwrap(), told);
        }
    }

    #[test]
    fn the_seeds_of_a_list_come_back_in_their_order() {
        let seeds = [5, 6, 7, 3, 9, 10, u64::MAX, 0];
        let list = RunList::new("hill", seeds);
        assert_eq!((list.seeds.len(), list.runs()), (5, 8));
        let back: Vec<u64> = (0..9).filter_map(|n| list.seed(n)).collect();
        assert_eq!(back, seeds);
        assert_eq!(RunList::new("hill", 5..5).runs(), 0);
    }
}
