//! Hits: short disturbances where the track has a joint or a bump.
//!
//! A hit begins at the end of the step in which the instrument passes the place, forwards or backwards. On the axes of
//! an accelerometer or gyro it is one period of a sine, so that it leaves no velocity behind; any other reading jumps
//! for as long as it lasts. Random places follow each other at exponential distances of travel.

use super::spec::HitSpec;
use super::step_interval::StepInterval;
use super::stream::Stream;
use crate::checked::NonNegative;
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// Largest number of simultaneous hits; with more hits the oldest ends.
const MAX_AT_ONCE: usize = 16;

/// Hits of an instrument of `N` axes.
#[derive(Clone, Debug)]
pub struct Hits<const N: usize> {
    size: [f64; 2],
    duration_s: f64,
    inertial: bool,
    joints_m: Vec<f64>,
    bumps: Option<Bumps>,
    sizes: Stream,
    last_m: Option<f64>,
    /// Begin, ns, and size on each axis of the active hits.
    active: VecDeque<(i64, [f64; N])>,
}

/// Places drawn at random along the way.
#[derive(Clone, Debug)]
struct Bumps {
    mean_m: f64,
    left_m: f64,
    stream: Stream,
}

impl<const N: usize> Hits<N> {
    /// The hits of an instrument on a track with joints at `joints_m`, ascending. `inertial` = its hits are swings, not
    /// jumps.
    pub fn new(spec: &HitSpec, inertial: bool, joints_m: &[f64], seed: u64, name: &str) -> Self {
        let bumps = (spec.per_m.get() > 0.0).then(|| {
            let stream = Stream::new(seed, &format!("{name}/bumps"));
            let mut bumps = Bumps {
                mean_m: 1.0 / spec.per_m.get(),
                left_m: 0.0,
                stream,
            };
            bumps.draw();
            bumps
        });
        Self {
            size: spec.size.map(NonNegative::get),
            duration_s: spec.duration_ms.get() * 1e-3,
            inertial,
            joints_m: if spec.at_joints {
                joints_m.to_vec()
            } else {
                Vec::new()
            },
            bumps,
            sizes: Stream::new(seed, &format!("{name}/hits")),
            last_m: None,
            active: VecDeque::with_capacity(MAX_AT_ONCE),
        }
    }

    /// The disturbance at the end of `step`, at which the instrument is at `chainage_m`.
    pub fn advance(&mut self, step: StepInterval, chainage_m: f64) -> [f64; N] {
        let last_m = self.last_m.replace(chainage_m).unwrap_or(chainage_m);
        for _ in 0..self.passed(last_m, chainage_m) {
            if self.active.len() == MAX_AT_ONCE {
                self.active.pop_front();
            }
            let size = std::array::from_fn(|_| self.draw());
            self.active.push_back((step.to_ns, size));
        }
        let age_s = |begin_ns: i64| (step.to_ns - begin_ns) as f64 * 1e-9;
        let duration_s = self.duration_s;
        self.active.retain(|(begin, _)| age_s(*begin) < duration_s);
        let mut sum = [0.0; N];
        for (begin, size) in &self.active {
            let shape = if self.inertial {
                libm::sin(TAU * age_s(*begin) / duration_s)
            } else {
                1.0
            };
            sum = std::array::from_fn(|i| sum[i] + shape * size[i]);
        }
        sum
    }

    /// Places passed on the way from one chainage to another.
    fn passed(&mut self, from_m: f64, to_m: f64) -> usize {
        let (low, high) = (from_m.min(to_m), from_m.max(to_m));
        let until = |s: f64| self.joints_m.partition_point(|joint| *joint <= s);
        let joints = until(high) - until(low);
        joints
            + self
                .bumps
                .as_mut()
                .map_or(0, |bumps| bumps.passed(high - low))
    }

    fn draw(&mut self) -> f64 {
        let [low, high] = self.size;
        let magnitude = low + (high - low) * self.sizes.uniform();
        if self.sizes.uniform() < 0.5 {
            magnitude
        } else {
            -magnitude
        }
    }
}

impl Bumps {
    fn passed(&mut self, travelled_m: f64) -> usize {
        self.left_m -= travelled_m;
        let mut count = 0;
        while self.left_m < 0.0 && count < MAX_AT_ONCE {
            self.draw();
            count += 1;
        }
        count
    }

    fn draw(&mut self) {
        self.left_m += -self.mean_m * libm::log(1.0 - self.stream.uniform());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checked::Positive;

    const DT_NS: i64 = 2_000_000;

    fn hits(at_joints: bool, per_m: f64, inertial: bool) -> Hits<1> {
        let spec = HitSpec {
            at_joints,
            per_m: NonNegative::new(per_m),
            size: [0.5, 1.5].map(NonNegative::new),
            duration_ms: Positive::new(20.0),
        };
        let joints: Vec<f64> = (1..=10).map(|i| 3.0 * f64::from(i)).collect();
        Hits::new(&spec, inertial, &joints, 5, "test")
    }

    /// The disturbance at every step of a ride of 1 m/s from `from_m`, for `steps` steps; `sign` = direction.
    fn ride(hits: &mut Hits<1>, from_m: f64, sign: f64, steps: i64) -> Vec<f64> {
        (0..steps)
            .map(|k| {
                let step = StepInterval {
                    from_ns: k * DT_NS,
                    to_ns: (k + 1) * DT_NS,
                };
                hits.advance(step, from_m + sign * 0.002 * k as f64)[0]
            })
            .collect()
    }

    /// Chainages at which a jump begins.
    fn begins(x: &[f64], from_m: f64, sign: f64) -> Vec<f64> {
        (1..x.len())
            .filter(|k| x[*k] != 0.0 && x[k - 1] == 0.0)
            .map(|k| from_m + sign * 0.002 * k as f64)
            .collect()
    }

    #[test]
    fn joints_hit_at_their_chainages_in_either_direction_and_once() {
        for (from, sign, places) in [(1.0, 1.0, [3.0, 6.0, 9.0]), (10.0, -1.0, [9.0, 6.0, 3.0])] {
            let x = ride(&mut hits(true, 0.0, false), from, sign, 4200);
            let found = begins(&x, from, sign);
            assert_eq!(found.len(), 3);
            for (s, place) in found.iter().zip(places) {
                assert!((s - place).abs() < 0.003, "{s} not {place}");
            }
            // 20 ms are ten steps.
            assert_eq!(x.iter().filter(|v| **v != 0.0).count(), 30);
            assert!(
                x.iter()
                    .all(|v| *v == 0.0 || (0.5..=1.5).contains(&v.abs()))
            );
        }
    }

    #[test]
    fn at_a_standstill_nothing_hits() {
        let mut standing = hits(true, 5.0, false);
        let x = ride(&mut standing, 3.0, 0.0, 1000);
        assert!(x.iter().all(|v| *v == 0.0));
    }

    /// A swing of whole periods leaves no velocity: its sum over the steps is zero.
    #[test]
    fn a_swing_leaves_no_velocity_behind() {
        let x = ride(&mut hits(true, 0.0, true), 1.0, 1.0, 4200);
        assert!(x.iter().any(|v| v.abs() > 0.4));
        assert!(x.iter().sum::<f64>().abs() < 1e-9);
    }

    /// Over 2000 m at 0.5 per metre: 1000 ± 5 √1000 hits, both signs, distances with the spread of an exponential.
    #[test]
    fn bumps_come_at_their_rate_and_at_random() {
        let x = ride(&mut hits(false, 0.5, false), 0.0, 1.0, 1_000_000);
        let places = begins(&x, 0.0, 1.0);
        let n = places.len() as f64;
        // Two within 20 mm are seen as one: 1 % of them.
        assert!((n - 990.0).abs() < 5.0 * 1000_f64.sqrt(), "{n}");
        let gaps: Vec<f64> = places.windows(2).map(|p| p[1] - p[0]).collect();
        let mean = gaps.iter().sum::<f64>() / gaps.len() as f64;
        let sd = (gaps.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / gaps.len() as f64).sqrt();
        assert!((sd / mean - 1.0).abs() < 0.2, "{sd} against {mean}");
        let up = x.iter().filter(|v| **v > 0.0).count() as f64;
        let down = x.iter().filter(|v| **v < 0.0).count() as f64;
        assert!((up / (up + down) - 0.5).abs() < 5.0 * 0.5 / n.sqrt());
    }
}
