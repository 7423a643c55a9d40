//! A plant that diverges ends the run with an error: when, which body, and which value is the likely cause.
//!
//! Values of a file may each be in their range and still have no physics together: a damping that turns a velocity
//! round within a step, a drag that stops a train in a step. Forces then grow from step to step until they are no
//! numbers.

use crate::error::Error;
use crate::guarded::guarded;
use crate::train::Train;

/// Key of the train's value that changes velocities most within a step of `dt_s`.
fn likely_key(train: &Train, gravity_mps2: f64, dt_s: f64) -> &'static str {
    let r = &train.resistance;
    let masses = train.bodies.iter().map(|b| b.mass_kg);
    let lightest_kg = masses.fold(f64::INFINITY, f64::min).max(1e-6);
    let speed_mps = train.limits.max_speed_mps.max(0.1);
    let pull_n = |d: &crate::train::Drive| {
        d.torque_max_nm * d.gear_ratio / d.wheel_radius_m / d.efficiency_brake
    };
    let pulls = train.drives.iter().map(pull_n);
    // change of speed in a step, over the speed
    let by_force = |n: f64| n / lightest_kg * dt_s / speed_mps;
    let candidates = [
        (
            "train.resistance.bearing_nspm",
            by_force(r.bearing_nspm * speed_mps),
        ),
        ("train.resistance.bearing_n", by_force(r.bearing_n)),
        (
            "train.resistance.air_nspm2",
            by_force(r.air_nspm2 * speed_mps * speed_mps),
        ),
        (
            "train.resistance.running_wheel",
            r.running_wheel * gravity_mps2 * dt_s / speed_mps,
        ),
        (
            "train.drive.torque_max_nm",
            by_force(pulls.fold(0.0, f64::max)),
        ),
        ("physics.gravity_mps2", gravity_mps2 * dt_s / speed_mps),
    ];
    let most = candidates.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
    match most {
        Some((key, change)) if change > 0.1 => key,
        _ => "physics.dt_ms",
    }
}

/// The causes of a divergence: what a run needs to name one.
#[derive(Clone, Copy)]
pub(crate) struct Causes<'a> {
    pub(crate) train: &'a Train,
    pub(crate) gravity_mps2: f64,
    pub(crate) dt_s: f64,
}

impl Causes<'_> {
    /// Makes a plant. A panic of its arithmetic is an error at the start.
    pub(crate) fn build<T>(&self, make: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
        guarded(make).unwrap_or_else(|_| Err(self.broken(0.0, None)))
    }

    /// Error of a plant that diverges at `t_s` (s), in this body if the plant names one.
    pub(crate) fn broken(&self, t_s: f64, body: Option<&str>) -> Error {
        let key = likely_key(self.train, self.gravity_mps2, self.dt_s);
        let body = body.map_or(String::new(), |name| format!(" of `{name}`"));
        Error::Broken {
            t_s,
            what: format!("the motion{body} diverges; the likely cause is the value of `{key}`"),
        }
    }
}
