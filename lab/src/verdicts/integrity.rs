//! Integrity of the estimators of a run: how many of their valid samples are misleading, and the worst of these.

use crate::metrics::series::ErrorSample;
use crate::metrics::{Marks, Quantity, mark};
use monorig_sim::config::scenario::{IntegrityLimits, KnownFailure, ScenarioFile};
use serde::{Deserialize, Serialize};

/// Quality of one estimator's marks of one quantity, over a whole run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Integrity {
    pub(crate) estimator: String,
    pub(crate) quantity: Quantity,
    /// Samples.
    pub(crate) samples: u64,
    /// Samples that are marked valid.
    pub(crate) valid: u64,
    /// Valid samples with a reference.
    #[serde(default)]
    pub(crate) judged: u64,
    /// Valid samples whose reference is too coarse to show that an estimate is right.
    #[serde(default)]
    pub(crate) coarse: u64,
    /// Misleading samples: marked valid, and the error exceeds k reported standard deviations and the alert limit.
    pub(crate) misleading: u64,
    /// Overconfident samples: marked valid, and the error exceeds k reported standard deviations, for any size.
    #[serde(default)]
    pub(crate) overconfident: u64,
    /// Alert limit: a share of the mass, or degrees.
    pub(crate) alert: f64,
    /// The misleading sample with the largest error.
    pub(crate) worst: Option<Misleading>,
    /// Largest share of misleading samples among the valid samples over all seeds; none for an estimator that is shown
    /// for reference only.
    pub(crate) at_most: Option<f64>,
    /// Reason of the known failure, if the integrity has one and `expect` does not bound it.
    pub(crate) known_failure: Option<String>,
    /// Share above which the failure is worse than known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) no_worse_than: Option<f64>,
}

/// The outcome of an integrity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// The estimator is shown for reference only.
    ForReference,
    /// No sample is marked valid, so no sample can mislead.
    NothingValid,
    /// No sample marked valid has a reference.
    NoReference,
    /// The misleading share is within the allowed share.
    Holds,
    /// The misleading share exceeds the allowed share, as a known failure.
    KnownFailure,
    /// The misleading share exceeds the allowed share, or the known failure.
    Fails,
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
    /// True if another integrity has the same estimator and quantity.
    pub(crate) fn is_of_same(&self, other: &Self) -> bool {
        (&self.estimator, self.quantity) == (&other.estimator, other.quantity)
    }

    /// Integrity of every quantity of an estimator, before its first sample. `judged` is false for one that is there
    /// for reference only.
    pub(crate) fn of(
        estimator: &str,
        judged: bool,
        limits: &IntegrityLimits,
        file: &ScenarioFile,
    ) -> [Self; 3] {
        Quantity::ALL.map(|quantity| {
            let metric = mark(quantity, Marks::Integrity);
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
                judged: 0,
                coarse: 0,
                misleading: 0,
                overconfident: 0,
                alert: quantity.alert(limits),
                worst: None,
                at_most: judged.then_some(limits.max_share),
                known_failure: known_failure.map(|k| k.why.clone()),
                no_worse_than: known_failure.map(|k| k.no_worse_than.get()),
            }
        })
    }

    /// Adds a sample.
    pub(crate) fn count(&mut self, x: &ErrorSample, limits: &IntegrityLimits) {
        let quantity = self.quantity;
        self.samples += 1;
        self.valid += u64::from(quantity.is_valid(x));
        let judged = quantity.is_judged(x);
        self.judged += u64::from(judged);
        self.coarse += u64::from(judged && quantity.is_coarse(x, limits));
        self.overconfident += u64::from(quantity.is_overconfident(x, limits));
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

    /// Share of misleading samples among the judged samples; NaN if no sample could be judged.
    pub(crate) fn share(&self) -> f64 {
        self.misleading as f64 / self.judged as f64
    }

    /// Valid samples whose reference can show that they are right.
    pub(super) fn fine(&self) -> u64 {
        self.judged - self.coarse.min(self.judged)
    }

    /// Decides it: every verdict and every report reads this.
    pub(crate) fn outcome(&self) -> Outcome {
        let share = self.share();
        match (self.at_most, &self.known_failure) {
            (None, _) => Outcome::ForReference,
            _ if self.valid == 0 => Outcome::NothingValid,
            _ if self.judged == 0 => Outcome::NoReference,
            (Some(most), _) if share <= most && self.fine() == 0 => Outcome::NoReference,
            (Some(most), _) if share <= most => Outcome::Holds,
            (_, Some(_)) if self.no_worse_than.is_none_or(|x| share <= x) => Outcome::KnownFailure,
            _ => Outcome::Fails,
        }
    }

    /// True if the counts are possible.
    pub(crate) fn is_possible(&self) -> bool {
        self.misleading <= self.judged
            && self.overconfident <= self.judged
            && self.coarse <= self.judged
            && self.judged <= self.valid
            && self.valid <= self.samples
            && self.worst.is_some() == (self.misleading > 0)
    }

    /// Error of the worst sample in alert limits; 0 if no sample is misleading.
    pub(crate) fn severity(&self) -> f64 {
        self.worst.map_or(0.0, |w| w.error.abs() / self.alert)
    }

    /// Misleading share in a few words, such as `slope 55 %, known`; `None` if no sample is valid or could be judged.
    pub(crate) fn share_words(&self) -> Option<String> {
        let mark = match self.outcome() {
            Outcome::NothingValid | Outcome::NoReference => return None,
            Outcome::KnownFailure => ", known",
            Outcome::Fails => ", FAILED",
            Outcome::ForReference | Outcome::Holds => "",
        };
        (self.judged > 0).then(|| match self.misleading {
            0 => "no".to_owned(),
            _ => format!(
                "{} {} %{mark}",
                self.quantity.words(),
                percent(self.share())
            ),
        })
    }

    /// Adds the counts of another run of the same estimator and quantity.
    pub(crate) fn add(&mut self, other: &Self) {
        self.samples += other.samples;
        self.valid += other.valid;
        self.judged += other.judged;
        self.coarse += other.coarse;
        self.misleading += other.misleading;
        self.overconfident += other.overconfident;
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

/// A share in per cent with two significant digits.
pub(super) fn percent(share: f64) -> String {
    let x = 100.0 * share;
    match x {
        x if x >= 10.0 => format!("{x:.0}"),
        x if x >= 1.0 => format!("{x:.1}"),
        x if x >= 0.1 => format!("{x:.2}"),
        x => format!("{x:.3}"),
    }
}
