//! Spike gate: holds out a jump of a channel that does not last.

use crate::Real;
use crate::api::snapshot::state;
use crate::tuning;

/// Limits of a spike gate, in the unit of the instrument and in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpikeLimits {
    /// Jumps up to this are never spikes.
    pub floor: Real,
    /// Largest change of the instrument per second.
    pub rate: Real,
    /// Time that samples may be held out for; a jump that has stayed for longer is real.
    pub longest: Real,
}

/// Spike gate: a sample that jumps further from the last accepted one than the instrument can is held out, for a time
/// at most.
///
/// Joints and bumps make a wheel's speed jump by 0.1 to 1.3 m/s for a few samples; low-passes, derivatives and
/// integrals in front of an estimator have no innovation to gate. Without a spike nothing is delayed and nothing
/// changed. It is a causal decision filter after Hampel (1974), with the last accepted sample in place of the median,
/// and the running mean of jumps, clipped at the threshold, in place of the median deviation. An instrument with a
/// period beyond the longest time holds nothing out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpikeGate {
    limits: SpikeLimits,
    last: Option<Real>,
    jump: Real,
    held_for: Real,
}

impl SpikeGate {
    /// Builds the spike gate with its limits.
    pub fn new(limits: SpikeLimits) -> Self {
        Self {
            limits,
            last: None,
            jump: 0.0,
            held_for: 0.0,
        }
    }

    /// Takes a new sample, `period` after the one before; `None` if it is held out.
    pub fn take(&mut self, sample: Real, period: Real) -> Option<Real> {
        let limits = &self.limits;
        if let Some(last) = self.last.filter(|_| period <= limits.longest) {
            let waited = self.held_for + period;
            let usual = tuning::STATISTICS.jump_factor * self.jump;
            let limit = limits.floor + limits.rate * waited + usual;
            let jump = (sample - last).abs();
            if self.held_for == 0.0 {
                self.jump += (jump.min(limit) - self.jump) / tuning::SPIKE_GATE.memory;
            }
            if jump > limit && waited <= limits.longest {
                self.held_for = waited;
                return None;
            }
        }
        (self.last, self.held_for) = (Some(sample), 0.0);
        Some(sample)
    }

    /// The last sample accepted.
    pub fn value(&self) -> Option<Real> {
        self.last
    }
}

state!(SpikeGate { last, jump, held_for; limits });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    const SPEED: SpikeLimits = SpikeLimits {
        floor: 0.05,
        rate: 3.0,
        longest: 0.2,
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
            assert_eq!(hold.take(value, 0.01).is_none(), bump != 0.0, "{k}");
        }
    }

    #[test]
    fn what_stays_is_real() {
        let mut hold = SpikeGate::new(SPEED);
        for _ in 0..100 {
            hold.take(1.0, 0.05);
        }
        let taken: std::vec::Vec<_> = (0..6).map(|_| hold.take(3.6, 0.05)).collect();
        assert_eq!(taken[..4], [None; 4]);
        assert_eq!(taken[4..], [Some(3.6); 2]);
    }

    #[test]
    fn noise_and_ramps_pass_at_once() {
        let mut random = Random::new(95);
        let mut noise = SpikeGate::new(SPEED);
        let mut ramp = SpikeGate::new(SPEED);
        let held = (0..10_000).filter(|_| noise.take(0.02 * random.normal(), 0.01).is_none());
        assert!(held.count() < 10);
        assert!((0..1000).all(|k| ramp.take(0.03 * Real::from(k), 0.01).is_some()));
    }

    #[test]
    fn a_slow_channel_and_the_first_sample_after_a_pause_pass() {
        let mut hold = SpikeGate::new(SPEED);
        hold.take(1.0, 0.01);
        assert_eq!(hold.take(5.0, 1.0), Some(5.0));
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
                    assert_eq!(hold.take(value, 0.01), Some(value));
                }
                let last = hold.value().unwrap();
                let usual = u * (1.0 - (63.0 / 64.0 as Real).powi(n));
                let mut limit = 0.05 + 3.0 * 0.01 + 6.0 * usual;
                let learnt = usual + (limit - usual) / 64.0;
                for _ in 0..held {
                    assert_eq!(hold.take(last - 50.0, 0.01), None);
                }
                if held > 0 {
                    limit = 0.05 + 3.0 * 0.01 * Real::from(held + 1) + 6.0 * learnt;
                }
                for (by, taken) in [(0.99, true), (1.01, false), (-0.99, true), (-1.01, false)] {
                    let value = last + by * limit;
                    let found = { hold }.take(value, 0.01);
                    assert_eq!(found, taken.then_some(value), "{n} {held} {by}");
                }
            }
        }
    }
}
