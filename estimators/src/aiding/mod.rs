//! Measurements of a state that many instruments observe, one in each file: a measurement is an [`Aid`], and [`fuse`]
//! lets it correct the belief.
//!
//! Three layers, as in PX4's ekf2: *control* ([`Control`]) finds out whether a step brings the measurement at all, a
//! *gate* ([`GateRule`]) weighs its innovation against what is expected, and the rest is *fused*. [`fuse`]
//! makes the status of a measurement; without a measurement the control layer gives the reason.

pub mod force_balance;
pub mod force_window;
pub mod lateral;
pub mod standstill;
pub mod vertical;
pub mod wheels;

use nalgebra::SVector;

use crate::Real;
use crate::api::aid::{AidOutcome, AidStatus, Rejection};
use crate::api::real::sqrt;
use crate::detect::control::Control;
use crate::filters::gaussian::Gaussian;

/// A measurement of one number that the state `x` predicts: z = h(x) + v, v ~ N(0, R).
pub trait Aid<const N: usize> {
    /// Innovation z − h(x). A mean over a time takes the states of its samples.
    fn innovation(&self, x: &SVector<Real, N>) -> Real;

    /// Measurement without noise.
    fn h(&self, x: &SVector<Real, N>) -> Real;

    /// Its Jacobian ∂h/∂x, as a column.
    fn H(&self, x: &SVector<Real, N>) -> SVector<Real, N>;

    /// Variance of its noise.
    fn R(&self) -> Real;
}

/// Rule for an innovation that is larger than expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GateRule {
    /// The innovation counts as any other.
    Open,
    /// Beyond this size the innovation does not count, for this reason.
    Reject(Real, Rejection),
    /// Beyond this number of standard deviations the noise is increased until the innovation has this number (Huber
    /// 1964).
    Deweight(Real),
}

impl GateRule {
    /// Square of an innovation `y` of variance `S` over the gate's threshold; 0 without a gate.
    fn ratio(self, y: Real, S: Real) -> Real {
        let threshold = match self {
            GateRule::Open => return 0.0,
            GateRule::Reject(most, _) => most * most,
            GateRule::Deweight(sd) => sd * sd * S,
        };
        y * y / threshold.max(Real::MIN_POSITIVE)
    }
}

/// Corrects a belief by a measurement and returns its status; `None` without a new measurement.
#[inline]
pub fn fuse<const N: usize>(
    belief: &mut Gaussian<N>,
    aid: Control<impl Aid<N>>,
    gate: GateRule,
) -> Option<AidStatus> {
    let aid = match aid {
        Control::New(aid) => aid,
        Control::Held => return None,
        Control::Out(outcome) => return Some(AidStatus::not_fused(outcome)),
    };
    Some(Innovation::of(belief, &aid).fuse(belief, gate))
}

/// Innovation of a measurement against a belief.
pub struct Innovation<const N: usize> {
    y: Real,
    h: SVector<Real, N>,
    Ph: SVector<Real, N>,
    /// Variance of the noise of the measurement.
    pub R: Real,
}

impl<const N: usize> Innovation<N> {
    /// Innovation of a measurement against a belief.
    pub fn of(belief: &Gaussian<N>, aid: &impl Aid<N>) -> Self {
        let h = aid.H(&belief.x);
        Self {
            y: aid.innovation(&belief.x),
            h,
            Ph: belief.covariance_with(&h),
            R: aid.R(),
        }
    }

    /// Innovation over its standard deviation.
    pub fn normalised(&self) -> Real {
        self.y / sqrt(self.h.dot(&self.Ph) + self.R)
    }

    /// Corrects the belief by the measurement and returns its status.
    pub fn fuse(&self, belief: &mut Gaussian<N>, gate: GateRule) -> AidStatus {
        let Self { y, h, Ph, R } = self;
        let S = h.dot(Ph) + R;
        let ratio = gate.ratio(*y, S);
        let beyond = ratio > 1.0;
        let outcome = match gate {
            GateRule::Reject(_, reason) if beyond => AidOutcome::Rejected(reason),
            _ => {
                let inflated = R + if beyond { (ratio - 1.0) * S } else { 0.0 };
                match belief.update_known(*y, h, Ph, inflated) {
                    None => AidOutcome::Rejected(Rejection::Numeric),
                    Some(()) if beyond => AidOutcome::Deweighted,
                    Some(()) => AidOutcome::Fused,
                }
            }
        };
        AidStatus {
            innovation: *y,
            innovation_variance: S,
            test_ratio: ratio,
            outcome,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::vector;

    /// One number of two, measured as 2 x₁ with R = 1.
    struct Twice(Real);

    impl Aid<2> for Twice {
        fn innovation(&self, x: &SVector<Real, 2>) -> Real {
            self.0 - self.h(x)
        }

        fn h(&self, x: &SVector<Real, 2>) -> Real {
            2.0 * x.x
        }

        fn H(&self, _: &SVector<Real, 2>) -> SVector<Real, 2> {
            vector![2.0, 0.0]
        }

        fn R(&self) -> Real {
            1.0
        }
    }

    fn start() -> Gaussian<2> {
        Gaussian::independent(vector![1.0, 0.0], vector![1.0, 1.0])
    }

    /// P = 1, h = 2: S = 5, K = 2/5, P⁺ = 1/5.
    #[test]
    fn an_open_gate_is_the_scalar_kalman_update() {
        let mut belief = start();
        let status = fuse(&mut belief, Control::New(Twice(7.0)), GateRule::Open).unwrap();
        assert_eq!((status.innovation, status.innovation_variance), (5.0, 5.0));
        assert_eq!(
            (status.test_ratio, status.outcome),
            (0.0, AidOutcome::Fused)
        );
        assert!((belief.x.x - 3.0).abs() < 1e-12 && (belief.P.m11 - 0.2).abs() < 1e-12);
    }

    /// y² = 100 against 9 S = 45: S becomes 100/9, and the gain 2/(100/9).
    #[test]
    fn a_large_innovation_is_deweighted_to_the_threshold() {
        let mut belief = start();
        let gate = GateRule::Deweight(3.0);
        let status = fuse(&mut belief, Control::New(Twice(12.0)), gate).unwrap();
        assert_eq!(status.outcome, AidOutcome::Deweighted);
        assert!((status.test_ratio - 100.0 / 45.0).abs() < 1e-12);
        assert!((belief.x.x - (1.0 + 10.0 * 0.18)).abs() < 1e-12);
    }

    #[test]
    fn what_is_rejected_held_or_out_of_use_changes_nothing() {
        let mut belief = start();
        let gate = GateRule::Reject(3.0, Rejection::Slip);
        let status = fuse(&mut belief, Control::New(Twice(7.0)), gate).unwrap();
        assert_eq!(status.outcome, AidOutcome::Rejected(Rejection::Slip));
        assert!((status.test_ratio - 25.0 / 9.0).abs() < 1e-12);
        assert_eq!(fuse(&mut belief, Control::<Twice>::Held, gate), None);
        let stale = fuse(&mut belief, Control::<Twice>::Out(AidOutcome::Stale), gate);
        assert_eq!(stale, Some(AidStatus::default()));
        assert_eq!(belief, start());
    }
}
