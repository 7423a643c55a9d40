//! Vertical curvature of the rail, dθ/ds, by the pitch rate over the speed.

use crate::Real;
use crate::api::real::within;
use crate::api::snapshot::state;

/// Way over which it is smoothed, m: in way, not in time, or a body that nods at a stop would leave a curvature of its
/// own.
const MEMORY_M: Real = 0.05;
/// Speed from which it is learnt, m/s.
const MIN_SPEED_MPS: Real = 0.12;
/// Sharpest curve of a rail, 1/m: a radius of 8 m.
pub const MAX_CURVATURE_PER_M: Real = 0.13;

/// Low-pass of θ̇/v in way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RailCurvature {
    per_m: Real,
}

impl RailCurvature {
    /// The unit moves on at `speed_mps` and pitches at `theta_dot`, rad/s.
    pub fn step(&mut self, speed_mps: Real, theta_dot: Real, dt: Real) {
        if speed_mps.abs() > MIN_SPEED_MPS {
            let way = speed_mps.abs() * dt / MEMORY_M;
            self.per_m += way / (1.0 + way) * (theta_dot / speed_mps - self.per_m);
            self.per_m = within(self.per_m, -MAX_CURVATURE_PER_M, MAX_CURVATURE_PER_M);
        }
    }

    /// It is known from elsewhere.
    pub fn set(&mut self, per_m: Real) {
        self.per_m = within(per_m, -MAX_CURVATURE_PER_M, MAX_CURVATURE_PER_M);
    }

    /// 1/m, + where the grade grows.
    pub fn per_m(&self) -> Real {
        self.per_m
    }
}

state!(RailCurvature { per_m; });
