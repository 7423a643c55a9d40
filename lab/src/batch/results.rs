//! The results of a study or a test as rows of their campaign: seed, scenario and drawn values follow from it.

use crate::batch::StudyFile;
use crate::campaign::{Campaign, CampaignRow, PlannedRun};
use crate::verdicts::run_result::RunResult;
use crate::verdicts::verdict::ScenarioVerdict;
use monorig_sim::error::Error;

impl CampaignRow for RunResult {
    /// The study; `None` for a test.
    type Plan = Option<StudyFile>;

    fn plan(campaign: &Campaign) -> Result<Self::Plan, String> {
        let Some(study) = campaign.resolved.get("study") else {
            return Ok(None);
        };
        let study: StudyFile = serde_json::from_value(study.clone())
            .map_err(|e| format!("its header has no study of monorig: {e}"))?;
        for vary in &study.vary {
            vary.check().map_err(|(message, _)| message)?;
        }
        Ok(Some(study))
    }

    fn check(&self, campaign: &Campaign, study: &Self::Plan, index: u64) -> Result<(), String> {
        let run = campaign.is_run(index, &self.scenario, self.seed)?;
        if self.index != run.place {
            let there = self.index;
            return Err(format!(
                "this is not the result of run {index}, but of run {there}"
            ));
        }
        let values = study
            .as_ref()
            .map(|study| study.values(run.place, self.seed));
        if self.draws != values.unwrap_or_default() {
            return Err(format!(
                "the drawn values differ from run {index} of the study"
            ));
        }
        self.check()
    }
}

/// Judges the scenarios of a test by the rows of its campaign, or of a shard.
pub fn judged(
    campaign: &Campaign,
    rows: impl Iterator<Item = Result<(String, RunResult), Error>>,
) -> Result<Vec<ScenarioVerdict>, Error> {
    let lists = campaign.list.iter();
    let mut all: Vec<_> = lists.map(|list| (&list.scenario, Vec::new())).collect();
    for (n, row) in (0..).zip(rows) {
        let (_, run) = row?;
        let planned = PlannedRun::find(&campaign.list, campaign.index(n));
        if let Some((_, runs)) = planned.and_then(|planned| all.get_mut(planned.of)) {
            runs.push(run);
        }
    }
    let verdicts = all.into_iter();
    Ok(verdicts
        .map(|(scenario, runs)| ScenarioVerdict::new(scenario, runs))
        .collect())
}
