//! Innovation gate: whether a measurement enters a filter, by the size of its innovation.

use crate::Real;
use crate::api::snapshot::state;
use crate::tuning;

/// Passage of a measurement through the gate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passage {
    /// It enters.
    Fuse,
    /// It does not.
    Reject,
    /// It enters after so many rejections that the filter must be wrong: widen the covariance by the squared innovation
    /// first.
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
pub struct InnovationGate {
    on: bool,
    threshold: Real,
    timeout_s: Real,
    scale: Real,
    rejecting_s: Real,
    rejected: u32,
    test_ratio: Real,
}

impl InnovationGate {
    /// Rejects beyond `threshold_sd` standard deviations; reopens after `timeout_s` and at least three samples. If not
    /// `on`, all enter.
    pub fn new(on: bool, threshold_sd: Real, timeout_s: Real) -> Self {
        Self {
            on,
            threshold: threshold_sd * threshold_sd,
            timeout_s,
            scale: 1.0,
            rejecting_s: 0.0,
            rejected: 0,
            test_ratio: 0.0,
        }
    }

    /// Judges an innovation of normalised square `nis` (on the un-adapted noise), `period_s` after the one before.
    pub fn judge(&mut self, nis: Real, period_s: Real) -> Passage {
        if !self.on || !nis.is_finite() {
            return Passage::Fuse;
        }
        self.test_ratio = nis / (self.threshold * self.scale.max(1.0));
        self.scale += (nis.min(tuning::INNOVATION_GATE.scale_clip * self.scale) - self.scale)
            / tuning::INNOVATION_GATE.scale_memory;
        self.scale = self.scale.max(1e-3);
        if self.test_ratio <= 1.0 {
            (self.rejecting_s, self.rejected) = (0.0, 0);
            return Passage::Fuse;
        }
        self.rejecting_s += period_s;
        self.rejected = self.rejected.saturating_add(1);
        if self.rejecting_s > self.timeout_s
            && self.rejected >= tuning::INNOVATION_GATE.min_rejections
        {
            (self.rejecting_s, self.rejected) = (0.0, 0);
            return Passage::Reopen;
        }
        Passage::Reject
    }

    /// Test ratio of the last innovation: above 1 the gate acts; 0 if it is off.
    pub fn test_ratio(&self) -> Real {
        self.test_ratio
    }
}

state!(InnovationGate { scale, rejecting_s, rejected, test_ratio; on, threshold, timeout_s }
    where |this| this.scale > 0.0);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn a_jump_of_one_or_two_samples_does_not_enter() {
        let mut gate = InnovationGate::new(true, 5.0, 0.5);
        let mut random = Random::new(91);
        for k in 0..5_000 {
            let bump = k % 500 == 100 || k % 500 == 101;
            let y = random.normal() + if bump { 100.0 } else { 0.0 };
            let passage = gate.judge(y * y, 0.01);
            assert_eq!(passage == Passage::Reject, bump, "{k}");
            assert_eq!(gate.test_ratio() > 1.0, bump);
        }
    }

    #[test]
    fn it_cannot_lock_a_filter_out() {
        // A shift that stays: reopened after the timeout, however slow the source.
        for (period_s, timeout_s) in [(0.01, 0.5), (0.15, 0.5), (1.0, 0.5)] {
            let mut gate = InnovationGate::new(true, 5.0, timeout_s);
            let count = (1..=1000).find(|_| gate.judge(1e8, period_s) == Passage::Reopen);
            let least = (timeout_s / period_s).max(2.0);
            let count = Real::from(count.unwrap());
            assert!(count >= least && count <= least + 2.0, "{count}");
        }
        // Noise set ten times too small: few are rejected once the scale is known.
        let mut gate = InnovationGate::new(true, 5.0, 0.5);
        let mut random = Random::new(92);
        let mut passes = |count: usize| {
            (0..count)
                .filter(|_| gate.judge((10.0 * random.normal()).powi(2), 0.01) == Passage::Fuse)
                .count()
        };
        passes(1000);
        assert!(passes(1000) > 990);
    }

    #[test]
    fn off_it_passes_all() {
        let mut gate = InnovationGate::new(false, 5.0, 0.5);
        assert_eq!(gate.judge(1e9, 0.01), Passage::Fuse);
        assert_eq!(gate.test_ratio(), 0.0);
    }

    /// The scale goes to the mean square of the innovations with a memory of a hundred, whatever they are by; an
    /// outlier counts in it for no more than four times what is usual. Below what is expected the gate is that of the
    /// noise given. A square that is no number is for others.
    #[test]
    fn the_gate_goes_by_the_running_scale() {
        for square in [0.5, 2.0, 3.9] {
            let mut gate = InnovationGate::new(true, 5.0, 0.5);
            for n in 0..400 {
                let scale = 1.0 + (square - 1.0) * (1.0 - (0.99 as Real).powi(n));
                assert!((gate.scale / scale - 1.0).abs() < 1e-9);
                gate.judge(square, 0.01);
                let ratio = square / (25.0 * scale.max(1.0));
                assert!((gate.test_ratio() / ratio - 1.0).abs() < 1e-9);
            }
            let (scale, limit) = (gate.scale, 25.0 * gate.scale.max(1.0));
            for (by, passage) in [(0.999, Passage::Fuse), (1.001, Passage::Reject)] {
                let mut gate = gate;
                assert_eq!(gate.judge(by * limit, 0.01), passage);
                assert!((gate.scale / scale - 1.03).abs() < 1e-9);
                assert_eq!(gate.judge(Real::NAN, 0.01), Passage::Fuse);
            }
        }
        let mut gate = InnovationGate::new(true, 5.0, 0.5);
        (0..2_000).for_each(|_| {
            gate.judge(0.0, 0.01);
        });
        assert_eq!(gate.scale, 1e-3);
    }

    /// The time and the number of rejections begin anew with each measurement that enters.
    #[test]
    fn it_reopens_after_rejections_in_a_row() {
        let mut gate = InnovationGate::new(true, 5.0, 0.5);
        for (count, nis, last) in [
            (5, 1e8, Passage::Reject),
            (1, 0.0, Passage::Fuse),
            (5, 1e8, Passage::Reject),
            (1, 1e8, Passage::Reopen),
            (5, 1e8, Passage::Reject),
        ] {
            let all = (0..count).map(|_| gate.judge(nis, 0.099)).last();
            assert_eq!(all, Some(last));
        }
    }
}
