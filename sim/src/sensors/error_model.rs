//! Error model of one axis of an instrument, effect by effect, in the order of the signal path:
//!
//! 1. `x₁ = (1 + s + s_warm) x`: scale, known part + part drawn once a run + part that comes with warming up;
//! 2. `x₂ = x₁ + 4 L R u (1 − u) sign x₁`, u = min(|x₁|/R, 1): terminal-based linearity L of full scale R: right at
//!    zero and at full scale, off by L·R half-way (the definition of IEC 61298-2);
//! 3. `x₃ = x₂ + b₀ + b_walk + b_markov + b_warm`: biases, constant (known + drawn once a run), wandering, and
//!    warming up;
//! 4. `x₄ = x₃ + w`: white noise, absolute and relative to the reading;
//! 5. quantisation, 6. saturation (between 4 and 5: faults, see `fault`).
//!
//! Bandwidth acts on the ideal signal at every physics step (see `low_pass`); rate, jitter, latency and drop-out act on
//! samples (see `sampling`); misalignment mixes axes (see `misalignment`).

use super::noise::{GaussMarkov, RandomWalk, White, white_sd};
use super::spec::{Errors, WarmUp};
use super::stream::Stream;
use crate::checked::{Finite, NonNegative, Positive};

/// The errors of one axis during one run.
#[derive(Clone, Debug)]
pub struct ErrorModel {
    gain: f64,
    linearity: f64,
    full_scale: f64,
    bias: f64,
    walk: Option<RandomWalk>,
    markov: Option<GaussMarkov>,
    warmth: Option<Warmth>,
    white: White,
    /// Step of the converter; 0 = none. No `Option`: the compiler divides by its content before it asks whether it has
    /// any, and a division by stray bits, if they are a subnormal number, costs a hundred cycles.
    quantisation: f64,
    range: Option<[f64; 2]>,
}

impl ErrorModel {
    /// Draw the constants of a run and start the processes. `axis` names the random streams, `rate_hz` is the sampling
    /// rate, `axis_bias` a known bias of this axis, unit.
    pub fn new(errors: &Errors, rate_hz: f64, axis_bias: f64, seed: u64, axis: &str) -> Self {
        let stream = |effect: &str| Stream::new(seed, &format!("{axis}/{effect}"));
        let period_s = 1.0 / rate_hz;
        let range = errors.range.map(|limits| limits.map(Finite::get));
        let white = white_sd(
            errors.noise_sd.get(),
            errors.noise_density.get(),
            errors.random_walk_of_integral.get(),
            rate_hz,
        );
        let walk = errors.bias_random_walk.get();
        Self {
            gain: 1.0
                + errors.scale_error.get()
                + errors.scale_error_sd.get() * stream("scale").normal(),
            linearity: errors.linearity.get(),
            full_scale: range.map_or(f64::INFINITY, |[low, high]| low.abs().max(high.abs())),
            bias: errors.bias.get()
                + axis_bias
                + errors.bias_sd.get() * stream("bias").normal()
                + errors.switch_on_bias.map_or(0.0, |limits| {
                    switch_on(limits.map(NonNegative::get), &mut stream("switch_on"))
                }),
            walk: (walk > 0.0).then(|| RandomWalk::new(walk, period_s, stream("walk"))),
            markov: errors
                .gauss_markov
                .map(|m| GaussMarkov::new(m.sd.get(), m.time_s.get(), period_s, stream("markov"))),
            warmth: errors.warm_up.map(|w| Warmth::new(&w, period_s)),
            white: White::new(white, errors.noise_sd_rel.get(), stream("white")),
            quantisation: errors.quantisation.map_or(0.0, Positive::get),
            range,
        }
    }

    /// Effects 1 to 4: what the sensing element makes of the ideal value. Once per sample period, in order.
    pub fn sense(&mut self, ideal: f64) -> f64 {
        let warm = self.warmth.as_mut().map_or([0.0; 2], Warmth::advance);
        let mut x = (self.gain + warm[1]) * ideal;
        if self.linearity > 0.0 {
            let u = (x.abs() / self.full_scale).min(1.0);
            x += 4.0 * self.linearity * self.full_scale * u * (1.0 - u) * x.signum();
        }
        let reading = x;
        x += self.bias + warm[0];
        if let Some(walk) = &mut self.walk {
            x += walk.draw();
        }
        if let Some(markov) = &mut self.markov {
            x += markov.draw();
        }
        x + self.white.draw(reading)
    }

    /// Effects 5 and 6: what the converter makes of the sensed value.
    pub fn convert(&self, sensed: f64) -> f64 {
        let mut x = sensed;
        if self.quantisation > 0.0 {
            x = self.quantisation * libm::rint(x / self.quantisation);
        }
        if let Some([low, high]) = self.range {
            x = x.clamp(low, high);
        }
        x
    }
}

/// A bias whose magnitude is uniform between the limits, of either sign.
fn switch_on([least, greatest]: [f64; 2], stream: &mut Stream) -> f64 {
    let magnitude = least + (greatest - least) * stream.uniform();
    if stream.uniform() < 0.5 {
        magnitude
    } else {
        -magnitude
    }
}

/// First-order heating from the start of the run on.
#[derive(Clone, Copy, Debug)]
struct Warmth {
    bias: f64,
    scale: f64,
    share: f64,
    per_sample: f64,
}

impl Warmth {
    fn new(w: &WarmUp, period_s: f64) -> Self {
        Self {
            bias: w.bias.get(),
            scale: w.scale_error.get(),
            share: 0.0,
            per_sample: 1.0 - libm::exp(-period_s / w.time_s.get()),
        }
    }

    /// Bias and scale error now; then a sample period passes.
    fn advance(&mut self) -> [f64; 2] {
        let now = [self.bias * self.share, self.scale * self.share];
        self.share += self.per_sample * (1.0 - self.share);
        now
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checked::Fraction;
    use crate::sensors::spec::Markov;

    fn model(errors: Errors, seed: u64) -> ErrorModel {
        ErrorModel::new(&errors, 100.0, 0.0, seed, "test")
    }

    #[test]
    fn without_errors_a_reading_is_the_truth_to_the_bit() {
        let mut m = model(Errors::default(), 1);
        for x in [0.0, -3.7, 1e-9, 1e6] {
            let sensed = m.sense(x);
            assert_eq!(m.convert(sensed), x);
        }
    }

    #[test]
    fn known_scale_and_bias_act_as_a_straight_line() {
        let mut m = ErrorModel::new(
            &Errors {
                scale_error: Finite::new(0.02),
                bias: Finite::new(-0.5),
                ..Errors::default()
            },
            100.0,
            0.25,
            1,
            "test",
        );
        for x in [-10.0, 0.0, 10.0] {
            assert!((m.sense(x) - (1.02 * x - 0.25)).abs() < 1e-12);
        }
    }

    #[test]
    fn warming_up_brings_bias_and_scale_by_the_law_of_first_order() {
        let mut m = model(
            Errors {
                warm_up: Some(WarmUp {
                    time_s: Positive::new(20.0),
                    bias: Finite::new(0.5),
                    scale_error: Finite::new(-0.1),
                }),
                ..Errors::default()
            },
            1,
        );
        for k in 0..10_000 {
            let warm = 1.0 - (-0.01 * f64::from(k) / 20.0).exp();
            let expected = (1.0 - 0.1 * warm) * 3.0 + 0.5 * warm;
            assert!((m.sense(3.0) - expected).abs() < 1e-9, "sample {k}");
        }
    }

    #[test]
    fn linearity_is_right_at_the_ends_and_off_half_way() {
        let mut m = model(
            Errors {
                linearity: Fraction::new(0.01),
                range: Some([-10.0, 10.0].map(Finite::new)),
                ..Errors::default()
            },
            1,
        );
        for (x, expected) in [
            (0.0, 0.0),
            (10.0, 10.0),
            (-10.0, -10.0),
            (5.0, 5.1),
            (-5.0, -5.1),
            (2.5, 2.575),
        ] {
            assert!((m.sense(x) - expected).abs() < 1e-12, "{x}");
        }
    }

    #[test]
    fn constants_of_a_run_have_their_spread_and_stay() {
        let errors = Errors {
            bias_sd: NonNegative::new(0.3),
            scale_error_sd: NonNegative::new(0.01),
            ..Errors::default()
        };
        let runs = 20_000;
        let (mut biases, mut gains) = (0.0, 0.0);
        for seed in 0..runs {
            let mut m = model(errors, seed);
            let bias = m.sense(0.0);
            assert_eq!(bias, m.sense(0.0));
            let gain = m.sense(1.0) - bias - 1.0;
            biases += bias * bias;
            gains += gain * gain;
        }
        let bound = 5.0 * f64::sqrt(2.0 / runs as f64);
        assert!((biases / runs as f64 / 0.09 - 1.0).abs() < bound);
        assert!((gains / runs as f64 / 1e-4 - 1.0).abs() < bound);
    }

    #[test]
    fn a_switch_on_bias_is_uniform_between_its_limits_and_of_either_sign() {
        let errors = Errors {
            switch_on_bias: Some([0.2, 0.6].map(NonNegative::new)),
            ..Errors::default()
        };
        let runs = 20_000;
        let biases: Vec<f64> = (0..runs)
            .map(|seed| model(errors, seed).sense(0.0))
            .collect();
        assert!(biases.iter().all(|b| (0.2..=0.6).contains(&b.abs())));
        let n = runs as f64;
        let up = biases.iter().filter(|b| **b > 0.0).count() as f64 / n;
        let mean = biases.iter().map(|b| b.abs()).sum::<f64>() / n;
        assert!((up - 0.5).abs() < 5.0 * 0.5 / n.sqrt());
        // Standard deviation of the uniform: 0.4/√12.
        assert!((mean - 0.4).abs() < 5.0 * 0.4 / (12.0 * n).sqrt());
        let mut sound = model(Errors::default(), 1);
        let mut biased = model(errors, 1);
        assert_eq!(biased.sense(1.0) - biased.sense(1.0), 0.0, "it stays");
        assert_eq!(sound.sense(1.0), 1.0);
    }

    /// A signal that crosses many steps gets an error uniform on ± half a step: variance q²/12 (Widrow 1956).
    #[test]
    fn quantisation_rounds_to_steps_with_the_variance_of_a_uniform() {
        let m = model(
            Errors {
                quantisation: Some(Positive::new(0.25)),
                ..Errors::default()
            },
            1,
        );
        let count = 100_000;
        let mut squares = 0.0;
        for i in 0..count {
            let x = -40.0 + 80.0 * (i as f64 + 0.5) / count as f64;
            let y = m.convert(x);
            assert_eq!(y / 0.25, f64::round(y / 0.25));
            assert!((y - x).abs() <= 0.125 + 1e-12);
            squares += (y - x) * (y - x);
        }
        assert!((squares / count as f64 / (0.0625 / 12.0) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn readings_never_leave_the_range() {
        let mut m = model(
            Errors {
                noise_sd: NonNegative::new(3.0),
                quantisation: Some(Positive::new(0.7)),
                range: Some([-2.0, 5.0].map(Finite::new)),
                ..Errors::default()
            },
            1,
        );
        let (mut lowest, mut highest) = (false, false);
        for _ in 0..10_000 {
            let sensed = m.sense(1.5);
            let y = m.convert(sensed);
            assert!((-2.0..=5.0).contains(&y));
            lowest |= y == -2.0;
            highest |= y == 5.0;
        }
        assert!(lowest && highest, "noise this large must reach both ends");
    }

    /// All noise keys at once: variances add.
    #[test]
    fn independent_noises_add_as_variances() {
        let mut m = model(
            Errors {
                noise_sd: NonNegative::new(0.1),
                noise_density: NonNegative::new(0.02),
                random_walk_of_integral: NonNegative::new(0.015),
                gauss_markov: Some(Markov {
                    sd: NonNegative::new(0.2),
                    time_s: Positive::new(0.02),
                }),
                ..Errors::default()
            },
            9,
        );
        let count = 400_000;
        let squares: f64 = (0..count).map(|_| m.sense(0.0)).map(|x| x * x).sum();
        let expected = 0.01 + 0.0004 * 50.0 + 0.000225 * 100.0 + 0.04;
        // The Markov part has (1 + φ²)/(1 − φ²) = 2.2 samples per independent one: bound with that.
        let bound = 5.0 * f64::sqrt(2.0 * 2.2 / count as f64);
        assert!((squares / count as f64 / expected - 1.0).abs() < bound);
    }

    #[test]
    fn switching_one_effect_on_leaves_the_draws_of_the_others() {
        let white = Errors {
            noise_sd: NonNegative::new(1.0),
            ..Errors::default()
        };
        let more = Errors {
            bias_random_walk: NonNegative::new(1e-30),
            bias_sd: NonNegative::new(1e-30),
            ..white
        };
        let (mut a, mut b) = (model(white, 5), model(more, 5));
        for _ in 0..100 {
            assert_eq!(a.sense(0.0).to_bits(), b.sense(0.0).to_bits());
        }
    }
}
