//! Innovation gate: whether a measurement enters a filter, by the size of its innovation, and its consistency test and
//! status.

use crate::Real;
use crate::api::aid::{AidOutcome, AidStatus, Rejection};
use crate::api::snapshot::state;
use crate::tuning::STATISTICS;

/// Passage of a measurement through the gate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passage {
    /// The measurement is used.
    Fuse,
    /// The measurement is rejected.
    Reject,
    /// The measurement is used after many rejections, as the filter must be wrong: widen the covariance by the squared
    /// innovation first.
    Reopen,
}

/// Innovation gate of one source: rejects a measurement whose innovation is beyond a number of standard deviations, and
/// reopens after a time of nothing but rejections.
///
/// The test ratio is y²/(k² s² S), S the innovation variance on the un-adapted noise, k the threshold, s² ≥ 1 a running
/// scale: the mean of y²/S, each term clipped at four times the mean. So a gate does not starve a filter whose noise
/// was set too small (that is for the [`NisMonitor`](crate::detect::nis_monitor::NisMonitor) to find), and single
/// outliers do not open it. The timeout is that of the EKF2 estimator of PX4: a filter that rejects a source for longer
/// is reset to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gate {
    on: bool,
    threshold: Real,
    timeout_s: Real,
    scale: Real,
    rejecting_s: Real,
    rejected: u32,
    since_s: Real,
}

/// Decision of the gate on a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judgement {
    /// Passage of the measurement: fused, rejected, or fused after the gate has reopened.
    pub passage: Passage,
    /// Innovation, in the unit of the source, and its variance by the un-adapted noise.
    pub innovation: (Real, Real),
    /// Normalised innovation squared by the un-adapted noise.
    pub nis: Real,
    /// Time since the last measurement, s.
    pub period_s: Real,
    /// Test ratio of the gate.
    pub test_ratio: Real,
}

impl Gate {
    /// Builds a gate that rejects beyond `threshold_sd` standard deviations and reopens after `timeout_s` and at least
    /// three samples. If not `on`, all measurements enter.
    pub fn new(on: bool, threshold_sd: Real, timeout_s: Real) -> Self {
        Self {
            on,
            threshold: threshold_sd * threshold_sd,
            timeout_s,
            scale: 1.0,
            rejecting_s: 0.0,
            rejected: 0,
            since_s: 0.0,
        }
    }

    /// Advances the time by `dt` seconds.
    pub fn tick(&mut self, dt: Real) {
        self.since_s += dt;
    }

    /// Judges a measurement by its innovation and the innovation's variance by the un-adapted noise.
    pub fn judge(&mut self, innovation: Real, variance: Real) -> Judgement {
        let nis = innovation * innovation / variance.max(Real::MIN_POSITIVE);
        let period_s = core::mem::replace(&mut self.since_s, 0.0);
        let (passage, test_ratio) = self.pass(nis, period_s);
        Judgement {
            passage,
            innovation: (innovation, variance),
            nis,
            period_s,
            test_ratio,
        }
    }

    /// Passage of an innovation of normalised square `nis`, `period_s` after the last one, and its test ratio: above 1
    /// the gate acts; 0 if it is off.
    fn pass(&mut self, nis: Real, period_s: Real) -> (Passage, Real) {
        if !self.on || !nis.is_finite() {
            return (Passage::Fuse, 0.0);
        }
        let test_ratio = nis / (self.threshold * self.scale.max(1.0));
        self.scale += (nis.min(STATISTICS.clip * self.scale) - self.scale) / STATISTICS.samples;
        self.scale = self.scale.max(1e-3);
        if test_ratio <= 1.0 {
            (self.rejecting_s, self.rejected) = (0.0, 0);
            return (Passage::Fuse, test_ratio);
        }
        self.rejecting_s += period_s;
        self.rejected = self.rejected.saturating_add(1);
        if self.rejecting_s > self.timeout_s && self.rejected >= STATISTICS.in_a_row {
            (self.rejecting_s, self.rejected) = (0.0, 0);
            return (Passage::Reopen, test_ratio);
        }
        (Passage::Reject, test_ratio)
    }
}

impl Judgement {
    /// Status of the measurement; `fused`: innovation and variance by the filter's own account, where it entered and
    /// the numbers allowed an update.
    pub fn status(&self, fused: Option<(Real, Real)>) -> AidStatus {
        let outcome = match (self.passage, fused) {
            (Passage::Reject, _) => AidOutcome::Rejected(Rejection::Gate),
            (_, None) => AidOutcome::Rejected(Rejection::Numeric),
            (_, Some(_)) => AidOutcome::Fused,
        };
        let numeric = outcome == AidOutcome::Rejected(Rejection::Numeric);
        let (innovation, innovation_variance) = match fused {
            _ if numeric => (0.0, 0.0),
            Some(innovation) => innovation,
            None => self.innovation,
        };
        AidStatus {
            innovation,
            innovation_variance,
            test_ratio: self.test_ratio,
            outcome,
        }
    }
}

state!(Gate { scale, rejecting_s, rejected, since_s; on, threshold, timeout_s }
    where |this| this.scale > 0.0);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn a_jump_of_one_or_two_samples_does_not_enter() {
        let mut gate = Gate::new(true, 5.0, 0.5);
        let mut random = Random::new(91);
        for k in 0..5_000 {
            let bump = k % 500 == 100 || k % 500 == 101;
            let y = random.normal() + if bump { 100.0 } else { 0.0 };
            let (passage, test_ratio) = gate.pass(y * y, 0.01);
            assert_eq!(passage == Passage::Reject, bump, "{k}");
            assert_eq!(test_ratio > 1.0, bump);
        }
    }

    #[test]
    fn it_cannot_lock_a_filter_out() {
        // A shift that stays: reopened after the timeout, however slow the source.
        for (period_s, timeout_s) in [(0.01, 0.5), (0.15, 0.5), (1.0, 0.5)] {
            let mut gate = Gate::new(true, 5.0, timeout_s);
            let count = (1..=1000).find(|_| gate.pass(1e8, period_s).0 == Passage::Reopen);
            let least = (timeout_s / period_s).max(2.0);
            let count = Real::from(count.unwrap());
            assert!(count >= least && count <= least + 2.0, "{count}");
        }
        // Noise set ten times too small: few are rejected once the scale is known.
        let mut gate = Gate::new(true, 5.0, 0.5);
        let mut random = Random::new(92);
        let mut passes = |count: usize| {
            (0..count)
                .filter(|_| gate.pass((10.0 * random.normal()).powi(2), 0.01).0 == Passage::Fuse)
                .count()
        };
        passes(1000);
        assert!(passes(1000) > 990);
    }

    #[test]
    fn off_it_passes_all() {
        let mut gate = Gate::new(false, 5.0, 0.5);
        assert_eq!(gate.pass(1e9, 0.01), (Passage::Fuse, 0.0));
    }

    /// The scale goes to the mean square of the innovations with a memory of 64, whatever they are by; an
    /// outlier counts in it for no more than four times what is usual. Below what is expected the gate is that of the
    /// noise given. A square that is no number is for others.
    #[test]
    fn the_gate_goes_by_the_running_scale() {
        for square in [0.5, 2.0, 3.9] {
            let mut gate = Gate::new(true, 5.0, 0.5);
            for n in 0..400 {
                let scale = 1.0 + (square - 1.0) * (1.0 - (63.0 / 64.0 as Real).powi(n));
                assert!((gate.scale / scale - 1.0).abs() < 1e-9);
                let (_, test_ratio) = gate.pass(square, 0.01);
                let ratio = square / (25.0 * scale.max(1.0));
                assert!((test_ratio / ratio - 1.0).abs() < 1e-9);
            }
            let (scale, limit) = (gate.scale, 25.0 * gate.scale.max(1.0));
            for (by, passage) in [(0.999, Passage::Fuse), (1.001, Passage::Reject)] {
                let mut gate = gate;
                assert_eq!(gate.pass(by * limit, 0.01).0, passage);
                assert!((gate.scale / scale - 1.0 - 3.0 / 64.0).abs() < 1e-9);
                assert_eq!(gate.pass(Real::NAN, 0.01).0, Passage::Fuse);
            }
        }
        let mut gate = Gate::new(true, 5.0, 0.5);
        (0..2_000).for_each(|_| {
            gate.pass(0.0, 0.01);
        });
        assert_eq!(gate.scale, 1e-3);
    }

    /// The time and the number of rejections begin anew with each measurement that enters.
    #[test]
    fn it_reopens_after_rejections_in_a_row() {
        let mut gate = Gate::new(true, 5.0, 0.5);
        for (count, nis, last) in [
            (5, 1e8, Passage::Reject),
            (1, 0.0, Passage::Fuse),
            (5, 1e8, Passage::Reject),
            (1, 1e8, Passage::Reopen),
            (5, 1e8, Passage::Reject),
        ] {
            let all = (0..count).map(|_| gate.pass(nis, 0.099).0).last();
            assert_eq!(all, Some(last));
        }
    }

    #[test]
    fn the_status_says_what_the_gate_did() {
        let mut gate = Gate::new(true, 5.0, 0.5);
        gate.tick(0.01);
        let small = gate.judge(0.3, 0.01);
        assert_eq!((small.passage, small.period_s), (Passage::Fuse, 0.01));
        let fused = small.status(Some((0.3, 0.02)));
        assert_eq!(fused.outcome, AidOutcome::Fused);
        assert!((fused.test_ratio - 9.0 / 25.0).abs() < 1e-6);
        assert_eq!(fused.innovation_variance, 0.02);
        let none = small.status(None);
        assert_eq!(none.outcome, AidOutcome::Rejected(Rejection::Numeric));
        gate.tick(0.01);
        let large = gate.judge(1.0, 0.01);
        let rejected = large.status(None);
        assert_eq!(rejected.outcome, AidOutcome::Rejected(Rejection::Gate));
        assert!(rejected.test_ratio > 1.0 && rejected.innovation == 1.0);
    }

    /// The square is that of the innovation over its variance, and the period the time of all steps since the last
    /// measurement. Numbers that allow no update have no innovation; one that is rejected has that of the gate.
    #[test]
    fn a_judgement_tells_square_and_period() {
        let mut gate = Gate::new(true, 5.0, 0.5);
        (0..3).for_each(|_| gate.tick(0.02));
        let judged = gate.judge(-0.3, 0.01);
        assert!((judged.nis - 9.0).abs() < 1e-9 && (judged.period_s - 0.06).abs() < 1e-12);
        assert_eq!(judged.innovation, (-0.3, 0.01));
        gate.tick(0.01);
        assert_eq!(gate.judge(0.0, 0.0).period_s, 0.01);
        let none = judged.status(None);
        assert_eq!((none.innovation, none.innovation_variance), (0.0, 0.0));
        gate.tick(0.01);
        let rejected = gate.judge(1.0, 0.01);
        for fused in [None, Some((0.5, 0.02))] {
            let status = rejected.status(fused);
            assert_eq!(status.outcome, AidOutcome::Rejected(Rejection::Gate));
            let (innovation, variance) = fused.unwrap_or((1.0, 0.01));
            assert_eq!(
                (status.innovation, status.innovation_variance),
                (innovation, variance)
            );
        }
    }
}
