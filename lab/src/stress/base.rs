//! A scenario to which conditions are applied, with its estimators side by side.

use crate::stress::Condition;
use crate::verdicts::expected;
use monorig_estimators::api::signals::VehicleData;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::{Simulation, resolved};
use monorig_sim::config::file::{Sets, input_error};
use monorig_sim::config::scenario::{FeedForward, Scenario};
use monorig_sim::error::Error;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// A wanted estimator: its name and, if it was given, its type.
pub type WantedEstimator = (String, Option<String>);

/// A scenario to which conditions are applied.
pub(super) struct Base {
    pub(super) path: PathBuf,
    pub(super) name: String,
    /// Changes that all runs of the scenario have.
    changes: Vec<(String, String)>,
    pub(super) seeds: Vec<u64>,
    /// Nominal vehicle for the estimators without a condition.
    vehicle: VehicleData,
    pub(super) resolved: Value,
}

impl Base {
    /// Reads a scenario with these changes.
    pub(super) fn load(
        path: &Path,
        estimators: &[WantedEstimator],
        sets: &[(String, String)],
        registry: &Registry,
    ) -> Result<Self, Error> {
        let plain = Scenario::load(path, sets)?;
        if plain.file.estimators.is_empty() && estimators.is_empty() {
            let help = "name estimators with --estimators or in the scenario";
            return Err(input_error(
                path,
                "estimators",
                "no estimator is given to try",
                help,
            ));
        }
        let mut changes = sets.to_vec();
        changes.extend(side_by_side(&plain, estimators)?);
        let scenario =
            Scenario::load_with(path, &Sets::new(&changes).written_in("monorig stress"))?;
        expected::check(&scenario)?;
        let resolved = resolved(&scenario, registry);
        let seeds = scenario.seeds().to_vec();
        let name = scenario.name.clone();
        // what is told by a factor is told of the truth, whatever a seed would draw
        let mut exactly = changes.clone();
        exactly.push((
            "vehicle.exact.all".into(),
            "a factor applies to the true value".into(),
        ));
        let exactly = Scenario::load_with(path, &Sets::new(&exactly).written_in("monorig stress"))?;
        let simulation = Simulation::build(exactly, registry, seeds.first().copied().unwrap_or(1))?;
        Ok(Self {
            path: path.into(),
            name,
            changes,
            seeds,
            vehicle: simulation.vehicle.data(),
            resolved,
        })
    }

    /// Names of the estimators of the scenario.
    pub(super) fn estimators(&self) -> Vec<String> {
        let all = self.resolved.pointer("/parameters/estimators");
        let names = all
            .and_then(Value::as_object)
            .into_iter()
            .flat_map(|m| m.keys());
        names.cloned().collect()
    }

    /// Changes of a run.
    pub(super) fn sets(&self, condition: Option<&Condition>) -> Sets {
        let mut changes = self.changes.clone();
        let Some(condition) = condition else {
            return Sets::new(&changes).written_in("monorig stress");
        };
        changes.extend(condition.changes(&self.vehicle));
        Sets::new(&changes).written_in(&condition.file_name())
    }

    /// Checks the scenario under a condition.
    pub(super) fn check(&self, condition: &Condition, registry: &Registry) -> Result<(), Error> {
        let scenario = Scenario::load_with(&self.path, &self.sets(Some(condition)))?;
        let seed = self.seeds.first().copied().unwrap_or(1);
        Simulation::build(scenario, registry, seed).map(drop)
    }
}

/// The changes that put estimators side by side: all see the same measurements, so that none of them is in the loop.
/// The feed-forward of the controller comes from the truth where it came from an estimate. Expectations are of the
/// scenario without a condition, and go.
fn side_by_side(
    scenario: &Scenario,
    estimators: &[WantedEstimator],
) -> Result<Vec<(String, String)>, Error> {
    let mut changes = vec![
        ("in_loop".to_owned(), "null".to_owned()),
        ("expect".to_owned(), "[]".to_owned()),
        ("known_failures".to_owned(), "[]".to_owned()),
        ("integrity.reference_only".to_owned(), "[]".to_owned()),
    ];
    if scenario.file.drive.controller.feedforward == FeedForward::Estimate {
        changes.push(("drive.controller.feedforward".into(), "truth".into()));
    }
    if estimators.is_empty() {
        return Ok(changes);
    }
    let mut wanted = serde_json::Map::new();
    for (name, is) in estimators {
        let settings = match scenario.file.estimators.get(name) {
            Some(there) if is.as_ref().is_none_or(|is| is == there.type_name(name)) => json!(there),
            Some(there) => {
                return Err(scenario.error(
                    format!("estimators.{name}"),
                    format!("`{name}` is {} in this scenario", there.type_name(name)),
                    "another name before the `=`",
                ));
            }
            None => match is {
                Some(is) => json!({ "is": is }),
                None => json!({}),
            },
        };
        wanted.insert(name.clone(), settings);
    }
    changes.push(("estimators".into(), Value::Object(wanted).to_string()));
    Ok(changes)
}
