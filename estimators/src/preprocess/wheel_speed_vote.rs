//! One speed of the train from the speeds of its wheels.

use crate::Real;
use crate::preprocess::sorted::Sorted;

/// Largest difference between the speeds of rolling wheels beyond their noise, as a share of the speed: worn wheels,
/// errors of scale.
const ROLLING_SHARE: Real = 0.03;

/// Vote on the speed of a train, m/s: the median of its wheel speeds, guarded against wheels that slip together.
///
/// The median is not moved by one slipping wheel. Wheels slip in the direction of their torque: where the two middle
/// ones are further apart than wheels that roll, the one that has slipped less counts. If two wheels or more have
/// slipped even less than the winner, the winner slips too, and the speed is not known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelSpeedVote {
    /// Largest difference between the speeds of rolling wheels at standstill, m/s.
    tolerance_mps: Real,
}

impl WheelSpeedVote {
    /// Makes a vote in which rolling wheels may differ by `tolerance_mps` and 3 % of the speed.
    pub fn new(tolerance_mps: Real) -> Self {
        Self { tolerance_mps }
    }

    /// The speed of the train, m/s, from at most [`MAX_DRIVES`](crate::api::signals::MAX_DRIVES) wheel speeds, m/s, and
    /// the sum of the motor torques, of which only the sign matters; `None` without a wheel or where too many slip.
    pub fn speed_mps(
        &self,
        wheels_mps: impl IntoIterator<Item = Real>,
        motor_torque_nm: Real,
    ) -> Option<Real> {
        let mut sorted = Sorted::of(wheels_mps);
        let sorted = sorted.numbers_mut();
        let count = sorted.len();
        let last = count.checked_sub(1)?;
        if motor_torque_nm < 0.0 {
            sorted.reverse();
        }
        let less = *sorted.get(last / 2)?;
        let more = *sorted.get(count / 2)?;
        let apart =
            |a: Real, b: Real| (a - b).abs() > self.tolerance_mps + ROLLING_SHARE * less.abs();
        let middle = if apart(less, more) {
            less
        } else {
            0.5 * (less + more)
        };
        let second_least = sorted.get(1).filter(|_| count > 3);
        match second_least {
            Some(second_least) if apart(*second_least, middle) => None,
            _ => Some(middle),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn speed(values: &[Real], torque: Real) -> Option<Real> {
        WheelSpeedVote::new(0.05).speed_mps(values.iter().copied(), torque)
    }

    #[test]
    fn a_wheel_that_slips_or_errs_is_outvoted() {
        assert_eq!(speed(&[1.0, 9.0, 1.01], 50.0), Some(1.01));
        assert_eq!(speed(&[1.0, 1.02], 50.0), Some(1.01));
        assert_eq!(speed(&[], 50.0), None);
        assert_eq!(speed(&[0.0, 1.0, 1.0, 1.0, 1.0, 1.0], 50.0), Some(1.0));
    }

    #[test]
    fn the_sign_of_a_speed_of_zero_does_not_depend_on_the_order_of_the_wheels() {
        for torque in [50.0, -50.0] {
            let signs = [[-0.0, 0.0, -0.0], [-0.0, -0.0, 0.0], [0.0, -0.0, -0.0]]
                .map(|wheels| speed(&wheels, torque).map(Real::is_sign_negative));
            assert_eq!(signs, [Some(true); 3], "{torque}");
        }
    }

    #[test]
    fn wheels_slip_in_the_direction_of_their_torque() {
        let half = [1.4, 1.0, 1.4, 1.0, 1.5, 1.0, 1.4, 1.0];
        assert_eq!(speed(&half, 50.0), Some(1.0));
        assert_eq!(speed(&half.map(|v| -v), -50.0), Some(-1.0));
        // Braked by their motors, wheels turn too slowly.
        assert_eq!(speed(&half.map(|v| 2.0 - v), -50.0), Some(1.0));
        // Six of eight: the speed is not known.
        let most = [1.4, 1.0, 1.4, 1.0, 1.5, 1.4, 1.4, 1.4];
        assert_eq!(speed(&most, 50.0), None);
    }

    #[test]
    fn wheels_that_roll_may_differ_the_more_the_faster() {
        // 0.05 m/s and 3 % of 3 m/s: 0.14 m/s.
        assert_eq!(speed(&[3.0, 3.125], 50.0), Some(3.0625));
        assert_eq!(speed(&[3.0, 3.15], 50.0), Some(3.0));
        // Without torque the slower ones roll.
        assert_eq!(speed(&[1.0, 1.0, 1.5, 1.5], 0.0), Some(1.0));
    }
}
