//! The search: the optimiser proposes trials; those in the store are taken from it, new ones are run and added to it.
//!
//! A resumed study starts the optimiser anew; as its proposals and their losses are the same, it comes to where it
//! was in no time and goes on as if nothing had happened.

use crate::campaign::Store;
use crate::tuning::baseline::Baseline;
use crate::tuning::evaluate::Evaluator;
use crate::tuning::optimise::{self, Search, WORST};
use crate::tuning::progress::Progress;
use crate::tuning::space::Space;
use crate::tuning::study::TuningStudy;
use crate::tuning::study::Values;
use crate::tuning::trial_store::{Trial, vacant};
use monorig_sim::error::Error;
use monorig_sim::record::identity::Identity;
use monorig_sim::record::inputs;
use std::collections::HashMap;
use std::path::Path;

/// Loss that the optimiser gets for the best trials that break a constraint: no trial that keeps all of them is as bad.
const BROKEN: f64 = 2.0;

/// Treatment of existing trials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Begin {
    /// No trial may exist.
    #[default]
    New,
    /// The search continues after the existing trials.
    Resume,
    /// Existing trials are dropped.
    Restart,
}

/// End of a search.
#[derive(Clone, Debug)]
pub struct SearchResult {
    /// All trials.
    pub trials: Vec<Trial>,
    /// Index of the winner: least loss, the first of equals; none if every trial failed or broke a constraint.
    pub(crate) winner: Option<usize>,
    /// True if the budget was spent, false if the search was interrupted.
    pub(crate) finished: bool,
}

/// Searches over the tuning runs of `evaluator`, relative to their `baseline`; trials are kept in the file `store`, and
/// `begin` decides about existing trials.
pub(crate) fn search(
    study: &TuningStudy,
    evaluator: &Evaluator<'_>,
    baseline: &Baseline,
    (store, begin): (&Path, Begin),
    monorig: &Identity,
    progress: &dyn Progress,
) -> Result<SearchResult, Error> {
    let kept = store.with_file_name("inputs");
    let campaign = study.campaign(monorig);
    let mut stored = Vec::new();
    let store = match begin {
        Begin::Resume => Store::resume(store, &campaign, |trial| stored.push(trial))?,
        Begin::Restart => Store::replace(store, &campaign)?,
        Begin::New => {
            vacant(store)?;
            Store::replace(store, &campaign)?
        }
    };
    inputs::keep(study.inputs(), &kept)?;
    let space = Space::new(&study.file.parameters);
    let mut runner = TrialRunner {
        study,
        evaluator,
        store,
        stored,
        baseline,
        trials: Vec::new(),
        seen: HashMap::new(),
        best: None,
        stopped: false,
        error: None,
        progress,
    };
    let defaults = study.defaults();
    runner.score("default", defaults.clone());
    if let Some(published) = study.published() {
        runner.score("published", published);
    }
    let start = space.point(&defaults);
    let counts = space.counts();
    let budget = study.file.budget as usize;
    let plan = Search {
        optimiser: study.file.optimiser,
        start: &start,
        counts: &counts,
        objectives: study.file.objective.losses(),
        budget: budget - runner.trials.len(),
        seed: study.file.seed,
    };
    optimise::minimise(&plan, &mut |point| {
        runner
            .score("search", space.values(point))
            .unwrap_or_else(|| vec![WORST; plan.objectives])
    });
    if let Some(e) = runner.error {
        return Err(e);
    }
    Ok(SearchResult {
        winner: runner.best,
        finished: !runner.stopped,
        trials: runner.trials,
    })
}

/// Scores the proposals of the optimiser: from the store, from an equal trial before, or by running it.
struct TrialRunner<'a> {
    study: &'a TuningStudy,
    evaluator: &'a Evaluator<'a>,
    store: Store<Trial>,
    /// Trials of an earlier, interrupted search.
    stored: Vec<Trial>,
    baseline: &'a Baseline,
    trials: Vec<Trial>,
    /// Trials by their parameters as JSON: proposed twice, run once.
    seen: HashMap<String, usize>,
    best: Option<usize>,
    stopped: bool,
    error: Option<Error>,
    progress: &'a dyn Progress,
}

impl TrialRunner<'_> {
    /// Losses of a proposed trial; `None` after the end of the search.
    fn score(&mut self, origin: &str, parameters: Values) -> Option<Vec<f64>> {
        let index = self.trials.len();
        if self.stopped || self.error.is_some() || index >= self.study.file.budget as usize {
            return None;
        }
        // Strings and finite numbers: nothing in here can fail to serialise.
        let text = serde_json::to_string(&parameters).unwrap_or_default();
        let again = self
            .seen
            .get(&text)
            .and_then(|i| self.trials.get(*i))
            .cloned();
        let trial = match (self.stored.get(index), again) {
            (Some(stored), _) => stored.clone(),
            (None, Some(before)) => Trial {
                trial: index,
                origin: origin.to_owned(),
                ..before
            },
            (None, None) => self.run(index, origin, parameters),
        };
        if index >= self.stored.len()
            && let Err(e) = self.store.append(&trial)
        {
            self.error = Some(e);
            return None;
        }
        let losses = self.losses_for_optimiser(&trial);
        self.seen.entry(text).or_insert(index);
        let best = self.best.and_then(|i| self.trials.get(i));
        if trial.loss() < best.map_or(f64::INFINITY, Trial::loss) {
            self.best = Some(index);
        }
        self.trials.push(trial);
        let best = self.best.and_then(|i| self.trials.get(i));
        let budget = self.study.file.budget as usize;
        if let Some(trial) = self.trials.last() {
            self.stopped = !self.progress.trial(trial, best, budget) && index + 1 < budget;
        }
        Some(losses)
    }

    fn run(&mut self, index: usize, origin: &str, parameters: Values) -> Trial {
        // the first trial is the defaults, which have been run already
        let measured = match index {
            0 => self.baseline.defaults.clone(),
            _ => self.evaluator.evaluate(&parameters),
        };
        self.baseline.trial(index, origin, parameters, &measured)
    }

    /// The losses as the optimiser gets them: the loss above that of the defaults, or how badly constraints are
    /// broken; between −1 and [`WORST`], whatever the metric.
    fn losses_for_optimiser(&self, trial: &Trial) -> Vec<f64> {
        match trial {
            t if t.losses.is_empty() => vec![WORST; self.study.file.objective.losses()],
            t if t.violation > 0.0 => {
                let bad = BROKEN + t.violation.min(1.0) * (WORST - BROKEN) * 0.99;
                vec![bad; t.losses.len()]
            }
            t => t.losses.iter().map(|x| (x - 1.0).min(BROKEN)).collect(),
        }
    }
}
