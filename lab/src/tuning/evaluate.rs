//! Runs a trial: an estimator with the trial's parameters over every run of the study, side by side on several threads.

use crate::batch::map_in_order;
use crate::metrics;
use crate::metrics::series::{ErrorSample, ErrorSeries};
use crate::replay::{ReplayData, cache::Cache, play::play};
pub use crate::tuning::loss::RunMetrics;
use crate::tuning::loss::{MetricWindow, metric_windows};
use crate::tuning::progress::Progress;
pub use crate::tuning::study::Stage;
use crate::tuning::study::Values;
use crate::tuning::study::{Evaluation, TuningStudy};
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::registry::BoxedEstimator;
use monorig_sim::closed_loop::run;
use monorig_sim::config::scenario::{IntegrityLimits, Scenario};
use monorig_sim::error::Error;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Who evaluates, and with what.
#[derive(Clone, Copy)]
pub struct Means<'a> {
    /// Folder of the recordings.
    pub cache: &'a Cache,
    /// Threads.
    pub jobs: usize,
}

/// Runs ready to be evaluated.
pub struct Evaluator<'a> {
    study: &'a TuningStudy,
    runs: Vec<OneRun>,
    windows: Vec<MetricWindow>,
    jobs: usize,
}

/// A scenario and seed, and where its samples come from.
struct OneRun {
    group: usize,
    seed: u64,
    source: SampleSource,
    limits: IntegrityLimits,
}

enum SampleSource {
    Replay(Box<ReplayData>),
    ClosedLoop(Box<Scenario>),
}

impl OneRun {
    /// Records what is to be replayed, or finds it in the cache. None if `go_on` stopped it.
    fn prepare(
        study: &TuningStudy,
        stage: Stage,
        (group, seed): (usize, u64),
        cache: &Cache,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Option<Self>, Error> {
        let scenario = &stage.groups(study)[group].scenario;
        let source = match study.file.evaluation {
            Evaluation::ClosedLoop => SampleSource::ClosedLoop(Box::new(scenario.clone())),
            Evaluation::Replay => match cache.get(scenario, &study.registry, seed, go_on)? {
                Some(columns) => SampleSource::Replay(Box::new(columns)),
                None => return Ok(None),
            },
        };
        Ok(Some(Self {
            group,
            seed,
            source,
            limits: IntegrityLimits::of(&scenario.file),
        }))
    }
}

impl<'a> Evaluator<'a> {
    /// Makes the runs of a stage ready. None if `progress` stopped it.
    pub fn prepare(
        study: &'a TuningStudy,
        stage: Stage,
        means: Means<'a>,
        progress: &dyn Progress,
    ) -> Result<Option<Self>, Error> {
        let list = stage.list(study);
        let done = AtomicUsize::new(0);
        let runs = map_in_order(means.jobs, &list, |&run| {
            let mut share = |_| {
                progress.stage(
                    stage.label(),
                    done.load(Ordering::Relaxed) as f64 / list.len() as f64,
                )
            };
            let ready = OneRun::prepare(study, stage, run, means.cache, &mut share);
            done.fetch_add(1, Ordering::Relaxed);
            ready
        });
        let runs: Option<Vec<OneRun>> = runs.into_iter().collect::<Result<_, Error>>()?;
        Ok(runs.map(|runs| Self {
            study,
            runs,
            windows: metric_windows(&study.file),
            jobs: means.jobs,
        }))
    }

    /// The metrics of the study over all runs with these parameters, in the order of the study.
    pub fn evaluate(&self, values: &Values) -> Vec<RunMetrics> {
        let measured = map_in_order(self.jobs, &self.runs, |run| {
            self.measure(&self.series(run, values)?)
        });
        let runs = self.runs.iter().zip(measured);
        runs.map(|(run, values)| RunMetrics {
            group: run.group,
            seed: run.seed,
            values,
        })
        .collect()
    }

    /// The study's estimator with these parameters.
    fn estimator(&self, columns: &ReplayData, values: &Values) -> Result<BoxedEstimator, String> {
        let (of, settings) = (&self.study.of, self.study.settings(values));
        of.build(&columns.vehicle, &settings.named())
            .map_err(|e| e.to_string())
    }

    /// The samples of the first run of a group with these parameters.
    pub(crate) fn trace(&self, group: usize, values: &Values) -> Result<Vec<ErrorSample>, String> {
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

    fn measure(&self, series: &ErrorSeries) -> Result<Vec<f64>, String> {
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
        self.windows.iter().map(one).collect()
    }

    fn series(&self, run: &OneRun, values: &Values) -> Result<ErrorSeries, String> {
        caught(|| self.run(run, values))
    }

    fn run(&self, run: &OneRun, values: &Values) -> Result<ErrorSeries, String> {
        let name = &self.study.file.estimator;
        match &run.source {
            SampleSource::Replay(columns) => {
                let samples = play(columns, name, self.estimator(columns, values)?)
                    .map_err(|e| e.to_string())?;
                Ok(ErrorSeries {
                    estimators: vec![(name.clone(), samples)],
                    limits: run.limits,
                    ..ErrorSeries::default()
                })
            }
            SampleSource::ClosedLoop(scenario) => {
                let mut scenario = scenario.as_ref().clone();
                let settings = self.study.settings(values);
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

/// A panic is an error like any other: it fails the trial, not the study.
fn caught<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| Err("it panicked".into()))
}
