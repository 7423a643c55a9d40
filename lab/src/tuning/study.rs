//! The study file, and the study read from it.

use crate::campaign::{Campaign, CampaignKind, RunList};
use monorig_estimators::api::params::Setting;
use monorig_sim::closed_loop::registry::{EstimatorType, Refusal, Registry};
use monorig_sim::closed_loop::resolved;
use monorig_sim::config::checked::{Finite, Fraction, NonNegative, Positive, Version1};
use monorig_sim::config::file::{Document, Sets, name_of, named, read_library};
use monorig_sim::config::input_files::InputFiles;
use monorig_sim::config::scenario::{ParameterValue, Scenario, Seeds, Settings};
use monorig_sim::error::Error;
use monorig_sim::record::identity::Identity;
use schemars::JsonSchema;
use serde::de::{Error as _, IntoDeserializer};
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// Parameter values by name.
pub(crate) type Values = BTreeMap<String, ParameterValue>;

/// A tuning study.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "StudyFile")]
pub struct TuningFile {
    /// Format version, 1.
    pub(crate) version: Version1,
    /// Purpose of the study.
    pub(crate) why: String,
    /// The estimator to tune: its name in the scenarios.
    pub(crate) estimator: String,
    /// Type of the estimator, if its name is not a type.
    pub(crate) is: Option<String>,
    /// Shared library with the estimator, relative to the study.
    pub(crate) library: Option<String>,
    /// FMU with the estimator, relative to the study.
    pub(crate) fmu: Option<String>,
    /// Names in the FMU that replace monorig's names, and numbers that replace missing standard deviations.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) map: BTreeMap<String, ParameterValue>,
    /// Varied parameters and their ranges.
    pub(crate) parameters: BTreeMap<String, Range>,
    /// Parameters with a fixed value other than their default in every trial.
    #[serde(default)]
    pub(crate) fixed: BTreeMap<String, ParameterValue>,
    /// Published constants to compare with (parameters of `parameters` that are missing here keep their default).
    #[serde(default)]
    pub published: BTreeMap<String, ParameterValue>,
    /// Tuning runs, which the optimiser uses.
    pub(crate) tuning: Vec<Runs>,
    /// Validation runs, which the optimiser never uses: there the winner is held against the defaults and the published
    /// constants.
    pub(crate) validation: Vec<Runs>,
    /// Objective that the search minimises.
    pub(crate) objective: Objective,
    /// Bounds that each tuning scenario must hold in the mean over its seeds.
    #[serde(default)]
    pub(crate) constraints: Vec<Constraint>,
    /// Share of the defaults' valid samples that must stay valid: errors count valid samples only, so without this a
    /// trial could win by marking hard samples invalid.
    #[serde(default = "keep_valid")]
    pub(crate) keep_valid: Fraction,
    /// Optimiser that chooses the trials.
    #[serde(default, deserialize_with = "optimiser")]
    pub(crate) optimiser: Optimiser,
    /// Number of trials, including the defaults and the published constants.
    pub(crate) budget: u32,
    /// Seed of the optimiser.
    #[serde(default = "one")]
    pub(crate) seed: u64,
    /// Method of running a trial.
    #[serde(default)]
    pub(crate) evaluation: Evaluation,
    /// Resolution of the curves around the winner.
    #[serde(default)]
    pub(crate) sensitivity: SensitivityPoints,
}

/// The values a parameter may have: `from` … `to`, or one of `choices`.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Range {
    /// Smallest value.
    pub(crate) from: Option<Finite>,
    /// Largest value.
    pub(crate) to: Option<Finite>,
    /// Scale of the values between the ends.
    pub(crate) scale: Scale,
    /// True for whole numbers only.
    pub(crate) integer: bool,
    /// The values to try: numbers, words of a choice, or true and false.
    pub(crate) choices: Option<Vec<ParameterValue>>,
}

/// Scale of the values in a range.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Scale {
    /// Evenly.
    #[default]
    Linear,
    /// Evenly in the logarithm.
    Log,
    /// Evenly in the logarithm of the memory 1/(1 − x): for forgetting factors.
    Memory,
}

/// Place of a value on the scale.
pub(crate) fn bend(scale: Scale, x: f64) -> f64 {
    match scale {
        Scale::Linear => x,
        Scale::Log => x.ln(),
        Scale::Memory => -(1.0 - x).ln(),
    }
}

/// Value at a place on the scale.
pub(crate) fn unbend(scale: Scale, y: f64) -> f64 {
    match scale {
        Scale::Linear => y,
        Scale::Log => y.exp(),
        Scale::Memory => 1.0 - (-y).exp(),
    }
}

/// The value of a parameter that is a number.
pub(crate) fn as_number(value: &ParameterValue) -> Option<f64> {
    match value {
        ParameterValue::Number(x) => Some(x.get()),
        _ => None,
    }
}

/// Seeds of a scenario.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Runs {
    /// Scenario file, relative to this file.
    pub(crate) scenario: String,
    /// Changes to it, as `--set` makes them: path and value.
    #[serde(default)]
    pub(crate) set: BTreeMap<String, serde_json::Value>,
    /// Seeds.
    pub(crate) seeds: Seeds,
    /// Weight in the loss.
    #[serde(default = "weight")]
    pub(crate) weight: Positive,
}

/// Objective that the search minimises.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Objective {
    /// The metrics.
    pub(crate) metrics: Vec<Term>,
    /// Combination of metrics and scenarios to one number, or to several.
    #[serde(default)]
    pub(crate) combine: Combine,
}

impl Objective {
    /// Number of losses of a trial: one for each metric of a front.
    pub(crate) fn losses(&self) -> usize {
        match self.combine {
            Combine::Pareto => self.metrics.len(),
            _ => 1,
        }
    }
}

/// A metric of the objective.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Term {
    /// Its name.
    pub(crate) metric: String,
    /// Begin of the window, s.
    #[serde(default = "after_s")]
    pub(crate) after_s: NonNegative,
    /// End of the window, s; none = to the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) until_s: Option<Positive>,
    /// Weight in the loss.
    #[serde(default = "weight")]
    pub(crate) weight: Positive,
}

/// Combination of metrics and scenarios to one number, or to several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Combine {
    /// Weighted mean over scenarios and metrics.
    #[default]
    Weighted,
    /// The scenario in which the weighted mean over the metrics is worst.
    Worst,
    /// One number per metric, none traded for another: the result is a front.
    Pareto,
}

/// A bound on a metric.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Constraint {
    /// The metric.
    pub(crate) metric: String,
    /// Begin of the window, s.
    #[serde(default = "after_s")]
    pub(crate) after_s: NonNegative,
    /// End of the window, s; none = to the end.
    pub(crate) until_s: Option<Positive>,
    /// Upper bound.
    pub(crate) at_most: Option<Finite>,
    /// Lower bound.
    pub(crate) at_least: Option<Finite>,
}

/// Optimiser that chooses the trials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Optimiser {
    /// Covariance matrix adaptation evolution strategy (Hansen and Ostermeier 2001): the one to take.
    #[default]
    CmaEs,
    /// A grid over all parameters.
    Grid,
    /// Evenly at random: what others must beat.
    Random,
    /// Non-dominated sorting genetic algorithm (Deb et al. 2002): for `combine: pareto`.
    Nsga2,
}

/// Method of running a trial.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Evaluation {
    /// Over recorded measurements: for estimators beside the loop.
    #[default]
    Replay,
    /// The complete simulation again for every trial: for the estimator in the loop.
    ClosedLoop,
}

/// Resolution of the curves around the winner.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct SensitivityPoints {
    /// Points of each curve; 0 = no curves.
    pub(crate) curve: u32,
}

impl Default for SensitivityPoints {
    fn default() -> Self {
        Self { curve: 9 }
    }
}

/// Removed optimisers and their replacements.
const REMOVED: [(&str, &str); 4] = [
    ("nelder_mead", "`cma_es`"),
    ("differential_evolution", "`cma_es`"),
    ("bayesian", "`cma_es`, with a budget of 50 or more"),
    ("tpe", "`cma_es`; `random` for choices only"),
];

/// Reads an optimiser. A removed one is refused with the one to take.
fn optimiser<'de, D: Deserializer<'de>>(from: D) -> Result<Optimiser, D::Error> {
    let name = String::deserialize(from)?;
    if let Some((_, instead)) = REMOVED.iter().find(|r| r.0 == name) {
        let message = format!("the optimiser `{name}` was removed; write {instead}");
        return Err(D::Error::custom(message));
    }
    Optimiser::deserialize(name.into_deserializer())
}

fn keep_valid() -> Fraction {
    Fraction::new(0.95)
}

fn one() -> u64 {
    1
}

fn weight() -> Positive {
    Positive::new(1.0)
}

fn after_s() -> NonNegative {
    NonNegative::new(crate::verdicts::summary::AFTER_S)
}

/// Seeds of a scenario, loaded.
#[derive(Clone, Debug)]
pub(crate) struct RunGroup {
    /// The scenario with its changes.
    pub(crate) scenario: Scenario,
    /// Its seeds.
    pub(crate) seeds: Vec<u64>,
    /// Weight in the loss.
    pub(crate) weight: f64,
}

/// A study, read and checked.
#[derive(Clone, Debug)]
pub struct TuningStudy {
    /// File name without its ending.
    pub name: String,
    /// Contents of the file.
    pub file: TuningFile,
    /// Tuning runs, which the optimiser uses.
    pub(crate) tuning: Vec<RunGroup>,
    /// Validation runs, which the optimiser never uses.
    pub(crate) validation: Vec<RunGroup>,
    /// The type of the estimator to tune.
    pub(crate) of: EstimatorType,
    /// The estimator in the form of a scenario, with its defaults.
    untuned: Settings,
    /// Registry of estimators and controllers.
    pub(crate) registry: Registry,
    document: Document,
    inputs: InputFiles,
}

impl TuningStudy {
    /// Reads a study and every scenario it names; the files go into `inputs`.
    pub(super) fn read(
        path: &Path,
        registry: &Registry,
        inputs: &InputFiles,
    ) -> Result<Self, Error> {
        let document = Document::read(path)?;
        let file: TuningFile = document.parse()?;
        let is = file.is.as_deref();
        let mut untuned = is.map_or_else(Settings::default, Settings::of_type);
        let part = |key: &'static str, name: &Option<String>| -> Result<_, Error> {
            let Some(name) = name else { return Ok(None) };
            let found = named(path, key, name)?;
            read_library(&found)?;
            Ok(Some((name.clone(), found)))
        };
        let mut key = is.map_or("estimator", |_| "is");
        if let Some((name, found)) = part("library", &file.library)? {
            (key, untuned) = ("library", untuned.in_library(&name, found));
        }
        if let Some((name, found)) = part("fmu", &file.fmu)? {
            if key == "library" {
                let why = "an estimator is in a library or in an FMU, not in both";
                return Err(document.error("fmu", why, "keep only one of the two"));
            }
            (key, untuned) = ("fmu", untuned.in_fmu(&name, found));
        }
        if !file.map.is_empty() && file.fmu.is_none() {
            let why = "`map` needs `fmu`: it gives the names in an FMU";
            return Err(document.error("map", why, "remove `map`, or name the FMU"));
        }
        untuned.map = file.map.clone();
        let of = registry
            .estimator_of(&file.estimator, &untuned)
            .map_err(|w| document.error(key, w.message, w.help))?;
        let groups = |list: &[Runs], key: &str| -> Result<Vec<RunGroup>, Error> {
            let load = |(i, runs): (usize, &Runs)| {
                let at = named(path, &format!("{key}[{i}].scenario"), &runs.scenario)?;
                let set: Vec<(String, String)> = runs
                    .set
                    .iter()
                    .map(|(path, value)| (path.clone(), value.to_string()))
                    .collect();
                let file = path.file_name().unwrap_or_default().to_string_lossy();
                let set = Sets::new(&set).written_in(&format!("{key}[{i}].set of {file}"));
                Ok(RunGroup {
                    scenario: Scenario::load_with(&at, &set)?,
                    seeds: runs.seeds.as_slice().to_vec(),
                    weight: runs.weight.get(),
                })
            };
            list.iter().enumerate().map(load).collect()
        };
        Ok(Self {
            name: name_of(path)?,
            tuning: groups(&file.tuning, "tuning")?,
            validation: groups(&file.validation, "validation")?,
            file,
            of,
            untuned,
            registry: registry.clone(),
            document,
            inputs: inputs.clone(),
        })
    }

    /// Campaign of the trials, with this program as its maker.
    pub(crate) fn campaign(&self, monorig: &Identity) -> Campaign {
        let all = |groups: &[RunGroup]| -> Vec<Value> {
            let each = groups.iter().map(|g| &g.scenario);
            each.map(|s| resolved(s, &self.registry)).collect()
        };
        let resolved = json!({
            "study": self.file,
            "defaults": self.defaults(),
            "tuning": all(&self.tuning),
            "validation": all(&self.validation),
        });
        let folder = self.document.path().parent().unwrap_or(Path::new(""));
        let inputs = self.inputs.digests(folder);
        let list = vec![RunList::new("trials", 0..u64::from(self.file.budget))];
        Campaign::new(
            CampaignKind::Tune,
            &self.name,
            list,
            monorig,
            inputs,
            resolved,
        )
    }

    /// Files of the study with the content that was read.
    pub(crate) fn inputs(&self) -> &InputFiles {
        &self.inputs
    }

    /// An error at a key of the study.
    pub(crate) fn error(&self, key: impl Into<String>, wrong: Refusal) -> Error {
        self.document.error(key, wrong.message, wrong.help)
    }

    /// An error at a key of the study: what is wrong, and what would be right.
    pub(crate) fn wrong(
        &self,
        key: impl Into<String>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Error {
        self.document.error(key, message, help)
    }

    /// Defaults of the varied parameters; parameters whose default the estimator derives from the vehicle are left out.
    pub fn defaults(&self) -> Values {
        let default = |key: &String| {
            let default = self.of.key(key).ok()?.default()?;
            Some((key.clone(), parameter_value(default)?))
        };
        self.file.parameters.keys().filter_map(default).collect()
    }

    /// True if a value lies at an end of the range of its parameter, to a ten-thousandth of the range: a better one may
    /// lie beyond.
    pub fn is_at_end(&self, name: &str, x: &ParameterValue) -> bool {
        let (Some(x), Some(range)) = (as_number(x), self.file.parameters.get(name)) else {
            return false;
        };
        let (Some(from), Some(to)) = (range.from, range.to) else {
            return false;
        };
        let [from, to, x] = [from.get(), to.get(), x].map(|x| bend(range.scale, x));
        let near = |end: f64| (x - end).abs() <= 1e-4 * (to - from).abs();
        near(from) || near(to)
    }

    /// The published constants, with other parameters at their defaults; `None` if the study has no published
    /// constants.
    pub(crate) fn published(&self) -> Option<Values> {
        if self.file.published.is_empty() {
            return None;
        }
        let mut all = self.defaults();
        let published = self.file.published.iter();
        all.extend(published.map(|(k, x)| (k.clone(), x.clone())));
        Some(all)
    }

    /// The estimator of a trial in the form of a scenario: its type, and `fixed` with the trial's values.
    pub(crate) fn settings(&self, values: &Values) -> Settings {
        let mut all = self.file.fixed.clone();
        all.extend(values.iter().map(|(k, x)| (k.clone(), x.clone())));
        let mut settings = self.untuned.clone();
        settings.values = all;
        settings
    }
}

/// A default in the form of a file; `None` if a file cannot have this value.
fn parameter_value(setting: Setting<'_>) -> Option<ParameterValue> {
    Some(match setting {
        Setting::Number(x) => ParameterValue::Number(Finite::try_from(x).ok()?),
        Setting::Flag(flag) => ParameterValue::Flag(flag),
        Setting::Choice(word) => ParameterValue::Choice(word.to_owned()),
    })
}

/// The tuning runs or the validation runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Tuning runs.
    Tuning,
    /// Validation runs.
    Validation,
}

impl Stage {
    /// Its runs.
    pub(crate) fn groups(self, study: &TuningStudy) -> &[RunGroup] {
        match self {
            Self::Tuning => &study.tuning,
            Self::Validation => &study.validation,
        }
    }

    /// Name for the progress.
    pub(crate) fn label(self) -> &'static str {
        match self {
            Self::Tuning => "tuning runs",
            Self::Validation => "validation runs",
        }
    }

    /// Group and seed of each run, in order.
    pub(crate) fn list(self, study: &TuningStudy) -> Vec<(usize, u64)> {
        let groups = self.groups(study).iter().enumerate();
        groups
            .flat_map(|(i, g)| g.seeds.iter().map(move |seed| (i, *seed)))
            .collect()
    }
}
