//! Load on chains as a pendulum with a known force: exact solution for an acceleration that is constant over each sub-step.
//!
//! φ̈ = −ω² φ − a cos θ/L, ω² = g/L, φ the angle of the chains against their rest, + forward. The solution is the sum of the free one from
//! (φ, φ̇) and the forced one from rest; the free one is linear, and so is the block mean of φ:
//!
//! φ̄ = [sin ωT/(ωT), (1 − cos ωT)/(ω² T)] (φ, φ̇)ᵀ + forced.
//!
//! With a length L = (L₀ + g m/k) e^λ: a longitudinal stiffness k in series makes the pendulum longer by g m/k.

use crate::Real;
use crate::api::real::{GRAVITY, cos, sin, sqrt};

/// Sub-steps of a block.
pub const SUBSTEPS: usize = 5;

/// What a pendulum of one length does over a block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SwingBlock {
    /// Transition of (φ, φ̇).
    pub A: [[Real; 2]; 2],
    /// What the force adds to (φ, φ̇).
    pub forced: [Real; 2],
    /// Row that gives the mean of φ from (φ, φ̇) at the start, and what the force adds to it.
    pub mean: [Real; 2],
    /// See above.
    pub forced_mean: Real,
}

impl SwingBlock {
    /// For a pendulum of `length_m` under `accelerations` (m/s², each times cos θ), held for `substep_s` each.
    pub fn new(length_m: Real, accelerations: &[Real; SUBSTEPS], substep_s: Real) -> Self {
        let w = sqrt(GRAVITY / length_m.max(0.05));
        let h = substep_s;
        let (c, s) = (cos(w * h), sin(w * h));
        let (mut angle, mut rate, mut mean) = (0.0, 0.0, 0.0);
        for a in accelerations {
            let rest = -a / GRAVITY;
            let away = angle - rest;
            mean += rest + away * s / (w * h) + rate * (1.0 - c) / (w * w * h);
            (angle, rate) = (rest + c * away + s / w * rate, c * rate - s * w * away);
        }
        let T = SUBSTEPS as Real * h;
        let (C, S) = (cos(w * T), sin(w * T));
        Self {
            A: [[C, S / w], [-S * w, C]],
            forced: [angle, rate],
            mean: [S / (w * T), (1.0 - C) / (w * w * T)],
            forced_mean: mean / SUBSTEPS as Real,
        }
    }

    /// (φ, φ̇) at the end of the block.
    pub fn end(&self, [angle, rate]: [Real; 2]) -> [Real; 2] {
        let ([[a, b], [c, d]], [e, f]) = (self.A, self.forced);
        [a * angle + b * rate + e, c * angle + d * rate + f]
    }

    /// Mean of φ over the block.
    pub fn mean_angle(&self, [angle, rate]: [Real; 2]) -> Real {
        let [a, b] = self.mean;
        a * angle + b * rate + self.forced_mean
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_solution_of_its_equation() {
        // Oracle: the equation integrated in small steps (leapfrog).
        let (length, h) = (0.65, 0.1);
        let accelerations = [0.3, 0.5, 0.1, -0.4, 0.2];
        let (mut angle, mut rate, mut sum): (f64, f64, f64) = (0.02, -0.1, 0.0);
        let fine = 20_000;
        for a in accelerations {
            let dt = h / fine as f64;
            let force = |angle: f64| -9.81 / length * angle - a / length;
            for _ in 0..fine {
                let half = rate + 0.5 * dt * force(angle);
                let next = angle + dt * half;
                sum += 0.5 * (angle + next) * dt;
                angle = next;
                rate = half + 0.5 * dt * force(angle);
            }
        }
        let block = SwingBlock::new(length as Real, &accelerations.map(|a| a as Real), h as Real);
        let [phi, phi_dot] = block.end([0.02, -0.1]);
        let mean = block.mean_angle([0.02, -0.1]);
        assert!((f64::from(phi as f32) - angle).abs() < 1e-6);
        assert!((f64::from(phi_dot as f32) - rate).abs() < 1e-5);
        assert!((f64::from(mean as f32) - sum / 0.5).abs() < 1e-6);
    }

    #[test]
    fn a_steady_acceleration_leaves_it_at_its_rest() {
        let block = SwingBlock::new(0.6, &[0.4; SUBSTEPS], 0.1);
        let rest = -0.4 / GRAVITY;
        let [angle, rate] = block.end([rest, 0.0]);
        assert!((angle - rest).abs() < 1e-6 && rate.abs() < 1e-6);
        assert!((block.mean_angle([rest, 0.0]) - rest).abs() < 1e-6);
    }
}
