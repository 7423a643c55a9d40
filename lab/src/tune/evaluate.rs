//! Runs a trial: an estimator with the trial's parameters over every run of the study, side by side on several threads.

use super::space::Values;
use super::study::{Evaluation, Group, Study};
use crate::metrics;
use crate::replay::{Columns, cache::Cache, play::play};
use crate::series::{Sample, Series};
use monorig_estimators::registry;
use monorig_sim::checked::Finite;
use monorig_sim::error::Error;
use monorig_sim::rig::Rig;
use monorig_sim::run;
use monorig_sim::scenario::{ParameterValue, Scenario, Settings};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A metric over a window of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// Its name.
    pub metric: String,
    /// From here, s.
    pub after_s: f64,
    /// To here, s.
    pub until_s: f64,
}

/// Runs ready to be evaluated.
pub struct Bench {
    estimator: String,
    fixed: BTreeMap<String, ParameterValue>,
    runs: Vec<OneRun>,
    /// Threads.
    pub jobs: usize,
}

/// A scenario and seed, and where its samples come from.
struct OneRun {
    group: usize,
    seed: u64,
    source: Source,
}

enum Source {
    Replay(Box<Columns>),
    ClosedLoop(Box<Scenario>),
}

/// What a run has shown: the wanted metrics, in their order, or why there are none.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// Index of the group.
    pub group: usize,
    /// Seed.
    pub seed: u64,
    /// The metrics.
    pub values: Result<Vec<f64>, String>,
}

impl Bench {
    /// Records what is to be replayed, or finds it in the cache. None if `go_on` stopped it; it is told the share done.
    pub fn prepare(
        study: &Study,
        groups: &[Group],
        cache: &Cache,
        jobs: usize,
        go_on: &(dyn Fn(f64) -> bool + Sync),
    ) -> Result<Option<Self>, Error> {
        let list: Vec<(usize, u64)> = groups
            .iter()
            .enumerate()
            .flat_map(|(i, g)| g.seeds.iter().map(move |seed| (i, *seed)))
            .collect();
        let done = AtomicUsize::new(0);
        let sources = parallel(&list, jobs, |&(i, seed)| {
            let scenario = &groups[i].scenario;
            let source = match study.file.evaluation {
                Evaluation::ClosedLoop => Some(Source::ClosedLoop(Box::new(scenario.clone()))),
                Evaluation::Replay => {
                    let share = |_| go_on(done.load(Ordering::Relaxed) as f64 / list.len() as f64);
                    cache
                        .get(scenario, seed, &mut { share })?
                        .map(|columns| Source::Replay(Box::new(columns)))
                }
            };
            done.fetch_add(1, Ordering::Relaxed);
            Ok::<_, Error>(source)
        });
        let mut runs = Vec::new();
        for ((group, seed), source) in list.into_iter().zip(sources) {
            match source? {
                None => return Ok(None),
                Some(source) => runs.push(OneRun {
                    group,
                    seed,
                    source,
                }),
            }
        }
        Ok(Some(Self {
            estimator: study.file.estimator.clone(),
            fixed: study.file.fixed.clone(),
            runs,
            jobs,
        }))
    }

    /// Steps of all recordings together.
    pub fn steps(&self) -> usize {
        let steps = |run: &OneRun| match &run.source {
            Source::Replay(columns) => columns.len(),
            Source::ClosedLoop(_) => 0,
        };
        self.runs.iter().map(steps).sum()
    }

    /// All runs with these parameters; the order is that of the study, whatever the number of threads.
    pub fn evaluate(&self, values: &Values, wanted: &[Wanted]) -> Vec<Shown> {
        parallel(&self.runs, self.jobs, |run| {
            let series = self.series(run, values);
            Shown {
                group: run.group,
                seed: run.seed,
                values: series.and_then(|series| self.measure(&series, wanted)),
            }
        })
    }

    /// The samples of the first run of a group with these parameters.
    pub fn trace(&self, group: usize, values: &Values) -> Result<Vec<Sample>, String> {
        match self.runs.iter().find(|run| run.group == group) {
            Some(run) => self.samples(self.series(run, values)?),
            None => Err("there is no such run".into()),
        }
    }

    /// The estimator's samples.
    fn samples(&self, series: Series) -> Result<Vec<Sample>, String> {
        let mut estimators = series.estimators.into_iter();
        match estimators.find(|(name, _)| *name == self.estimator) {
            Some((_, samples)) => Ok(samples),
            None => Err("the run has no samples".into()),
        }
    }

    fn measure(&self, series: &Series, wanted: &[Wanted]) -> Result<Vec<f64>, String> {
        let one = |w: &Wanted| {
            metrics::measure(series, &self.estimator, &w.metric, w.after_s, w.until_s)
                .or_else(|| metrics::measure_run(series, &w.metric, w.after_s, w.until_s))
                .ok_or_else(|| format!("there is no metric {}", w.metric))
        };
        wanted.iter().map(one).collect()
    }

    /// A panic is an error like any other: it fails the trial, not the study.
    fn series(&self, run: &OneRun, values: &Values) -> Result<Series, String> {
        catch_unwind(AssertUnwindSafe(|| self.run(run, values)))
            .unwrap_or_else(|_| Err("it panicked".into()))
    }

    fn run(&self, run: &OneRun, values: &Values) -> Result<Series, String> {
        match &run.source {
            Source::Replay(columns) => {
                let fixed = self.fixed.iter().map(|(k, x)| (k.as_str(), x.setting()));
                let named = fixed.chain(values.iter().map(|(k, x)| (k.as_str(), (*x).into())));
                let estimator = registry::build(&self.estimator, &columns.vehicle, named)
                    .map_err(|e| e.to_string())?;
                let mut samples = Vec::new();
                play(columns, estimator, &mut samples);
                Ok(Series {
                    estimators: vec![(self.estimator.clone(), samples)],
                    tracking: Vec::new(),
                })
            }
            Source::ClosedLoop(scenario) => {
                let mut scenario = scenario.as_ref().clone();
                let mut all = self.fixed.clone();
                for (key, x) in values {
                    all.insert(key.clone(), ParameterValue::Number(Finite::try_from(*x)?));
                }
                let bank = &mut scenario.file.estimators;
                bank.insert(self.estimator.clone(), Settings::new(all));
                let mut rig = Rig::build(scenario, run.seed).map_err(|e| e.to_string())?;
                let mut series = Series::default();
                run::run(&mut rig, &mut [&mut series], &mut |_| true).map_err(|e| e.to_string())?;
                Ok(series)
            }
        }
    }
}

/// The same for every item, on so many threads; results in the order of the items.
pub fn parallel<T: Sync, R: Send>(
    items: &[T],
    jobs: usize,
    each: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    if jobs <= 1 || items.len() <= 1 {
        return items.iter().map(each).collect();
    }
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::with_capacity(items.len()));
    std::thread::scope(|scope| {
        for _ in 0..jobs.min(items.len()) {
            scope.spawn(|| {
                loop {
                    let i = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(i) else { break };
                    let result = each(item);
                    if let Ok(mut done) = done.lock() {
                        done.push((i, result));
                    }
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_default();
    done.sort_unstable_by_key(|(i, _)| *i);
    done.into_iter().map(|(_, result)| result).collect()
}
