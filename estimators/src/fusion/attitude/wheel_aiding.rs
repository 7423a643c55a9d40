//! Wheels as a measurement of the attitude filter's speed: gate of each wheel (slip), mean of the rest, and the monitor of the gyro.
//!
//! h = (v − l_z θ̇)(1 + e_w), R = σ_w²/n for n wheels in use. While no wheel is in use the filter coasts on the accelerometer.

use nalgebra::SVector;

use super::params::{AttitudeParams, AttitudeSupervision};
use super::{N, SCALE, THETA, V};
use crate::Real;
use crate::api::aid::{AidOutcome, AidStatus, Rejection};
use crate::api::real::sqrt;
use crate::api::signals::MAX_DRIVES;
use crate::api::snapshot::state;
use crate::detect::validity::Integrity;
use crate::filters::gaussian::Gaussian;

/// Share of the speed by which wheels may differ beyond their noise (creep, scale).
const SPREAD: Real = 0.004;
/// Memory of the scale of one wheel against the mean of all, s, and the speed from which it is learnt, m/s.
const SCALE_MEMORY_S: Real = 20.0;
const SCALE_SPEED_MPS: Real = 0.2;
/// Time without a wheel after which all are taken again, s, and the variance by which the speed is then opened, m²/s² per s.
const MAX_COAST_S: Real = 8.0;
const REOPEN: Real = 1.0;
/// Coasting, the speed's variance grows by this from 1 s on, m²/s² per s.
const COAST: Real = 4e-4;
/// Gyro monitor: memory of the innovation, s; threshold of the square of its mean over its variance, and largest excess taken; time after a rejected
/// wheel for which it rests, s.
const MONITOR_S: Real = 0.3;
const MONITOR_THRESHOLD: Real = 30.0;
const MAX_EXCESS: Real = 20.0;
/// Time that the test must be above its threshold, s: slip is rejected sooner.
const MONITOR_WAIT_S: Real = 0.25;
const NIS_REST_S: Real = 1.5;
/// The same after a shock of the accelerometer.
const SHOCK_REST_S: Real = 0.5;
/// Standard deviations within which wheels agree, and the pitch variance it adds per unit of excess, rad²/s.
const AGREE_SD: Real = 7.0;
const DOUBT_RAD2PS: Real = 1.6e-5;
/// Speed from which the monitor works, m/s.
const MONITOR_SPEED_MPS: Real = 0.05;

/// Wheels of the attitude filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelAiding {
    drives: usize,
    sd_mps: Real,
    gate: Real,
    slip_gate: bool,
    monitor: bool,
    scale: [Real; MAX_DRIVES],
    coast_s: Real,
    mean: Real,
    test: Real,
    above_s: Real,
    rest_s: Real,
}

/// What became of the wheels of one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WheelOutcome {
    /// Wheels in use.
    pub used: usize,
    /// Wheels beyond the gate.
    pub rejected: usize,
    /// Of the mean, if any wheel had a new sample.
    pub status: Option<AidStatus>,
}

/// Mean and extremes of the wheels in use.
#[derive(Clone, Copy, Debug)]
struct Vote {
    used: usize,
    rejected: usize,
    mean: Real,
    range: Real,
    nearest: Real,
}

impl WheelAiding {
    /// For `drives` wheels.
    pub fn new(
        drives: usize,
        params: &AttitudeParams,
        supervision: &AttitudeSupervision,
        integrity: &Integrity,
    ) -> Self {
        Self {
            drives: drives.min(MAX_DRIVES),
            sd_mps: params.wheel_speed_sd_mps,
            gate: integrity.gate_sd,
            slip_gate: supervision.slip_gate && integrity.innovation_gate,
            monitor: supervision.gyro_monitor,
            scale: [0.0; MAX_DRIVES],
            coast_s: 0.0,
            mean: 0.0,
            test: 0.0,
            above_s: 0.0,
            rest_s: 0.0,
        }
    }

    /// Corrects the belief by the new samples. `lever_mps` is l_z θ̇, `lever_row` its derivatives by the state.
    pub fn step(
        &mut self,
        belief: &mut Gaussian<N>,
        new_mps: &[Option<Real>; MAX_DRIVES],
        (lever_mps, lever_row): (Real, &[(usize, Real)]),
        dt: Real,
    ) -> WheelOutcome {
        let speed = belief.x[V] - lever_mps;
        let predicted = speed * (1.0 + belief.x[SCALE]);
        let spread = SPREAD * predicted;
        let variance = belief.P[(V, V)] + self.sd_mps * self.sd_mps + spread * spread;
        let limit = self.gate * sqrt(variance);
        let vote = self.vote(new_mps, predicted, limit);
        if vote.used == 0 {
            self.coast(belief, dt);
            let status = (vote.rejected > 0).then(|| AidStatus {
                innovation: vote.nearest,
                innovation_variance: variance,
                test_ratio: vote.nearest * vote.nearest / (limit * limit).max(Real::MIN_POSITIVE),
                outcome: AidOutcome::Rejected(Rejection::Slip),
            });
            return WheelOutcome {
                used: 0,
                rejected: vote.rejected,
                status,
            };
        }
        self.coast_s = 0.0;
        let innovation = vote.mean - predicted;
        let R = self.sd_mps * self.sd_mps / vote.used as Real;
        let S = belief.P[(V, V)] + R;
        self.watch_gyro(belief, &vote, [innovation, S], dt);
        let mut h = SVector::<Real, N>::zeros();
        h[V] = 1.0 + belief.x[SCALE];
        for (place, by) in lever_row {
            h[*place] -= by * (1.0 + belief.x[SCALE]);
        }
        h[SCALE] = speed;
        let fused = belief.update_scalar(innovation, &h, R);
        if vote.rejected == 0 && vote.used == self.drives && vote.mean.abs() > SCALE_SPEED_MPS {
            self.learn_scales(new_mps, vote.mean, dt);
        }
        WheelOutcome {
            used: vote.used,
            rejected: vote.rejected,
            status: Some(AidStatus {
                innovation,
                innovation_variance: S,
                test_ratio: innovation * innovation / (limit * limit).max(Real::MIN_POSITIVE),
                outcome: match fused {
                    Some(()) => AidOutcome::Fused,
                    None => AidOutcome::Rejected(Rejection::Numeric),
                },
            }),
        }
    }

    fn vote(&self, new_mps: &[Option<Real>; MAX_DRIVES], predicted: Real, limit: Real) -> Vote {
        let (mut used, mut rejected, mut sum) = (0, 0, 0.0);
        let (mut low, mut high, mut nearest) = (Real::MAX, Real::MIN, Real::MAX);
        for (sample, scale) in new_mps.iter().zip(&self.scale).take(self.drives) {
            let Some(v) = sample.map(|v| v / (1.0 + scale)) else {
                continue;
            };
            let away = v - predicted;
            if away.abs() < nearest.abs() {
                nearest = away;
            }
            if self.slip_gate && away.abs() > limit {
                rejected += 1;
                continue;
            }
            (used, sum) = (used + 1, sum + v);
            (low, high) = (low.min(v), high.max(v));
        }
        Vote {
            used,
            rejected,
            mean: sum / used.max(1) as Real,
            range: if used > 0 { high - low } else { 0.0 },
            nearest: if used + rejected > 0 { nearest } else { 0.0 },
        }
    }

    /// The accelerometer has had a shock: the speed has jumped, which is no sign of a wrong pitch.
    pub fn shock(&mut self) {
        (self.mean, self.rest_s) = (0.0, self.rest_s.max(SHOCK_REST_S));
    }

    /// No wheel: the speed is that of the accelerometer; after a long time without, wheels that were right all along are let in again.
    fn coast(&mut self, belief: &mut Gaussian<N>, dt: Real) {
        self.coast_s += dt;
        if self.coast_s > 1.0 {
            belief.P[(V, V)] += COAST * dt;
        }
        if self.coast_s > MAX_COAST_S {
            belief.P[(V, V)] += REOPEN * dt;
        }
    }

    /// Wheels that agree with each other and contradict the filter: then the pitch, the gyro's integral, is wrong. The mean of the innovations finds
    /// that much sooner than the mean of their squares: with the wheels' noise white, its variance is S dt/(2 τ).
    fn watch_gyro(
        &mut self,
        belief: &mut Gaussian<N>,
        vote: &Vote,
        innovation: [Real; 2],
        dt: Real,
    ) {
        let range = AGREE_SD * self.sd_mps + SPREAD * vote.mean.abs();
        let agree = vote.rejected == 0 && (vote.used == 1 || vote.range < range);
        let [y, S] = innovation;
        if agree {
            self.mean += (dt / (MONITOR_S + dt)) * (y - self.mean);
        } else {
            (self.mean, self.rest_s) = (0.0, NIS_REST_S);
        }
        self.rest_s = (self.rest_s - dt).max(0.0);
        self.test = self.mean * self.mean / (S * dt / (2.0 * MONITOR_S)).max(Real::MIN_POSITIVE);
        let excess = (self.test - MONITOR_THRESHOLD).min(MAX_EXCESS);
        let moving = belief.x[V].abs() > MONITOR_SPEED_MPS;
        let above = moving && excess > 0.0 && self.rest_s <= 0.0;
        self.above_s = if above { self.above_s + dt } else { 0.0 };
        if self.monitor && self.above_s > MONITOR_WAIT_S {
            belief.P[(THETA, THETA)] += DOUBT_RAD2PS * excess * dt;
        }
    }

    /// Square of the mean innovation over its variance.
    pub fn test(&self) -> Real {
        self.test
    }

    fn learn_scales(&mut self, new_mps: &[Option<Real>; MAX_DRIVES], mean: Real, dt: Real) {
        for (scale, sample) in self.scale.iter_mut().zip(new_mps) {
            if let Some(v) = sample {
                *scale += dt / SCALE_MEMORY_S * (v / mean - 1.0 - *scale);
                *scale = scale.clamp(-0.2, 0.2);
            }
        }
    }
}

state!(WheelAiding { scale, coast_s, mean, test, above_s, rest_s; drives, sd_mps, gate, slip_gate, monitor });
