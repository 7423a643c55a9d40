//! The search: the optimiser asks, known trials are answered from the store, new ones are run and added to it.
//!
//! A resumed study asks the optimiser's questions from the first on; as they and their answers are the same, it comes to where
//! it was in no time and goes on as if nothing had happened.

use crate::tuning::baseline::Yardstick;
use crate::tuning::evaluate::Bench;
use crate::tuning::loss::wanted;
use crate::tuning::optimise;
use crate::tuning::optimise::{Search, WORST};
use crate::tuning::space::{Space, Values};
use crate::tuning::study::{Combine, Study};
use crate::tuning::trial_store::{Header, Store, Trial};
use monorig_sim::error::Error;
use std::collections::HashMap;
use std::path::Path;
use std::time::{Duration, Instant};

/// Told to the optimiser for the best trials that break a constraint: no trial that keeps all of them is as bad.
const BROKEN: f64 = 2.0;

/// How a search ended.
#[derive(Clone, Debug)]
pub struct Found {
    /// All trials.
    pub trials: Vec<Trial>,
    /// Index of the winner: least loss, the first of equals; none if every trial failed or broke a constraint.
    pub winner: Option<usize>,
    /// Whether the budget was spent (not interrupted).
    pub finished: bool,
    /// Time spent on running trials.
    pub running: Duration,
    /// Time spent on all else: the optimiser, the store.
    pub beside: Duration,
}

/// Someone who watches a search.
pub trait Watcher: Send {
    /// A trial is judged; `best` is the best so far. Says whether to go on.
    fn trial(&mut self, trial: &Trial, best: Option<&Trial>, budget: usize) -> bool;
}

/// Search with a bench of tuning runs and what the defaults show in them; trials are kept in the file `store`, and with `resume` taken from it.
pub fn search(
    study: &Study,
    bench: &Bench,
    yardstick: &Yardstick,
    store: &Path,
    resume: bool,
    watcher: &mut dyn Watcher,
) -> Result<Found, Error> {
    let started = Instant::now();
    let header = Header {
        study: study.name.clone(),
        hash: study.hash()?,
        monorig: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let (store, known) = if resume && store.exists() {
        Store::resume(store, &header)?
    } else {
        (Store::create(store, &header)?, Vec::new())
    };
    let space = Space::new(&study.file.parameters);
    let mut desk = Desk {
        study,
        bench,
        store,
        known,
        yardstick,
        trials: Vec::new(),
        seen: HashMap::new(),
        best: None,
        running: Duration::ZERO,
        stopped: false,
        error: None,
        watcher,
    };
    let defaults = study.defaults();
    desk.answer("default", defaults.clone());
    if let Some(published) = study.published() {
        desk.answer("published", published);
    }
    let start = space.point(&defaults);
    let counts = space.counts();
    let budget = study.file.budget as usize;
    let plan = Search {
        optimiser: study.file.optimiser,
        start: &start,
        counts: &counts,
        objectives: match study.file.objective.combine {
            Combine::Pareto => study.file.objective.metrics.len(),
            _ => 1,
        },
        budget: budget - desk.trials.len(),
        seed: study.file.seed,
    };
    optimise::minimise(&plan, &mut |point| {
        desk.answer("search", space.values(point))
            .unwrap_or_else(|| vec![WORST; plan.objectives])
    });
    if let Some(e) = desk.error {
        return Err(e);
    }
    Ok(Found {
        winner: desk.best,
        finished: !desk.stopped,
        running: desk.running,
        beside: started.elapsed() - desk.running,
        trials: desk.trials,
    })
}

/// Where questions arrive.
struct Desk<'a> {
    study: &'a Study,
    bench: &'a Bench,
    store: Store,
    known: Vec<Trial>,
    yardstick: &'a Yardstick,
    trials: Vec<Trial>,
    /// Trials by the bits of their parameters: asked twice, run once.
    seen: HashMap<Vec<u64>, usize>,
    best: Option<usize>,
    running: Duration,
    stopped: bool,
    error: Option<Error>,
    watcher: &'a mut dyn Watcher,
}

impl Desk<'_> {
    /// The answer to a question; none once the search is over.
    fn answer(&mut self, origin: &str, parameters: Values) -> Option<Vec<f64>> {
        let index = self.trials.len();
        if self.stopped || self.error.is_some() || index >= self.study.file.budget as usize {
            return None;
        }
        let bits: Vec<u64> = parameters.values().map(|x| x.to_bits()).collect();
        let again = self
            .seen
            .get(&bits)
            .and_then(|i| self.trials.get(*i))
            .cloned();
        let trial = match (self.known.get(index), again) {
            (Some(known), _) => known.clone(),
            (None, Some(before)) => Trial {
                trial: index,
                origin: origin.to_owned(),
                ..before
            },
            (None, None) => self.run(index, origin, parameters),
        };
        if index >= self.known.len()
            && let Err(e) = self.store.add(&trial)
        {
            self.error = Some(e);
            return None;
        }
        let told = self.told(&trial);
        self.seen.entry(bits).or_insert(index);
        let best = self.best.and_then(|i| self.trials.get(i));
        if trial.loss() < best.map_or(f64::INFINITY, Trial::loss) {
            self.best = Some(index);
        }
        self.trials.push(trial);
        let best = self.best.and_then(|i| self.trials.get(i));
        let budget = self.study.file.budget as usize;
        if let Some(trial) = self.trials.last() {
            self.stopped = !self.watcher.trial(trial, best, budget) && index + 1 < budget;
        }
        Some(told)
    }

    fn run(&mut self, index: usize, origin: &str, parameters: Values) -> Trial {
        let started = Instant::now();
        // the first trial is the defaults, which have been run already
        let shown = match index {
            0 => self.yardstick.defaults.clone(),
            _ => self.bench.evaluate(&parameters, &wanted(&self.study.file)),
        };
        let verdict = self.yardstick.judge.judge(&shown);
        self.running += started.elapsed();
        Trial {
            trial: index,
            origin: origin.to_owned(),
            parameters,
            losses: verdict.losses,
            violation: verdict.violation,
            failed: verdict.failed,
        }
    }

    /// What the optimiser hears: the loss above that of the defaults, or how badly constraints are broken; between −1 and
    /// [`WORST`], whatever the metric.
    fn told(&self, trial: &Trial) -> Vec<f64> {
        match trial {
            t if t.losses.is_empty() => vec![WORST; self.objectives()],
            t if t.violation > 0.0 => {
                let bad = BROKEN + t.violation.min(1.0) * (WORST - BROKEN) * 0.99;
                vec![bad; t.losses.len()]
            }
            t => t.losses.iter().map(|x| (x - 1.0).min(BROKEN)).collect(),
        }
    }

    fn objectives(&self) -> usize {
        match self.study.file.objective.combine {
            Combine::Pareto => self.study.file.objective.metrics.len(),
            _ => 1,
        }
    }
}
