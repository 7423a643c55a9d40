//! Times at which an instrument samples and delivers values, and the clock for their stamps.

use crate::checked::{Finite, Fraction, NonNegative, Positive};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Times at which values are sampled and delivered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sampling {
    /// Samples per second; at most one per physics step.
    pub rate_hz: Positive,
    /// Time from sampling a value to delivering it, ms.
    #[serde(default)]
    pub latency_ms: NonNegative,
    /// Standard deviation of the sampling instant about its stamp, ms.
    #[serde(default)]
    pub jitter_ms: NonNegative,
    /// Probability that a sample is lost.
    #[serde(default)]
    pub dropout: Fraction,
    /// Further time to arrival, drawn for every sample; a sample waits for those before it.
    #[serde(default)]
    pub arrival_jitter: Option<ArrivalJitter>,
    /// Samples are delivered only at multiples of this time, ms; 0 = immediately.
    #[serde(default)]
    pub bunching_ms: NonNegative,
    /// A share of samples that arrives late and out of order.
    #[serde(default)]
    pub reordering: Option<Reordering>,
    /// Error of the clock that stamps the samples.
    #[serde(default)]
    pub clock: ClockSpec,
    /// Sample that is delivered if several have arrived within a step.
    #[serde(default)]
    pub many: Many,
}

impl Sampling {
    /// Makes a sampling with this rate, Hz, where every sample arrives at once with a right stamp.
    pub fn at(rate_hz: f64) -> Self {
        Self {
            rate_hz: Positive::new(rate_hz),
            latency_ms: NonNegative::ZERO,
            jitter_ms: NonNegative::ZERO,
            dropout: Fraction::ZERO,
            arrival_jitter: None,
            bunching_ms: NonNegative::ZERO,
            reordering: None,
            clock: ClockSpec::default(),
            many: Many::Mean,
        }
    }
}

impl Default for Sampling {
    /// 100 Hz.
    fn default() -> Self {
        Self::at(100.0)
    }
}

/// Time to arrival that differs from sample to sample; samples keep their order.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArrivalJitter {
    /// Distribution of the time.
    pub distribution: DelayDistribution,
    /// Longest time (uniform: from 0 to this) or mean time (exponential, cut off at ten times this), ms.
    pub ms: Positive,
}

impl ArrivalJitter {
    /// Longest time to arrival, ms.
    pub fn longest_ms(self) -> f64 {
        match self.distribution {
            DelayDistribution::Uniform => self.ms.get(),
            DelayDistribution::Exponential => 10.0 * self.ms.get(),
        }
    }
}

/// Distribution of a time to arrival.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DelayDistribution {
    /// Every time from 0 to `ms` is equally likely.
    Uniform,
    /// Short times are likely, long times rare.
    Exponential,
}

/// Samples that arrive after younger ones.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reordering {
    /// Probability that a sample is delayed.
    pub share: Fraction,
    /// Delay of such a sample, ms.
    pub delay_ms: Positive,
}

/// Clock of an instrument: it stamps t with t + offset + drift·t.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Clock")] // the name in the JSON schema
pub struct ClockSpec {
    /// Known offset, + stamps too late, ms.
    pub offset_ms: Finite,
    /// Standard deviation of an offset drawn once a run, ms.
    pub offset_sd_ms: NonNegative,
    /// Known drift, + runs fast, millionths.
    pub drift_ppm: Finite,
    /// Standard deviation of a drift drawn once a run, millionths.
    pub drift_sd_ppm: NonNegative,
}

/// Sample that is delivered if several have arrived since the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Many {
    /// Their mean, with the mean of their stamps.
    #[default]
    Mean,
    /// The sample with the newest stamp; the others are dropped.
    Newest,
}
