//! A battery: the runs of scenarios without and under each of the conditions.

use crate::batch::{Interrupted, RunSpec, run_observed};
use crate::campaign::{Campaign, CampaignKind, PlannedRun, RunList};
use crate::stress::base::{Base, WantedEstimator};
use crate::stress::print::Print;
use crate::stress::{Classes, Condition, ConditionRow, NOMINAL, StressRun};
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::input_files::InputFiles;
use monorig_sim::error::Error;
use monorig_sim::record::identity::Identity;
use monorig_sim::record::manifest;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Scenarios to which a condition is applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pairing {
    /// All scenarios, which are also run without a condition.
    Every,
    /// The scenario at the same place in its list.
    OneByOne,
}

/// A checked battery.
pub struct Battery {
    conditions: Vec<Condition>,
    scenarios: Vec<Base>,
    estimators: Vec<String>,
    /// Places of scenario and condition of each list.
    cases: Vec<(usize, Option<usize>)>,
    lists: Vec<RunList>,
    inputs: InputFiles,
    /// Conditions that a scenario cannot have, with the reason.
    left_out: Vec<String>,
}

impl Battery {
    /// Reads scenarios and checks each of them under every condition by building its simulation. `sets` are changes to
    /// all scenarios. Every file that a run may need is read here and never again. A condition that some of the
    /// scenarios cannot have is left out of these; one that none can have is an error.
    pub fn load(
        scenarios: &[PathBuf],
        conditions: Vec<Condition>,
        pairing: Pairing,
        estimators: &[WantedEstimator],
        sets: &[(String, String)],
        registry: &Registry,
    ) -> Result<Self, Error> {
        let inputs = InputFiles::default();
        let of_files = inputs.clone();
        inputs.during(|| {
            let scenarios = scenarios
                .iter()
                .map(|path| Base::load(path, estimators, sets, registry))
                .collect::<Result<Vec<_>, Error>>()?;
            let names = match estimators {
                [] => scenarios.iter().flat_map(Base::estimators).collect(),
                named => named.iter().map(|(name, _)| name.clone()).collect(),
            };
            let mut battery = Self {
                conditions,
                scenarios,
                estimators: names,
                cases: Vec::new(),
                lists: Vec::new(),
                inputs: of_files,
                left_out: Vec::new(),
            };
            battery.estimators.sort();
            battery.estimators.dedup();
            battery.plan(pairing, registry)?;
            battery.inputs.seal();
            Ok(battery)
        })
    }

    /// Lists the runs: without a condition, then under each.
    fn plan(&mut self, pairing: Pairing, registry: &Registry) -> Result<(), Error> {
        let nominal = (pairing == Pairing::Every).then_some(None);
        for condition in nominal
            .into_iter()
            .chain((0..self.conditions.len()).map(Some))
        {
            let mut refused = None;
            let before = self.cases.len();
            for (scenario, base) in self.scenarios.iter().enumerate() {
                if pairing == Pairing::OneByOne && condition != Some(scenario) {
                    continue;
                }
                let under = condition.and_then(|i| self.conditions.get(i));
                if let Some(under) = under
                    && let Err(e) = base.check(under, registry)
                {
                    self.left_out
                        .push(format!("{} of {}: {e}", under.name, base.name));
                    refused = Some(under.refused(&base.name, &e));
                    continue;
                }
                self.cases.push((scenario, condition));
                let name = under.map_or(NOMINAL, |c| c.name.as_str());
                let list = RunList::new(&base.name, base.seeds.iter().copied());
                self.lists.push(list.under(name));
            }
            if let Some(e) = refused.filter(|_| self.cases.len() == before) {
                return Err(e);
            }
        }
        Ok(())
    }

    /// Conditions that a scenario cannot have, with the reason.
    pub fn left_out(&self) -> &[String] {
        &self.left_out
    }

    /// Names of the estimators, in alphabetical order.
    pub fn estimators(&self) -> &[String] {
        &self.estimators
    }

    /// Rows of the matrix: the nominal one, if it is run, then the conditions.
    pub fn rows(&self) -> Vec<ConditionRow> {
        let nominal = ConditionRow {
            condition: NOMINAL.into(),
            group: None,
            words: "no condition".into(),
            classes: Classes::new(),
            over_s: 0.0,
        };
        let of = |c: &Condition| ConditionRow {
            condition: c.name.clone(),
            group: Some(c.group()),
            words: c.words().into(),
            classes: c.classes().clone(),
            over_s: c.over_s(),
        };
        let is_run = self.cases.iter().any(|(_, condition)| condition.is_none());
        let nominal = is_run.then_some(nominal).into_iter();
        nominal.chain(self.conditions.iter().map(of)).collect()
    }

    /// Number of runs.
    pub fn runs(&self) -> u64 {
        self.lists.iter().map(RunList::runs).sum()
    }

    /// Makes the run of this index. None if there is none.
    pub fn run(
        &self,
        index: u64,
        registry: &Registry,
        go_on: &dyn Fn() -> bool,
    ) -> Result<Option<StressRun>, Interrupted> {
        let planned = PlannedRun::find(&self.lists, index);
        let found = planned.and_then(|run| {
            let (scenario, condition) = *self.cases.get(run.of)?;
            Some((run, self.scenarios.get(scenario)?, condition))
        });
        let Some((run, base, condition)) = found else {
            return Ok(None);
        };
        let condition = condition.and_then(|i| self.conditions.get(i));
        let changes = base.sets(condition);
        let spec = RunSpec::new(index, &base.path, run.seed, changes, &self.inputs);
        let mut print = Print::default();
        let result = run_observed(&spec, registry, go_on, &mut print)?;
        let name = condition.map_or(NOMINAL, |c| c.name.as_str());
        Ok(Some(StressRun::of(name, print.text(), result)))
    }

    /// Campaign of these runs, with this program as its maker.
    pub fn campaign(&self, monorig: &Identity) -> Campaign {
        let conditions = self.conditions.iter();
        let conditions: BTreeMap<&str, Value> = conditions
            .map(|c| (c.name.as_str(), json!(c.file)))
            .collect();
        let resolved = json!({
            "estimators": self.estimators,
            "rows": self.rows(),
            "conditions": conditions,
        });
        let folder = self.scenarios.first().and_then(|s| s.path.parent());
        let inputs = self.inputs.digests(folder.unwrap_or(Path::new("")));
        let lists = self.lists.iter().zip(&self.cases);
        let lists = lists.map(|(list, (scenario, _))| {
            let resolved = self.scenarios.get(*scenario).map(|s| &s.resolved);
            let hash = manifest::hash(monorig, &BTreeMap::new(), &json!(resolved));
            list.clone().hashed(hash)
        });
        Campaign::new(
            CampaignKind::Stress,
            "stress",
            lists.collect(),
            monorig,
            inputs,
            resolved,
        )
    }

    /// Files of scenarios and conditions with the content that was read.
    pub fn inputs(&self) -> &InputFiles {
        &self.inputs
    }
}
