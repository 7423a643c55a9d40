//! A check and its verdict, and the figures of a channel.

/// The verdict of a check.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// The check found nothing wrong.
    Good,
    /// The check found something wrong, with its possible cause.
    Bad(String),
    /// The log cannot decide the check, with the reason.
    Unknown(String),
}

/// A check: the quantity, the number that was found, and its meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// The quantity that was checked.
    pub what: String,
    /// The value; NaN without a value.
    pub value: f64,
    /// Its unit.
    pub unit: &'static str,
    /// The good numbers, in words.
    pub good: String,
    /// Its meaning.
    pub verdict: Verdict,
}

/// Figures of the samples of a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelReport {
    /// Its name.
    pub name: String,
    /// Samples per second, by the median step, Hz.
    pub rate_hz: f64,
    /// Standard deviation of the steps that are no gaps, ms.
    pub jitter_ms: f64,
    /// Steps of more than five times the median.
    pub gaps: u64,
    /// Longest of these steps, s; 0 without such a step.
    pub longest_gap_s: f64,
    /// Number of samples with the stamp of the previous sample.
    pub duplicates: u64,
    /// Usable share of the samples.
    pub valid: f64,
}

pub(super) fn check(
    what: impl Into<String>,
    value: f64,
    unit: &'static str,
    good: &str,
    verdict: Verdict,
) -> Check {
    Check {
        what: what.into(),
        value,
        unit,
        good: good.into(),
        verdict,
    }
}

pub(super) fn norm(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}
