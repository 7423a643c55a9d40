//! Gyro: angular rate of the body at the mount, in mount axes (x forward, y left, z up), rad/s.
//!
//! ω_M = R_WMᵀ ω_W. A sample is the mean of ω_M since the sample before (a rate-integrating gyro), linear between steps.
//! A grade that grows shows as a negative rate about y.

use super::instrument::{Instrument, SamplingMode, StepInterval};
use super::misalignment;
use crate::config::sensor_sheet_file::InertialSensor;
use crate::error::Error;
use crate::plant::MountState;

/// Name in events and errors.
pub const NAME: &str = "gyro";

/// A three-axis gyro.
#[derive(Clone, Debug)]
pub struct Gyro {
    /// Index in `Truth::mounts`.
    pub mount: usize,
    /// Sampling, errors, faults.
    pub instrument: Instrument<3>,
}

impl Gyro {
    /// A gyro at a mount.
    pub fn new(sheet: &InertialSensor, mount: usize, seed: u64) -> Self {
        let bias = sheet.axis_bias.map_or([0.0; 3], |b| b.map(|x| x.get()));
        let axes = [(".x", bias[0]), (".y", bias[1]), (".z", bias[2])];
        let mut instrument = Instrument::new(
            NAME,
            SamplingMode::Integrating,
            (&sheet.sampling, &sheet.errors),
            axes,
            seed,
        );
        instrument.misalign(misalignment::draw(sheet, seed, NAME));
        Self { mount, instrument }
    }

    /// The mount moved from `before` to `now`.
    pub fn observe(
        &mut self,
        span: StepInterval,
        before: &MountState,
        now: &MountState,
    ) -> Result<(), Error> {
        self.instrument
            .observe(span, body_rate(before), body_rate(now))
    }
}

/// Angular rate in mount axes, rad/s.
pub fn body_rate(state: &MountState) -> [f64; 3] {
    state.q_wm.inverse_transform_vector(&state.w_w).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};

    /// Heading north (+y), grade growing: the body turns about world +x, which is its own −y.
    #[test]
    fn a_growing_grade_is_a_negative_rate_about_left() {
        let q = UnitQuaternion::from_euler_angles(0.0, 0.0, std::f64::consts::FRAC_PI_2);
        let state = MountState {
            v_w: Vector3::zeros(),
            q_wm: q,
            w_w: Vector3::new(0.1, 0.0, 0.0),
        };
        let rate = Vector3::from(body_rate(&state));
        assert!(
            (rate - Vector3::new(0.0, -0.1, 0.0)).norm() < 1e-15,
            "{rate}"
        );
    }
}
