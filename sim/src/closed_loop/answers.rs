//! Steps of an estimator outside the program in real time: how many were answered, and when.

use std::sync::{Arc, Mutex, PoisonError};

/// Counts of the steps, so far, of an estimator outside the program.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AnswerCounts {
    /// Longest time to an answer since the step before, ms; NaN without an answer.
    pub latency_ms: f64,
    /// Steps that were sent.
    pub asked: u64,
    /// Answers that came too late.
    pub late: u64,
    /// Steps without an answer.
    pub lost: u64,
    /// Steps that the rig itself sent too late.
    pub rig_late: u64,
}

/// The counts of one estimator, which its link writes and the rig records.
#[derive(Clone, Debug, Default)]
pub struct AnswerCounter(Arc<Mutex<AnswerCounts>>);

impl AnswerCounter {
    /// The counts after the last step.
    pub fn get(&self) -> AnswerCounts {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Replaces the counts.
    pub fn set(&self, counts: AnswerCounts) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = counts;
    }
}
