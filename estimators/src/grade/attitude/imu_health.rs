//! Health of the IMU: what of it is in use.

use super::kinematics::Inputs;
use crate::Real;
use crate::api::real::{GRAVITY, sqrt};
use crate::api::snapshot::state;
use crate::preprocess::front_end::Channels;

/// Low-pass of |f| − g, s. A shorter one (0.1 s) rejects the shocks of rail joints, too.
const NORM_LAG_S: Real = 0.4;
/// Behind it, deviation of |f| from g beyond which the accelerometer is out of use, m/s², and for how long, s.
const NORM_GATE_MPS2: Real = 0.35;
const NORM_HOLD_S: Real = 0.5;
/// Equal samples on all three axes from which an instrument is stuck, and changes after which that is looked at.
const STUCK_SAMPLES: u32 = 3;
const MIN_CHANGES: u32 = 100;

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
            if self.run < STUCK_SAMPLES {
                self.repeats = self.repeats.saturating_add(self.run);
            }
            self.changes = self.changes.saturating_add(1);
            (self.last, self.run) = (sample, 0);
        }
        self.is_stuck()
    }

    fn is_stuck(&self) -> bool {
        let noisy =
            self.changes >= MIN_CHANGES && self.repeats.saturating_mul(MIN_CHANGES) < self.changes;
        noisy && self.run >= STUCK_SAMPLES
    }
}

/// Jump of the accelerometer from one sample to the next that is a shock, m/s².
const SHOCK_MPS2: Real = 1.5;
/// Jump of the gyro beyond which a sample must be confirmed by the next one: at least, rad/s; over the mean jump of late; memory of that,
/// samples.
const MIN_JUMP_RADPS: Real = 0.1;
const JUMP_FACTOR: Real = 6.0;
const JUMP_MEMORY: Real = 20.0;

/// Spike gate of the gyro: a sample that jumps is held back until the next one confirms it. What was held back of a jump that is real is then
/// added, so that the integral loses nothing.
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
    /// Takes a sample and returns what is to be used.
    fn take(&mut self, sample: [Real; 3]) -> [Real; 3] {
        let Some(last) = self.last else {
            self.last = Some(sample);
            return sample;
        };
        let limit = (JUMP_FACTOR * self.jump).max(MIN_JUMP_RADPS);
        let jump = apart(sample, last);
        let pending = self.pending.take();
        if jump <= limit {
            self.jump += (jump - self.jump) / JUMP_MEMORY;
            self.last = Some(sample);
            return sample;
        }
        let Some(before) = pending.filter(|before| apart(sample, *before) <= limit) else {
            self.pending = Some(sample);
            return last;
        };
        self.jump += (jump - self.jump) / JUMP_MEMORY;
        self.last = Some(sample);
        let ([x, y, z], [x1, y1, z1], [x0, y0, z0]) = (sample, before, last);
        [x + x1 - x0, y + y1 - y0, z + z1 - z0]
    }
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
}

impl ImuHealth {
    /// With the gate on |f|, and that for spikes, on or off.
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
        }
    }

    /// What is in use for this step, with the gyro's `bias` (rad/s) taken off.
    pub fn step(
        &mut self,
        z: &Channels,
        bias: [Real; 3],
        speed_mps: Real,
        gyro: bool,
        dt: Real,
    ) -> Inputs {
        let [new_force, new_rate] = z.new;
        let raw = z.angular_rate_radps.filter(|_| gyro);
        let rate = match raw {
            Some(raw) if self.spike_gate && new_rate => Some(self.spikes.take(raw)),
            Some(raw) if self.spike_gate => self.spikes.last.or(Some(raw)),
            Some(raw) => Some(raw),
            None => {
                self.spikes = SpikeGate::default();
                None
            }
        };
        let mut u = Inputs {
            force: z.specific_force_mps2,
            rate,
            ..Inputs::default()
        };
        if let (Some(rate), Some(raw)) = (u.rate, z.angular_rate_radps) {
            let stuck = match new_rate {
                true => self.rate.take(raw),
                false => self.rate.is_stuck(),
            };
            u.stuck |= stuck;
            u.rate = (!stuck).then(|| {
                let ([p, q, r], [p0, q0, r0]) = (rate, bias);
                [p - p0, q - q0, r - r0]
            });
        }
        if let Some(force) = u.force {
            let last = self.last_force.replace(force);
            u.shock = last.is_some_and(|last| apart(force, last) > SHOCK_MPS2);
            let stuck = match new_force {
                true => self.force.take(force),
                false => self.force.is_stuck(),
            };
            u.stuck |= stuck;
            if !stuck {
                self.check_norm(force, u.rate.map_or(0.0, |[_, _, r]| r) * speed_mps, dt);
            }
            self.out_s = (self.out_s - dt).max(0.0);
            if stuck || (self.gate && self.out_s > 0.0) {
                u.force = None;
            }
        }
        u
    }

    fn check_norm(&mut self, [x, y, z]: [Real; 3], centripetal_mps2: Real, dt: Real) {
        let expected = sqrt(GRAVITY * GRAVITY + centripetal_mps2 * centripetal_mps2);
        let error = sqrt(x * x + y * y + z * z) - expected;
        self.norm_error_mps2 += dt / (NORM_LAG_S + dt) * (error - self.norm_error_mps2);
        if self.norm_error_mps2.abs() > NORM_GATE_MPS2 {
            self.out_s = NORM_HOLD_S;
        }
    }
}

state!(StuckVector { last, run, changes, repeats; });
state!(SpikeGate { last, pending, jump; });
state!(ImuHealth { spikes, last_force, force, rate, norm_error_mps2, out_s; gate, spike_gate });
