//! Random processes of the error models, sampled at a fixed period T.
//!
//! | process | recursion | Allan deviation σ(τ) |
//! |---|---|---|
//! | white | w(k) = σ n(k) | N/√τ with N = σ√T |
//! | random walk | b(k) = b(k−1) + K√T n(k) | K√(τ/3) |
//! | Gauss–Markov | b(k) = φ b(k−1) + s√(1−φ²) n(k), φ = exp(−T/τ_c) | hump near 1.9 τ_c |
//!
//! n(k) is standard normal. Source: IEEE Std 952-1997, annex C (angle random walk, rate random walk, Markov noise).

use super::stream::Stream;

/// White noise: every draw independent.
#[derive(Clone, Debug)]
pub struct White {
    variance: f64,
    relative_variance: f64,
    sd: f64,
    stream: Stream,
}

impl White {
    /// `sd` in the unit of the signal, `relative_sd` as share of the signal; the two add as variances.
    pub fn new(sd: f64, relative_sd: f64, stream: Stream) -> Self {
        Self {
            variance: sd * sd,
            relative_variance: relative_sd * relative_sd,
            sd,
            stream,
        }
    }

    /// The next draw, while the signal is `signal`.
    pub fn draw(&mut self, signal: f64) -> f64 {
        let sd = if self.relative_variance > 0.0 {
            (self.variance + self.relative_variance * signal * signal).sqrt()
        } else {
            self.sd
        };
        if sd > 0.0 {
            sd * self.stream.normal()
        } else {
            0.0
        }
    }
}

/// Standard deviation of white noise per sample, from the figures of a data sheet, at `rate_hz` samples a second.
///
/// Two conventions live side by side and differ by √2, so each has its own argument:
/// - `density`, unit/√Hz, *one-sided*: the sampled noise fills the band from 0 to the Nyquist frequency f/2,
///   σ = density·√(f/2). This is how accelerometer sheets print mg/√Hz.
/// - `random_walk_of_integral` N, unit·√s (rad/√s, (m/s)/√s), *two-sided*: the integral of the signal wanders with
///   standard deviation N√t, so σ = N/√T = N·√f. This is how sheets print °/√h and m/s/√h (angle and velocity random
///   walk; IEEE Std 952-1997, annex C).
pub fn white_sd(sd: f64, density: f64, random_walk_of_integral: f64, rate_hz: f64) -> f64 {
    let from_density = density * density * rate_hz / 2.0;
    let from_integral = random_walk_of_integral * random_walk_of_integral * rate_hz;
    (sd * sd + from_density + from_integral).sqrt()
}

/// A bias that wanders without limit.
#[derive(Clone, Debug)]
pub struct RandomWalk {
    step_sd: f64,
    value: f64,
    stream: Stream,
}

impl RandomWalk {
    /// `density` in unit/√s: after t seconds the standard deviation is density·√t. Starts at 0.
    pub fn new(density: f64, period_s: f64, stream: Stream) -> Self {
        Self {
            step_sd: density * period_s.sqrt(),
            value: 0.0,
            stream,
        }
    }

    /// Advances by one period.
    pub fn draw(&mut self) -> f64 {
        self.value += self.step_sd * self.stream.normal();
        self.value
    }
}

/// A bias that wanders within bounds: first-order Gauss–Markov, stationary from the start.
#[derive(Clone, Debug)]
pub struct GaussMarkov {
    phi: f64,
    step_sd: f64,
    value: f64,
    stream: Stream,
}

impl GaussMarkov {
    /// Standard deviation `sd`, correlation time `time_s` (autocorrelation 1/e after it).
    pub fn new(sd: f64, time_s: f64, period_s: f64, mut stream: Stream) -> Self {
        // 1 − φ² through expm1: exact for correlation times far above the period.
        let step_sd = sd * (-libm::expm1(-2.0 * period_s / time_s)).sqrt();
        let value = sd * stream.normal();
        Self {
            phi: libm::exp(-period_s / time_s),
            step_sd,
            value,
            stream,
        }
    }

    /// Advances by one period.
    pub fn draw(&mut self) -> f64 {
        self.value = self.phi * self.value + self.step_sd * self.stream.normal();
        self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensors::behaviour::{allan_deviation, slope};

    const T: f64 = 0.01;
    const N: usize = 1 << 18;

    fn variance(x: &[f64]) -> f64 {
        x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64
    }

    #[test]
    fn white_noise_has_its_variance_and_no_memory() {
        let mut noise = White::new(0.3, 0.0, Stream::new(1, "white"));
        let x: Vec<f64> = (0..N).map(|_| noise.draw(5.0)).collect();
        let n = N as f64;
        // var of the variance estimate of a normal: 2σ⁴/n; of the autocorrelation estimate: 1/n.
        assert!((variance(&x) / 0.09 - 1.0).abs() < 5.0 * f64::sqrt(2.0 / n));
        for lag in [1, 2, 3, 10, 100] {
            let r = x.iter().zip(&x[lag..]).map(|(a, b)| a * b).sum::<f64>() / n / variance(&x);
            assert!(r.abs() < 5.0 / n.sqrt(), "lag {lag}: {r}");
        }
    }

    #[test]
    fn relative_noise_grows_with_the_signal_and_adds_as_variance() {
        for signal in [0.0, -100.0, 1000.0] {
            let mut noise = White::new(2.0, 0.01, Stream::new(3, "relative"));
            let x: Vec<f64> = (0..N).map(|_| noise.draw(signal)).collect();
            let expected = 4.0 + 1e-4 * signal * signal;
            assert!((variance(&x) / expected - 1.0).abs() < 5.0 * f64::sqrt(2.0 / N as f64));
        }
    }

    /// Both conventions, against the integral: a one-sided density d is a two-sided d²/2, whose integral wanders by
    /// d√(t/2).
    #[test]
    fn densities_are_those_of_the_integral() {
        for rate in [50.0, 100.0, 200.0] {
            for (sd, per_root_second) in [
                (white_sd(0.0, 0.02, 0.0, rate), 0.02 / f64::sqrt(2.0)),
                (white_sd(0.0, 0.0, 0.02, rate), 0.02),
            ] {
                let mut noise = White::new(sd, 0.0, Stream::new(4, "integral"));
                let runs = 4000;
                let ends: Vec<f64> = (0..runs)
                    .map(|_| (0..rate as usize).map(|_| noise.draw(0.0) / rate).sum())
                    .collect();
                let ratio = variance(&ends) / (per_root_second * per_root_second);
                assert!(
                    (ratio - 1.0).abs() < 5.0 * f64::sqrt(2.0 / runs as f64),
                    "{rate} Hz: {ratio}"
                );
            }
        }
    }

    #[test]
    fn white_noise_has_allan_slope_minus_one_half_at_the_right_level() {
        let mut noise = White::new(0.3, 0.0, Stream::new(5, "white"));
        let x: Vec<f64> = (0..N).map(|_| noise.draw(0.0)).collect();
        let coefficient = 0.3 * T.sqrt();
        let points: Vec<(f64, f64)> = (0..10).map(|p| allan_deviation(&x, T, 1 << p)).collect();
        for (i, (tau, deviation)) in points.iter().enumerate() {
            // Relative sd of the deviation from M clusters: at most √(3/4)/√M for white noise (Lesage & Audoin 1973).
            let clusters = (N >> i) as f64;
            let ratio = deviation / (coefficient / tau.sqrt());
            assert!(
                (ratio - 1.0).abs() < 5.0 * (0.75 / clusters).sqrt(),
                "τ = {tau}: {ratio}"
            );
        }
        assert!((slope(&points) + 0.5).abs() < 0.02, "{}", slope(&points));
    }

    #[test]
    fn random_walk_has_allan_slope_plus_one_half_at_the_right_level() {
        let mut walk = RandomWalk::new(0.05, T, Stream::new(6, "walk"));
        let x: Vec<f64> = (0..N).map(|_| walk.draw()).collect();
        // From 16 periods on: below, the staircase of the sampled walk shows (exactly 1/(2m²) relative in variance).
        let points: Vec<(f64, f64)> = (4..11).map(|p| allan_deviation(&x, T, 1 << p)).collect();
        for (i, (tau, deviation)) in points.iter().enumerate() {
            let clusters = (N >> (i + 4)) as f64;
            let ratio = deviation / (0.05 * (tau / 3.0).sqrt());
            assert!(
                (ratio - 1.0).abs() < 5.0 * (0.75 / clusters).sqrt() + 0.002,
                "τ = {tau}: {ratio}"
            );
        }
        assert!((slope(&points) - 0.5).abs() < 0.06, "{}", slope(&points));
    }

    #[test]
    fn random_walk_spreads_with_the_root_of_time() {
        let runs = 4000;
        for steps in [100, 400] {
            let ends: Vec<f64> = (0..runs)
                .map(|i| {
                    let mut walk = RandomWalk::new(0.5, T, Stream::new(i, "spread"));
                    (0..steps).fold(0.0, |_, _| walk.draw())
                })
                .collect();
            let expected = 0.25 * steps as f64 * T;
            assert!((variance(&ends) / expected - 1.0).abs() < 5.0 * f64::sqrt(2.0 / runs as f64));
        }
    }

    #[test]
    fn gauss_markov_is_stationary_and_forgets_exponentially() {
        let (sd, time) = (0.2, 0.5);
        let mut process = GaussMarkov::new(sd, time, T, Stream::new(8, "markov"));
        let x: Vec<f64> = (0..N).map(|_| process.draw()).collect();
        // Bartlett: the estimates have about N·T/τ_c independent draws for variance (φ² memory: τ_c/2 each side).
        let independent = N as f64 * T / time;
        let v = variance(&x);
        assert!(
            (v / (sd * sd) - 1.0).abs() < 5.0 * f64::sqrt(2.0 / independent),
            "{v}"
        );
        for lag in [10, 50, 100, 250] {
            let r = x.iter().zip(&x[lag..]).map(|(a, b)| a * b).sum::<f64>()
                / (N - lag) as f64
                / (sd * sd);
            let expected = f64::exp(-(lag as f64) * T / time);
            assert!(
                (r - expected).abs() < 5.0 * f64::sqrt(2.0 / independent),
                "lag {lag}: {r} not {expected}"
            );
        }
        // Across runs the first value already has the full spread.
        let runs = 4000;
        let first: Vec<f64> = (0..runs)
            .map(|i| GaussMarkov::new(sd, time, T, Stream::new(i, "first")).draw())
            .collect();
        assert!((variance(&first) / (sd * sd) - 1.0).abs() < 5.0 * f64::sqrt(2.0 / runs as f64));
    }
}
