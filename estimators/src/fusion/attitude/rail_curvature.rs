//! Vertical curvature of the rail, dθ/ds, by the pitch rate over the speed.

use crate::Real;
use crate::api::real::within;
use crate::api::snapshot::state;
use crate::tuning::{CURVATURE, MOTION, RAIL};

/// Low-pass of θ̇/v over distance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RailCurvature {
    per_m: Real,
}

impl RailCurvature {
    /// Takes a step at `speed_mps` with the pitch rate `theta_dot`, rad/s.
    pub fn step(&mut self, speed_mps: Real, theta_dot: Real, dt: Real) {
        if speed_mps.abs() > MOTION.moves_mps {
            let way = speed_mps.abs() * dt / CURVATURE.memory_m;
            self.per_m += way / (1.0 + way) * (theta_dot / speed_mps - self.per_m);
            self.per_m = within(self.per_m, -RAIL.max_turn_radpm, RAIL.max_turn_radpm);
        }
    }

    /// Sets a curvature from another source.
    pub fn set(&mut self, per_m: Real) {
        self.per_m = within(per_m, -RAIL.max_turn_radpm, RAIL.max_turn_radpm);
    }

    /// 1/m, + where the grade grows.
    pub fn per_m(&self) -> Real {
        self.per_m
    }
}

state!(RailCurvature { per_m; });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::real::exp;

    const DT: Real = 1e-4;

    /// On a rail of the curvature κ the pitch turns at κ v, whichever way the unit goes. A share of 1 − 1/e of a new
    /// curvature is found after the memory in way, at every speed, and in the end all of it.
    #[test]
    fn a_curvature_is_found_over_the_same_way_at_every_speed() {
        for speed in [0.2, 1.5, -0.7 as Real] {
            for kappa in [0.1, -0.04] {
                let mut curvature = RailCurvature::default();
                let mut go = |way_m: Real| {
                    let steps = (way_m / (speed.abs() * DT)) as usize;
                    (0..steps).for_each(|_| curvature.step(speed, kappa * speed, DT));
                    curvature.per_m() / kappa
                };
                let share = go(CURVATURE.memory_m);
                assert!((share + exp(-1.0) - 1.0).abs() < 0.01, "{speed}: {share}");
                assert!((go(1.0) - 1.0).abs() < 1e-6, "{speed} {kappa}");
            }
        }
    }

    /// A body that nods at a stop tells nothing of the rail.
    #[test]
    fn a_nod_at_a_stop_is_no_curvature() {
        for speed in [0.059, -0.059, 0.0] {
            let mut curvature = RailCurvature::default();
            curvature.set(0.05);
            (0..100).for_each(|_| curvature.step(speed, 0.3, 0.01));
            assert_eq!(curvature.per_m(), 0.05);
        }
    }

    #[test]
    fn it_is_never_sharper_than_a_rail_can_be() {
        for sign in [1.0, -1.0] {
            let mut curvature = RailCurvature::default();
            curvature.set(sign);
            assert_eq!(curvature.per_m(), sign * RAIL.max_turn_radpm);
            curvature.set(0.0);
            (0..100).for_each(|_| curvature.step(1.0, sign, 0.01));
            assert_eq!(curvature.per_m(), sign * RAIL.max_turn_radpm);
        }
    }
}
