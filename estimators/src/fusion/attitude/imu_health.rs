//! Health of the IMU: stuck detectors, spike gate of the gyro, and the length of the specific force.

use crate::Real;
use crate::api::reading::Channels;
use crate::api::real::{GRAVITY, sqrt};
use crate::api::snapshot::state;
use crate::tuning;

/// Stuck detector for three axes at once: noise never repeats all of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StuckVector {
    last: [Real; 3],
    run: u32,
    changes: u32,
    repeats: u32,
}

impl StuckVector {
    /// Takes a sample and returns whether the instrument is stuck.
    fn take(&mut self, sample: [Real; 3]) -> bool {
        if sample == self.last {
            self.run = self.run.saturating_add(1);
        } else {
            // A repetition that ended soon was one of a coarse instrument.
            if self.run < tuning::STUCK.imu_samples {
                self.repeats = self.repeats.saturating_add(self.run);
            }
            self.changes = self.changes.saturating_add(1);
            (self.last, self.run) = (sample, 0);
        }
        self.is_stuck()
    }

    fn is_stuck(&self) -> bool {
        let noisy = self.changes >= tuning::STUCK.min_changes_per_repeat
            && self
                .repeats
                .saturating_mul(tuning::STUCK.min_changes_per_repeat)
                < self.changes;
        noisy && self.run >= tuning::STUCK.imu_samples
    }
}

/// Spike gate of the gyro. A sample that jumps is held back until the next sample confirms it, or a shock of the
/// accelerometer does. A blow to the body moves both instruments; its rates have both signs and an integral of nearly
/// nothing, which must not be cut. A jump that is real is added afterwards, so that the integral loses nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpikeGate {
    last: Option<[Real; 3]>,
    pending: Option<[Real; 3]>,
    jump: Real,
}

/// Largest difference of two vectors on an axis.
fn apart(a: [Real; 3], b: [Real; 3]) -> Real {
    a.iter()
        .zip(&b)
        .fold(0.0, |most: Real, (a, b)| most.max((a - b).abs()))
}

impl SpikeGate {
    /// Takes a sample, with whether the body is `shaken`, and returns what is to be used.
    fn take(&mut self, sample: [Real; 3], shaken: bool) -> [Real; 3] {
        let Some(last) = self.last else {
            self.last = Some(sample);
            return sample;
        };
        let limit = (tuning::STATISTICS.jump_factor * self.jump).max(tuning::SHOCK.min_jump_radps);
        let jump = apart(sample, last);
        let pending = self.pending.take();
        let confirmed = pending.filter(|before| shaken || apart(sample, *before) <= limit);
        if jump > limit && !shaken && confirmed.is_none() {
            self.pending = Some(sample);
            return last;
        }
        if !shaken {
            self.jump += (jump - self.jump) / tuning::SHOCK.jump_memory;
        }
        self.last = Some(sample);
        let held = confirmed.filter(|_| shaken || jump > limit).unwrap_or(last);
        let ([x, y, z], [x1, y1, z1], [x0, y0, z0]) = (sample, held, last);
        [x + x1 - x0, y + y1 - y0, z + z1 - z0]
    }
}

/// Instruments that are in use for a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SoundImu {
    /// Specific force in IMU axes, m/s²; `None` while the accelerometer is out of use.
    pub force_mps2: Option<[Real; 3]>,
    /// Angular rate as the gyro reads it, rad/s; `None` while the gyro is out of use.
    pub rate_radps: Option<[Real; 3]>,
    /// True if an instrument is out of use because it is stuck.
    pub stuck: bool,
    /// True if the accelerometer jumps: an outlier, or a rail joint.
    pub shock: bool,
}

/// Health of accelerometer and gyro: freshness by the front end, stuck detectors, and the length of the specific force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuHealth {
    gate: bool,
    spike_gate: bool,
    spikes: SpikeGate,
    last_force: Option<[Real; 3]>,
    force: StuckVector,
    rate: StuckVector,
    norm_error_mps2: Real,
    out_s: Real,
    ring_s: Real,
}

impl ImuHealth {
    /// Builds the health check with the gate on |f|, and that for spikes, on or off.
    pub fn new(gate: bool, spike_gate: bool) -> Self {
        Self {
            gate,
            spike_gate,
            spikes: SpikeGate::default(),
            last_force: None,
            force: StuckVector::default(),
            rate: StuckVector::default(),
            norm_error_mps2: 0.0,
            out_s: 0.0,
            ring_s: 0.0,
        }
    }

    /// Takes the samples of a step and returns what of the IMU is in use. `yaw_bias_radps` is the gyro's bias about z;
    /// without `gyro` it is not used.
    pub fn step(
        &mut self,
        z: &Channels,
        yaw_bias_radps: Real,
        speed_mps: Real,
        gyro: bool,
        dt: Real,
    ) -> SoundImu {
        let [new_force, new_rate] = z.new;
        let mut imu = SoundImu {
            shock: self.is_shock(z.specific_force_mps2, dt),
            ..SoundImu::default()
        };
        if let Some(raw) = z.angular_rate_radps.filter(|_| gyro) {
            let despiked = match (self.spike_gate, new_rate) {
                (false, _) => raw,
                (true, true) => self.spikes.take(raw, self.ring_s > 0.0),
                (true, false) => self.spikes.last.unwrap_or(raw),
            };
            let stuck = match new_rate {
                true => self.rate.take(raw),
                false => self.rate.is_stuck(),
            };
            imu.stuck |= stuck;
            imu.rate_radps = (!stuck).then_some(despiked);
        } else {
            self.spikes = SpikeGate::default();
        }
        if let Some(force) = z.specific_force_mps2 {
            let stuck = match new_force {
                true => self.force.take(force),
                false => self.force.is_stuck(),
            };
            imu.stuck |= stuck;
            if !stuck {
                let yaw_rate = imu.rate_radps.map_or(0.0, |[_, _, r]| r - yaw_bias_radps);
                self.check_norm(force, yaw_rate * speed_mps, dt);
            }
            self.out_s = (self.out_s - dt).max(0.0);
            imu.force_mps2 = Some(force).filter(|_| !(stuck || self.gate && self.out_s > 0.0));
        }
        imu
    }

    /// Returns true if the accelerometer jumps.
    fn is_shock(&mut self, force: Option<[Real; 3]>, dt: Real) -> bool {
        self.ring_s = (self.ring_s - dt).max(0.0);
        let Some(force) = force else { return false };
        let last = self.last_force.replace(force);
        let shock = last.is_some_and(|last| apart(force, last) > tuning::SHOCK.jump_mps2);
        if shock {
            self.ring_s = tuning::SHOCK.ring_s;
        }
        shock
    }

    fn check_norm(&mut self, [x, y, z]: [Real; 3], centripetal_mps2: Real, dt: Real) {
        let expected = sqrt(GRAVITY * GRAVITY + centripetal_mps2 * centripetal_mps2);
        let error = sqrt(x * x + y * y + z * z) - expected;
        self.norm_error_mps2 +=
            dt / (tuning::SHOCK.norm_lag_s + dt) * (error - self.norm_error_mps2);
        if self.norm_error_mps2.abs() > tuning::SHOCK.norm_gate_mps2 {
            self.out_s = tuning::SHOCK.rest_s;
        }
    }
}

state!(StuckVector { last, run, changes, repeats; });
state!(SpikeGate { last, pending, jump; });
state!(ImuHealth { spikes, last_force, force, rate, norm_error_mps2, out_s, ring_s; gate, spike_gate });

#[cfg(test)]
mod tests {
    use super::*;

    /// Sum of the pitch rates that are used of these samples, [pitch rate, rise of f_x] each, behind a quiet second.
    fn used(samples: &[[Real; 2]]) -> Real {
        let mut health = ImuHealth::new(true, true);
        let quiet = [[0.0, 0.0]; 100];
        let mut sum = 0.0;
        for (k, [rate, force]) in quiet.iter().chain(samples).chain(&quiet).enumerate() {
            let noise = if k % 2 == 0 { 1e-4 } else { -1e-4 };
            let z = Channels {
                specific_force_mps2: Some([force + noise, 0.0, GRAVITY]),
                angular_rate_radps: Some([0.0, rate + noise, 0.0]),
                new: [true; 2],
                ..Channels::default()
            };
            let [_, q, _] = health
                .step(&z, 0.0, 1.0, true, 0.005)
                .rate_radps
                .unwrap_or_default();
            sum += q;
        }
        sum
    }

    #[test]
    fn a_spike_of_the_gyro_alone_is_left_out() {
        assert!(used(&[[0.3, 0.0]]).abs() < 1e-2);
        assert!(used(&[[-0.3, 0.0], [0.0, 0.0], [0.5, 0.0]]).abs() < 1e-2);
    }

    #[test]
    fn a_jump_that_stays_loses_nothing_of_its_integral() {
        assert!((used(&[[0.3, 0.0]; 10]) - 3.0).abs() < 1e-2);
    }

    /// A blow, with its sample first on the gyro or first on the accelerometer.
    #[test]
    fn a_blow_loses_nothing_of_its_integral() {
        let blow = [[0.03, 8.0], [0.06, 7.0], [-0.12, -5.0], [0.03, 2.0]];
        assert!(used(&blow).abs() < 1e-2);
        let [before, after] = [[[0.4, 0.0], [-0.3, 9.0]], [[0.0, 9.0], [0.1, 0.0]]];
        assert!((used(&before) - 0.1).abs() < 1e-2);
        assert!((used(&after) - 0.1).abs() < 1e-2);
    }

    /// A gyro whose readings go to and fro by `j` has, after n jumps, a usual jump of j (1 − 0.95ⁿ). Six times that is
    /// let through, or 0.1 rad/s where that is more; a sample beyond waits for the next one. Jumps of a body that is
    /// shaken are not usual ones.
    #[test]
    fn a_noisy_gyro_may_jump_by_six_times_its_usual_jump() {
        let usual = 0.08;
        for n in [0, 3, 10, 40, 300] {
            for shaken in [0, 50] {
                let mut gate = SpikeGate::default();
                let at = |k: i32| [if k % 2 == 0 { usual } else { 0.0 }, 0.0, 0.0];
                for k in 0..=n {
                    assert_eq!(gate.take(at(k), false), at(k));
                }
                let [rest, ..] = at(n);
                for k in 0..shaken {
                    let jump = if k % 2 == 0 { 2.0 } else { 0.0 };
                    gate.take([rest + jump, 0.0, 0.0], true);
                }
                let limit = (6.0 * usual * (1.0 - (0.95 as Real).powi(n))).max(0.1);
                for (by, passes) in [(0.99, true), (1.01, false), (-0.99, true), (-1.01, false)] {
                    for axis in 0..3 {
                        let mut sample = [rest, 0.0, 0.0];
                        sample[axis] += by * limit;
                        let taken = { gate }.take(sample, false);
                        let expected = if passes { sample } else { [rest, 0.0, 0.0] };
                        assert!(apart(taken, expected) < 1e-12, "{n} {shaken} {by} {axis}");
                    }
                }
            }
        }
    }

    /// A sample held back is added once it is confirmed, on each axis its own: by a sample next to it, or by a shock,
    /// however far the gyro has come back then. Without a shock one that comes back was a spike, even if it comes back
    /// to near where the spike was.
    #[test]
    fn a_jump_that_is_confirmed_is_added_on_its_own_axis() {
        let held = [0.4, -0.5, 0.6];
        for (next, shaken, counts) in [
            ([0.41, -0.49, 0.62], false, true),
            ([0.05, 0.06, -0.07], true, true),
            ([0.05, 0.06, -0.07], false, false),
        ] {
            let mut gate = SpikeGate::default();
            assert_eq!(gate.take([0.01; 3], false), [0.01; 3]);
            assert_eq!(gate.take(held, false), [0.01; 3]);
            let taken = gate.take(next, shaken);
            for axis in 0..3 {
                let late = if counts { held[axis] - 0.01 } else { 0.0 };
                assert!((taken[axis] - next[axis] - late).abs() < 1e-12, "{next:?}");
            }
        }
        let mut gate = SpikeGate::default();
        for (sample, used) in [(0.0, 0.0), (0.12, 0.0), (0.05, 0.05), (0.0, 0.0)] {
            assert_eq!(gate.take([sample, 0.0, 0.0], false), [used, 0.0, 0.0]);
        }
    }

    /// Bias of the gyro about z, rad/s: large, so that a wrong one shows.
    const YAW_BIAS_RADPS: Real = 0.5;

    /// The IMU in use over a second of quiet samples and then another, made by `samples` from the number of
    /// the step: specific force and rate.
    fn last(
        health: &mut ImuHealth,
        seconds: Real,
        samples: impl Fn(u32) -> ([Real; 3], [Real; 3]),
        speed: Real,
    ) -> SoundImu {
        let mut last = SoundImu::default();
        for k in 0..(seconds / 0.005) as u32 {
            let (force, rate) = samples(k);
            let z = Channels {
                specific_force_mps2: Some(force),
                angular_rate_radps: Some(rate),
                new: [true; 2],
                ..Channels::default()
            };
            last = health.step(&z, YAW_BIAS_RADPS, speed, true, 0.005);
        }
        last
    }

    fn noise(k: u32) -> Real {
        1e-4 * Real::from(k % 7)
    }

    /// One of the two instruments that repeats itself is out of use and is called stuck, whichever it is; the other
    /// one stays in use. Both that go on are in use.
    #[test]
    fn an_instrument_that_is_stuck_is_named_whichever_it_is() {
        for (force_stuck, rate_stuck) in
            [(true, false), (false, true), (true, true), (false, false)]
        {
            let mut health = ImuHealth::new(true, true);
            let at = |k: u32, stuck: bool| if stuck { noise(3) } else { noise(k) };
            let quiet = |k: u32| ([noise(k), 0.0, GRAVITY], [noise(k), 0.0, 0.0]);
            last(&mut health, 1.0, quiet, 1.0);
            let samples = |k: u32| {
                (
                    [at(k, force_stuck), 0.0, GRAVITY],
                    [at(k, rate_stuck), 0.0, 0.0],
                )
            };
            let imu = last(&mut health, 0.5, samples, 1.0);
            assert_eq!(imu.stuck, force_stuck || rate_stuck);
            assert_eq!(imu.force_mps2.is_some(), !force_stuck);
            assert_eq!(imu.rate_radps.is_some(), !rate_stuck);
        }
    }

    /// The length of the specific force is g, and in a bend √(g² + (v r)²) with the yaw rate r less the bias of the
    /// gyro: by more than 0.35 m/s² off for longer than its lag, the accelerometer is out of use, and in use again half
    /// a second after it is right. Without the gate it is always in use.
    #[test]
    fn an_accelerometer_that_does_not_read_g_is_out_of_use() {
        let (speed, yaw_rate): (Real, Real) = (2.0, 1.5);
        let along = |force: [Real; 3], yaw_rate: Real| {
            move |k: u32| {
                let [x, y, z] = force;
                let rate = [noise(k), 0.0, yaw_rate + YAW_BIAS_RADPS];
                ([x + noise(k), y, z], rate)
            }
        };
        let bend = [0.0, speed * yaw_rate, GRAVITY];
        for (force, rate, sound) in [
            ([0.0, 0.0, GRAVITY], 0.0, true),
            ([0.0, 0.0, GRAVITY + 0.3], 0.0, true),
            ([0.0, 0.0, GRAVITY - 0.4], 0.0, false),
            ([0.0, 0.0, GRAVITY + 0.4], 0.0, false),
            ([3.0, 0.0, GRAVITY], 0.0, false),
            (bend, 0.0, false),
            (bend, yaw_rate, true),
            ([0.0, 0.0, GRAVITY], yaw_rate, false),
        ] {
            for gated in [true, false] {
                let mut health = ImuHealth::new(gated, true);
                let imu = last(&mut health, 4.0, along(force, rate), speed);
                assert_eq!(
                    imu.force_mps2.is_some(),
                    sound || !gated,
                    "{force:?} {rate}"
                );
            }
        }
        // 0.5 m/s² more: beyond the gate after 0.4 ln(0.5/0.15) = 0.48 s, and 0.4 ln(0.5/0.35) + 0.5 = 0.64 s after it
        // is right again, in use
        let mut health = ImuHealth::new(true, true);
        let (right, wrong) = (
            along([0.0, 0.0, GRAVITY], 0.0),
            along([0.0, 0.0, GRAVITY + 0.5], 0.0),
        );
        last(&mut health, 1.0, right, 0.0);
        assert!(last(&mut health, 0.45, wrong, 0.0).force_mps2.is_some());
        assert!(last(&mut health, 0.10, wrong, 0.0).force_mps2.is_none());
        last(&mut health, 4.0, wrong, 0.0);
        assert!(last(&mut health, 0.60, right, 0.0).force_mps2.is_none());
        assert!(last(&mut health, 0.10, right, 0.0).force_mps2.is_some());
    }

    /// A coarse instrument that has repeated itself once in a hundred changes repeats itself again; one that has not
    /// done so in a hundred, nor once in a hundred and one, is stuck from the third repetition on.
    #[test]
    fn an_instrument_that_repeats_itself_now_and_then_is_not_stuck() {
        for (changes, repeats, stuck) in [
            (99, 0, false),
            (100, 0, true),
            (100, 1, false),
            (101, 1, true),
            (200, 2, false),
        ] {
            let mut vector = StuckVector::default();
            let at = |k: u32| [0.0, 0.0, Real::from(k)];
            for k in 1..=changes {
                assert!(!vector.take(at(k)));
                if k <= repeats {
                    vector.take(at(k));
                }
            }
            let [first, second, third] = [0; 3].map(|_| vector.take(at(changes)));
            assert!(!first && !second);
            assert_eq!(third, stuck, "{changes} {repeats}");
        }
    }
}
