//! Integrity of the estimators of a run: how many of their valid samples are misleading, and the worst of these.

use crate::metrics::series::ErrorSample;
use crate::metrics::{Quantity, misleading_share};
use monorig_sim::config::scenario::{IntegrityLimits, KnownFailure, ScenarioFile};
use serde::{Deserialize, Serialize};

/// Quality of one estimator's marks of one quantity, over a whole run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Integrity {
    pub(crate) estimator: String,
    pub(crate) quantity: Quantity,
    /// Samples with a reference.
    pub(crate) samples: u64,
    /// Those of them that are marked valid.
    pub(crate) valid: u64,
    /// Misleading samples: marked valid, and the error exceeds k reported standard deviations and the alert limit.
    pub(crate) misleading: u64,
    /// Alert limit: a share of the mass, or degrees.
    pub(crate) alert: f64,
    /// The misleading sample with the largest error.
    pub(crate) worst: Option<Misleading>,
    /// Most that may be misleading of the valid samples over all seeds; none for an estimator that is shown for
    /// reference only.
    pub(crate) at_most: Option<f64>,
    /// Why it is known to be misleading, if it is and `expect` does not bound it.
    pub(crate) known_failure: Option<String>,
}

/// A misleading sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Misleading {
    /// Instant, s.
    pub(crate) t_s: f64,
    /// Error: a share of the mass, or degrees.
    pub(crate) error: f64,
    /// (error / reported standard deviation)²; none if it is infinite.
    pub(crate) nees: Option<f64>,
}

impl Integrity {
    /// Integrity of every quantity of an estimator, before its first sample. `judged` is false for one that is there
    /// for reference only.
    pub(crate) fn of(
        estimator: &str,
        judged: bool,
        limits: &IntegrityLimits,
        file: &ScenarioFile,
    ) -> [Self; 3] {
        Quantity::ALL.map(|quantity| {
            let metric = misleading_share(quantity);
            let meant = |k: &&KnownFailure| {
                k.metric == metric
                    && k.estimator.as_deref() == Some(estimator)
                    && !file.expect.iter().any(|e| e.is_meant_by(k))
            };
            let known_failure = file.known_failures.iter().find(meant);
            Self {
                estimator: estimator.to_owned(),
                quantity,
                samples: 0,
                valid: 0,
                misleading: 0,
                alert: quantity.alert(limits),
                worst: None,
                at_most: judged.then_some(limits.max_share),
                known_failure: known_failure.map(|k| k.why.clone()),
            }
        })
    }

    /// One sample more.
    pub(crate) fn count(&mut self, x: &ErrorSample, limits: &IntegrityLimits) {
        let quantity = self.quantity;
        // without a reference nobody knows whether a sample misleads
        if !quantity.has_reference(x) {
            return;
        }
        self.samples += 1;
        self.valid += u64::from(quantity.is_valid(x));
        if !quantity.is_misleading(x, limits) {
            return;
        }
        self.misleading += 1;
        let error = quantity.error(x);
        if self.worst.is_none_or(|w| error.abs() >= w.error.abs()) {
            self.worst = Some(Misleading {
                t_s: x.t_s,
                error,
                nees: Some(quantity.nees(x)).filter(|n| n.is_finite()),
            });
        }
    }

    /// Share of the valid samples that is misleading; not a number if none is valid.
    pub(crate) fn share(&self) -> f64 {
        self.misleading as f64 / self.valid as f64
    }

    /// Error of the worst sample in alert limits; 0 if none is misleading.
    pub(crate) fn severity(&self) -> f64 {
        self.worst.map_or(0.0, |w| w.error.abs() / self.alert)
    }

    /// Adds the counts of another run of the same estimator and quantity.
    pub(crate) fn add(&mut self, other: &Self) {
        self.samples += other.samples;
        self.valid += other.valid;
        self.misleading += other.misleading;
        if other.severity() > self.severity() {
            self.worst = other.worst;
        }
    }

    /// Describes the worst sample, such as `marks a mass valid that is 59 % off: NEES 215`; `None` if none is
    /// misleading.
    pub(crate) fn words(&self) -> Option<String> {
        let worst = self.worst?;
        let nees = worst
            .nees
            .map_or("infinite".to_owned(), |n| format!("{n:.0}"));
        let off = match self.quantity {
            Quantity::Mass => format!("{:.0} %", 100.0 * worst.error.abs()),
            _ => format!("{:.2}°", worst.error.abs()),
        };
        let article = match self.quantity {
            Quantity::EffectiveSlope => "an",
            _ => "a",
        };
        Some(format!(
            "{} marks {article} {} valid that is {off} off: NEES {nees}",
            self.estimator,
            self.quantity.words()
        ))
    }
}
