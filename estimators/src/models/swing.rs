//! Load on chains as a pendulum with a known force: exact solution for an acceleration that is constant over each
//! sub-step.
//!
//! φ̈ = −ω² φ − a cos θ/L, ω² = g/L, φ the angle of the chains against their rest, + forward. The solution is the sum
//! of the free one from (φ, φ̇) and the forced one from rest; the free one is linear, and so is the block mean of φ:
//!
//! φ̄ = [sin ωT/(ωT), (1 − cos ωT)/(ω² T)] (φ, φ̇)ᵀ + forced.
//!
//! With a length L = (L₀ + g m/k) e^λ: a longitudinal stiffness k in series makes the pendulum longer by g m/k.

use crate::Real;
use crate::api::real::{GRAVITY, cos, sin, sqrt};

/// Shortest pendulum that is computed, m.
pub const MIN_LENGTH_M: Real = 0.05;

/// Sub-steps of a block.
pub const SUBSTEPS: usize = 5;

/// Motion of a pendulum over a block: a linear map of (φ, φ̇) at its start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SwingBlock {
    /// Transition of (φ, φ̇).
    pub A: [[Real; 2]; 2],
    /// Part of (φ, φ̇) at the end that is due to the force.
    pub forced: [Real; 2],
    /// Row that gives the mean of φ from (φ, φ̇) at the start.
    pub mean: [Real; 2],
    /// Part of the mean of φ that is due to the force.
    pub forced_mean: Real,
}

impl SwingBlock {
    /// Builds the block for a pendulum of `length_m` under `accelerations` (m/s², each times cos θ), held for
    /// `substep_s` each.
    pub fn new(length_m: Real, accelerations: &[Real; SUBSTEPS], substep_s: Real) -> Self {
        let w = sqrt(GRAVITY / length_m.max(MIN_LENGTH_M));
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

    /// The derivative of [`SwingBlock::new`] by the natural logarithm of the length. It is a map of the same form.
    pub fn by_log_length(
        length_m: Real,
        accelerations: &[Real; SUBSTEPS],
        substep_s: Real,
    ) -> Self {
        let w = sqrt(GRAVITY / length_m.max(MIN_LENGTH_M));
        let dw = -0.5 * w;
        // Sine and cosine of w t, over w, and their derivatives.
        let over = |t: Real| {
            let (c, s) = (cos(w * t), sin(w * t));
            let (dc, ds) = (-s * t * dw, c * t * dw);
            let angle = [s / w, ds / w - s * dw / (w * w)];
            let rate = [s * w, ds * w + s * dw];
            let mean = [s / (w * t), (ds / w - s * dw / (w * w)) / t];
            let square = w * w * t;
            let mean_by_rate = [
                (1.0 - c) / square,
                -(dc + 2.0 * (1.0 - c) * dw / w) / square,
            ];
            ([c, dc], angle, rate, mean, mean_by_rate)
        };
        let h = substep_s;
        let ([c, dc], [by_rate, dby_rate], [by_angle, dby_angle], [m, dm], [n, dn]) = over(h);
        let (mut angle, mut rate) = (0.0, 0.0);
        let (mut dangle, mut drate, mut dmean) = (0.0, 0.0, 0.0);
        for a in accelerations {
            let rest = -a / GRAVITY;
            let away = angle - rest;
            dmean += dangle * m + away * dm + drate * n + rate * dn;
            (dangle, drate) = (
                dc * away + c * dangle + dby_rate * rate + by_rate * drate,
                dc * rate + c * drate - dby_angle * away - by_angle * dangle,
            );
            (angle, rate) = (rest + c * away + by_rate * rate, c * rate - by_angle * away);
        }
        let ([_, dC], [_, dby_rate], [_, dby_angle], [_, dm], [_, dn]) = over(SUBSTEPS as Real * h);
        Self {
            A: [[dC, dby_rate], [-dby_angle, dC]],
            forced: [dangle, drate],
            mean: [dm, dn],
            forced_mean: dmean / SUBSTEPS as Real,
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
    fn the_derivative_by_the_length_is_that_of_central_differences() {
        let accelerations = [0.3, 0.5, 0.1, -0.4, 0.2];
        let (length, step): (Real, Real) = (0.65, 1e-5);
        let at = |log: Real| SwingBlock::new(length * log.exp(), &accelerations, 0.1);
        let (plus, minus) = (at(step), at(-step));
        let by_length = SwingBlock::by_log_length(length, &accelerations, 0.1);
        for start in [[0.0, 0.0], [0.02, -0.1], [-0.3, 0.5]] {
            let ends = plus.end(start).into_iter().zip(minus.end(start));
            for (derivative, (plus, minus)) in by_length.end(start).into_iter().zip(ends) {
                assert!((derivative - (plus - minus) / (2.0 * step)).abs() < 1e-8);
            }
            let mean = (plus.mean_angle(start) - minus.mean_angle(start)) / (2.0 * step);
            assert!((by_length.mean_angle(start) - mean).abs() < 1e-8);
        }
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
