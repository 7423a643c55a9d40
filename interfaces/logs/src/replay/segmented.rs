//! Estimators over a log of several segments.

use monorig_estimators::Real;
use monorig_estimators::api::aid::AidStatus;
use monorig_estimators::api::estimator::{Estimator, Internal};
use monorig_estimators::api::signals::{Command, Estimate, Measurements};
use monorig_estimators::api::snapshot::SnapshotError;
use monorig_sim::closed_loop::registry::BoxedEstimator;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// Time of the first sample after zero of the log's clock above which the clock has run before the log, s.
const MAX_FIRST_STEP_S: f64 = 1.0;

/// An estimator that is reset where a new segment of the log begins.
pub(super) struct Segmented {
    pub inner: BoxedEstimator,
    pub segment: Arc<AtomicU32>,
    pub known: Option<u32>,
    pub step_s: f64,
}

/// A step of a second, which is as long as steps of estimators may be, without the rounding of the times at its ends.
fn within_a_second(dt: Real) -> Real {
    if dt > 1.0 && dt < 1.0 + 1e-6 { 1.0 } else { dt }
}

impl Estimator for Segmented {
    fn step(
        &mut self,
        z: &Measurements,
        u: &Command,
        dt: Real,
    ) -> Result<Estimate, monorig_estimators::Error> {
        let segment = self.segment.load(Ordering::Relaxed);
        match self.known.replace(segment) {
            Some(known) if known == segment => return self.inner.step(z, u, within_a_second(dt)),
            Some(_) => self.inner.reset(),
            // a log whose clock began with it
            None if dt > 0.0 && dt <= MAX_FIRST_STEP_S => return self.inner.step(z, u, dt),
            None => {}
        }
        // the first step of a segment: the time before it does not count
        self.inner.step(z, u, self.step_s)
    }
    fn reset(&mut self) {
        self.inner.reset();
    }
    fn internals(&self) -> &[Internal] {
        self.inner.internals()
    }
    fn internal_values(&self, values: &mut [Real]) {
        self.inner.internal_values(values);
    }
    fn aid_sources(&self) -> &[&'static str] {
        self.inner.aid_sources()
    }
    fn aid_status(&self, status: &mut [AidStatus]) {
        self.inner.aid_status(status);
    }
    fn snapshot(&self, bytes: &mut [u8]) -> Result<usize, SnapshotError> {
        self.inner.snapshot(bytes)
    }
    fn restore(&mut self, snapshot: &[u8]) -> Result<(), SnapshotError> {
        self.inner.restore(snapshot)
    }
}
