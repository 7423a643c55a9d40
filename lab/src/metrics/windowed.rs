//! Metrics over windows of a run, measured during the run, in constant memory.

use crate::metrics::find;
use crate::metrics::series::{ErrorSample, Tracking};
use crate::metrics::window::{Window, Windowed};
use monorig_sim::config::scenario::IntegrityLimits;

/// A metric to measure.
#[derive(Clone)]
pub(crate) struct WantedMetric {
    /// The estimator; `None` = train and controller.
    pub(crate) estimator: Option<String>,
    /// Name of the metric.
    pub(crate) metric: String,
    /// When.
    pub(crate) window: Window,
}

/// Steps that are measured at once: what a metric looks at stays near.
const BLOCK: usize = 64;

/// Values of the wanted metrics, in their order.
pub(crate) struct WindowedMetrics {
    all: Vec<Measured>,
    /// Steps not yet measured: the state of the run, and the samples of each estimator.
    tracking: Vec<Tracking>,
    samples: Vec<Vec<ErrorSample>>,
}

/// Nothing where there is no such estimator, or the metric is not one of it.
enum Measured {
    /// Of the estimator in this place.
    OfEstimator(usize, Windowed<ErrorSample>),
    OfRun(Windowed<Tracking>),
    Nothing(Window),
}

impl WindowedMetrics {
    /// Begins to measure the wanted metrics of a run with these estimators.
    pub(crate) fn new(
        estimators: &[String],
        wanted: &[WantedMetric],
        limits: &IntegrityLimits,
    ) -> Self {
        let start = |w: &WantedMetric| {
            let metric = find(&w.metric)?;
            Some(match &w.estimator {
                None => Measured::OfRun(Windowed::new(w.window, metric.of_run()?)),
                Some(name) => Measured::OfEstimator(
                    estimators.iter().position(|e| e == name)?,
                    Windowed::new(w.window, metric.of_estimator(limits)?),
                ),
            })
        };
        let all = wanted.iter();
        let all = all.map(|w| start(w).unwrap_or(Measured::Nothing(w.window)));
        Self {
            all: all.collect(),
            tracking: Vec::with_capacity(BLOCK),
            samples: vec![Vec::with_capacity(BLOCK); estimators.len()],
        }
    }

    /// A step of the run: its state, and a sample of each estimator in their order.
    pub(crate) fn add(&mut self, tracking: &Tracking, samples: &[ErrorSample]) {
        self.tracking.push(*tracking);
        for (all, x) in self.samples.iter_mut().zip(samples) {
            all.push(*x);
        }
        if self.tracking.len() >= BLOCK {
            self.measure();
        }
    }

    fn measure(&mut self) {
        let tracking = &self.tracking;
        for measured in &mut self.all {
            match measured {
                Measured::OfEstimator(estimator, windowed) => {
                    let samples = self.samples.get(*estimator);
                    windowed.add_all(tracking, samples.map_or(&[], Vec::as_slice));
                }
                Measured::OfRun(windowed) => windowed.add_all(tracking, tracking),
                Measured::Nothing(window) => tracking.iter().for_each(|t| window.see(t)),
            }
        }
        self.tracking.clear();
        self.samples.iter_mut().for_each(Vec::clear);
    }

    /// The run is over.
    pub(crate) fn finish(&mut self) {
        self.measure();
        for measured in &mut self.all {
            match measured {
                Measured::OfEstimator(_, windowed) => windowed.finish(),
                Measured::OfRun(windowed) => windowed.finish(),
                Measured::Nothing(_) => {}
            }
        }
    }

    /// Values of a finished run, each with its window; `None` if there is nothing to measure.
    pub(crate) fn values(&self) -> impl Iterator<Item = (Option<f64>, Window)> {
        self.all.iter().map(|measured| match measured {
            Measured::OfEstimator(_, w) => (Some(w.value()), w.window),
            Measured::OfRun(w) => (Some(w.value()), w.window),
            Measured::Nothing(window) => (None, *window),
        })
    }
}
