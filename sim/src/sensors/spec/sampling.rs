//! Blocks of a sensor sheet for what surrounds an instrument: the way its samples take, the clock, shaking, hits, a sprung mount.

use crate::config::checked::{Finite, Fraction, NonNegative, Positive};
use crate::sensors::spec;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Time to arrival that differs from sample to sample; samples keep their order.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "ArrivalJitter")] // the name in the JSON schema
pub struct ArrivalJitterFile {
    /// How it is distributed.
    pub distribution: DelayDistribution,
    /// Longest time (uniform: from 0 to this) or mean time (exponential, cut off at ten times this), ms.
    pub ms: Positive,
}

/// Distribution of a time to arrival.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DelayDistribution {
    /// Every time from 0 to `ms` is as likely.
    Uniform,
    /// Short ones are likely, long ones rare.
    Exponential,
}

impl From<ArrivalJitterFile> for spec::ArrivalJitter {
    fn from(j: ArrivalJitterFile) -> Self {
        match j.distribution {
            DelayDistribution::Uniform => Self::Uniform(j.ms.get()),
            DelayDistribution::Exponential => Self::Exponential(j.ms.get()),
        }
    }
}

/// Samples that arrive after younger ones.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Reordering")] // the name in the JSON schema
pub struct ReorderingFile {
    /// Probability of a sample to be held up.
    pub share: Fraction,
    /// Time it is held up, ms.
    pub delay_ms: Positive,
}

impl From<ReorderingFile> for spec::Reordering {
    fn from(r: ReorderingFile) -> Self {
        Self {
            share: r.share.get(),
            delay_ms: r.delay_ms.get(),
        }
    }
}

/// Clock of an instrument: it stamps t with t + offset + drift·t.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Clock")] // the name in the JSON schema
pub struct ClockFile {
    /// Known offset, + stamps too late, ms.
    pub offset_ms: Finite,
    /// Standard deviation of an offset drawn once a run, ms.
    pub offset_sd_ms: NonNegative,
    /// Known drift, + runs fast, millionths.
    pub drift_ppm: Finite,
    /// Standard deviation of a drift drawn once a run, millionths.
    pub drift_sd_ppm: NonNegative,
}

impl Default for ClockFile {
    fn default() -> Self {
        Self {
            offset_ms: Finite::ZERO,
            offset_sd_ms: NonNegative::new(0.0),
            drift_ppm: Finite::ZERO,
            drift_sd_ppm: NonNegative::new(0.0),
        }
    }
}

impl From<ClockFile> for spec::ClockSpec {
    fn from(c: ClockFile) -> Self {
        Self {
            offset_ms: c.offset_ms.get(),
            offset_sd_ms: c.offset_sd_ms.get(),
            drift_ppm: c.drift_ppm.get(),
            drift_sd_ppm: c.drift_sd_ppm.get(),
        }
    }
}

/// What is handed over when several samples have arrived since the last step.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Many")] // the name in the JSON schema
pub enum ManyFile {
    /// Their mean, with the mean of their stamps.
    #[default]
    Mean,
    /// The one with the newest stamp; the others are dropped.
    Newest,
}

impl From<ManyFile> for spec::Many {
    fn from(many: ManyFile) -> Self {
        match many {
            ManyFile::Mean => Self::Mean,
            ManyFile::Newest => Self::Newest,
        }
    }
}

/// Band-limited noise whose level grows in proportion to the speed up to `full_mps` and stays there.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Vibration")] // the name in the JSON schema
pub struct VibrationFile {
    /// Standard deviation from `full_mps` on, unit.
    pub sd: NonNegative,
    /// Speed from which on it has its full level, m/s.
    pub full_mps: Positive,
    /// Lower and upper corner frequency, Hz; the density falls by 20 dB per decade beyond each.
    pub band_hz: [Positive; 2],
}

impl From<VibrationFile> for spec::VibrationSpec {
    fn from(v: VibrationFile) -> Self {
        Self {
            sd: v.sd.get(),
            full_mps: v.full_mps.get(),
            band_hz: v.band_hz.map(|f| f.get()),
        }
    }
}

/// Short disturbances at places of the track: one period of a sine on the axes of an accelerometer or gyro, a jump of any other
/// reading.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Hits")] // the name in the JSON schema
pub struct HitsFile {
    /// One at every rail joint of the track.
    #[serde(default)]
    pub at_joints: bool,
    /// So many more at random places, per metre travelled.
    #[serde(default = "no_more")]
    pub per_m: NonNegative,
    /// [least, greatest] magnitude, sign at random, unit.
    pub size: [NonNegative; 2],
    /// How long one lasts, ms.
    pub duration_ms: Positive,
}

fn no_more() -> NonNegative {
    NonNegative::new(0.0)
}

impl From<HitsFile> for spec::HitSpec {
    fn from(h: HitsFile) -> Self {
        Self {
            at_joints: h.at_joints,
            per_m: h.per_m.get(),
            size: h.size.map(|x| x.get()),
            duration_ms: h.duration_ms.get(),
        }
    }
}

/// Pitch of a sprung body under acceleration along the track, which turns what is bolted to it: a second-order lag.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Lean")] // the name in the JSON schema
pub struct LeanFile {
    /// Static pitch, degrees of nose up per standard gravity of forward acceleration. Adds to what the vehicle's own suspension does.
    pub pitch_deg_per_g: Finite,
    /// Natural frequency, Hz.
    pub frequency_hz: Positive,
    /// Damping ratio.
    pub damping: Positive,
}

impl From<LeanFile> for spec::LeanSpec {
    fn from(l: LeanFile) -> Self {
        Self {
            pitch_deg_per_g: l.pitch_deg_per_g.get(),
            frequency_hz: l.frequency_hz.get(),
            damping: l.damping.get(),
        }
    }
}
