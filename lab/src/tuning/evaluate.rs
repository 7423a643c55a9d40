//! Runs a trial: an estimator with the trial's parameters over every run of the study, side by side on several threads.

use crate::batch::map_in_order;
use crate::metrics;
use crate::metrics::series::{ErrorSample, ErrorSeries};
use crate::replay::{ReplayData, cache::Cache, play::play};
use crate::tuning::progress::Progress;
use crate::tuning::study::Values;
use crate::tuning::study::{Evaluation, RunGroup, TuningStudy};
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::run;
use monorig_sim::config::scenario::{IntegrityLimits, Scenario};
use monorig_sim::error::Error;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};

/// A metric over a window of time.
#[derive(Clone, Debug, PartialEq)]
pub struct MetricWindow {
    /// Its name.
    pub metric: String,
    /// From here, s.
    pub after_s: f64,
    /// To here, s.
    pub until_s: f64,
}

/// Runs ready to be evaluated.
pub struct Evaluator<'a> {
    study: &'a TuningStudy,
    runs: Vec<OneRun>,
    /// Threads.
    pub jobs: usize,
}

/// A scenario and seed, and where its samples come from.
struct OneRun {
    group: usize,
    seed: u64,
    source: Source,
    limits: IntegrityLimits,
}

enum Source {
    Replay(Box<ReplayData>),
    ClosedLoop(Box<Scenario>),
}

/// The metrics of one run, in the order they were asked for, or why there are none.
#[derive(Clone, Debug, PartialEq)]
pub struct RunMetrics {
    /// Index of the group.
    pub group: usize,
    /// Seed.
    pub seed: u64,
    /// The metrics.
    pub values: Result<Vec<f64>, String>,
}

impl<'a> Evaluator<'a> {
    /// Records what is to be replayed, or finds it in the cache. None if `progress` stopped it.
    pub fn prepare(
        study: &'a TuningStudy,
        groups: &[RunGroup],
        cache: &Cache,
        jobs: usize,
        stage: &str,
        progress: &dyn Progress,
    ) -> Result<Option<Self>, Error> {
        let list: Vec<(usize, u64)> = groups
            .iter()
            .enumerate()
            .flat_map(|(i, g)| g.seeds.iter().map(move |seed| (i, *seed)))
            .collect();
        let done = AtomicUsize::new(0);
        let sources = map_in_order(jobs, &list, |&(i, seed)| {
            let scenario = &groups[i].scenario;
            let source = match study.file.evaluation {
                Evaluation::ClosedLoop => Some(Source::ClosedLoop(Box::new(scenario.clone()))),
                Evaluation::Replay => {
                    let share = |_| {
                        progress.stage(
                            stage,
                            done.load(Ordering::Relaxed) as f64 / list.len() as f64,
                        )
                    };
                    cache
                        .get(scenario, &study.registry, seed, &mut { share })?
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
                    limits: groups
                        .get(group)
                        .map(|g| IntegrityLimits::of(&g.scenario.file))
                        .unwrap_or_default(),
                }),
            }
        }
        Ok(Some(Self { study, runs, jobs }))
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
    pub fn evaluate(&self, values: &Values, windows: &[MetricWindow]) -> Vec<RunMetrics> {
        map_in_order(self.jobs, &self.runs, |run| {
            let series = self.series(run, values);
            RunMetrics {
                group: run.group,
                seed: run.seed,
                values: series.and_then(|series| self.measure(&series, windows)),
            }
        })
    }

    /// The samples of the first run of a group with these parameters.
    pub fn trace(&self, group: usize, values: &Values) -> Result<Vec<ErrorSample>, String> {
        match self.runs.iter().find(|run| run.group == group) {
            Some(run) => self.samples(self.series(run, values)?),
            None => Err("there is no such run".into()),
        }
    }

    /// The estimator's samples.
    fn samples(&self, series: ErrorSeries) -> Result<Vec<ErrorSample>, String> {
        let mut estimators = series.estimators.into_iter();
        match estimators.find(|(name, _)| *name == self.study.file.estimator) {
            Some((_, samples)) => Ok(samples),
            None => Err("the run has no samples".into()),
        }
    }

    fn measure(&self, series: &ErrorSeries, windows: &[MetricWindow]) -> Result<Vec<f64>, String> {
        let one = |w: &MetricWindow| {
            metrics::measure(
                series,
                &self.study.file.estimator,
                &w.metric,
                w.after_s,
                w.until_s,
            )
            .or_else(|| metrics::measure_run(series, &w.metric, w.after_s, w.until_s))
            .ok_or_else(|| format!("there is no metric {}", w.metric))
        };
        windows.iter().map(one).collect()
    }

    /// A panic is an error like any other: it fails the trial, not the study.
    fn series(&self, run: &OneRun, values: &Values) -> Result<ErrorSeries, String> {
        catch_unwind(AssertUnwindSafe(|| self.run(run, values)))
            .unwrap_or_else(|_| Err("it panicked".into()))
    }

    fn run(&self, run: &OneRun, values: &Values) -> Result<ErrorSeries, String> {
        let settings = self.study.settings(values);
        let name = &self.study.file.estimator;
        match &run.source {
            Source::Replay(columns) => {
                let of = &self.study.of;
                let estimator = of
                    .build(&columns.vehicle, &settings.named())
                    .map_err(|e| e.to_string())?;
                let mut samples = Vec::new();
                play(columns, estimator, &mut samples);
                Ok(ErrorSeries {
                    estimators: vec![(name.clone(), samples)],
                    limits: run.limits,
                    ..ErrorSeries::default()
                })
            }
            Source::ClosedLoop(scenario) => {
                let mut scenario = scenario.as_ref().clone();
                scenario.file.estimators.insert(name.clone(), settings);
                let mut simulation = Simulation::build(scenario, &self.study.registry, run.seed)
                    .map_err(|e| e.to_string())?;
                let mut series = ErrorSeries::default();
                run::run(&mut simulation, &mut [&mut series], &mut |_| true)
                    .map_err(|e| e.to_string())?;
                Ok(series)
            }
        }
    }
}
