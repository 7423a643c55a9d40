//! Lean: a sprung body pitches under acceleration and turns the instruments that are bolted to it.
//!
//! φ̈ = ω₀²(k a/g₀ − φ) − 2ζω₀ φ̇, φ the pitch against where the mount is without it (+ nose up), a the acceleration
//! along the track, g₀ = 9.80665 m/s². An accelerometer then reads g sin φ forward, a gyro −φ̇ about left.

use super::spec::LeanSpec;
use crate::plant::MountState;
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::TAU;

const STANDARD_GRAVITY_MPS2: f64 = 9.80665;

/// The lean of a mount.
#[derive(Clone, Copy, Debug)]
pub struct Lean {
    rad_per_mps2: f64,
    natural_radps: f64,
    damping: f64,
    pitch_rad: f64,
    rate_radps: f64,
}

impl Lean {
    /// Makes an upright lean.
    pub fn new(spec: &LeanSpec) -> Self {
        Self {
            rad_per_mps2: spec.pitch_deg_per_g.get().to_radians() / STANDARD_GRAVITY_MPS2,
            natural_radps: TAU * spec.frequency_hz.get(),
            damping: spec.damping.get(),
            pitch_rad: 0.0,
            rate_radps: 0.0,
        }
    }

    /// The mount as it leans after `dt_s` at an acceleration along the track; `upright` is the mount without lean.
    pub fn apply(&mut self, dt_s: f64, accel_mps2: f64, upright: &MountState) -> MountState {
        self.advance(dt_s, accel_mps2);
        let turned = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -self.pitch_rad);
        let rate_w = upright
            .q_wm
            .transform_vector(&Vector3::new(0.0, -self.rate_radps, 0.0));
        MountState {
            q_wm: upright.q_wm * turned,
            w_w: upright.w_w + rate_w,
            ..*upright
        }
    }

    /// Implicit Euler: stable whatever the step.
    fn advance(&mut self, dt_s: f64, accel_mps2: f64) {
        let stiffness = self.natural_radps * self.natural_radps;
        let off = self.rad_per_mps2 * accel_mps2 - self.pitch_rad;
        let inertia =
            1.0 + 2.0 * self.damping * self.natural_radps * dt_s + stiffness * dt_s * dt_s;
        self.rate_radps = (self.rate_radps + stiffness * off * dt_s) / inertia;
        self.pitch_rad += self.rate_radps * dt_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checked::{Finite, Positive};

    const UPRIGHT: MountState = MountState {
        v_w: Vector3::new(0.0, 0.0, 0.0),
        q_wm: UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(1.0, 0.0, 0.0, 0.0)),
        w_w: Vector3::new(0.0, 0.0, 0.0),
    };

    fn lean(damping: f64) -> Lean {
        Lean::new(&LeanSpec {
            pitch_deg_per_g: Finite::new(3.6),
            frequency_hz: Positive::new(1.5),
            damping: Positive::new(damping),
        })
    }

    /// Braking at 0.5 g: the nose goes down by 1.8°, and what points up then reads g sin 1.8° backwards.
    #[test]
    fn at_a_steady_deceleration_it_has_its_static_angle() {
        let mut lean = lean(0.4);
        let mut state = UPRIGHT;
        for _ in 0..5000 {
            state = lean.apply(0.002, -0.5 * 9.80665, &UPRIGHT);
        }
        let force = state
            .q_wm
            .inverse_transform_vector(&Vector3::new(0.0, 0.0, 9.81));
        let pitch = (force.x / 9.81).asin().to_degrees();
        assert!((pitch + 1.8).abs() < 1e-9, "{pitch}");
        assert!(state.w_w.norm() < 1e-9);
    }

    /// The gyro's rate about left is that of the pitch: its integral is the angle, with the sign of a nose that rises.
    #[test]
    fn the_rate_integrates_to_the_angle() {
        let mut lean = lean(0.4);
        let mut angle = 0.0;
        let mut state = UPRIGHT;
        for _ in 0..400 {
            state = lean.apply(0.002, 3.0, &UPRIGHT);
            angle -= state.q_wm.inverse_transform_vector(&state.w_w).y * 0.002;
        }
        let force = state
            .q_wm
            .inverse_transform_vector(&Vector3::new(0.0, 0.0, 1.0));
        assert!((force.x.asin() - angle).abs() < 1e-12);
        assert!(angle > 0.0);
    }

    /// Overshoot of a step of a second-order lag: exp(−πζ/√(1 − ζ²)); implicit steps of 2 ms add ω dt/2 = 0.01 to the
    /// damping.
    #[test]
    fn a_step_overshoots_as_its_damping_says() {
        let mut lean = lean(0.35);
        let mut highest = 0.0_f64;
        for _ in 0..1000 {
            let state = lean.apply(0.002, 9.80665, &UPRIGHT);
            highest = highest.max(state.q_wm.angle().to_degrees());
        }
        let overshoot = |zeta: f64| {
            3.6 * (1.0 + (-std::f64::consts::PI * zeta / (1.0 - zeta * zeta).sqrt()).exp())
        };
        assert!(
            highest < overshoot(0.35) && highest > overshoot(0.37),
            "{highest}"
        );
    }
}
