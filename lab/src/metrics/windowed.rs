//! Metrics over windows of a run, measured while it goes on, in memory that does not grow with the run.

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

/// Steps that are measured at once: what is looked at of them stays near, and each metric is called once for all of
/// them.
const BLOCK: usize = 64;

/// Values of the wanted metrics, in their order.
pub(crate) struct WindowedMetrics {
    all: Vec<Measured>,
    /// Steps not yet measured: the state of the run, and the samples of each estimator.
    tracking: Vec<Tracking>,
    samples: Vec<Vec<ErrorSample>>,
}

/// None where there is no such estimator, or the metric is not one of it.
enum Measured {
    OfEstimator(usize, Windowed<ErrorSample>),
    OfRun(Windowed<Tracking>),
    Nothing(Window),
}

impl WindowedMetrics {
    /// Begins to measure what is wanted of a run with these estimators.
    pub(crate) fn new(
        estimators: &[String],
        wanted: &[WantedMetric],
        limits: &IntegrityLimits,
    ) -> Self {
        let start = |w: &WantedMetric| {
            let metric = find(&w.metric)?;
            Some(match &w.estimator {
                Some(name) => {
                    let i = estimators.iter().position(|e| e == name)?;
                    let running = metric.of_estimator(limits)?;
                    Measured::OfEstimator(i, Windowed::new(w.window, running))
                }
                None => Measured::OfRun(Windowed::new(w.window, metric.of_run()?)),
            })
        };
        let all = wanted.iter();
        Self {
            all: all
                .map(|w| start(w).unwrap_or(Measured::Nothing(w.window)))
                .collect(),
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
                Measured::OfEstimator(i, windowed) => {
                    if let Some(samples) = self.samples.get(*i) {
                        windowed.add_all(tracking, samples);
                    }
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

    /// The values of a run that is over, each with its window; none where there is nothing to measure.
    pub(crate) fn values(&self) -> impl Iterator<Item = (Option<f64>, Window)> {
        self.all.iter().map(|measured| match measured {
            Measured::OfEstimator(_, w) => (Some(w.value()), w.window),
            Measured::OfRun(w) => (Some(w.value()), w.window),
            Measured::Nothing(window) => (None, *window),
        })
    }
}
