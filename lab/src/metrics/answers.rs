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
