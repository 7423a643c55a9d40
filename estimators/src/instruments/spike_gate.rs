//! Spike gate of an instrument with one axis or several: bridges a jump that does not last.

use crate::Real;
use crate::api::snapshot::state;
use crate::tuning::STATISTICS;

/// Limits of a spike gate, in the unit of the instrument. Times are in seconds; or in samples, where the period of each
/// sample is given as 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpikeLimits {
    /// Size up to which a jump is never a spike.
    pub floor: Real,
    /// Largest change of the instrument per unit of time.
    pub rate: Real,
    /// Longest time for which samples are rejected; a longer jump is real.
    pub longest: Real,
    /// True if the integral of the samples counts: a jump is then real as soon as the next sample agrees with the one
    /// held out, whose jump is added to it.
    pub keeps_integral: bool,
}

/// Spike gate: a sample that jumps further from the last accepted one than the instrument can is held out, for a time
/// at most.
///
/// Joints and bumps make a wheel's speed jump by 0.1 to 1.3 m/s for a few samples; low-passes, derivatives and
/// integrals in front of an estimator have no innovation to gate. Without a spike nothing is delayed and nothing
/// changed. It is a causal decision filter after Hampel (1974), with the last accepted sample in place of the median,
/// and the running mean of jumps, clipped at the threshold, in place of the median deviation. An instrument with a
/// period beyond the longest time holds nothing out.
///
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpikeGate<const N: usize> {
    limits: SpikeLimits,
    last: Option<[Real; N]>,
    jump: Real,
    held_for: Real,
    held: Option<[Real; N]>,
}

/// Largest difference of two vectors on an axis.
pub fn apart<const N: usize>(a: [Real; N], b: [Real; N]) -> Real {
    let axes = a.iter().zip(&b);
    axes.fold(0.0, |most: Real, (a, b)| most.max((a - b).abs()))
}

impl<const N: usize> SpikeGate<N> {
    /// Builds the spike gate with its limits.
    pub fn new(limits: SpikeLimits) -> Self {
        Self {
            limits,
            last: None,
            jump: 0.0,
            held_for: 0.0,
            held: None,
        }
    }

    /// Takes a new sample, `period` after the last sample; `None` if the sample is rejected.
    pub fn take(&mut self, sample: [Real; N], period: Real) -> Option<[Real; N]> {
        let limits = &self.limits;
        let Some(last) = self.last.filter(|_| period <= limits.longest) else {
            return Some(self.accept(sample));
        };
        let waited = self.held_for + period;
        let limit = limits.floor + limits.rate * waited + STATISTICS.fault_sd * self.jump;
        let jump = apart(sample, last);
        let held = self.held.filter(|_| limits.keeps_integral);
        let held = held.filter(|held| apart(sample, *held) <= limit);
        if self.held_for == 0.0 || held.is_some() {
            self.jump += (jump.min(limit) - self.jump) / STATISTICS.samples;
        }
        let beyond = jump > limit;
        if beyond && held.is_none() && waited <= limits.longest {
            (self.held, self.held_for) = (Some(sample), waited);
            return None;
        }
        let mut used = sample;
        if let Some(held) = held.filter(|_| beyond) {
            let jumps = held.iter().zip(last).map(|(held, last)| held - last);
            used.iter_mut()
                .zip(jumps)
                .for_each(|(used, jump)| *used += jump);
        }
        self.accept(sample);
        Some(used)
    }

    fn accept(&mut self, sample: [Real; N]) -> [Real; N] {
        (self.last, self.held_for, self.held) = (Some(sample), 0.0, None);
        sample
    }

    /// The last sample accepted.
    pub fn value(&self) -> Option<[Real; N]> {
        self.last
    }
}

state!(@[const N: usize] SpikeGate<N> { last, jump, held_for, held; limits });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    const SPEED: SpikeLimits = SpikeLimits {
        floor: 0.05,
        rate: 3.0,
        longest: 0.2,
        keeps_integral: false,
    };

    #[test]
    fn jumps_that_do_not_last_are_held_out() {
        let mut hold = SpikeGate::new(SPEED);
        let mut random = Random::new(94);
        for k in 0..10_000 {
            let bump = match k % 500 {
                50 | 51 => 1.3,
                75 => -0.5,
                200..215 => 0.6,
                _ => 0.0,
            };
            let value = 1.0 + 0.005 * random.normal() + bump;
            assert_eq!(hold.take([value], 0.01).is_none(), bump != 0.0, "{k}");
        }
    }

    #[test]
    fn what_stays_is_real() {
        let mut hold = SpikeGate::new(SPEED);
        for _ in 0..100 {
            hold.take([1.0], 0.05);
        }
        let taken: std::vec::Vec<_> = (0..6).map(|_| hold.take([3.6], 0.05)).collect();
        assert_eq!(taken[..4], [None; 4]);
        assert_eq!(taken[4..], [Some([3.6]); 2]);
    }

    #[test]
    fn noise_and_ramps_pass_at_once() {
        let mut random = Random::new(95);
        let mut noise = SpikeGate::new(SPEED);
        let mut ramp = SpikeGate::new(SPEED);
        let held = (0..10_000).filter(|_| noise.take([0.02 * random.normal()], 0.01).is_none());
        assert!(held.count() < 10);
        assert!((0..1000).all(|k| ramp.take([0.03 * Real::from(k)], 0.01).is_some()));
    }

    #[test]
    fn a_slow_channel_and_the_first_sample_after_a_pause_pass() {
        let mut hold = SpikeGate::new(SPEED);
        hold.take([1.0], 0.01);
        assert_eq!(hold.take([5.0], 1.0), Some([5.0]));
    }

    /// A sample may jump by the floor, by what the channel can change by since the last one that was taken, and by six
    /// usual steps: after n steps of u these are u (1 − (63/64)ⁿ). What is held out teaches no step.
    #[test]
    fn the_limit_is_the_floor_the_rate_and_six_usual_steps() {
        for (n, u) in [(0, 0.04), (10, 0.04), (64, 0.04), (1_000, 0.04)] {
            for held in 0..3 {
                let mut hold = SpikeGate::new(SPEED);
                for k in 0..=n {
                    let value = if k % 2 == 0 { 0.0 } else { u };
                    assert_eq!(hold.take([value], 0.01), Some([value]));
                }
                let [last] = hold.value().unwrap();
                let usual = u * (1.0 - (63.0 / 64.0 as Real).powi(n));
                let mut limit = 0.05 + 3.0 * 0.01 + 6.0 * usual;
                let learnt = usual + (limit - usual) / 64.0;
                for _ in 0..held {
                    assert_eq!(hold.take([last - 50.0], 0.01), None);
                }
                if held > 0 {
                    limit = 0.05 + 3.0 * 0.01 * Real::from(held + 1) + 6.0 * learnt;
                }
                for (by, taken) in [(0.99, true), (1.01, false), (-0.99, true), (-1.01, false)] {
                    let value = last + by * limit;
                    let found = { hold }.take([value], 0.01);
                    assert_eq!(found, taken.then_some([value]), "{n} {held} {by}");
                }
            }
        }
    }

    const RATE: SpikeLimits = SpikeLimits {
        floor: 0.1,
        rate: 0.0,
        longest: Real::INFINITY,
        keeps_integral: true,
    };

    /// The largest axis counts. A jump is added, on each axis its own, once the next sample agrees with it. One
    /// that comes back was a spike, and what jumps to and fro is held out.
    #[test]
    fn a_jump_that_stays_loses_nothing_of_its_integral() {
        let (jump, near, back) = ([0.4, -0.5, 0.6], [0.41, -0.49, 0.62], [0.05, 0.06, -0.07]);
        for (fro, next, counts) in [(0, near, true), (0, back, false), (5, back, false)] {
            let mut gate = SpikeGate::new(RATE);
            assert_eq!(gate.take([0.0; 3], 1.0), Some([0.0; 3]));
            assert_eq!(gate.take(jump, 1.0), None);
            for k in 0..fro {
                let sample = if k % 2 == 0 { jump.map(|x| -x) } else { jump };
                assert_eq!(gate.take(sample, 1.0), None);
            }
            let taken = gate.take(next, 1.0).unwrap();
            for axis in 0..3 {
                let late = if counts { jump[axis] } else { 0.0 };
                assert!((taken[axis] - next[axis] - late).abs() < 1e-12, "{next:?}");
            }
            assert_eq!(gate.value(), Some(next));
            assert_eq!(gate.take(next, 1.0), Some(next));
        }
    }
}
