//! Time by which wheel samples are newer than accelerometer samples, by the stamps of both.
//!
//! The state is that of the accelerometer's time. Wheels that come sooner, or later, measure the speed of another time:
//! in it the vehicle gains v̇ τ, and ½ v⃛ τ² that is not known.

use crate::Real;
use crate::api::reading::Channels;
use crate::api::snapshot::state;
use crate::tuning::{TIMES, WHEELS};

/// Mean time by which wheel speeds are newer than specific forces.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WheelsAhead {
    mean_s: Real,
    known_s: Real,
}

impl WheelsAhead {
    /// Takes the ages of a step of `dt` (s).
    pub fn step(&mut self, z: &Channels, dt: Real) {
        // A stamp of the future is that of a clock of its own.
        let [_, force_s, wheels_s] = z.age_s.map(|age_s| age_s.max(0.0));
        self.known_s = (self.known_s + dt).min(TIMES.mean_s);
        self.mean_s += dt / (self.known_s + dt) * (force_s - wheels_s - self.mean_s);
    }

    /// Speed gained in this time at an acceleration, m/s, and its variance, m²/s².
    pub fn gained(&self, acceleration_mps2: Real) -> (Real, Real) {
        if self.mean_s.abs() > TIMES.mean_s {
            return (0.0, 0.0);
        }
        let sd = 0.5 * WHEELS.jerk_mps3 * self.mean_s * self.mean_s;
        (acceleration_mps2 * self.mean_s, sd * sd)
    }
}

state!(WheelsAhead { mean_s, known_s; });

#[cfg(test)]
mod tests {
    use super::*;

    /// The speed gained at 1 m/s² once the ages of force and wheels, s, have lasted for 10 s.
    fn gained([force_s, wheels_s]: [Real; 2]) -> Real {
        let mut ahead = WheelsAhead::default();
        let channels = Channels {
            age_s: [0.7, force_s, wheels_s],
            ..Channels::default()
        };
        for _ in 0..1000 {
            ahead.step(&channels, 0.01);
        }
        ahead.gained(1.0).0
    }

    #[test]
    fn wheels_that_are_newer_than_the_force_have_gained_speed() {
        for (ages, expected) in [
            ([0.1, 0.0], 0.1),
            ([0.0, 0.1], -0.1),
            ([0.2, 0.2], 0.0),
            // a clock that is ahead, and one that is far behind
            ([-0.4, 0.0], 0.0),
            ([2.0, 0.0], 0.0),
        ] {
            assert!((gained(ages) - expected).abs() < 1e-3, "{ages:?}");
        }
    }

    #[test]
    fn what_is_not_known_of_the_gain_grows_with_the_square_of_the_time() {
        let of = |mean_s| {
            let known_s = TIMES.mean_s;
            WheelsAhead { mean_s, known_s }.gained(0.0).1
        };
        assert_eq!(of(0.0), 0.0);
        assert!((of(0.2) / of(0.1) - 16.0).abs() < 1e-9);
    }
}
