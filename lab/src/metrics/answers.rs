//! Shares of the steps of an external estimator in real time: answers that came late or not at all.

use crate::metrics::series::{Answers, ErrorSample};
use crate::metrics::statistics::{Accumulator, Running};

/// The share of the steps of a window that a count has counted.
pub(crate) fn share_of_asked(count: fn(&Answers) -> f64) -> Running<ErrorSample> {
    Box::new(Share {
        count,
        first: None,
        last: [f64::NAN; 2],
    })
}

struct Share {
    count: fn(&Answers) -> f64,
    /// Count and steps before the window, and at its end.
    first: Option<[f64; 2]>,
    last: [f64; 2],
}

impl Accumulator<ErrorSample> for Share {
    fn add(&mut self, x: &ErrorSample) {
        self.last = [(self.count)(&x.answers), x.answers.asked];
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

    fn sample(asked: f64, late: f64, latency_ms: f64) -> ErrorSample {
        let answers = Answers {
            latency_ms,
            asked,
            late,
            ..Answers::default()
        };
        ErrorSample {
            answers,
            ..ErrorSample::default()
        }
    }

    /// Of 8 steps in the window 2 are late, whatever was before it; the percentile counts the answers that came alone.
    #[test]
    fn shares_are_those_of_the_steps_of_a_window() {
        let mut share = share_of_asked(|a| a.late);
        let mut latency = p99_of_numbers(|x: &ErrorSample| x.answers.latency_ms);
        assert!(share.value().is_nan() && latency.value().is_nan());
        for k in 0..=8 {
            let late = if k < 4 { 5.0 } else { 7.0 };
            let ms = if k % 2 == 0 { f64::from(k) } else { f64::NAN };
            let x = sample(f64::from(100 + k), late, ms);
            share.add(&x);
            latency.add(&x);
        }
        assert_eq!(share.value(), 0.25);
        assert_eq!(latency.value(), 8.0);
        let mut none = share_of_asked(|a| a.late);
        none.add(&sample(f64::NAN, f64::NAN, f64::NAN));
        assert!(none.value().is_nan(), "an estimator of ours");
    }
}
