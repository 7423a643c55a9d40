//! The bound of a run during the run.

use super::attitude::{AttitudeBound, Motion};
use super::mass::MassBound;
use super::sheet::SheetNoise;
use monorig_estimators::api::signals::Vehicle;
use monorig_sim::closed_loop::{Simulation, tolerances};
use monorig_sim::plant::Truth;

/// Standard deviations that no estimator can be better than, at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundSample {
    /// s.
    pub t_s: f64,
    /// Bound of the grade at the IMU, rad.
    pub slope_rad: f64,
    /// Bound of the effective grade, rad.
    pub effective_rad: f64,
    /// Bound of the total mass, as a share of the mass.
    pub mass_rel: f64,
}

/// The bound of a run, computed from its true motion and the noise of its sheet.
pub(crate) struct RunningBound {
    attitude: AttitudeBound,
    mass: MassBound,
    vehicle: Vehicle,
    /// Standard deviation of the pitch of the IMU against its unit, rad.
    mount_rad: f64,
    gravity: f64,
    /// When the next step of the attitude is due, s.
    next_s: f64,
    now: Option<BoundSample>,
}

impl RunningBound {
    /// Makes the bound for this simulation; `None` without an accelerometer and wheel speeds, as for a recorded drive.
    pub(crate) fn of(simulation: &Simulation) -> Option<Self> {
        let noise = SheetNoise::of(&simulation.instruments);
        noise.accelerometer.and(noise.wheel_speed)?;
        let mut attitude = AttitudeBound::new(noise);
        attitude.drives(simulation.vehicle.drives);
        let tolerances = tolerances(&simulation.scenario);
        Some(Self {
            attitude,
            mass: MassBound::new(noise, &tolerances),
            mount_rad: tolerances.mount_deg.to_radians(),
            vehicle: simulation.vehicle,
            gravity: simulation.scenario.file.physics.gravity_mps2.get(),
            next_s: 0.0,
            now: None,
        })
    }

    /// Advances by a step of the plant; returns true if a sample of the accelerometer was due, which changes the bound.
    pub(crate) fn step(&mut self, truth: &Truth) -> bool {
        self.mass.step(truth, &self.vehicle, self.gravity);
        let due = self
            .attitude
            .step_s()
            .filter(|_| truth.t_s + 1e-9 >= self.next_s);
        let Some(step_s) = due else {
            return false;
        };
        self.next_s += step_s;
        self.attitude.step(Motion {
            speed_mps: truth.speed_at_imu_mps,
            grade_rad: truth.grade_at_imu_rad,
            grade_rate_radps: truth.curvature_vertical_1pm * truth.speed_mps,
            gravity_mps2: self.gravity,
        });
        self.now = self.sample_at(truth);
        true
    }

    /// Present bound; `None` before the first sample.
    pub(crate) fn now(&self) -> Option<BoundSample> {
        self.now
    }

    fn sample_at(&self, truth: &Truth) -> Option<BoundSample> {
        let (tilt, bias) = self.attitude.sd()?;
        let cos = libm::cos(truth.grade_effective_rad).max(f64::EPSILON);
        // the rail under the train has been read, and its noise is averaged out: what is left is the bias, and rail
        // not read
        let (mass_rel, unseen) = self.mass.sd(self.vehicle.drives).unwrap_or((f64::NAN, 0.0));
        Some(BoundSample {
            t_s: truth.t_s,
            slope_rad: tilt.hypot(self.mount_rad),
            effective_rad: (bias / (self.gravity * cos))
                .hypot(unseen)
                .hypot(self.mount_rad),
            mass_rel,
        })
    }
}
