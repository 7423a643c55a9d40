//! Health of the IMU: stuck detectors, spike gate of the gyro, length and direction of the specific force.

use crate::api::reading::Channels;
use crate::api::real::{GRAVITY, sqrt};
use crate::api::snapshot::state;
use crate::instruments::spike_gate::{SpikeGate, SpikeLimits};
use crate::instruments::stuck_detector::StuckDetector;
use crate::tuning::{GRAVITY_CHECK, MOTION, SHOCK, TIMES};
use crate::{Real, Time};

/// Instant for the stuck detectors of vectors, which do not depend on time.
const NO_CLOCK: Time = Time::from_ns(0);

/// Limits of the gyro's spike gate, which counts samples.
const RATE_LIMITS: SpikeLimits = SpikeLimits {
    floor: SHOCK.min_jump_radps,
    rate: 0.0,
    longest: Real::INFINITY,
    keeps_integral: true,
};

/// Instruments that are in use for a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SoundImu {
    /// Specific force in IMU axes, m/s²; `None` while the accelerometer is out of use.
    pub force_mps2: Option<[Real; 3]>,
    /// Angular rate as the gyro reads it, rad/s; `None` while the gyro is out of use.
    pub rate_radps: Option<[Real; 3]>,
    /// True if an instrument is out of use because it is stuck.
    pub stuck: bool,
    /// Scale error of the accelerometer by |f| while it is out of use; else 0.
    pub scale: Real,
}

/// Health of accelerometer and gyro: freshness by the front end, stuck detectors, and the specific force, which is as
/// long as g and points up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuHealth {
    gate: bool,
    spike_gate: bool,
    spikes: SpikeGate<3>,
    last_force: Option<[Real; 3]>,
    last_rate: Option<[Real; 3]>,
    force: StuckDetector<3>,
    rate: StuckDetector<3>,
    norm_error_mps2: Real,
    upright_mps2: Real,
    out_s: Real,
    moved: bool,
}

impl ImuHealth {
    /// Builds the health check with the gate on |f| and the gate for spikes on or off.
    pub fn new(gate: bool, spike_gate: bool) -> Self {
        Self {
            gate,
            spike_gate,
            spikes: SpikeGate::new(RATE_LIMITS),
            last_force: None,
            last_rate: None,
            force: StuckDetector::default(),
            rate: StuckDetector::default(),
            norm_error_mps2: 0.0,
            upright_mps2: 0.0,
            out_s: 0.0,
            moved: false,
        }
    }

    /// Takes the samples of a step and returns the parts of the IMU that are in use. `yaw_bias_radps` is the gyro's
    /// bias about z; without `gyro` it is not used.
    pub fn step(
        &mut self,
        z: &Channels,
        yaw_bias_radps: Real,
        speed_mps: Real,
        gyro: bool,
        dt: Real,
    ) -> SoundImu {
        let [new_force, new_rate] = z.new;
        self.moved |= speed_mps.abs() > MOTION.moves_mps;
        let mut imu = SoundImu::default();
        if let Some(raw) = z.angular_rate_radps.filter(|_| gyro) {
            let mut despiked = raw;
            if new_rate {
                let before = self.last_rate.replace(raw);
                before.inspect(|before| self.rate.take(raw, *before, NO_CLOCK));
                let passed = self.spikes.take(raw, 1.0);
                despiked = passed.or(self.spikes.value()).unwrap_or(raw);
            } else if let Some(held) = self.spikes.value() {
                despiked = held;
            }
            let stuck = self.rate.is_stuck(NO_CLOCK) || self.moved && self.rate.never_changed();
            imu.stuck |= stuck;
            let used = if self.spike_gate { despiked } else { raw };
            imu.rate_radps = (!stuck).then_some(used);
        } else {
            self.spikes = SpikeGate::new(RATE_LIMITS);
        }
        if let Some(force) = z.specific_force_mps2 {
            let before = self.last_force.replace(force);
            if let (true, Some(before)) = (new_force, before) {
                self.force.take(force, before, NO_CLOCK);
            }
            let stuck = self.force.is_stuck(NO_CLOCK) || self.moved && self.force.never_changed();
            imu.stuck |= stuck;
            if !stuck {
                let yaw_rate = imu.rate_radps.map_or(0.0, |[_, _, r]| r - yaw_bias_radps);
                let lag_s = before.map_or(0.0, |_| SHOCK.norm_lag_s);
                self.check_norm(force, yaw_rate * speed_mps, dt / (lag_s + dt));
            }
            self.out_s = (self.out_s - dt).max(0.0);
            imu.force_mps2 = Some(force).filter(|_| !(stuck || self.is_out()));
        }
        if self.is_out() {
            imu.scale = self.norm_error_mps2 / GRAVITY;
        }
        imu
    }

    /// Mean length of the specific force beyond the one that is expected, m/s².
    pub fn norm_error_mps2(&self) -> Real {
        self.norm_error_mps2
    }

    /// Returns true while length or direction of the specific force have the accelerometer out of use.
    fn is_out(&self) -> bool {
        self.gate && self.out_s > 0.0
    }

    fn check_norm(&mut self, [x, y, z]: [Real; 3], centripetal_mps2: Real, share: Real) {
        let expected = sqrt(GRAVITY * GRAVITY + centripetal_mps2 * centripetal_mps2);
        let length = sqrt(x * x + y * y + z * z);
        self.norm_error_mps2 += share * (length - expected - self.norm_error_mps2);
        self.upright_mps2 += share * (z - self.upright_mps2);
        let upright = self.upright_mps2 > GRAVITY_CHECK.min_upright * GRAVITY;
        if self.norm_error_mps2.abs() > SHOCK.norm_gate_mps2 || !upright {
            self.out_s = TIMES.lost_s;
        }
    }
}

state!(ImuHealth { spikes, last_force, last_rate, force, rate, norm_error_mps2, upright_mps2, out_s, moved; gate, spike_gate });

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
            last(&mut health, 2.0, quiet, 1.0);
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

    /// An instrument that repeats its first sample is out of use once the vehicle has moved, and in use again with the
    /// first sample that is another; before, it may as well be one without noise that stands.
    #[test]
    fn an_instrument_that_has_never_changed_is_stuck_in_motion() {
        let mut health = ImuHealth::new(true, true);
        let first = |_| ([0.1, 0.0, GRAVITY], [0.01, 0.0, 0.0]);
        let other = |_| ([0.2, 0.0, GRAVITY], [0.02, 0.0, 0.0]);
        for (samples, speed, stuck) in [
            (&first as &dyn Fn(u32) -> _, 0.0, false),
            (&first, -0.1, true),
            (&first, 0.0, true),
            (&other, 0.1, false),
        ] {
            let imu = last(&mut health, 1.0, samples, speed);
            assert_eq!(imu.stuck, stuck);
            assert_eq!(
                (imu.force_mps2.is_none(), imu.rate_radps.is_none()),
                (stuck, stuck)
            );
        }
    }

    /// An accelerometer whose axes are exchanged, or of the wrong sign, is out of use with its first sample, though
    /// what it reads is as long as g; one sample of a joint is no such thing.
    #[test]
    fn an_accelerometer_that_does_not_point_up_is_out_of_use() {
        let g = GRAVITY;
        for (force, upright) in [
            ([0.0, 0.0, g], true),
            ([0.8 * g, 0.0, 0.6 * g], true),
            ([0.0, g, 0.0], false),
            ([g, 0.0, 0.0], false),
            ([0.0, 0.0, -g], false),
        ] {
            let samples = |k: u32| (force.map(|f| f + noise(k)), [noise(k); 3]);
            for seconds in [0.005, 3.0] {
                let imu = last(&mut ImuHealth::new(true, true), seconds, samples, 0.0);
                assert_eq!(imu.force_mps2.is_some(), upright, "{force:?}");
            }
        }
        let mut health = ImuHealth::new(true, true);
        let joint = |k: u32| {
            (
                [noise(k), 0.0, if k == 300 { -g } else { g }],
                [noise(k); 3],
            )
        };
        assert!(
            last(&mut health, 301.0 * 0.005, joint, 1.0)
                .force_mps2
                .is_some()
        );
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
}
