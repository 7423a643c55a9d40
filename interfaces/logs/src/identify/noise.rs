//! Noise of a log's channels, and the parameters of estimators that stand for it.

use crate::drive::{Drive, Found, Plan, Step};
use crate::map::Map;
use monorig_estimators::api::params::KeyKind;
use monorig_estimators::api::signals::Measurements;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::scenario::Settings;
use monorig_sim::error::Error;
use std::collections::BTreeMap;

/// Noise of the channels: standard deviation of a sample by the second differences of successive ones (after von
/// Neumann 1941), which motion that is slow against the rate of the samples does not touch, and vibration does. The
/// tenth of them that is largest is left out: codes for "not available" and spikes are no noise.
#[derive(Clone, Debug, Default)]
pub(crate) struct Noise {
    channels: Vec<SecondDifferences>,
}

#[derive(Clone, Debug)]
struct SecondDifferences {
    kind: NoisySensor,
    index: usize,
    /// The last sample, and the one before it.
    last: f64,
    before: Option<f64>,
    /// Squares of every `stride`-th second difference, and how many of them there were.
    squares: Vec<f64>,
    stride: usize,
    seen: usize,
}

/// Squares that are kept of a channel.
const KEPT: usize = 1 << 16;
/// Share of the second differences that counts, and the mean square of these over that of all, of a normal
/// distribution: 1 − 2 q φ(q) / 0.9 with Φ(q) = 0.95.
const COUNTED: f64 = 0.9;
const MEAN_SQUARE: f64 = 0.622_9;

impl SecondDifferences {
    fn push(&mut self, square: f64) {
        if self.seen.is_multiple_of(self.stride) {
            self.squares.push(square);
        }
        self.seen += 1;
        if self.squares.len() == KEPT {
            let mut place = 0;
            self.squares.retain(|_| {
                place += 1;
                place % 2 == 1
            });
            self.stride *= 2;
        }
    }

    fn mean_square(&self) -> f64 {
        let mut sorted = self.squares.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let counted = ((COUNTED * sorted.len() as f64) as usize).max(1);
        let sum: f64 = sorted.iter().take(counted).sum();
        sum / (counted as f64 * MEAN_SQUARE)
    }
}

/// A sensor whose noise is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum NoisySensor {
    Force,
    Rate,
    Wheel,
    Torque,
}

/// Noise of a channel.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ChannelNoise {
    /// Its name, such as `wheel speed 2`.
    pub channel: String,
    /// Standard deviation of a sample.
    pub sd: f64,
    /// Standard deviation of that figure.
    pub sd_of_sd: f64,
    /// Unit of both.
    pub unit: &'static str,
    kind: NoisySensor,
    index: usize,
}

impl Noise {
    /// The noise of the log of a map, read once up to this length, ns.
    pub fn of_log(map: &Map, plan: &Plan, length_ns: i64) -> Result<Self, Error> {
        let mut noise = Self::default();
        let mut drive = Drive::open(map, plan)?;
        let (mut first_ns, mut step) = (None, Step::default());
        while drive.next_into(map, &mut step)? {
            let first_ns = *first_ns.get_or_insert(step.t_ns);
            if step.t_ns.saturating_sub(first_ns) > length_ns {
                break;
            }
            noise.see(&step.z);
        }
        Ok(noise)
    }

    /// The noise that was given to estimators in words: each value once.
    pub fn taken(&self, given: &[Found]) -> Option<String> {
        let mut words = Vec::new();
        for (parameter, _) in NAMES {
            let of = |f: &&Found| f.what.split([' ', ',']).any(|w| w.ends_with(parameter));
            if let Some(found) = given.iter().find(of) {
                words.push(format!("{parameter} {:.2e}", found.value));
            }
        }
        (!words.is_empty()).then(|| format!("noise (of the log: {})", words.join(", ")))
    }

    /// Takes the samples of a step.
    pub fn see(&mut self, z: &Measurements) {
        for (kind, sample) in [
            (NoisySensor::Force, z.specific_force_mps2),
            (NoisySensor::Rate, z.angular_rate_radps),
        ] {
            for (axis, x) in sample.iter().flat_map(|s| s.value).enumerate() {
                self.push(kind, axis, x);
            }
        }
        for (kind, slots) in [
            (NoisySensor::Wheel, &z.wheel_speed_mps),
            (NoisySensor::Torque, &z.motor_torque_nm),
        ] {
            for (i, sample) in slots.iter().enumerate() {
                if let Some(sample) = sample {
                    self.push(kind, i, sample.value);
                }
            }
        }
    }

    fn push(&mut self, kind: NoisySensor, index: usize, x: f64) {
        let mut channels = self.channels.iter_mut();
        match channels.find(|c| c.kind == kind && c.index == index) {
            Some(channel) => {
                if let Some(before) = channel.before {
                    channel.push((x - 2.0 * channel.last + before).powi(2));
                }
                channel.before = Some(channel.last);
                channel.last = x;
            }
            None => self.channels.push(SecondDifferences {
                kind,
                index,
                last: x,
                before: None,
                squares: Vec::new(),
                stride: 1,
                seen: 0,
            }),
        }
    }

    /// The figures of all channels with three samples.
    pub fn figures(&self) -> Vec<ChannelNoise> {
        let figure = |c: &SecondDifferences| {
            let (name, unit) = match c.kind {
                NoisySensor::Force => ("specific force", "m/s2"),
                NoisySensor::Rate => ("angular rate", "rad/s"),
                NoisySensor::Wheel => ("wheel speed", "m/s"),
                NoisySensor::Torque => ("motor torque", "Nm"),
            };
            let which = match c.kind {
                NoisySensor::Force | NoisySensor::Rate => ["forward", "left", "up"]
                    .get(c.index)
                    .copied()
                    .unwrap_or_default()
                    .to_owned(),
                _ => (c.index + 1).to_string(),
            };
            // of white noise the mean square is 1 + 4 + 1 times the variance
            let sd = (c.mean_square() / 6.0).sqrt();
            ChannelNoise {
                channel: format!("{name} {which}"),
                sd,
                // neighbours share samples (correlations −2/3 and 1/6): the variance of the variance is 2 (1 + 2 ·
                // 17/36) σ⁴ / n
                sd_of_sd: sd * (35.0 / (36.0 * c.seen as f64)).sqrt(),
                unit,
                kind: c.kind,
                index: c.index,
            }
        };
        self.channels
            .iter()
            .filter(|c| c.seen > 0)
            .map(figure)
            .collect()
    }

    /// Gives estimators the noise of the log: parameters that are called as below, and that the map has not set; where
    /// nobody asked for it (`asked` false) only what is more than their default, so that coarse steps of a wheel speed,
    /// which hide its noise, make no estimator sure of it. What was set.
    pub fn give(
        &self,
        estimators: &mut BTreeMap<String, Settings>,
        registry: &Registry,
        asked: bool,
    ) -> Vec<Found> {
        let figures = self.figures();
        let mut given = Vec::new();
        for (name, settings) in estimators.iter_mut() {
            let Ok(of_type) = registry.estimator_of(name, settings) else {
                continue; // refused where it is built
            };
            for (parameter, kind) in NAMES {
                let key = of_type.keys().find(|k| k.name == *parameter);
                let Some(KeyKind::Number {
                    range: [low, high],
                    default,
                    ..
                }) = key.map(|k| k.kind)
                else {
                    continue;
                };
                // along the vehicle of the IMU, the mean of the wheels
                let of_kind = figures.iter().filter(|f| f.kind == *kind);
                let used: Vec<_> = of_kind
                    .filter(|f| *kind == NoisySensor::Wheel || f.index == 0)
                    .collect();
                if used.is_empty() || settings.values.contains_key(*parameter) {
                    continue;
                }
                let n = used.len() as f64;
                let value = (used.iter().map(|f| f.sd * f.sd).sum::<f64>() / n).sqrt();
                let value = value.clamp(low, high);
                if !asked && default.is_some_and(|default| value <= default) {
                    continue;
                }
                *settings = std::mem::take(settings).set(parameter, value);
                let default = default.map_or("of the vehicle".to_owned(), |x| format!("{x}"));
                given.push(Found {
                    what: format!(
                        "estimators.{name}.{parameter}, noise of the log (default {default})"
                    ),
                    value,
                    sd: used.iter().map(|f| f.sd_of_sd).fold(0.0, f64::max),
                    unit: used.first().map_or("", |f| f.unit),
                });
            }
        }
        given
    }
}

/// Parameters of estimators that are the standard deviation of a sample.
const NAMES: &[(&str, NoisySensor)] = &[
    ("wheel_speed_sd_mps", NoisySensor::Wheel),
    ("accel_sd_mps2", NoisySensor::Force),
];

#[cfg(test)]
mod tests {
    use super::*;
    use monorig_testing::Random;

    /// The noise that is learnt is that of the samples, whatever codes stand among them: drawn places and codes, up to
    /// one sample in fifty. Three second differences a code make 6 % of all; the rest of the tenth that is left out is
    /// then 4.3 % of the others, whose mean square is 0.781 of the whole: a standard deviation is 12 % too large. Three
    /// times its own standard deviation, 0.9 %, is allowed besides.
    #[test]
    fn codes_are_no_noise() {
        let mut random = Random::new(6);
        for (n, codes) in [(15_000, 0), (15_000, 10), (15_000, 300), (200_000, 4000)] {
            let planted = 0.01 + random.unit();
            let mut x: Vec<f64> = (0..n)
                .map(|k| {
                    let sum: f64 = (0..12).map(|_| random.unit()).sum();
                    3.0 + 0.001 * f64::from(k) + planted * (sum - 6.0)
                })
                .collect();
            for _ in 0..codes {
                let at = random.below(x.len());
                x[at] = *random.of(&[0.0, 40.0, 100.0, 182.04, 655.35]);
            }
            let mut noise = Noise::default();
            x.iter().for_each(|x| noise.push(NoisySensor::Wheel, 0, *x));
            let ratio = noise.figures()[0].sd / planted;
            assert!((0.97..1.15).contains(&ratio), "{codes} of {n}: {ratio}");
        }
    }
}
