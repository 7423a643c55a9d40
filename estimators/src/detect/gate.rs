//! Gate, the second layer of a measurement source: it decides whether a measurement enters, and prepares its
//! consistency test and its status.

use crate::Real;
use crate::api::aid::{AidOutcome, AidStatus, Rejection};
use crate::api::snapshot::state;
use crate::detect::innovation_gate::{InnovationGate, Passage};
use crate::detect::validity::Integrity;

/// Gate of one source with the time since its last measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gate {
    gate: InnovationGate,
    since_s: Real,
}

/// Decision of the gate on a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judgement {
    /// Passage of the measurement: fused, rejected, or fused after the gate has reopened.
    pub passage: Passage,
    /// Innovation, in the unit of the source, and its variance on the un-adapted noise.
    pub innovation: (Real, Real),
    /// Normalised innovation squared on the un-adapted noise.
    pub nis: Real,
    /// Time since the measurement before, s.
    pub period_s: Real,
    /// Test ratio of the gate.
    pub test_ratio: Real,
}

impl Gate {
    /// Builds the gate with the parameters of the innovation gates.
    pub fn new(integrity: &Integrity) -> Self {
        Self::switched(integrity, true)
    }

    /// Builds the gate, on or off; off, all measurements enter.
    pub fn switched(integrity: &Integrity, on: bool) -> Self {
        Self {
            gate: integrity.gate(on),
            since_s: 0.0,
        }
    }

    /// `dt` seconds have passed.
    pub fn tick(&mut self, dt: Real) {
        self.since_s += dt;
    }

    /// Judges a measurement by its innovation and the variance of that on the un-adapted noise.
    pub fn judge(&mut self, innovation: Real, variance: Real) -> Judgement {
        let nis = innovation * innovation / variance.max(Real::MIN_POSITIVE);
        let period_s = core::mem::replace(&mut self.since_s, 0.0);
        Judgement {
            passage: self.gate.judge(nis, period_s),
            innovation: (innovation, variance),
            nis,
            period_s,
            test_ratio: self.gate.test_ratio(),
        }
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

state!(Gate { gate, since_s; });

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_status_says_what_the_gate_did() {
        let mut gate = Gate::new(&Integrity::default());
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
        let mut gate = Gate::new(&Integrity::default());
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
