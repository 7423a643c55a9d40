//! One speed of the train out of the speeds of its wheels.

use crate::Real;
use crate::api::signals::MAX_DRIVES;

/// Largest difference between the speeds of wheels that roll, beside their noise, as a share of the speed: worn wheels,
/// errors of scale.
const ROLLING_SHARE: Real = 0.03;

/// Vote on the speed of a train, m/s: the median of its wheel speeds, guarded against wheels that slip together.
///
/// The median is not moved by one slipping wheel. Wheels slip in the direction of their torque: where the two middle
/// ones are further apart than wheels that roll, the one that has slipped less counts. If two wheels or more have
/// slipped even less than the winner, the winner slips too, and the speed is not known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelSpeedVote {
    /// Largest difference between the speeds of wheels that roll, at standstill, m/s.
    tolerance_mps: Real,
}

impl WheelSpeedVote {
    /// A vote in which wheels that roll may differ by `tolerance_mps` and 3 % of the speed.
    pub fn new(tolerance_mps: Real) -> Self {
        Self { tolerance_mps }
    }

    /// The speed of the train, m/s, from at most [`MAX_DRIVES`] wheel speeds, m/s, and the sum of the motor torques, of
    /// which only the sign matters; `None` without a wheel or where too many slip.
    pub fn speed_mps(
        &self,
        wheels_mps: impl IntoIterator<Item = Real>,
        motor_torque_nm: Real,
    ) -> Option<Real> {
        let mut room = [Real::INFINITY; MAX_DRIVES];
        let mut count = 0_usize;
        for (place, value) in room.iter_mut().zip(wheels_mps) {
            *place = value;
            count += 1;
        }
        match room.first_chunk_mut::<8>() {
            Some(eight) if count <= 8 => sort_eight(eight),
            _ => room.sort_unstable_by(Real::total_cmp),
        }
        let last = count.checked_sub(1)?;
        let sorted = room.get_mut(..count)?;
        // Zeros of either sign pass for equal above; which one wins must not depend on the order of the wheels.
        if sorted.get(count / 2) == Some(&0.0) || sorted.get(last / 2) == Some(&0.0) {
            sorted.sort_unstable_by(Real::total_cmp);
        }
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

/// Sorts eight numbers by a network of 19 comparisons in 6 layers (Knuth, The Art of Computer Programming 3, 5.3.4): no
/// branch, and four comparisons side by side.
fn sort_eight(numbers: &mut [Real; 8]) {
    let [a, b, c, d, e, f, g, h] = *numbers;
    let ((a, c), (b, d), (e, g), (f, h)) = (pair(a, c), pair(b, d), pair(e, g), pair(f, h));
    let ((a, e), (b, f), (c, g), (d, h)) = (pair(a, e), pair(b, f), pair(c, g), pair(d, h));
    let ((a, b), (c, d), (e, f), (g, h)) = (pair(a, b), pair(c, d), pair(e, f), pair(g, h));
    let ((c, e), (d, f)) = (pair(c, e), pair(d, f));
    let ((b, e), (d, g)) = (pair(b, e), pair(d, g));
    let ((b, c), (d, e), (f, g)) = (pair(b, c), pair(d, e), pair(f, g));
    *numbers = [a, b, c, d, e, f, g, h];
}

/// The smaller one, then the other.
fn pair(a: Real, b: Real) -> (Real, Real) {
    if a < b { (a, b) } else { (b, a) }
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

    /// A network sorts all numbers if it sorts all of zeros and ones (Knuth).
    #[test]
    fn eight_numbers_are_sorted() {
        for bits in 0..256_u32 {
            let mut numbers = core::array::from_fn(|i| Real::from((bits >> i) as u8 & 1));
            sort_eight(&mut numbers);
            assert!(numbers.is_sorted(), "{bits:b}");
            assert_eq!(numbers.iter().sum::<Real>(), bits.count_ones() as Real);
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
