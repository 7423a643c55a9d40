//! Noise of a channel, learnt from its samples and not from the innovations of a filter.

use crate::Real;
use crate::api::real::{PI, sqrt};
use crate::api::snapshot::state;
use crate::filters::lag_share::LagShare;
use crate::tuning::{STATISTICS, TIMES};

/// Trend that is subtracted from a sample before its size counts.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Trend {
    /// The line through its two predecessors: x − 2 x′ + x″, which has √6 times the deviation of white noise. For a
    /// speed, whose ramps are no noise.
    Line { before: [Real; 2], seen: u32 },
    /// A low-pass of this time constant, s. For an accelerometer, whose vibration is not white.
    Level {
        tau_s: Real,
        share: LagShare,
        level: Option<Real>,
    },
}

/// Running robust root mean square of changes of a channel that are too fast for the vehicle.
///
/// σ = √(π/2) · mean |deviation|, exact for normal noise, with deviations clipped. Unlike a noise adapted to
/// innovations it contains no error of the model, so a consistency test against it means something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseLearning {
    trend: Trend,
    scale: Real,
    mean: Real,
    known_s: Real,
    share: LagShare,
}

impl NoiseLearning {
    /// For a wheel speed: deviation from the line through the two samples before.
    pub fn of_speed() -> Self {
        Self {
            trend: Trend::Line {
                before: [0.0; 2],
                seen: 0,
            },
            scale: sqrt(PI / 2.0) / sqrt(6.0),
            mean: 0.0,
            known_s: 0.0,
            share: LagShare::default(),
        }
    }

    /// For an accelerometer: deviation from a low-pass of 0.2 s.
    pub fn of_acceleration() -> Self {
        Self {
            trend: Trend::Level {
                tau_s: 0.2,
                share: LagShare::default(),
                level: None,
            },
            scale: sqrt(PI / 2.0),
            mean: 0.0,
            known_s: 0.0,
            share: LagShare::default(),
        }
    }

    /// Takes a new sample, `period_s` after the last sample.
    pub fn observe(&mut self, value: Real, period_s: Real) {
        let away = match &mut self.trend {
            Trend::Line { before, seen } => {
                let [last, older] = *before;
                *before = [value, last];
                *seen = seen.saturating_add(1);
                if *seen < 3 {
                    return;
                }
                value - 2.0 * last + older
            }
            Trend::Level {
                tau_s,
                share,
                level,
            } => {
                let before = level.unwrap_or(value);
                *level = Some(before + share.of(period_s, *tau_s) * (value - before));
                value - before
            }
        };
        self.known_s = (self.known_s + period_s).min(TIMES.memory_s);
        let share = self.share.of(period_s, self.known_s);
        let size = if self.known_s > TIMES.brief_s {
            away.abs().min(STATISTICS.clip * self.mean + 1e-6)
        } else {
            away.abs()
        };
        self.mean += share * (size - self.mean);
    }

    /// Standard deviation, in the unit of the channel; `None` before the first 0.3 s of samples.
    pub fn sd(&self) -> Option<Real> {
        (self.known_s > TIMES.brief_s).then_some(self.scale * self.mean)
    }
}

impl crate::api::snapshot::State for Trend {
    fn visit(&mut self, archive: &mut crate::api::snapshot::Archive) {
        match self {
            Trend::Line { before, seen } => {
                before.visit(archive);
                seen.visit(archive);
            }
            Trend::Level { level, .. } => level.visit(archive),
        }
    }
}

state!(NoiseLearning { trend, mean, known_s; scale, share });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn white_noise_on_a_ramp_is_found_to_a_tenth() {
        let mut random = Random::new(96);
        let mut speed = NoiseLearning::of_speed();
        let mut force = NoiseLearning::of_acceleration();
        for k in 0..2_000 {
            let t = 0.01 * Real::from(k);
            speed.observe(0.5 * t + 0.02 * random.normal(), 0.01);
            force.observe(0.3 + 0.01 * t + 0.5 * random.normal(), 0.01);
            assert!(t > 0.25 || speed.sd().is_none());
            assert!(t < 0.35 || speed.sd().is_some());
        }
        let (speed, force) = (speed.sd().unwrap(), force.sd().unwrap());
        assert!((speed / 0.02 - 1.0).abs() < 0.15, "{speed}");
        assert!((force / 0.5 - 1.0).abs() < 0.15, "{force}");
    }

    #[test]
    fn bumps_are_no_noise() {
        let mut random = Random::new(97);
        let mut speed = NoiseLearning::of_speed();
        for k in 0..5_000 {
            let bump = if k % 200 == 150 { 1.0 } else { 0.0 };
            speed.observe(0.01 * random.normal() + bump, 0.01);
        }
        assert!(speed.sd().unwrap() < 0.015, "{:?}", speed.sd());
    }
}
