//! Status of each measurement source, so that a plot shows why an estimate moved or did not.

use crate::Real;
use crate::api::snapshot::{Archive, State, state};

/// The last measurement of one source as the filter saw it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AidStatus {
    /// Measurement minus prediction, in the unit of the source.
    pub innovation: Real,
    /// Variance of this innovation by the filter.
    pub innovation_variance: Real,
    /// Innovation squared over variance and over the gate's threshold: above 1 the gate acts. 0 where there is no gate.
    pub test_ratio: Real,
    /// Outcome: fused, deweighted, rejected or stale.
    pub outcome: AidOutcome,
}

impl AidStatus {
    /// Makes the status of a rejected measurement without an innovation.
    pub(crate) fn not_fused(outcome: AidOutcome) -> Self {
        Self {
            outcome,
            ..Self::default()
        }
    }

    /// Normalised innovation squared by the filter; `None` without an innovation.
    pub fn nis(&self) -> Option<Real> {
        let nis = self.innovation * self.innovation / self.innovation_variance;
        nis.is_finite().then_some(nis)
    }
}

/// Outcome of a measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum AidOutcome {
    /// No measurement has come, or none for such a long time that the source counts as lost.
    #[default]
    Stale,
    /// The measurement was used with the weight of its variance.
    Fused,
    /// The measurement was used with less weight.
    Deweighted,
    /// The measurement was not used.
    Rejected(Rejection),
}

/// Reason why a measurement was not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Rejection {
    /// The innovation was beyond the gate.
    Gate,
    /// Wheels contradict each other: slip.
    Slip,
    /// The channel repeats one value: stuck sensor.
    Stuck,
    /// The vehicle stands or brakes: the model does not hold.
    NotRunning,
    /// The regressor is not excited: nothing to learn from it.
    NotExcited,
    /// The update would have given a state that is not finite or no covariance.
    Numeric,
}

impl AidOutcome {
    /// Code for a record: 0 stale, 1 fused, 2 deweighted, from 3 on rejected (gate, slip, stuck, not running, not
    /// excited, numeric).
    pub fn code(self) -> u8 {
        match self {
            AidOutcome::Stale => 0,
            AidOutcome::Fused => 1,
            AidOutcome::Deweighted => 2,
            AidOutcome::Rejected(reason) => match reason {
                Rejection::Gate => 3,
                Rejection::Slip => 4,
                Rejection::Stuck => 5,
                Rejection::NotRunning => 6,
                Rejection::NotExcited => 7,
                Rejection::Numeric => 8,
            },
        }
    }
}

impl AidOutcome {
    /// Returns the outcome of this code, if there is one.
    pub fn from_code(code: u8) -> Option<Self> {
        Some(match code {
            0 => AidOutcome::Stale,
            1 => AidOutcome::Fused,
            2 => AidOutcome::Deweighted,
            3 => AidOutcome::Rejected(Rejection::Gate),
            4 => AidOutcome::Rejected(Rejection::Slip),
            5 => AidOutcome::Rejected(Rejection::Stuck),
            6 => AidOutcome::Rejected(Rejection::NotRunning),
            7 => AidOutcome::Rejected(Rejection::NotExcited),
            8 => AidOutcome::Rejected(Rejection::Numeric),
            _ => return None,
        })
    }
}

impl State for AidOutcome {
    fn visit(&mut self, archive: &mut Archive) {
        let mut code = self.code();
        code.visit(archive);
        let read = Self::from_code(code);
        archive.require(read.is_some());
        *self = read.unwrap_or_default();
    }
}

state!(AidStatus { innovation, innovation_variance, test_ratio, outcome; });

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_that_of_its_outcome() {
        for code in 0..9 {
            assert_eq!(AidOutcome::from_code(code).map(|o| o.code()), Some(code));
        }
        assert_eq!(AidOutcome::from_code(9), None);
    }
}
