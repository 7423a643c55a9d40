//! Adaptive smoothing: a first-order low-pass that opens when the signal leaves its own noise (adaptive smoothing
//! filter of the DFFRLS-AUKF method for monorail cranes, its eq. 7–10).
//!
//! Y ← Y + m (ψ − Y), with m from a corner frequency, m = 1 − e^(−2π f dt) (the printed m = 2π f/f_s is its small-m
//! limit), and the corner chosen by how far the input is from the output, Γ = |ψ − Y|, in units of the noise amplitude
//! Γ₀ at rest: calm up to δ₁ Γ₀, quicker up to δ₂ Γ₀, quickest beyond. (In print Γ is a signed difference of outputs,
//! which needs the m it chooses; the gain falls to 0 where motion sets in; the last branch grows without bound.)
//!
//! One gain serves all channels: signals that meet in one equation must be delayed alike.

use crate::Real;
use crate::api::real::{PI, lag};
use crate::api::snapshot::state;

/// The smoother of `N` channels; the first one chooses the gain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdaptiveSmoother<const N: usize> {
    corners_hz: [Real; 3],
    noise: Real,
    thresholds: [Real; 2],
    output: Option<[Real; N]>,
    gain: Real,
}

impl<const N: usize> AdaptiveSmoother<N> {
    /// `corners_hz` calm, quicker, quickest; `noise` Γ₀ in the unit of the first channel; `thresholds` δ₁ < δ₂.
    pub fn new(corners_hz: [Real; 3], noise: Real, thresholds: [Real; 2]) -> Self {
        Self {
            corners_hz,
            noise,
            thresholds,
            output: None,
            gain: 1.0,
        }
    }

    /// One sample of each channel, held for `dt_s`; the smoothed channels.
    pub fn step(&mut self, input: [Real; N], dt_s: Real) -> [Real; N] {
        let Some(mut output) = self.output else {
            self.output = Some(input);
            return input;
        };
        let first = |values: &[Real; N]| values.first().copied().unwrap_or(0.0);
        let away = (first(&input) - first(&output)).abs();
        let ([calm, quicker, quickest], [low, high]) = (self.corners_hz, self.thresholds);
        let corner = if away <= low * self.noise {
            calm
        } else if away <= high * self.noise {
            quicker
        } else {
            quickest
        };
        self.gain = lag(dt_s, 1.0 / (2.0 * PI * corner));
        for (out, new) in output.iter_mut().zip(input) {
            *out += self.gain * (new - *out);
        }
        self.output = Some(output);
        output
    }

    /// Gain m of the last step.
    pub fn gain(&self) -> Real {
        self.gain
    }
}

state!(@[const N: usize] AdaptiveSmoother<N> { output, gain; corners_hz, noise, thresholds });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, rms};
    use std::vec::Vec;

    #[test]
    fn at_rest_it_smooths_like_its_calm_corner_and_opens_on_a_step() {
        let mut smoother = AdaptiveSmoother::<1>::new([0.5, 2.0, 10.0], 0.1, [4.0, 8.0]);
        let mut random = Random::new(61);
        let dt = 0.01;
        let output: Vec<Real> = (0..20_000)
            .map(|_| smoother.step([0.1 * random.normal()], dt)[0])
            .collect();
        // Variance of a first-order low-pass on white noise: m/(2 − m).
        let m = 1.0 - (-2.0 * PI * 0.5 * dt).exp();
        let expected = 0.1 * (m / (2.0 - m)).sqrt();
        assert!((rms(&output[2000..]) / expected - 1.0).abs() < 0.15);
        let late = (0..30).map(|_| smoother.step([5.0], dt)[0]).last().unwrap();
        assert!(late > 4.0, "{late}");
    }

    #[test]
    fn channels_are_delayed_alike() {
        let mut smoother = AdaptiveSmoother::<2>::new([0.5, 2.0, 10.0], 0.1, [2.0, 4.0]);
        let mut random = Random::new(62);
        for _ in 0..1000 {
            let x = random.normal();
            let [a, b] = smoother.step([x, 3.0 * x + 1.0], 0.01);
            assert!((b - 3.0 * a - 1.0).abs() < 1e-12);
            assert!((0.0..=1.0).contains(&smoother.gain()));
        }
    }
}
