//! The part of the specific force that is due to the slope, f − v̇ = g sin θ + bias, and its derivative, with the speed
//! after the same filters.

use crate::Real;
use crate::api::snapshot::state;
use crate::filters::low_pass::MatchedFilter;

/// The two filters after each other, for specific force and wheel speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlopeForce {
    /// f behind the first filter.
    pub force: MatchedFilter,
    /// v behind the first filter.
    pub speed: MatchedFilter,
    /// f − v̇ and v, once more filtered.
    excess: MatchedFilter,
    speed_again: MatchedFilter,
}

impl SlopeForce {
    /// Low-passes with corner `cutoff_hz`, two after each other.
    pub fn new(cutoff_hz: Real) -> Self {
        let filter = MatchedFilter::new(cutoff_hz);
        Self {
            force: filter,
            speed: filter,
            excess: filter,
            speed_again: filter,
        }
    }

    /// Specific force f, m/s², and wheel speed, m/s, held for `dt` seconds. d(f − v̇)/dt, m/s³, and the speed delayed
    /// like it.
    pub fn step(&mut self, f: Real, v: Real, dt: Real) -> Option<(Real, Real)> {
        self.force.step(f, dt);
        self.speed.step(v, dt);
        let (force, speed) = self.force.value().zip(self.speed.value())?;
        self.excess.step(force - self.speed.rate(), dt);
        self.speed_again.step(speed, dt);
        Some((self.excess.rate(), self.speed_again.value()?))
    }
}

state!(SlopeForce { force, speed, excess, speed_again; });

#[cfg(test)]
mod tests {
    use super::*;

    /// d(f − v̇)/dt: what the wheels accelerate by more and more is no curvature.
    #[test]
    fn a_jerk_of_the_train_is_no_slope() {
        let mut force = SlopeForce::new(1.0);
        let mut last = None;
        for k in 0..2_000 {
            let t = 0.01 * k as Real;
            // v̇ = 0.05 t; the grade adds 0.1 m/s³.
            last = force.step(0.05 * t + 0.1 * t, 1.0 + 0.025 * t * t, 0.01);
        }
        let (jerk, _) = last.unwrap();
        assert!((jerk - 0.1).abs() < 1e-3, "{jerk}");
    }
}
