//! Metrics over windows of a run, measured during the run, in constant memory.

use crate::metrics::series::{ErrorSample, Tracking};
use crate::metrics::window::{Window, Windowed};
use crate::metrics::{OfSome, find};
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
    groups: Vec<SampleGroup>,
    /// Steps not yet measured: the state of the run, and the samples of each estimator.
    tracking: Vec<Tracking>,
    samples: Vec<Vec<ErrorSample>>,
}

/// Nothing where there is no such estimator, or the metric is not one of it.
enum Measured {
    /// Its group, and its place in it.
    OfEstimator(usize, usize),
    OfRun(Windowed<Tracking>),
    Nothing(Window),
}

/// Metrics of one estimator over the same samples: which of them count is found once for all.
struct SampleGroup {
    estimator: usize,
    windowed: Windowed<ErrorSample, OfSome>,
}

impl WindowedMetrics {
    /// Begins to measure the wanted metrics of a run with these estimators.
    pub(crate) fn new(
        estimators: &[String],
        wanted: &[WantedMetric],
        limits: &IntegrityLimits,
    ) -> Self {
        let mut groups: Vec<SampleGroup> = Vec::new();
        let mut start = |w: &WantedMetric| {
            let metric = find(&w.metric)?;
            let Some(name) = &w.estimator else {
                return Some(Measured::OfRun(Windowed::new(w.window, metric.of_run()?)));
            };
            let estimator = estimators.iter().position(|e| e == name)?;
            let (which, running) = metric.of_chosen(limits)?;
            let same = |g: &SampleGroup| {
                g.estimator == estimator
                    && g.windowed.window == w.window
                    && g.windowed.running.which == which
            };
            let known = groups.iter().position(same);
            let group = known.unwrap_or(groups.len());
            if known.is_none() {
                let none = OfSome {
                    which,
                    all: Vec::new(),
                };
                groups.push(SampleGroup {
                    estimator,
                    windowed: Windowed::new(w.window, none),
                });
            }
            let all = &mut groups.get_mut(group)?.windowed.running.all;
            all.push(running);
            Some(Measured::OfEstimator(group, all.len() - 1))
        };
        let all = wanted.iter();
        Self {
            all: all
                .map(|w| start(w).unwrap_or(Measured::Nothing(w.window)))
                .collect(),
            groups,
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
        for group in &mut self.groups {
            if let Some(samples) = self.samples.get(group.estimator) {
                group.windowed.add_all(tracking, samples);
            }
        }
        for measured in &mut self.all {
            match measured {
                Measured::OfEstimator(..) => {}
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
        self.groups.iter_mut().for_each(|g| g.windowed.finish());
        for measured in &mut self.all {
            if let Measured::OfRun(windowed) = measured {
                windowed.finish();
            }
        }
    }

    /// Values of a finished run, each with its window; `None` if there is nothing to measure.
    pub(crate) fn values(&self) -> impl Iterator<Item = (Option<f64>, Window)> {
        self.all.iter().filter_map(|measured| {
            Some(match measured {
                Measured::OfEstimator(group, place) => {
                    let windowed = &self.groups.get(*group)?.windowed;
                    let metric = windowed.running.all.get(*place)?;
                    (Some(metric.value()), windowed.window)
                }
                Measured::OfRun(w) => (Some(w.value()), w.window),
                Measured::Nothing(window) => (None, *window),
            })
        })
    }
}
