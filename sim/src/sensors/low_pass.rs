//! Bandwidth: a first-order low-pass on the ideal signal, τ ẏ + y = x with τ = 1/(2π f_c).
//!
//! The signal is linear between two physics steps, for which the solution over a step is exact (first-order hold):
//! y₁ = a y₀ + (c − a) x₀ + (1 − c) x₁, a = exp(−Δt/τ), c = (1 − a) τ/Δt.

use crate::fading::faded;

/// A first-order low-pass for `N` axes.
#[derive(Clone, Debug)]
pub struct LowPass<const N: usize> {
    corner_radps: f64,
    state: Option<[f64; N]>,
    /// Length of the step the factors are for, ns; and a, c.
    step_ns: i64,
    a: f64,
    c: f64,
}

impl<const N: usize> LowPass<N> {
    /// Corner frequency in Hz.
    pub fn new(bandwidth_hz: f64) -> Self {
        Self {
            corner_radps: 2.0 * std::f64::consts::PI * bandwidth_hz,
            state: None,
            step_ns: 0,
            a: 1.0,
            c: 1.0,
        }
    }

    /// The filtered signal at both ends of a step over which the input goes from `start` to `end`. Begins settled.
    pub fn pass(&mut self, step_ns: i64, start: [f64; N], end: [f64; N]) -> ([f64; N], [f64; N]) {
        if step_ns != self.step_ns {
            self.step_ns = step_ns;
            let steps = self.corner_radps * step_ns as f64 * 1e-9;
            self.a = libm::exp(-steps);
            self.c = if steps > 0.0 {
                -libm::expm1(-steps) / steps
            } else {
                1.0
            };
        }
        let before = self.state.unwrap_or(start);
        let after = std::array::from_fn(|i| {
            faded(self.a * before[i] + (self.c - self.a) * start[i] + (1.0 - self.c) * end[i])
        });
        self.state = Some(after);
        (before, after)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn a_step_is_followed_exponentially() {
        let mut filter = LowPass::new(5.0);
        filter.pass(2_000_000, [0.0], [0.0]);
        for k in 1..200 {
            let (_, [y]) = filter.pass(2_000_000, [1.0], [1.0]);
            assert!((y - (1.0 - f64::exp(-2.0 * PI * 5.0 * 0.002 * f64::from(k)))).abs() < 1e-12);
        }
    }

    #[test]
    fn a_ramp_is_followed_with_a_lag_of_the_time_constant() {
        let mut filter = LowPass::new(5.0);
        let mut last = 0.0;
        for k in 0..2000 {
            let t = f64::from(k) * 0.002;
            (_, [last]) = filter.pass(2_000_000, [t], [t + 0.002]);
        }
        assert!((last - (4.0 - 1.0 / (2.0 * PI * 5.0))).abs() < 1e-9);
    }

    /// |H(f_c)| = 1/√2, whatever the step.
    #[test]
    fn at_the_corner_the_amplitude_is_down_by_root_two() {
        for step_ns in [500_000, 2_000_000] {
            let mut filter = LowPass::new(5.0);
            let dt = step_ns as f64 * 1e-9;
            let x = |k: f64| f64::sin(2.0 * PI * 5.0 * k * dt);
            let (mut squares, mut count) = (0.0, 0.0);
            for k in 0..(4.0 / dt) as usize {
                let (_, [y]) = filter.pass(step_ns, [x(k as f64)], [x(k as f64 + 1.0)]);
                if k as f64 * dt >= 2.0 {
                    squares += y * y;
                    count += 1.0;
                }
            }
            let amplitude = f64::sqrt(2.0 * squares / count);
            assert!((amplitude - f64::sqrt(0.5)).abs() < 1e-3, "{amplitude}");
        }
    }
}
