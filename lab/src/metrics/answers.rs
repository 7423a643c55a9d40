//! Shares of the steps of an external estimator in real time: answers that came late or not at all.

use crate::metrics::series::ErrorSample;
use crate::metrics::statistics::{Accumulator, Running};
use monorig_sim::closed_loop::AnswerCounts;

/// Share of the steps of a window that a counter has counted.
pub(crate) fn share_of_asked(count: fn(&AnswerCounts) -> u64) -> Running<ErrorSample> {
    Box::new(Share {
        count,
        first: None,
        last: [f64::NAN; 2],
    })
}

struct Share {
    count: fn(&AnswerCounts) -> u64,
    /// Count and steps before the window, and at its end.
    first: Option<[f64; 2]>,
    last: [f64; 2],
}

impl Accumulator<ErrorSample> for Share {
    fn add(&mut self, x: &ErrorSample) {
        let counts = x.answers.map(|a| [(self.count)(&a), a.asked]);
        self.last = counts.map_or([f64::NAN; 2], |counts| counts.map(|n| n as f64));
        self.first.get_or_insert(self.last);
    }

    fn value(&self) -> f64 {
        let [before, asked_before] = self.first.unwrap_or([f64::NAN; 2]);
        let [count, asked] = self.last;
        (count - before) / (asked - asked_before)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::percentile::p99_of_numbers;
    use crate::metrics::series::{ErrorSampler, Target};
    use monorig_estimators::api::estimator::Internal;
    use monorig_estimators::api::signals::{Command, Estimate, Measurements};
    use monorig_estimators::{Error as Refused, Estimator};
    use monorig_sim::closed_loop::estimators::RunningEstimator;

    fn sample(asked: u64, late: u64, latency_ms: f64) -> ErrorSample {
        let answers = AnswerCounts {
            latency_ms,
            asked,
            late,
            ..AnswerCounts::default()
        };
        ErrorSample {
            answers: Some(answers),
            ..ErrorSample::default()
        }
    }

    /// Of 8 steps in the window 2 are late, whatever was before it; the percentile counts the answers that came alone.
    #[test]
    fn shares_are_those_of_the_steps_of_a_window() {
        let mut share = share_of_asked(|a| a.late);
        let mut latency = p99_of_numbers(|x: &ErrorSample| x.answers.unwrap().latency_ms);
        assert!(share.value().is_nan() && latency.value().is_nan());
        for k in 0..=8 {
            let late = if k < 4 { 5 } else { 7 };
            let ms = if k % 2 == 0 { k as f64 } else { f64::NAN };
            let x = sample(100 + k, late, ms);
            share.add(&x);
            latency.add(&x);
        }
        assert_eq!(share.value(), 0.25);
        assert_eq!(latency.value(), 8.0);
        let mut none = share_of_asked(|a| a.late);
        none.add(&ErrorSample::default());
        assert!(none.value().is_nan(), "an estimator of ours");
    }

    /// An estimator of a user whose internals have the names of the rig's counts.
    struct Namesake;

    const NAMES: [Internal; 5] = [
        Internal::new("answer_latency_ms", "ms"),
        Internal::new("answers_asked", "1"),
        Internal::new("answers_late", "1"),
        Internal::new("answers_lost", "1"),
        Internal::new("rig_late", "1"),
    ];

    impl Estimator for Namesake {
        fn step(&mut self, _: &Measurements, _: &Command, _: f64) -> Result<Estimate, Refused> {
            Ok(Estimate::default())
        }
        fn reset(&mut self) {}
        fn internals(&self) -> &[Internal] {
            &NAMES
        }
        fn internal_values(&self, values: &mut [f64]) {
            values.fill(7.0);
        }
    }

    #[test]
    fn an_internal_called_rig_late_is_not_taken_for_the_lateness_of_the_rig() {
        let member = RunningEstimator::new("mine", Box::new(Namesake));
        assert_eq!(member.internals_named(["rig_late"]), [Some(7.0)]);
        assert_eq!(member.answers(), None);
        let mut sampler = ErrorSampler::of(&member);
        let mut share = share_of_asked(|a| a.rig_late);
        for _ in 0..3 {
            let x = sampler.sample(&member, &Target::default());
            assert_eq!(x.answers, None);
            share.add(&x);
        }
        assert!(share.value().is_nan());
    }
}
