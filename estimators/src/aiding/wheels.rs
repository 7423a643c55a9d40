//! Wheel speeds, which measure the speed: gate of each wheel (slip), and the mean of the rest.
//!
//! h = (v + v̇ τ − l_z θ̇)(1 + e_w), R = σ_w²/n for n wheels in use. θ̇ is that of the step, linear in the state; τ is
//! the time by which the wheels are ahead of the accelerometer by their stamps, and v̇ τ is known.

use nalgebra::SVector;

use crate::Real;
use crate::aiding::Aid;
use crate::api::real::sqrt;
use crate::api::signals::MAX_DRIVES;
use crate::api::snapshot::state;
use crate::detect::control::Control;
use crate::filters::gaussian::Gaussian;
use crate::models::attitude::{LinearPitchRate, N, SCALE, V};

/// Share of the speed by which wheels may differ beyond their noise (creep, scale).
pub const SPREAD: Real = 0.004;
/// Standard deviations within which wheels agree.
pub const AGREE_SD: Real = 7.0;
/// Memory of the scale of one wheel against the mean of all, s, and the speed from which it is learnt, m/s.
const SCALE_MEMORY_S: Real = 20.0;
const SCALE_SPEED_MPS: Real = 0.2;
/// Largest scale error of one wheel against the mean.
const MAX_SCALE: Real = 0.2;

/// Mean of the wheels in use, as a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wheels {
    /// Mean speed, m/s.
    pub speed_mps: Real,
    /// Variance of that, m²/s².
    pub variance: Real,
    /// Distance l_z of the IMU below the unit's middle, m.
    pub below_m: Real,
    /// Rate of the pitch.
    pub pitch_rate: LinearPitchRate,
    /// Speed gained since the time of the state, v̇ τ, m/s.
    pub gained_mps: Real,
}

impl Wheels {
    /// v + v̇ τ − l_z θ̇, m/s.
    fn at_rail(&self, x: &SVector<Real, N>) -> Real {
        x[V] + self.gained_mps - self.below_m * self.pitch_rate.at(x)
    }
}

impl Aid<N> for Wheels {
    fn innovation(&self, x: &SVector<Real, N>) -> Real {
        self.speed_mps - self.h(x)
    }

    fn h(&self, x: &SVector<Real, N>) -> Real {
        self.at_rail(x) * (1.0 + x[SCALE])
    }

    #[allow(
        clippy::indexing_slicing,
        reason = "indices of states are constants below N"
    )]
    fn H(&self, x: &SVector<Real, N>) -> SVector<Real, N> {
        let mut h = SVector::<Real, N>::zeros();
        let scale = 1.0 + x[SCALE];
        h[V] = scale;
        for (place, by) in self.pitch_rate.by_state() {
            h[place] -= self.below_m * by * scale;
        }
        h[SCALE] = self.at_rail(x);
        h
    }

    fn R(&self) -> Real {
        self.variance
    }
}

/// Vote of the wheels of one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ballot {
    /// Wheels in use.
    pub used: usize,
    /// Wheels beyond the gate.
    pub rejected: usize,
    /// Those of them that are ahead of the train while driven, or behind it while braked: they slip. The others are
    /// broken.
    pub slipping: usize,
    /// Mean of those in use, m/s; without any the one nearest to the prediction.
    pub speed_mps: Real,
    /// Largest difference of two in use, m/s.
    pub range_mps: Real,
    /// Deviation from the prediction beyond which a wheel is rejected, m/s.
    pub limit_mps: Real,
    /// True if several wheels, all there are, agree with each other beyond the gate and do not slip.
    pub contradicts: bool,
}

/// Gate of each wheel, and the scales of the wheels against each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelGate {
    drives: usize,
    sd_mps: Real,
    gate_sd: Real,
    gated: bool,
    scale: [Real; MAX_DRIVES],
}

impl WheelGate {
    /// Builds the gate for `drives` wheels whose speeds have the standard deviation `sd_mps`, with a gate of `gate_sd`
    /// of them unless it is not `gated`.
    pub fn new(drives: usize, sd_mps: Real, gate_sd: Real, gated: bool) -> Self {
        Self {
            drives: drives.min(MAX_DRIVES),
            sd_mps,
            gate_sd,
            gated,
            scale: [0.0; MAX_DRIVES],
        }
    }

    /// Returns true if wheels beyond the gate are rejected.
    pub fn is_gated(&self) -> bool {
        self.gated
    }

    /// The new samples against a belief: the measurement, and the vote that made it. The wheels are ahead of the state
    /// by a time in which the vehicle gains a speed, m/s, known with a variance, m²/s².
    #[allow(
        clippy::indexing_slicing,
        reason = "indices of states are constants below N"
    )]
    pub fn control(
        &mut self,
        belief: &Gaussian<N>,
        (new_mps, torque_nm): (&[Option<Real>; MAX_DRIVES], &[Option<Real>; MAX_DRIVES]),
        (below_m, pitch_rate): (Real, LinearPitchRate),
        (gained_mps, gained_variance): (Real, Real),
        dt: Real,
    ) -> (Control<Wheels>, Ballot) {
        let mut wheels = Wheels {
            speed_mps: 0.0,
            variance: self.sd_mps * self.sd_mps,
            below_m,
            pitch_rate,
            gained_mps,
        };
        let predicted = wheels.h(&belief.x);
        let spread = SPREAD * predicted;
        let variance = belief.P[(V, V)] + wheels.variance + gained_variance + spread * spread;
        let limit = self.gate_sd * sqrt(variance);
        let ballot = self.vote(new_mps, torque_nm, predicted, limit);
        wheels.speed_mps = ballot.speed_mps;
        wheels.variance = wheels.variance / ballot.used.max(1) as Real + gained_variance;
        if ballot.rejected == 0
            && ballot.used == self.drives
            && ballot.speed_mps.abs() > SCALE_SPEED_MPS
        {
            self.learn_scales(new_mps, ballot.speed_mps, dt);
        }
        match ballot.used + ballot.rejected {
            0 => (Control::Held, ballot),
            _ => (Control::New(wheels), ballot),
        }
    }

    fn vote(
        &self,
        new_mps: &[Option<Real>; MAX_DRIVES],
        torque_nm: &[Option<Real>; MAX_DRIVES],
        predicted: Real,
        limit: Real,
    ) -> Ballot {
        let (mut used, mut rejected, mut slipping, mut sum) = (0, 0, 0, 0.0);
        let (mut low, mut high, mut nearest) = (Real::MAX, Real::MIN, Real::MAX);
        let (mut least, mut most) = (Real::MAX, Real::MIN);
        let units = new_mps.iter().zip(&self.scale).zip(torque_nm);
        for ((sample, scale), torque) in units.take(self.drives) {
            let Some(v) = sample.map(|v| v / (1.0 + scale)) else {
                continue;
            };
            (least, most) = (least.min(v), most.max(v));
            if (v - predicted).abs() < (nearest - predicted).abs() {
                nearest = v;
            }
            if self.gated && (v - predicted).abs() > limit {
                rejected += 1;
                let driven = torque.unwrap_or(v - predicted) * (v - predicted) > 0.0;
                slipping += usize::from(driven);
                continue;
            }
            (used, sum) = (used + 1, sum + v);
            (low, high) = (low.min(v), high.max(v));
        }
        Ballot {
            used,
            rejected,
            slipping,
            speed_mps: match (used, rejected) {
                (0, 0) => 0.0,
                (0, _) => nearest,
                _ => sum / used as Real,
            },
            range_mps: if used > 0 { high - low } else { 0.0 },
            limit_mps: limit,
            contradicts: used == 0
                && rejected > 1
                && slipping == 0
                && most - least < AGREE_SD * self.sd_mps + SPREAD * most.abs(),
        }
    }

    fn learn_scales(&mut self, new_mps: &[Option<Real>; MAX_DRIVES], mean: Real, dt: Real) {
        for (scale, sample) in self.scale.iter_mut().zip(new_mps) {
            if let Some(v) = sample {
                *scale += dt / SCALE_MEMORY_S * (v / mean - 1.0 - *scale);
                *scale = scale.clamp(-MAX_SCALE, MAX_SCALE);
            }
        }
    }
}

state!(WheelGate { scale; drives, sd_mps, gate_sd, gated });
