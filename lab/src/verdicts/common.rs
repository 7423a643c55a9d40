//! Errors of two estimators over the samples that both mark valid.

use crate::metrics::series::ErrorSample;
use crate::metrics::{Metric, Quantity, Running, estimator_metrics};
use monorig_sim::config::scenario::IntegrityLimits;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Errors of an estimator and of the reference over the samples that both mark valid.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CommonErrors {
    /// Share of all samples that both mark valid, by quantity.
    pub(crate) share: BTreeMap<Quantity, f64>,
    /// Values of the estimator and the reference, by metric; null = could not be measured.
    pub(crate) errors: BTreeMap<String, [Option<f64>; 2]>,
}

/// Running sums of [`CommonErrors`].
pub(super) struct CommonErrorsSoFar {
    samples: u64,
    both_valid: BTreeMap<Quantity, u64>,
    errors: Vec<ErrorsSoFar>,
}

struct ErrorsSoFar {
    metric: &'static Metric,
    quantity: Quantity,
    own: Running<ErrorSample>,
    reference: Running<ErrorSample>,
}

impl CommonErrorsSoFar {
    pub(crate) fn new(limits: &IntegrityLimits) -> Self {
        let errors = estimator_metrics().filter(|m| !m.is_of_valid());
        let errors = errors.filter_map(|metric| {
            Some(ErrorsSoFar {
                metric,
                quantity: metric.error_of()?,
                own: metric.of_estimator(limits)?,
                reference: metric.of_estimator(limits)?,
            })
        });
        Self {
            samples: 0,
            both_valid: Quantity::ALL.map(|q| (q, 0)).into(),
            errors: errors.collect(),
        }
    }

    /// Adds the samples of one step.
    pub(crate) fn add(&mut self, own: &ErrorSample, reference: &ErrorSample) {
        let both = |q: Quantity| q.is_valid(own) && q.is_valid(reference);
        self.samples += 1;
        for (q, n) in &mut self.both_valid {
            *n += u64::from(both(*q));
        }
        for e in self.errors.iter_mut().filter(|e| both(e.quantity)) {
            e.own.add(own);
            e.reference.add(reference);
        }
    }

    pub(crate) fn value(&self) -> CommonErrors {
        let share = self.both_valid.iter();
        let share = share.map(|(q, n)| (*q, *n as f64 / self.samples.max(1) as f64));
        let errors = self.errors.iter().map(|e| {
            let values = [e.own.value(), e.reference.value()];
            let finite = values.map(|x| Some(x).filter(|x| x.is_finite()));
            (e.metric.name.to_owned(), finite)
        });
        CommonErrors {
            share: share.collect(),
            errors: errors.collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Only what both mark valid counts, and the order of the two does not change which samples these are.
    #[test]
    fn common_samples_are_those_that_both_mark_valid() {
        let of = |marks: [bool; 4], e: f64| -> Vec<ErrorSample> {
            let samples = marks.iter().enumerate();
            samples
                .map(|(i, valid)| ErrorSample {
                    mass_kg: 1000.0 * e * (1.0 + i as f64),
                    mass_valid: *valid,
                    ..Default::default()
                })
                .collect()
        };
        let common = |a: &[ErrorSample], b: &[ErrorSample]| {
            let mut so_far = CommonErrorsSoFar::new(&IntegrityLimits::default());
            a.iter().zip(b).for_each(|(a, b)| so_far.add(a, b));
            let common = so_far.value();
            (common.share[&Quantity::Mass], common.errors["mass_rmse_kg"])
        };
        let a = of([true, true, false, true], 0.1);
        let b = of([false, true, true, true], 0.2);
        let rms = (0.5 * (4.0 + 16.0f64)).sqrt();
        let near = |x: Option<f64>, y: f64| x.is_some_and(|x| (x - y).abs() < 1e-9);
        let (share, [ours, theirs]) = common(&a, &b);
        assert!(near(ours, 100.0 * rms) && near(theirs, 200.0 * rms) && share == 0.5);
        let (_, [ours, theirs]) = common(&b, &a);
        assert!(near(ours, 200.0 * rms) && near(theirs, 100.0 * rms));
        let c = of([false; 4], 0.2);
        assert_eq!(common(&a, &c), (0.0, [None, None]));
    }
}
