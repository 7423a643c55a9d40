//! Vibration: band-limited noise whose level grows with the speed.
//!
//! White noise of two-sided density 2(a + b) through s/((s + a)(s + b)), a and b the corners in rad/s: standard
//! deviation 1, one-sided density S(f) = 4(a + b) ω²/((ω² + a²)(ω² + b²)), ω = 2πf. By partial fractions that is (b u_b
//! − a u_a)/(b − a) of two processes u̇_c = −c u_c + w of the same white noise, whose joint steps over any time are
//! known exactly (Gillespie 1996, Phys. Rev. E 54, 2084, for one of them): variances (1 − e^(−2cT))/2c, covariance (1 −
//! e^(−(a+b)T))/(a + b). Its integral is X = (u_a − u_b)/(b − a): bounded, as that of a body that stays on its track
//! is. The value of a step is its mean over the step, (X₁ − X₀)/T, so that sampling folds nothing from above into low
//! frequencies; with steps of 2 ms that takes some 4 % of the level of a band up to 20 Hz.

use super::spec::VibrationSpec;
use super::stream::Stream;
use std::f64::consts::TAU;

/// Vibration of `N` axes, independent of each other.
#[derive(Clone, Debug)]
pub struct Vibration<const N: usize> {
    sd: f64,
    full_mps: f64,
    corners_radps: [f64; 2],
    axes: [[f64; 2]; N],
    stream: Stream,
    /// Length of the step that the factors are for, s.
    step_s: f64,
    factors: Factors,
}

/// Decay of both processes over a step, and the Cholesky factor of what a step adds.
#[derive(Clone, Copy, Debug, Default)]
struct Factors {
    decay: [f64; 2],
    l11: f64,
    l21: f64,
    l22: f64,
}

impl<const N: usize> Vibration<N> {
    /// The vibration of an instrument. Its processes begin stationary.
    pub fn new(spec: &VibrationSpec, seed: u64, name: &str) -> Self {
        let corners_radps = spec.band_hz.map(|f| TAU * f.get());
        let mut stream = Stream::new(seed, &format!("{name}/vibration"));
        // A step without end adds the stationary distribution.
        let stationary = Factors::new(corners_radps, f64::INFINITY);
        let axes = std::array::from_fn(|_| stationary.step([0.0; 2], &mut stream));
        Self {
            sd: spec.sd.get(),
            full_mps: spec.full_mps.get(),
            corners_radps,
            axes,
            stream,
            step_s: 0.0,
            factors: Factors::default(),
        }
    }

    /// The vibration after `dt_s` at this speed, in the unit of the instrument.
    pub fn advance(&mut self, dt_s: f64, speed_mps: f64) -> [f64; N] {
        if dt_s != self.step_s {
            self.step_s = dt_s;
            self.factors = Factors::new(self.corners_radps, dt_s);
        }
        let [a, b] = self.corners_radps;
        // Both processes are driven by noise of two-sided density 2(a + b).
        let unit = (2.0 * (a + b)).sqrt() / ((b - a) * dt_s);
        let level = self.sd * (speed_mps.abs() / self.full_mps).min(1.0);
        let integral = |[u_a, u_b]: [f64; 2]| u_a - u_b;
        let (factors, stream) = (self.factors, &mut self.stream);
        std::array::from_fn(|i| {
            let before = integral(self.axes[i]);
            self.axes[i] = factors.step(self.axes[i], stream);
            level * unit * (integral(self.axes[i]) - before)
        })
    }
}

impl Factors {
    /// Factors of a step of `dt_s` at noise of density 1.
    fn new([a, b]: [f64; 2], dt_s: f64) -> Self {
        let grown = |rate: f64| -libm::expm1(-rate * dt_s) / rate;
        let (var_a, var_b, cov) = (grown(2.0 * a), grown(2.0 * b), grown(a + b));
        let l11 = var_a.sqrt();
        let l21 = cov / l11;
        Self {
            decay: [libm::exp(-a * dt_s), libm::exp(-b * dt_s)],
            l11,
            l21,
            l22: (var_b - l21 * l21).max(0.0).sqrt(),
        }
    }

    fn step(&self, [u_a, u_b]: [f64; 2], stream: &mut Stream) -> [f64; 2] {
        let (n1, n2) = (stream.normal(), stream.normal());
        [
            self.decay[0] * u_a + self.l11 * n1,
            self.decay[1] * u_b + self.l21 * n1 + self.l22 * n2,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checked::{NonNegative, Positive};

    const DT: f64 = 0.002;

    fn vibration(speed_mps: f64, count: usize) -> Vec<f64> {
        let spec = VibrationSpec {
            sd: NonNegative::new(2.0),
            full_mps: Positive::new(0.5),
            band_hz: [4.0, 15.0].map(Positive::new),
        };
        let mut v = Vibration::<1>::new(&spec, 3, "test");
        (0..count).map(|_| v.advance(DT, speed_mps)[0]).collect()
    }

    fn variance(x: &[f64]) -> f64 {
        x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64
    }

    /// In proportion to the speed up to `full_mps`, nothing at a standstill. The band forgets within 0.1 s: 5 % at 10⁵
    /// steps.
    #[test]
    fn its_level_grows_with_the_speed_up_to_the_full_one() {
        for (speed, sd) in [(0.0, 0.0), (0.1, 0.4), (-0.25, 1.0), (0.5, 2.0), (5.0, 2.0)] {
            let found = variance(&vibration(speed, 100_000)).sqrt();
            assert!((found - sd).abs() <= 0.05 * sd, "{speed} m/s: {found}");
        }
    }

    /// Averaged periodograms against the closed form, at frequencies within and on both sides of the band.
    #[test]
    fn its_density_is_that_of_the_band() {
        let (length, pieces) = (1000, 400);
        let x = vibration(1.0, length * pieces);
        let (a, b) = (TAU * 4.0, TAU * 15.0);
        for f in [1.0, 4.0, 8.0, 15.0, 40.0] {
            let power: f64 = x
                .chunks_exact(length)
                .map(|piece| {
                    // Hann window, so that the band does not leak into its skirts.
                    let (mut re, mut im) = (0.0, 0.0);
                    for (k, v) in piece.iter().enumerate() {
                        let hann = 1.0 - (TAU * k as f64 / length as f64).cos();
                        let phase = TAU * f * k as f64 * DT;
                        re += hann * v * phase.cos();
                        im += hann * v * phase.sin();
                    }
                    re * re + im * im
                })
                .sum();
            // Mean square of the window 1 − cos: 3/2.
            let found = 2.0 * DT * power / (1.5 * length as f64 * pieces as f64);
            let w = TAU * f;
            let expected = 4.0 * 4.0 * (a + b) * w * w / ((w * w + a * a) * (w * w + b * b));
            // Each periodogram spreads by its mean: 5 σ of 400, and 4 % for the resolution of 0.5 Hz and the alias at
            // 40 Hz.
            assert!(
                (found / expected - 1.0).abs() < 5.0 / (pieces as f64).sqrt() + 0.04,
                "{f} Hz: {found} not {expected}"
            );
        }
    }

    /// The velocity that it adds stays within bounds: its integral is a stationary process of variance sd²/(ab), about
    /// where it began. It forgets within 1/a, 0.04 s: 25 000 independent values, 5 σ of their deviation are 3 %.
    #[test]
    fn its_integral_is_bounded() {
        let x = vibration(1.0, 500_000);
        let mut v = 0.0;
        let path: Vec<f64> = x
            .iter()
            .map(|step| {
                v += step * DT;
                v
            })
            .collect();
        let mean = path.iter().sum::<f64>() / path.len() as f64;
        let centred: Vec<f64> = path.iter().map(|v| v - mean).collect();
        let expected = 2.0 / (TAU * TAU * 4.0 * 15.0).sqrt();
        let found = variance(&centred).sqrt();
        assert!(
            (found / expected - 1.0).abs() < 0.03,
            "{found} not {expected}"
        );
    }
}
