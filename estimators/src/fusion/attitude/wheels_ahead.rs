//! Time by which the wheels are ahead of the accelerometer, by the stamps of both.
//!
//! The state is that of the accelerometer's time. Wheels that come sooner, or later, measure the speed of another time:
//! in it the vehicle gains v̇ τ, and ½ v⃛ τ² that is not known.

use crate::Real;
use crate::api::snapshot::state;
use crate::preprocess::front_end::Channels;

/// Memory of the time, s.
const MEMORY_S: Real = 1.0;
/// Clocks that are further apart are set differently, s.
const MAX_S: Real = 0.5;
/// Change of the acceleration that is not known, m/s³: the jerk of a start.
const JERK_MPS3: Real = 0.5;

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
        self.known_s = (self.known_s + dt).min(MEMORY_S);
        self.mean_s += dt / (self.known_s + dt) * (force_s - wheels_s - self.mean_s);
    }

    /// Speed gained in that time at an acceleration, m/s, and its variance, m²/s².
    pub fn gained(&self, acceleration_mps2: Real) -> (Real, Real) {
        if self.mean_s.abs() > MAX_S {
            return (0.0, 0.0);
        }
        let sd = 0.5 * JERK_MPS3 * self.mean_s * self.mean_s;
        (acceleration_mps2 * self.mean_s, sd * sd)
    }
}

state!(WheelsAhead { mean_s, known_s; });
