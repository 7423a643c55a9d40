//! Biases of a gyro at a standstill that its sheet does not allow.
//!
//! The Kalman filter cannot follow them: with the standard deviation of a good sheet it has no gain left. A vehicle
//! that stands does not turn, so that what six windows in a row read alike is the bias, whatever the sheet says. A body
//! that rocks reads differently in them.

use crate::Real;
use crate::aiding::standstill::STANDING_NOISE;
use crate::api::real::sqrt;
use crate::api::snapshot::state;
use crate::filters::gaussian::Gaussian;
use crate::models::attitude::{GYRO_X, GYRO_Y, GYRO_Z, N, PHI, THETA};

/// Length of a window, s, and windows in a row that must be alike.
const WINDOW_S: Real = 0.25;
const WINDOWS: u32 = 6;
/// Standard deviations beyond which a window contradicts the bias of the filter, and the largest difference of two
/// windows as a share of what they contradict it by.
const CONTRADICTION_SD: Real = 5.0;
const MAX_DIFFERENCE: Real = 0.25;

/// Windows in a row of one axis that contradict the filter alike: least and largest mean, rad/s, their sum and number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Run {
    least: Real,
    most: Real,
    sum: Real,
    windows: u32,
}

impl Run {
    /// Takes the mean of a window; `off` is how far it is from the filter's bias, rad/s.
    fn take(&mut self, mean: Real, off: Real) {
        let (least, most) = (self.least.min(mean), self.most.max(mean));
        let alike = self.windows > 0 && most - least < MAX_DIFFERENCE * off.abs();
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
        if self.length_s < WINDOW_S {
            return;
        }
        let means = self.turned_rad.map(|turned| turned / self.length_s);
        let all_s = Real::from(WINDOWS as u8) * self.length_s;
        (self.turned_rad, self.length_s) = ([0.0; 3], 0.0);
        let noise = STANDING_NOISE * STANDING_NOISE / all_s;
        let axes = [(GYRO_X, Some(PHI)), (GYRO_Y, Some(THETA)), (GYRO_Z, None)];
        for (((bias, angle), mean), run) in axes.into_iter().zip(means).zip(&mut self.runs) {
            let off = mean - belief.x[bias];
            if off.abs() < CONTRADICTION_SD * sqrt(belief.P[(bias, bias)] + noise) {
                *run = Run::default();
                continue;
            }
            run.take(mean, off);
            if run.windows < WINDOWS {
                continue;
            }
            belief.set_independent(bias, run.sum / Real::from(WINDOWS as u8), noise);
            if let Some(angle) = angle {
                belief.P[(angle, angle)] += off * off * all_s * all_s;
            }
            *run = Run::default();
        }
    }
}

state!(Run { least, most, sum, windows; });
state!(StandingBias { turned_rad, length_s, runs; });
