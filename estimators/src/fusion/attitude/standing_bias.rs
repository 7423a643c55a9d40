//! Detection of gyro biases at a standstill that are beyond its sheet.
//!
//! The Kalman filter cannot follow them: with the standard deviation of a good sheet it has no gain left. A vehicle
//! that stands does not turn, so that what six windows in a row read alike is the bias, whatever the sheet says. A body
//! that rocks reads differently in them.

use crate::Real;
use crate::api::real::sqrt;
use crate::api::snapshot::state;
use crate::filters::gaussian::Gaussian;
use crate::models::attitude::{GYRO_X, GYRO_Y, GYRO_Z, N, PHI, THETA};
use crate::tuning::{STANDSTILL, STATISTICS};

/// Windows in a row of one axis that contradict the filter alike: least and largest mean, rad/s, their sum and number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Run {
    least: Real,
    most: Real,
    sum: Real,
    windows: u32,
}

impl Run {
    /// Takes the mean of a window; `off` is its difference from the filter's bias, rad/s.
    fn take(&mut self, mean: Real, off: Real) {
        let (least, most) = (self.least.min(mean), self.most.max(mean));
        let alike = self.windows > 0 && most - least < STANDSTILL.max_difference * off.abs();
        *self = match alike {
            true => Self {
                least,
                most,
                sum: self.sum + mean,
                windows: self.windows + 1,
            },
            false => Self {
                least: mean,
                most: mean,
                sum: mean,
                windows: 1,
            },
        };
    }
}

/// The comparison.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StandingBias {
    turned_rad: [Real; 3],
    length_s: Real,
    runs: [Run; 3],
}

impl StandingBias {
    /// Takes the rates of a step of `dt` seconds at a standstill, rad/s. Biases that are contradicted become those that
    /// were read, and the angles that they have turned by are doubted.
    #[allow(
        clippy::indexing_slicing,
        reason = "indices of states are constants below N"
    )]
    pub fn step(&mut self, belief: &mut Gaussian<N>, rate_radps: [Real; 3], dt: Real) {
        for (turned, rate) in self.turned_rad.iter_mut().zip(rate_radps) {
            *turned += rate * dt;
        }
        self.length_s += dt;
        if self.length_s < STANDSTILL.window_s {
            return;
        }
        let means = self.turned_rad.map(|turned| turned / self.length_s);
        let all_s = Real::from(STATISTICS.confirming as u8) * self.length_s;
        (self.turned_rad, self.length_s) = ([0.0; 3], 0.0);
        let noise = STANDSTILL.noise * STANDSTILL.noise / all_s;
        let axes = [(GYRO_X, Some(PHI)), (GYRO_Y, Some(THETA)), (GYRO_Z, None)];
        for (((bias, angle), mean), run) in axes.into_iter().zip(means).zip(&mut self.runs) {
            let off = mean - belief.x[bias];
            if off.abs() < STATISTICS.fault_sd * sqrt(belief.P[(bias, bias)] + noise) {
                *run = Run::default();
                continue;
            }
            run.take(mean, off);
            if run.windows < STATISTICS.confirming {
                continue;
            }
            belief.set_independent(
                bias,
                run.sum / Real::from(STATISTICS.confirming as u8),
                noise,
            );
            if let Some(angle) = angle {
                belief.P[(angle, angle)] += off * off * all_s * all_s;
            }
            *run = Run::default();
        }
    }
}

state!(Run { least, most, sum, windows; });
state!(StandingBias { turned_rad, length_s, runs; });

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SVector;

    /// 16 steps are a window of 0.25 s.
    const DT: Real = 1.0 / 64.0;
    const BIAS_SD: Real = 1e-4;
    /// Variance of the mean of the six windows, 1.5 s.
    const READ: Real = 3e-4 * 3e-4 / 1.5;

    /// A belief of the bias 0.01 rad/s about all axes.
    fn belief() -> Gaussian<N> {
        let mut belief = Gaussian::independent(SVector::zeros(), SVector::zeros());
        for bias in [GYRO_X, GYRO_Y, GYRO_Z] {
            belief.set_independent(bias, 0.01, BIAS_SD * BIAS_SD);
        }
        for angle in [THETA, PHI] {
            belief.set_independent(angle, 0.0, 0.01);
        }
        belief
    }

    /// The belief after windows in which one axis is off by these rates.
    fn after(axis: usize, off: &[Real]) -> Gaussian<N> {
        let (mut belief, mut standing) = (belief(), StandingBias::default());
        for off in off {
            let mut rate = [0.01; 3];
            rate[axis] += off;
            (0..16).for_each(|_| standing.step(&mut belief, rate, DT));
        }
        belief
    }

    /// After six windows that read alike the bias is their mean, as well as it is read in 1.5 s, and the angle that it
    /// turns is doubted by what it has turned by in that time: the roll about x, the pitch about y, and about z none.
    /// After five, nothing has changed.
    #[test]
    fn six_windows_that_read_alike_are_the_bias() {
        for (axis, bias, angle) in [
            (0, GYRO_X, Some(PHI)),
            (1, GYRO_Y, Some(THETA)),
            (2, GYRO_Z, None),
        ] {
            for off in [0.004, -0.004, 0.05] {
                assert_eq!(after(axis, &[off; 5]), belief());
                let found = after(axis, &[off; 6]);
                assert!((found.x[bias] - 0.01 - off).abs() < 1e-12);
                assert!((found.P[(bias, bias)] / READ - 1.0).abs() < 1e-9);
                let mut expected = belief();
                expected.set_independent(bias, found.x[bias], found.P[(bias, bias)]);
                if let Some(angle) = angle {
                    let turned = found.P[(angle, angle)] - expected.P[(angle, angle)];
                    assert!((turned / (off * 1.5).powi(2) - 1.0).abs() < 1e-9, "{axis}");
                    expected.P[(angle, angle)] = found.P[(angle, angle)];
                }
                assert_eq!(found, expected);
            }
        }
    }

    /// A reading within six standard deviations, of the bias and of what is read, is the filter's.
    #[test]
    fn a_reading_that_the_filter_allows_is_left_to_it() {
        let limit = 6.0 * (BIAS_SD * BIAS_SD + READ).sqrt();
        for sign in [1.0, -1.0] {
            assert_eq!(after(1, &[0.99 * sign * limit; 12]), belief());
            assert_ne!(after(1, &[1.01 * sign * limit; 6]), belief());
        }
    }

    /// Windows of a body that rocks differ by more than a quarter of what they contradict the filter by. One that
    /// agrees with the filter begins the count anew.
    #[test]
    fn windows_that_differ_are_no_bias() {
        for sign in [1.0, -1.0] {
            let to_and_fro = |by: Real| {
                let window = |k: i32| sign * 0.01 * (1.0 + if k % 2 == 0 { by } else { -by });
                let windows: [Real; 12] = core::array::from_fn(|k| window(k as i32));
                windows
            };
            assert_eq!(after(1, &to_and_fro(0.12)), belief());
            let found = after(1, &to_and_fro(0.10)[..6]);
            assert!((found.x[GYRO_Y] - 0.01 - sign * 0.01).abs() < 1e-12);
            let drift: [Real; 6] = core::array::from_fn(|k| sign * (0.01 + 2e-4 * k as Real));
            let found = after(1, &drift);
            assert!((found.x[GYRO_Y] - 0.01 - sign * 0.0105).abs() < 1e-12);
            let mut windows = [sign * 0.01; 11];
            windows[5] = 0.0;
            assert_eq!(after(1, &windows), belief());
            windows[5] = -sign * 0.01;
            assert_eq!(after(1, &windows), belief());
        }
    }
}
