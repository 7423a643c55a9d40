//! Measures the [`Summary`] of a run during the run, in constant memory.

use crate::bound::RunningBound;
use crate::metrics::lagged::GradeAtMiddle;
use crate::metrics::series::{ErrorSample, ErrorSampler, Geometry, Target, Tracking};
use crate::metrics::{
    End, Marks, Metric, Pace, Quantity, WantedMetric, Window, WindowedMetrics, estimator_metrics,
    mark, run_metrics,
};
use crate::verdicts::common::CommonErrorsSoFar;
use crate::verdicts::expected::{self, Bound};
use crate::verdicts::integrity::Integrity;
use crate::verdicts::summary::{AFTER_S, ExpectationVerdict, Summary};
use crate::verdicts::weakened;
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::estimators::RunningEstimator;
use monorig_sim::closed_loop::run::{Observer, Outcome, StepFrame};
use monorig_sim::config::scenario::{IntegrityLimits, Moment, Scenario};
use monorig_sim::error::Error;
use std::collections::BTreeMap;

/// Observer that measures the [`Summary`] of a run.
#[derive(Default)]
pub struct SummaryObserver {
    /// Reference estimator for errors over common valid samples: name, and place in the run.
    reference: Option<String>,
    reference_at: Option<usize>,
    limits: IntegrityLimits,
    bound: Option<RunningBound>,
    middle: Option<GradeAtMiddle>,
    pace: Pace,
    estimators: Vec<EstimatorSoFar>,
    samplers: Vec<ErrorSampler>,
    samples: Vec<ErrorSample>,
    bounds: Vec<Bound>,
    weakened: Vec<String>,
    /// First and last sampled instant, s.
    times_s: Option<(f64, f64)>,
    /// Start of the metrics, s: [`AFTER_S`] after the start of the run, or of the part of a log that is played.
    after_s: f64,
    /// The metrics to measure: metrics from there on, then the bounds.
    wanted: Vec<WantedMetric>,
    metrics: Option<WindowedMetrics>,
}

struct EstimatorSoFar {
    name: String,
    ever_valid: bool,
    integrity: [Integrity; 3],
    common: Option<CommonErrorsSoFar>,
}

impl SummaryObserver {
    /// Makes an observer that also compares every estimator with this one, over the samples that both mark valid.
    pub fn against(reference: &str) -> Self {
        Self {
            reference: Some(reference.to_owned()),
            ..Self::default()
        }
    }

    /// Summary of the run.
    pub fn summary(&self, scenario: &Scenario, seed: u64, outcome: &Outcome) -> Summary {
        let values: Vec<(Option<f64>, Window)> = self
            .metrics
            .iter()
            .flat_map(WindowedMetrics::values)
            .collect();
        let metrics = values.len().saturating_sub(self.bounds.len());
        let (metrics, bounds) = values.split_at(metrics);
        let mut estimators: BTreeMap<_, _> = self
            .estimators
            .iter()
            .map(|e| (e.name.clone(), BTreeMap::new()))
            .collect();
        let mut run = BTreeMap::new();
        for (wanted, (value, _)) in self.wanted.iter().zip(metrics) {
            let of = wanted.estimator.as_ref();
            let table = of.and_then(|name| estimators.get_mut(name));
            let table = table.unwrap_or(&mut run);
            table.insert(wanted.metric.clone(), finite(*value));
        }
        for (e, sampler) in self.estimators.iter().zip(&self.samplers) {
            let of = estimators.get_mut(&e.name);
            let found = |of: &&mut BTreeMap<String, Option<f64>>| {
                let available = mark(Quantity::Mass, Marks::Availability);
                let available = of.get(available).copied().flatten();
                sampler.mass_estimated || available != Some(0.0)
            };
            // of a log: an estimator whose mass stays as at the start, and that never marks it valid, finds none
            if let Some(of) = of.filter(|of| scenario.is_recorded() && !found(of)) {
                let errors = estimator_metrics().filter(|m| m.error_of() == Some(Quantity::Mass));
                of.extend(errors.map(|m| (m.name.to_owned(), None)));
            }
        }
        let times = self.times_s.unwrap_or((0.0, 0.0));
        let windows = self.bounds.iter().zip(bounds);
        let windows = windows.filter_map(|(b, (_, window))| {
            weakened::of_window(&b.expectation, window, times.0, times.1)
        });
        let integrity = || self.estimators.iter().flat_map(|e| e.integrity.iter());
        let few = integrity().filter_map(weakened::of_integrity);
        let weakened = self.weakened.iter().cloned().chain(windows).chain(few);
        let mut weakened: Vec<String> = weakened.collect();
        weakened.sort_unstable();
        weakened.dedup();
        let never_valid = self.estimators.iter().filter(|e| !e.ever_valid);
        Summary {
            version: 1,
            scenario: scenario.name.clone(),
            seed,
            finished: outcome.finished,
            never_valid: never_valid.map(|e| e.name.clone()).collect(),
            simulated_s: outcome.simulated_s,
            steps: outcome.steps,
            after_s: self.after_s,
            estimators,
            run,
            refusals: outcome.refusals.clone(),
            expectations: self
                .bounds
                .iter()
                .zip(bounds)
                .map(|(bound, (value, window))| {
                    judge(bound, *value, window, times.1, outcome.finished)
                })
                .collect(),
            limits: self.limits,
            integrity: integrity().cloned().collect(),
            weakened,
            common: self
                .estimators
                .iter()
                .filter_map(|e| Some((e.name.clone(), e.common.as_ref()?.value())))
                .collect(),
        }
    }
}

impl Observer for SummaryObserver {
    fn begin(&mut self, s: &Simulation) -> Result<(), Error> {
        let file = &s.scenario.file;
        self.limits = IntegrityLimits::of(file);
        self.bound = RunningBound::of(s);
        self.middle = Some(GradeAtMiddle::of(s));
        self.bounds = expected::bounds(file);
        self.weakened = weakened::of_file(file);
        let trim = s.scenario.trim();
        let trim = trim.map(|trim| format!("a part of the log only: trim {trim}"));
        self.weakened.extend(trim);
        if s.scenario.is_recorded() {
            self.bounds.extend(expected::of_references(file));
        }
        let geometry = Geometry::of(s);
        let of_bound = |bound: &Bound| {
            let e = &bound.expectation;
            let end = |s: f64, moment: &Option<Moment>| match moment {
                Some(moment) => End::of(moment, file, &geometry),
                None => End::At(s),
            };
            let after_s = e.after_s.map_or(0.0, f64::from);
            let until_s = e.until_s.map_or(f64::INFINITY, f64::from);
            WantedMetric {
                estimator: e.estimator.clone(),
                metric: e.metric.clone(),
                window: Window::between(end(after_s, &e.after), end(until_s, &e.until)),
            }
        };
        let after_s = AFTER_S + begin_s(s);
        self.after_s = after_s;
        let from_then_on = |estimator: Option<&String>, metric: &Metric| WantedMetric {
            estimator: estimator.cloned(),
            metric: metric.name.to_owned(),
            // integrity counts from the start, here as in its verdict
            window: match metric.is_integrity() {
                true => Window::new(0.0, f64::INFINITY),
                false => Window::new(after_s, f64::INFINITY),
            },
        };
        let names: Vec<String> = s.estimators.iter().map(|e| e.name.clone()).collect();
        let of_estimators = names
            .iter()
            .flat_map(|name| estimator_metrics().map(|m| from_then_on(Some(name), m)));
        self.wanted = of_estimators
            .chain(run_metrics().map(|m| from_then_on(None, m)))
            .chain(self.bounds.iter().map(of_bound))
            .collect();
        self.metrics = Some(WindowedMetrics::new(&names, &self.wanted, &self.limits));
        self.samplers = s.estimators.iter().map(ErrorSampler::of).collect();
        let judged = |e: &RunningEstimator| !e.reference && expected::is_judged(file, &e.name);
        let reference = self.reference.as_ref();
        self.reference_at = names.iter().position(|name| Some(name) == reference);
        let common = |e: &RunningEstimator| {
            let other = self.reference_at.is_some() && Some(&e.name) != reference;
            other.then(|| CommonErrorsSoFar::new(&self.limits))
        };
        self.estimators = s
            .estimators
            .iter()
            .map(|e| EstimatorSoFar {
                name: e.name.clone(),
                ever_valid: false,
                integrity: Integrity::of(&e.name, judged(e), &self.limits, file),
                common: common(e),
            })
            .collect();
        Ok(())
    }

    fn on_step(&mut self, f: &StepFrame<'_>) -> Result<(), Error> {
        let bound = self.bound.as_mut().and_then(|bound| {
            bound.step(f.truth);
            bound.now()
        });
        if !self.pace.takes(f) {
            return Ok(());
        }
        let middle = self.middle.as_mut();
        let middle = middle.map_or(f64::NAN, |m| m.at(f.truth.chainage_m));
        let target = Target::of(f.truth, bound, middle);
        self.samples.clear();
        let samples = f.estimators.iter().zip(&mut self.samplers);
        self.samples
            .extend(samples.map(|(e, sampler)| sampler.sample(e, &target)));
        let first_s = self.times_s.map_or(f.truth.t_s, |(first_s, _)| first_s);
        self.times_s = Some((first_s, f.truth.t_s));
        if let Some(metrics) = &mut self.metrics {
            metrics.add(&Tracking::of(f), &self.samples);
        }
        for (e, x) in self.estimators.iter_mut().zip(&self.samples) {
            e.ever_valid |= x.mass_valid || x.slope_valid;
            for integrity in &mut e.integrity {
                integrity.count(x, &self.limits);
            }
        }
        let reference = self.reference_at.and_then(|i| self.samples.get(i));
        if let Some(reference) = reference.filter(|x| x.t_s >= self.after_s) {
            for (e, x) in self.estimators.iter_mut().zip(&self.samples) {
                if let Some(common) = &mut e.common {
                    common.add(x, reference);
                }
            }
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), Error> {
        if let Some(metrics) = &mut self.metrics {
            metrics.finish();
        }
        Ok(())
    }
}

/// Start of a run, s: 0, or the first step of the part of a log that is played, whose times are those of the whole log.
fn begin_s(s: &Simulation) -> f64 {
    match s.scenario.is_recorded() {
        // the loop begins a step before the first one
        true => (1e3 * (s.plant.truth().t_s + s.dt_s)).round().max(0.0) * 1e-3,
        false => 0.0,
    }
}

fn finite(x: Option<f64>) -> Option<f64> {
    x.filter(|x| x.is_finite())
}

/// The verdict on a bound. One whose window begins before the run, or whose end the run never came to, could not be
/// measured: what was measured is another window. The last sample of the run was at `last_s`.
fn judge(
    bound: &Bound,
    value: Option<f64>,
    window: &Window,
    last_s: f64,
    finished: bool,
) -> ExpectationVerdict {
    let e = &bound.expectation;
    let ends = e.until_s.is_some() || e.until.is_some();
    let begins = e.after_s.is_some() || e.after.is_some();
    let whole =
        !(begins && window.after_s() < 0.0 || ends && window.until_s() > last_s + LAST_STEP_S);
    let given = |s: f64, is_given: bool| finite(is_given.then_some(s));
    let mut verdict = ExpectationVerdict {
        estimator: e.estimator.clone(),
        metric: e.metric.clone(),
        window: e.window(),
        after_s: given(window.after_s(), begins),
        until_s: finite(Some(window.until_s())),
        at_most: e.at_most.map(f64::from),
        at_least: e.at_least.map(f64::from),
        quantile: Some(e.share_of_runs()),
        mean: e.mean,
        value: finite(value).filter(|_| whole),
        held: false,
        known_failure: bound.known.as_ref().map(|k| k.why.clone()),
        no_worse_than: bound.known.as_ref().map(|k| k.no_worse_than.get()),
    };
    verdict.held = verdict.follows(finished);
    verdict
}

/// Largest time between the last sample and the end of a run, s.
const LAST_STEP_S: f64 = 0.5;
