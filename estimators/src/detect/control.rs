//! Control, the first layer of every measurement source: whether a step brings a new measurement, holds the last one,
//! or must do without.

use crate::Real;
use crate::api::aid::{AidOutcome, AidStatus, Rejection};
use crate::api::reading::Reading;
use crate::filters::rls::Outcome;

/// Measurement of a source in one step, if there is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Control<T> {
    /// A new measurement, for gate and fusion.
    New(T),
    /// No new measurement; the last is still fresh.
    Held,
    /// No usable measurement.
    Out(AidOutcome),
}

impl<T> Control<T> {
    /// Control of a measurement that comes with (nearly) every step while its instruments are `fresh`.
    pub fn of(new: Option<T>, fresh: bool) -> Self {
        match (new, fresh) {
            (Some(new), _) => Control::New(new),
            (None, true) => Control::Held,
            (None, false) => Control::Out(AidOutcome::Stale),
        }
    }
}

/// Wheel speed, m/s: out of use when it is stale, stuck, or the wheels slip.
pub fn wheel_speed(reading: &Reading) -> Control<Real> {
    match reading.wheel_speed_fault {
        Some(reason) => Control::Out(AidOutcome::Rejected(reason)),
        None => Control::of(reading.new_speed_mps, reading.speed_mps.is_some()),
    }
}

/// The force balance, as a measurement of the mass: out of use without torque or accelerometer (if it is `needed`), and
/// while the train stands or brakes.
pub fn force_balance(reading: &Reading, running: bool, accelerometer: bool) -> Control<()> {
    let fresh = reading.motor_torque_nm.is_some()
        && reading.speed_mps.is_some()
        && (!accelerometer || reading.specific_force_mps2.is_some());
    if !fresh {
        Control::Out(AidOutcome::Stale)
    } else if !running {
        Control::Out(AidOutcome::Rejected(Rejection::NotRunning))
    } else {
        Control::Held
    }
}

/// Status of a source without an innovation.
pub fn without(outcome: AidOutcome) -> AidStatus {
    AidStatus {
        outcome,
        ..AidStatus::default()
    }
}

/// Status of a wheel speed that a regression takes as an input: it has no innovation of its own.
pub fn wheel_speed_input(reading: &Reading) -> AidStatus {
    without(match wheel_speed(reading) {
        Control::Out(outcome) => outcome,
        _ => AidOutcome::Fused,
    })
}

/// Status of an innovation and its variance that a filter has fused; `None` if the numbers allowed no update.
pub fn fused(innovation: Option<(Real, Real)>) -> AidStatus {
    innovation.map_or(
        without(AidOutcome::Rejected(Rejection::Numeric)),
        |(innovation, innovation_variance)| AidStatus {
            innovation,
            innovation_variance,
            test_ratio: 0.0,
            outcome: AidOutcome::Fused,
        },
    )
}

/// Status of a sample that a regression has taken in; `None` if the numbers allowed no update.
pub fn regressed(outcome: Option<&Outcome>, excited: bool) -> AidStatus {
    let Some(outcome) = outcome else {
        return fused(None);
    };
    let sd = outcome.residual / outcome.normalised;
    let variance = if sd.is_finite() { sd * sd } else { 0.0 };
    AidStatus {
        outcome: if excited {
            AidOutcome::Fused
        } else {
            AidOutcome::Deweighted
        },
        ..fused(Some((outcome.residual, variance)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wheel_speed_is_new_held_stale_or_rejected() {
        let mut reading = Reading::default();
        assert_eq!(wheel_speed(&reading), Control::Out(AidOutcome::Stale));
        reading.speed_mps = Some(1.0);
        assert_eq!(wheel_speed(&reading), Control::Held);
        reading.new_speed_mps = Some(1.0);
        assert_eq!(wheel_speed(&reading), Control::New(1.0));
        let slip = Reading {
            wheel_speed_fault: Some(Rejection::Slip),
            ..Reading::default()
        };
        let rejected = AidOutcome::Rejected(Rejection::Slip);
        assert_eq!(wheel_speed(&slip), Control::Out(rejected));
        assert_eq!(wheel_speed_input(&slip).outcome, rejected);
    }

    #[test]
    fn the_force_balance_needs_its_instruments_and_a_running_train() {
        let full = Reading {
            speed_mps: Some(1.0),
            motor_torque_nm: Some(100.0),
            ..Reading::default()
        };
        let stale = Control::Out(AidOutcome::Stale);
        let standing = Control::Out(AidOutcome::Rejected(Rejection::NotRunning));
        assert_eq!(force_balance(&full, true, true), stale);
        assert_eq!(force_balance(&full, true, false), Control::Held);
        assert_eq!(force_balance(&full, false, false), standing);
    }

    #[test]
    fn the_variance_of_a_residual_is_that_it_was_normalised_by() {
        let outcome = Outcome {
            residual: -0.3,
            normalised: -1.5,
            ..Outcome::default()
        };
        let status = regressed(Some(&outcome), false);
        assert_eq!(status.outcome, AidOutcome::Deweighted);
        assert!((status.innovation_variance - 0.04).abs() < 1e-12);
        assert_eq!(
            regressed(None, true).outcome,
            AidOutcome::Rejected(Rejection::Numeric)
        );
    }

    #[test]
    fn the_force_balance_needs_each_of_its_instruments() {
        let full = Reading {
            speed_mps: Some(1.0),
            motor_torque_nm: Some(100.0),
            specific_force_mps2: Some(0.0),
            ..Reading::default()
        };
        assert_eq!(force_balance(&full, true, true), Control::Held);
        for lacking in [
            Reading {
                speed_mps: None,
                ..full
            },
            Reading {
                motor_torque_nm: None,
                ..full
            },
            Reading {
                specific_force_mps2: None,
                ..full
            },
        ] {
            let stale = Control::Out(AidOutcome::Stale);
            assert_eq!(force_balance(&lacking, true, true), stale);
        }
    }
}
