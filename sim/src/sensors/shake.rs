//! Shaking of an instrument by the track: vibration that grows with the speed, hits at rail joints and bumps.
//!
//! Both act on the signal before the bandwidth and the sampling, in the axes of the mount, in parts of a
//! physics step of at most 2 ms.

use super::hits::Hits;
use super::spec::Errors;
use super::step_interval::StepInterval;
use super::value_sampler::{SamplingMode, ValueSampler};
use super::vibration::Vibration;
use crate::checked::Positive;
use crate::plant::Truth;

/// Longest time for which the shaking is taken as linear, ns: a physics step may be longer than a hit allows.
const PART_NS: i64 = 2_000_000;

/// Place of an instrument on the track, and its speed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ride {
    /// Chainage, m.
    pub chainage_m: f64,
    /// Speed along the track, m/s.
    pub speed_mps: f64,
}

impl Ride {
    /// The ride of the IMU.
    pub fn at_imu(truth: &Truth) -> Self {
        Self {
            chainage_m: truth.chainage_m,
            speed_mps: truth.speed_mps,
        }
    }

    /// The ride some time earlier, s, at the same speed.
    pub fn earlier(&self, by_s: f64) -> Self {
        Self {
            chainage_m: self.chainage_m - by_s * self.speed_mps,
            ..*self
        }
    }
}

/// Vibration and hits of one instrument of `N` axes.
#[derive(Clone, Debug)]
pub struct Shake<const N: usize> {
    vibration: Option<Vibration<N>>,
    hits: Option<Hits<N>>,
    /// Share on each axis.
    shares: [f64; N],
    last: [f64; N],
    sampler: ValueSampler<N>,
}

impl<const N: usize> Shake<N> {
    /// Number of parts of a step in each of which the shaking is linear.
    pub fn parts(step: StepInterval) -> i64 {
        ((step.to_ns - step.from_ns + PART_NS - 1) / PART_NS).max(1)
    }

    /// Makes the shaking that the errors specify, if any. `joints_m` are the chainages of the rail's joints, ascending.
    pub fn new(
        errors: &Errors,
        mode: SamplingMode,
        shares: [f64; N],
        joints_m: &[f64],
        seed: u64,
        name: &str,
    ) -> Option<Self> {
        if errors.vibration.is_none() && errors.hits.is_none() {
            return None;
        }
        let inertial = N == 3;
        Some(Self {
            vibration: errors.vibration.map(|v| Vibration::new(&v, seed, name)),
            hits: errors
                .hits
                .map(|h| Hits::new(&h, inertial, joints_m, seed, name)),
            shares,
            last: [0.0; N],
            sampler: ValueSampler::new(mode, errors.bandwidth_hz.map(Positive::get)),
        })
    }

    /// Advances to the end of `step`, where the ride is `ride`.
    pub fn advance(&mut self, step: StepInterval, ride: Ride) {
        let mut now = [0.0; N];
        if let Some(vibration) = &mut self.vibration {
            let x = vibration.advance(step.length_s(), ride.speed_mps);
            now = std::array::from_fn(|i| now[i] + x[i]);
        }
        if let Some(hits) = &mut self.hits {
            let x = hits.advance(step, ride.chainage_m);
            now = std::array::from_fn(|i| now[i] + x[i]);
        }
        now = std::array::from_fn(|i| self.shares[i] * now[i]);
        let before = std::mem::replace(&mut self.last, now);
        self.sampler.begin(step, before, now);
    }

    /// Returns the shaking that adds to a value at `t_ns`, as [`ValueSampler::take`] does.
    pub fn take(&mut self, t_ns: i64) -> Option<[f64; N]> {
        self.sampler.take(t_ns)
    }

    /// Ends the step.
    pub fn finish(&mut self) {
        self.sampler.finish();
    }
}
